//! A statement of the text and its requirements to be tested.

use super::{evidence::Evidence, rules::Part};

/// A statement of the text.
#[derive(Debug, Clone)]
pub struct Claim {
    /// Its name, of which there is one.
    pub id: &'static str,
    /// Subject of it.
    pub theme: Theme,
    /// The statement, quoted or put shortly.
    pub statement: &'static str,
    /// Section and figures.
    pub place: &'static str,
    /// How it is measured here.
    pub measure: &'static str,
    /// The plans that it needs.
    pub plans: &'static [&'static str],
    pub(super) source: Source,
}

/// Subject of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Theme {
    /// Batch fits of ARX models.
    BatchArx,
    /// Batch fits of Box-Jenkins models.
    BatchBj,
    /// The order of the noise model.
    RemnantOrder,
    /// Where searches start.
    InitialConditions,
    /// Recursive estimates.
    Recursive,
    /// Noise level, remnant time constant, sample time.
    Noise,
    /// Experiments with people.
    Experiment,
}

impl Theme {
    /// A heading.
    pub fn title(self) -> &'static str {
        match self {
            Self::BatchArx => "Batch fits of ARX models",
            Self::BatchBj => "Batch fits of Box-Jenkins models",
            Self::RemnantOrder => "Order of the noise model",
            Self::InitialConditions => "Where searches start",
            Self::Recursive => "Recursive estimates",
            Self::Noise => "Noise level, remnant and sample time",
            Self::Experiment => "Experiments",
        }
    }
}

/// Where the numbers of a claim come from.
#[derive(Debug, Clone, Copy)]
pub(super) enum Source {
    /// Measured from the results of studies.
    Data(fn(&Evidence<'_>) -> Result<Vec<Part>, String>),
    /// Not measured, and why.
    Untested(&'static str),
}
