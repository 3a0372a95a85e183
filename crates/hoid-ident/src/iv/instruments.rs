//! The choice of instruments.

use std::fmt;

use hoid_model::Record;

/// Channel of the forcing function in a record.
pub const FORCING_CHANNEL: &str = "f_t";

/// The choice of instruments.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Instruments {
    /// The input itself and the output that the model simulates from it. For an open loop: in a closed loop the input
    /// contains the noise, and the estimate is biased.
    #[default]
    Simulated,
    /// The part of the input that follows this channel, which is independent of the noise: the forcing function f_t or
    /// a known disturbance. For a closed loop.
    External(String),
}

impl Instruments {
    /// Parses the text of users: `simulated`, or the name of a channel.
    pub fn of_text(text: &str) -> Self {
        match text {
            "simulated" => Self::Simulated,
            channel => Self::External(channel.to_owned()),
        }
    }

    /// Returns the forcing function f_t if all records have it: in a closed loop it is independent of the noise.
    /// Otherwise simulated instruments.
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
