//! Options of the identification of a model from recordings.

use hoid_ident::family::FamilyEstimator;
use hoid_model::{ContinuousTransferFunction, Decimation, FaultHandling};

use crate::description::Excitation;

/// Options of the identification of a model from recordings: by default of the operator of a person.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification<E = FamilyEstimator> {
    /// The estimator. Its excitation and period are those below.
    pub estimator: E,
    /// The channel of the recorded disturbance or target.
    pub excitation: Excitation,
    /// Its period, s; found from its lines if it is not given.
    pub period_s: Option<f64>,
    /// Treatment of faults of the recordings.
    pub faults: FaultHandling,
    /// Whether a high rate is lowered.
    pub rate: Decimation,
    /// The controlled element: adds the loop to the verdict.
    pub controlled_element: Option<ContinuousTransferFunction>,
    /// The answers that the verdict is about ([`crate::Answers`]); by default the response and the loop.
    pub answers: Vec<String>,
}

impl Default for Identification {
    fn default() -> Self {
        Self::of(FamilyEstimator::default())
    }
}

impl<E> Identification<E> {
    /// Returns the defaults with this estimator.
    pub fn of(estimator: E) -> Self {
        Self {
            estimator,
            excitation: Excitation::default(),
            period_s: None,
            faults: FaultHandling::default(),
            rate: Decimation::default(),
            controlled_element: None,
            answers: Vec::new(),
        }
    }
}
