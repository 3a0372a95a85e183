//! The choice of instruments.

use std::fmt;

use hoid_model::Record;

/// Name of the channel with the forcing function.
pub const FORCING_CHANNEL: &str = "f_t";

/// The choice of instruments.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Instruments {
    /// The measured input, and the output that the model simulates from it. These instruments are valid for an open
    /// loop: in a closed loop the input contains noise, and the estimate is biased.
    #[default]
    Simulated,
    /// The part of the input that follows this channel, for a closed loop. The channel is a forcing function f_t or a
    /// known disturbance, which is independent of the noise.
    External(String),
}

impl Instruments {
    /// Parses the value of an option: `simulated`, or the name of a channel.
    pub fn from_text(text: &str) -> Self {
        match text {
            "simulated" => Self::Simulated,
            channel => Self::External(channel.to_owned()),
        }
    }

    /// Returns the forcing function f_t as instruments if all records have it, since it is independent of the noise in
    /// a closed loop; otherwise simulated instruments.
    pub fn default_for(records: &[Record]) -> Self {
        if records.iter().all(|r| r.channel(FORCING_CHANNEL).is_some()) {
            Self::External(FORCING_CHANNEL.to_owned())
        } else {
            Self::Simulated
        }
    }
}

impl fmt::Display for Instruments {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Simulated => f.write_str("simulated instruments"),
            Self::External(channel) => write!(f, "instruments from {channel}"),
        }
    }
}
