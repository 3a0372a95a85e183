//! Report of an experiment will, before it is done.
//!
//! | module | contents |
//! |---|---|
//! | [`expected`] | standard errors of a person by the information of the lines of a forcing function |
//! | [`Designing`] | amplitudes and places of the lines that are most informative, under limits |
//! | [`crest_factor`] | lines without common harmonics (`lines`), and their phases |

mod designing;
mod information;
mod lines;

use hoid_model::ModelError;
use thiserror::Error;

pub use designing::{Designed, Designing, Wanted, periods};
pub use information::{Enters, Expected, Remnant, Task, expected};
pub use lines::crest_factor;

/// Why there is nothing to be expected of an experiment.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DesignError {
    /// A number without meaning.
    #[error("{quantity} is {found}, expected {expected}")]
    OutOfRange {
        /// What.
        quantity: &'static str,
        /// Its definition.
        found: f64,
        /// Its admissible values.
        expected: &'static str,
    },
    /// A loop of which there is no crossover.
    #[error(
        "the gain of the loop does not fall through one between 0.01 and 100 rad/s: give the person another gain, or other units of the element"
    )]
    NoCrossover,
    /// Lines that leave the person open.
    #[error(
        "{lines} lines do not determine {coordinates} parameters: add lines, each of which gives two numbers, and spread them over the frequencies at which the person works"
    )]
    NotIdentifiable {
        /// Lines of the forcing function.
        lines: usize,
        /// Parameters of the person.
        coordinates: usize,
    },
    /// A requested quantity that is not a parameter of the person.
    #[error("{name} is nothing that this person has; expected one of {expected}")]
    NotThere {
        /// The requested item.
        name: String,
        /// The available items.
        expected: String,
    },
    /// An operator or element without meaning, or a loop that is not stable.
    #[error(transparent)]
    Model(#[from] ModelError),
}
