//! Options for identifying a model from recordings.

use hoid_ident::family::FamilyEstimator;
use hoid_model::{ContinuousTransferFunction, Decimation, FaultHandling};

use crate::description::Excitation;

/// Options for identifying a model from recordings; by default the operator of a person.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification<E = FamilyEstimator> {
    /// The estimator. Its excitation and period are replaced by the fields below.
    pub estimator: E,
    /// The channel of the recorded disturbance or target.
    pub excitation: Excitation,
    /// Period of the excitation (in s); determined from its lines if `None`.
    pub period_s: Option<f64>,
    /// Treatment of faults of the recordings.
    pub faults: FaultHandling,
    /// Decimation of recordings at a high sampling rate.
    pub rate: Decimation,
    /// Controlled element; if it is given, the verdict includes the loop.
    pub controlled_element: Option<ContinuousTransferFunction>,
    /// Names of the answers to which the verdict refers ([`crate::Answers`]); by default the response and the loop.
    pub answers: Vec<String>,
}

impl Default for Identification {
    fn default() -> Self {
        Self::of(FamilyEstimator::default())
    }
}

impl<E> Identification<E> {
    /// Returns default options for this estimator.
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
