//! Components of the instruments.

use std::fmt;

use hoid_model::Record;

/// Channel of the forcing function in a record that has one.
pub const FORCING_CHANNEL: &str = "f_t";

/// Components of the instruments.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Instruments {
    /// The input itself and the output that the model simulates from it. For an open loop: in a
    /// closed one the input carries the noise, and the estimate is biased.
    #[default]
    Simulated,
    /// The part of the input that follows this channel, which the noise does not reach: the forcing
    /// function f_t or a known disturbance. For a closed loop.
    External(String),
}

impl Instruments {
    /// As users write them: `simulated`, or the name of a channel.
    pub fn of_text(text: &str) -> Self {
        match text {
            "simulated" => Self::Simulated,
            channel => Self::External(channel.to_owned()),
        }
    }

    /// The forcing function f_t where all records have it: in a closed loop it is the signal that
    /// the noise does not reach. Else those that are simulated.
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
