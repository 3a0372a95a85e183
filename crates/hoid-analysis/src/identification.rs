//! How a model is identified from recordings.

use hoid_ident::family::FamilyEstimator;
use hoid_model::{ContinuousTransferFunction, Decimation, FaultHandling};

use crate::description::Excitation;

/// How a model is identified from recordings: by default the operator of a person.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification<E = FamilyEstimator> {
    /// The fitted model, and how. Its excitation and period are those below.
    pub estimator: E,
    /// The channel of the recorded disturbance or target.
    pub excitation: Excitation,
    /// Its period, s; found from its lines where it is not given.
    pub period_s: Option<f64>,
    /// Treatment of faults of the recordings.
    pub faults: FaultHandling,
    /// Whether a high rate is lowered.
    pub rate: Decimation,
    /// The controlled element: adds the loop to the verdict.
    pub controlled_element: Option<ContinuousTransferFunction>,
    /// Subject of the verdict ([`crate::Answers`]); by default the response and the loop.
    pub answers: Vec<String>,
}

impl Default for Identification {
    fn default() -> Self {
        Self::of(FamilyEstimator::default())
    }
}

impl<E> Identification<E> {
    /// By an estimator, everything else by default.
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
