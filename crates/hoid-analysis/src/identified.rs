//! Identification with any batch estimator: the processing steps from recordings to a result, and the findings.

use std::fmt;

use hoid_ident::{
    Fit, IdentError,
    diagnostics::response_to_error,
    family::FamilyFit,
    frequency::{Description, check_excitation},
    validation::GoodnessOfFit,
};
use hoid_model::{
    ContinuousTransferFunction, Decimation, Detrend, Record, Verdict, numbers::format_plain, uncertainty::Estimate,
};
use serde_json::{Map, Value};

use crate::{
    AnalysisError,
    answers::{self, Answers},
    description::Excitation,
    estimators::{BatchEstimator, FittedModel},
    identification::Identification,
    quality::SystemKind,
    reading::Reading,
    recordings::Recordings,
    settings::Setting,
};

/// An identified model, with its verdict and data.
#[derive(Debug, Clone)]
pub struct IdentifiedModel<F = FamilyFit> {
    /// Result of the fit.
    pub fit: F,
    /// Final verdict on the result.
    pub verdict: Verdict,
    /// The fitted recordings and their processing; their means are removed if this was requested.
    pub data: Recordings,
    /// The describing function that accompanies the fit, if there is one.
    pub described: Option<Description>,
    /// Settings used in the identification.
    pub settings: Vec<Setting>,
    /// The controlled element, if it is known.
    pub controlled_element: Option<ContinuousTransferFunction>,
    /// The channel of the excitation, if there is one.
    pub excitation: Option<String>,
    pub(crate) rate: Decimation,
    pub(crate) counts_samples: bool,
    pub(crate) removed_trend: Detrend,
    /// JSON object from which the result was read; `None` for a new result.
    pub(crate) source_json: Option<Map<String, Value>>,
}

/// Goodness of fit of a model on a recording that was not used in the estimation.
#[derive(Debug, Clone)]
pub struct ValidationResult {
    /// Name of the recording.
    pub name: String,
    /// Goodness of fit.
    pub quality: GoodnessOfFit,
}

/// Identifies the operator of a person from the runs of the person, with default settings.
///
/// # Errors
/// Same as [`Identification::run`].
pub fn identify(records: &[Record]) -> Result<IdentifiedModel, AnalysisError> {
    Identification::default().run(Recordings::from_records(records.iter().cloned()))
}

impl<E: BatchEstimator> Identification<E> {
    /// Repairs the recordings, fits the model, makes a second fit as a check, and forms the verdict.
    ///
    /// # Errors
    /// [`AnalysisError`] if there is no result. A doubtful result is not an error: see [`IdentifiedModel::verdict`].
    pub fn run(&self, recordings: Recordings) -> Result<IdentifiedModel<E::Fit>, AnalysisError> {
        if recordings.is_empty() {
            return Err(AnalysisError::NoRecordings);
        }
        if let Excitation::Named(channel) = &self.excitation {
            check_excitation(&recordings.records, channel)?;
        }
        let counts_samples = self.estimator.counts_samples();
        let mut data = recordings
            .repaired(self.faults, E::OF)?
            .at_rate(self.rate, counts_samples)?;
        // The signals of the loop are checked before the fit, which removes the response to further inputs from u.
        let of_loop = data.loop_findings(
            self.controlled_element.as_ref(),
            self.excitation.channel_name(),
            &self.estimator.further_inputs(),
        );
        let FittedModel {
            mut fit,
            verdict,
            described,
            removed_trend: taken_out,
            settings: used,
            found,
        } = E::fit(self, &mut data).map_err(|error| with_reason(error, &data.records))?;
        let verdict = data.with_findings(verdict);
        let response = (E::OF == SystemKind::Person)
            .then(|| response_to_error(&data.records))
            .flatten();
        let verdict = verdict.prepend(response.and_then(|found| found.finding()));
        let verdict = verdict.append(of_loop);
        let all = fit.answers(0, self.controlled_element.as_ref());
        let verdict = answers::with_answers(verdict, &all, &self.answers);
        E::set_verdict(&mut fit, &verdict);
        let reading = data.source.as_ref().map(|source| &source.reading);
        let by_default = Identification::of(self.estimator.with_defaults());
        let default_reading = reading.map(|_| Reading::default());
        let mut default = by_default.settings(data.records[0].sample_time());
        default.extend(shared_settings(&by_default, default_reading.as_ref()));
        let mut settings = Setting::mark_non_defaults(used, &default);
        settings.extend(found);
        settings.extend(Setting::mark_non_defaults(shared_settings(self, reading), &default));
        Ok(IdentifiedModel {
            fit,
            verdict,
            data,
            controlled_element: self.controlled_element.clone(),
            excitation: described.as_ref().and_then(|described| described.channel.clone()),
            described,
            settings,
            rate: self.rate,
            counts_samples,
            removed_trend: taken_out,
            source_json: None,
        })
    }
}

/// Largest deviation of an output that is a multiple of the input, relative to the largest output.
const MULTIPLE_TOLERANCE: f64 = 1e-9;

/// Replaces the error of a search without a finite loss, or of data that do not determine the model, if the output of a
/// record is a multiple of its input.
fn with_reason(error: AnalysisError, records: &[Record]) -> AnalysisError {
    use IdentError::{NoFiniteLoss, SingularInformation, SingularRegressors};
    let is_explained = matches!(
        error,
        AnalysisError::Ident(NoFiniteLoss | SingularInformation { .. } | SingularRegressors { .. })
    );
    let found = records.iter().filter(|_| is_explained).find_map(|record| {
        let (e, u) = (record.input(), record.output());
        let sum = |of: &[f64]| of.iter().zip(e).map(|(a, b)| a * b).sum::<f64>();
        let factor = sum(u) / sum(e);
        let largest = u.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        let is_multiple = |(e, u): (&f64, &f64)| (u - factor * e).abs() <= MULTIPLE_TOLERANCE * largest;
        (factor.is_finite() && e.iter().zip(u).all(is_multiple)).then(|| IdentError::OutputIsInput {
            label: record.label().to_owned(),
            factor: format_plain(factor),
        })
    });
    found.map_or(error, AnalysisError::Ident)
}

impl<F: Answers> IdentifiedModel<F> {
    /// Returns the verdict with the answers about the operator of a record; [`IdentifiedModel::verdict`] contains those
    /// of the first record.
    pub fn verdict_of_record(&self, record: usize) -> Verdict {
        let all = self.fit.answers(record, self.controlled_element.as_ref());
        answers::judged(self.verdict.clone(), &all)
    }
}

impl IdentifiedModel {
    /// Returns the VAF and NRMSE over all recordings, where each recording is predicted by its own operator.
    ///
    /// # Errors
    /// The errors of predicting the records.
    pub fn quality(&self) -> Result<GoodnessOfFit, AnalysisError> {
        let each = self.data.records.iter().enumerate();
        let validations = each.map(|(k, record)| self.fit.operator(k).polynomial_fit.validate(record));
        let validations = validations.collect::<Result<Vec<_>, _>>()?;
        Ok(GoodnessOfFit::pooled(self.data.records.iter().zip(&validations)))
    }
}

/// Returns the settings common to all fits, including defaults.
fn shared_settings<E: BatchEstimator>(how: &Identification<E>, reading: Option<&Reading>) -> Vec<Setting> {
    let (decimation, search) = (how.rate, how.estimator.search());
    let mut list = vec![Setting::new("initial state", how.estimator.initial_state())];
    match reading {
        Some(reading) => list.extend(reading.settings(decimation)),
        None => list.push(Setting::new("decimate", decimation.to_string())),
    }
    list.push(Setting::new("faults", how.faults.to_string()));
    list.extend(reading.and_then(Reading::masked_rows_setting));
    list.extend([
        Setting::new(
            "search",
            format!("{}, relative tolerance {:e}", search.method, search.tolerance),
        ),
        Setting::new("largest number of steps", search.max_iterations.to_string()),
    ]);
    let element = how.controlled_element.as_ref();
    list.extend(element.map(|element| Setting::new("controlled element", element.to_string())));
    list
}

impl fmt::Display for IdentifiedModel {
    /// Prints the verdict and the parameters of each operator.
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

impl<F> IdentifiedModel<F> {
    /// Computes how well a model of the fit predicts another recording of the person, which is decimated and detrended
    /// like the fitted recordings.
    ///
    /// # Errors
    /// [`AnalysisError`] if there is no recording, or if the recording has another sampling rate or is too short.
    pub fn validated(&self, model: &Fit, other: Recordings) -> Result<ValidationResult, AnalysisError> {
        let name = other.names.first().cloned().ok_or(AnalysisError::NoRecordings)?;
        let other = other.at_rate(self.rate, self.counts_samples)?.records.into_iter();
        let prepared: Vec<Record> = other.map(|record| record.detrended(self.removed_trend)).collect();
        let quality = model.quality(&prepared)?;
        Ok(ValidationResult { name, quality })
    }

    /// True if the means of e and u were removed before the fit; each record then has a separate level.
    pub fn is_without_means(&self) -> bool {
        self.removed_trend == Detrend::Mean
    }
}
