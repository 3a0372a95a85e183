//! From recordings to a result of any batch estimator: what is done, in its order, and what is found.

use std::fmt;

use hoid_ident::{Fit, family::FamilyFit, frequency::Description, validation::GoodnessOfFit};
use hoid_model::{Decimation, Detrend, Record, Verdict, uncertainty::Estimate};

use crate::{
    AnalysisError,
    estimators::{BatchEstimator, Fitted},
    identification::Identification,
    recordings::Recordings,
    settings::{Setting, shared_settings},
};

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

/// How well a model tells a recording that it was not fitted to.
#[derive(Debug, Clone)]
pub struct Validated {
    /// The recording.
    pub name: String,
    /// How well.
    pub quality: GoodnessOfFit,
}

/// The operator of a person from their runs, by the defaults.
///
/// # Errors
/// As [`Identification::run`].
pub fn identify(records: &[Record]) -> Result<Identified, AnalysisError> {
    Identification::default().run(Recordings::of_records(records.iter().cloned()))
}

impl<E: BatchEstimator> Identification<E> {
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
    /// How well a model of the fit tells another recording of the person, prepared as those that were fitted.
    ///
    /// # Errors
    /// [`AnalysisError`] where there is none, of another rate, or too short.
    pub fn validated(&self, model: &Fit, other: Recordings) -> Result<Validated, AnalysisError> {
        let name = other.names.first().cloned().ok_or(AnalysisError::NoRecordings)?;
        let other = other.at_rate(self.rate, self.counts_samples)?.records.into_iter();
        let prepared: Vec<Record> = other.map(|record| record.detrended(self.taken_out)).collect();
        let quality = model.quality(&prepared)?;
        Ok(Validated { name, quality })
    }

    /// Whether the fit is one without the means of e and u, which leaves each record its level.
    pub fn is_without_means(&self) -> bool {
        self.taken_out == Detrend::Mean
    }
}
