//! From recordings to a result of any batch estimator: what is done, in its order, and what is found.

use std::fmt;

use hoid_ident::{
    family::{FamilyEstimator, FamilyFit},
    frequency::Description,
};
use hoid_model::{
    ContinuousTransferFunction, Decimation, Detrend, FaultHandling, Record, Verdict, uncertainty::Estimate,
};

use crate::{
    AnalysisError,
    description::Excitation,
    estimators::{BatchEstimator, Fitted},
    recordings::Recordings,
    settings::{Setting, shared_settings},
};

/// How a model is identified from recordings: by default the operator of a person.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification<E = FamilyEstimator> {
    /// What is fitted, and how. Its excitation and period are those below.
    pub estimator: E,
    /// The channel of the recorded disturbance or target.
    pub excitation: Excitation,
    /// Its period, s; found from its lines where it is not given.
    pub period_s: Option<f64>,
    /// What is done about faults of the recordings.
    pub faults: FaultHandling,
    /// Whether a high rate is lowered.
    pub rate: Decimation,
    /// What the person controls: adds the loop to the verdict.
    pub controlled_element: Option<ContinuousTransferFunction>,
}

/// What was identified.
#[derive(Debug, Clone)]
pub struct Identified<F = FamilyFit> {
    /// The result.
    pub fit: F,
    /// What it is worth, of all that is known.
    pub verdict: Verdict,
    /// The recordings as they were fitted, without their means where these were taken out, and what was done
    /// to them.
    pub data: Recordings,
    /// The describing function that stands beside the fit.
    pub described: Option<Description>,
    /// The settings that were used.
    pub settings: Vec<Setting>,
    rate: Decimation,
    counts_samples: bool,
    taken_out: Detrend,
}

/// The operator of a person from their runs, by the defaults.
///
/// # Errors
/// As [`Identification::run`].
pub fn identify(records: &[Record]) -> Result<Identified, AnalysisError> {
    Identification::default().run(Recordings::of_records(records.iter().cloned()))
}

impl Default for Identification {
    fn default() -> Self {
        Self::of(FamilyEstimator::default())
    }
}

impl<E: BatchEstimator> Identification<E> {
    /// By an estimator, everything else by default.
    pub fn of(estimator: E) -> Self {
        Self {
            estimator,
            excitation: Excitation::default(),
            period_s: None,
            faults: FaultHandling::default(),
            rate: Decimation::default(),
            controlled_element: None,
        }
    }

    /// Repairs the recordings, fits, asks for a second opinion, and forms the verdict.
    ///
    /// # Errors
    /// [`AnalysisError`] where there is no result. One that is doubtful is none: see [`Identified::verdict`].
    pub fn run(&self, recordings: Recordings) -> Result<Identified<E::Fit>, AnalysisError> {
        if recordings.is_empty() {
            return Err(AnalysisError::NoRecordings);
        }
        let counts_samples = self.estimator.counts_samples();
        let mut data = recordings.repaired(self.faults)?.at_rate(self.rate, counts_samples)?;
        let Fitted {
            mut fit,
            verdict,
            described,
            taken_out,
            mut settings,
        } = E::fit(self, &mut data)?;
        let verdict = data.judged(verdict);
        E::judged(&mut fit, &verdict);
        settings.extend(shared_settings(
            &data,
            self.estimator.initial_state(),
            self.rate,
            self.faults,
            self.estimator.search(),
            self.controlled_element.as_ref(),
        ));
        Ok(Identified {
            fit,
            verdict,
            data,
            described,
            settings,
            rate: self.rate,
            counts_samples,
            taken_out,
        })
    }
}

impl fmt::Display for Identified {
    /// The verdict, and the parameters of each operator.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}\n\n{}", self.verdict, self.fit.title())?;
        for of in &self.fit.operators {
            for p in &of.parameters {
                let estimate = Estimate {
                    value: p.value,
                    standard_error: p.standard_error,
                };
                if p.determined {
                    write!(f, "\n{} = {estimate} {}", p.name, p.unit)?;
                } else {
                    write!(f, "\n{} is not determined", p.name)?;
                }
            }
        }
        Ok(())
    }
}

impl<F> Identified<F> {
    /// Other recordings of the person, prepared as those that were fitted: to judge the fit on them.
    ///
    /// # Errors
    /// [`AnalysisError`] where there is none, or its rate cannot be lowered.
    pub fn alike(&self, other: Recordings) -> Result<Recordings, AnalysisError> {
        if other.is_empty() {
            return Err(AnalysisError::NoRecordings);
        }
        let mut other = other.at_rate(self.rate, self.counts_samples)?;
        for record in &mut other.records {
            *record = record.clone().detrended(self.taken_out);
        }
        Ok(other)
    }
}
