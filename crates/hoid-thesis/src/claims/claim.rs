//! A statement of the thesis and the way it is tested.

use super::{evidence::Evidence, rules::Part};

/// A statement of the thesis.
#[derive(Debug, Clone)]
pub struct Claim {
    /// Unique name of the claim.
    pub id: &'static str,
    /// Subject of the claim.
    pub theme: Theme,
    /// The statement, quoted or abbreviated.
    pub statement: &'static str,
    /// Section and figures in which the statement occurs.
    pub reference: &'static str,
    /// Description of the measurement that tests the statement.
    pub measure: &'static str,
    /// Plans whose results the test requires.
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
    /// Order of the noise model.
    RemnantOrder,
    /// Starting points of searches.
    InitialConditions,
    /// Recursive estimates.
    Recursive,
    /// Noise level, remnant time constant, sample time.
    Noise,
    /// Experiments with people.
    Experiment,
}

impl Theme {
    /// Heading of the subject.
    pub fn title(self) -> &'static str {
        match self {
            Self::BatchArx => "Batch fits of ARX models",
            Self::BatchBj => "Batch fits of Box-Jenkins models",
            Self::RemnantOrder => "Order of the noise model",
            Self::InitialConditions => "Starts of the searches",
            Self::Recursive => "Recursive estimates",
            Self::Noise => "Noise level, remnant and sample time",
            Self::Experiment => "Experiments",
        }
    }
}

/// Origin of the numbers of a claim.
#[derive(Debug, Clone, Copy)]
pub(super) enum Source {
    /// Measured from the results of studies.
    Data(fn(&Evidence<'_>) -> Result<Vec<Part>, String>),
    /// Not measured, with the reason.
    Untested(&'static str),
}
