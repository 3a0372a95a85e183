//! Expected results of an experiment before it is done.
//!
//! | module | contents |
//! |---|---|
//! | [`expected`] | standard errors of a person from the information of the lines of a forcing function |
//! | [`Designing`] | most informative amplitudes and frequencies of the lines, under limits |
//! | [`crest_factor`] | lines without common harmonics (`lines`), and their phases |

mod designing;
mod information;
mod lines;

use hoid_model::ModelError;
use thiserror::Error;

pub use designing::{Designed, Designing, Wanted, periods};
pub use information::{Enters, Expected, Remnant, Task, expected};
pub use lines::crest_factor;

/// Errors of the prediction of an experiment.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DesignError {
    /// A number out of range.
    #[error("{quantity} is {found}, expected {expected}")]
    OutOfRange {
        /// Name of the quantity.
        quantity: &'static str,
        /// The value found.
        found: f64,
        /// The admissible values.
        expected: &'static str,
    },
    /// A loop without a crossover.
    #[error(
        "the gain of the loop does not fall through one between 0.01 and 100 rad/s: give the person another gain, or other units of the element"
    )]
    NoCrossover,
    /// Lines that do not determine the parameters of the person.
    #[error(
        "{lines} lines do not determine {coordinates} parameters: add lines, each of which gives two numbers, and spread them over the frequencies at which the person works"
    )]
    NotIdentifiable {
        /// Number of lines.
        lines: usize,
        /// Number of parameters of the person.
        coordinates: usize,
    },
    /// A requested quantity that is not a parameter of the person.
    #[error("{name} is nothing that this person has; expected one of {expected}")]
    NotThere {
        /// Name of the requested quantity.
        name: String,
        /// The available quantities.
        expected: String,
    },
    /// An invalid operator or element, or an unstable loop.
    #[error(transparent)]
    Model(#[from] ModelError),
}
