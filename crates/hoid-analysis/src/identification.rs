//! The operator of a person from recordings: what is done, in its order, and what is found.

use std::fmt;

use hoid_ident::{
    family::{FamilyEstimator, FamilyFit},
    frequency::Description,
    judgement::second_opinion,
    validation::GoodnessOfFit,
};
use hoid_model::{ContinuousTransferFunction, Decimation, Detrend, FaultHandling, Record, uncertainty::Estimate};

use crate::{
    AnalysisError,
    description::{Excitation, of_lines},
    level::levels_into,
    recordings::Recordings,
    settings::{Setting, operator_settings, shared_settings},
};

/// How the operator of a person is identified from recordings.
#[derive(Debug, Clone, Default)]
pub struct Identification {
    /// Forms, noise, prior, delay, what is individual. Its excitation and period are those below.
    pub operator: FamilyEstimator,
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
pub struct Identified {
    /// The operator, with the verdict of all that is known.
    pub fit: FamilyFit,
    /// The recordings as they were fitted, without their means where these were taken out, and what was done
    /// to them.
    pub data: Recordings,
    /// The describing function that stands beside the fit.
    pub described: Option<Description>,
    /// The settings that were used.
    pub settings: Vec<Setting>,
    rate: Decimation,
    detrend: Detrend,
}

/// How well an operator tells a recording that it was not fitted to.
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

impl Identification {
    /// Repairs the recordings, fits, asks for a second opinion, and forms the verdict.
    ///
    /// # Errors
    /// [`AnalysisError`] where there is no result. One that is doubtful is none: see
    /// [`FamilyFit::verdict`].
    pub fn run(&self, recordings: Recordings) -> Result<Identified, AnalysisError> {
        if recordings.is_empty() {
            return Err(AnalysisError::NoRecordings);
        }
        let mut data = recordings.repaired(self.faults)?.at_rate(self.rate, false)?;
        let described = data.described(&self.excitation, self.period_s, self.faults);
        let channel = match &described {
            // What was found, or what was named: instruments need no lines.
            Ok(Some(found)) => found.channel.clone(),
            _ => self.excitation.named().map(str::to_owned),
        };
        let estimator = FamilyEstimator {
            excitation: channel,
            period_s: self.period_s,
            ..self.operator.clone()
        };
        let mut fit = estimator.fit_beside(&data.records, of_lines(&described, &self.excitation))?;
        let element = self.controlled_element.as_ref();
        if self.faults != FaultHandling::Keep {
            let opinions = second_opinion::of_family(&estimator, &fit, &data.records, element);
            fit.verdict = fit.verdict.and(opinions);
        }
        if let Some(element) = element {
            fit.verdict = fit.verdict.clone().and(fit.loop_finding(0, element));
        }
        fit.verdict = data.judged(fit.verdict);
        let mut settings = operator_settings(&estimator);
        settings.extend(shared_settings(
            &data,
            estimator.initial_state.name(),
            self.rate,
            self.faults,
            &estimator.search,
            element,
        ));
        let described = described.ok().flatten();
        if let Some(channel) = described.as_ref().and_then(|d| d.channel.clone()) {
            settings.push(Setting::new("excitation", channel));
        }
        if estimator.detrend == Detrend::Mean {
            levels_into(&mut data.accounts, &data.records, |k, record| {
                fit.operator(k).polynomial_fit.level(record)
            });
        }
        for record in &mut data.records {
            *record = record.clone().detrended(estimator.detrend);
        }
        Ok(Identified {
            fit,
            data,
            described,
            settings,
            rate: self.rate,
            detrend: estimator.detrend,
        })
    }
}

impl fmt::Display for Identified {
    /// The verdict, and the parameters of each operator.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}\n\n{}", self.fit.verdict, self.fit.title())?;
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

impl Identified {
    /// How well the operator of the first recording tells another recording of the person, prepared as those
    /// that it was fitted to were.
    ///
    /// # Errors
    /// [`AnalysisError`] where the recording is of another rate, or too short.
    pub fn validated(&self, other: Recordings) -> Result<Validated, AnalysisError> {
        let name = other.names.first().cloned().ok_or(AnalysisError::NoRecordings)?;
        let records: Vec<Record> = other
            .at_rate(self.rate, false)?
            .records
            .into_iter()
            .map(|record| record.detrended(self.detrend))
            .collect();
        let quality = self.fit.operator(0).polynomial_fit.quality(&records)?;
        Ok(Validated { name, quality })
    }
}
