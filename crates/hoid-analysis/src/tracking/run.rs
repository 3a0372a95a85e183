//! Execution of a recursion, from a recording to a trace and its verdict.

use hoid_ident::IdentError;
use hoid_model::{
    Decimation, Record, SampleTime,
    option_names::{Renamed, rename_options},
};
use hoid_track::{
    CovarianceUpdates, RequestedStart, StartSource, Trace, TrackOptions, TrackPlan, TrackRequest, choose_covariance,
    default_start_span, track, track_validated,
};

use super::{
    settings::{OwnSettings, settings_of_recursion},
    tracked::{CovarianceSource, TrackingResult},
};
use crate::{
    AnalysisError,
    answers::{trace_answers, with_answers},
    names::OPERATOR,
    quality::{SystemKind, findings_of_quality},
    recordings::Recordings,
};

/// Options of `hoid identify` that a recursion does not have.
const FIT_OPTIONS: [&str; 8] = [
    "change",
    "excitation",
    "faults",
    "fix",
    "form",
    "horizon",
    "mask",
    "neuromuscular",
];

/// Request for a recursion over a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracking {
    /// The requested recursion.
    pub recursion: TrackRequest,
    /// Span of the start fit (in s); `None` for the first third of the record.
    pub start_span_s: Option<(f64, f64)>,
    /// Time from which the estimate is updated, s.
    pub update_from_s: Option<f64>,
    /// Length of the moving average of the trace, s.
    pub moving_average_s: Option<f64>,
    /// Number of samples of the recording per row of the trace.
    pub every: usize,
    /// Decimation of recordings at a high sampling rate.
    pub rate: Decimation,
    /// True if the second run controls reductions of P during the run; false if it determines only the initial P.
    pub update_covariance: bool,
}

impl Default for Tracking {
    fn default() -> Self {
        Self::of(TrackRequest::default())
    }
}

impl Tracking {
    /// Requests a recursion with defaults for all other options.
    pub fn of(recursion: TrackRequest) -> Self {
        Self {
            recursion,
            start_span_s: None,
            update_from_s: None,
            moving_average_s: None,
            every: 1,
            rate: Decimation::Auto,
            update_covariance: false,
        }
    }

    /// Returns the plan of the recursion for a recording, at the sampling rate at which the recording is tracked.
    ///
    /// # Errors
    /// [`AnalysisError::Options`] for contradictory options.
    pub fn plan(&self, recordings: &Recordings) -> Result<TrackPlan, AnalysisError> {
        let read = recordings
            .records
            .first()
            .ok_or(AnalysisError::NoRecordings)?
            .sample_time();
        let rate = match self.recursion.counts_samples() {
            _ if recordings.has_fixed_rate() => Decimation::Off,
            true => self.rate.explicit_only(),
            false => self.rate,
        };
        recursion_plan(&self.recursion, SampleTime::new(rate.factor(read) as f64 * read.s())?)
    }

    /// Tracks the recording. `validation` is a second run of the same person; `each` is called after every candidate of
    /// a search.
    ///
    /// # Errors
    /// [`AnalysisError`] if there is no trace. A doubtful trace is not an error: see [`TrackingResult::verdict`].
    pub fn run(
        &self,
        recordings: Recordings,
        validation: Option<Recordings>,
        each: &(dyn Fn() + Sync),
    ) -> Result<TrackingResult, AnalysisError> {
        let counts_samples = self.recursion.counts_samples();
        let read_ts = recordings
            .records
            .first()
            .ok_or(AnalysisError::NoRecordings)?
            .sample_time();
        let named_rate = recordings.has_fixed_rate();
        let data = recordings.at_rate(self.rate, counts_samples)?;
        let (record, account) = (&data.records[0], &data.accounts[0]);
        let every = match named_rate {
            true => self.every,
            // The requested number counts samples of the file; it is converted to samples at the reduced rate.
            false => (self.every as f64 * read_ts.s() / record.sample_time().s()).round() as usize,
        }
        .max(1);
        let plan = recursion_plan(&self.recursion, record.sample_time())?;
        self.check(&plan, record, validation.is_some())?;
        let span_s = self.start_span_s.unwrap_or_else(|| default_start_span(record));
        let span = record.span(span_s.0, span_s.1);
        let (planned, choice) = if plan.has_fixed_orders() {
            (plan.options().clone(), None)
        } else {
            plan.choose(span.as_ref().map_err(|error| error.clone())?, each)?
        };
        let mut used = TrackOptions {
            start: match planned.start {
                StartSource::Span(_) => StartSource::Span(Some(span_s)),
                other => other,
            },
            update_from_s: self.update_from_s,
            ..planned
        };
        let other = validation
            .map(|other| other.at_rate(self.rate, counts_samples))
            .transpose()?;
        let covariance = match &other {
            None => None,
            Some(other) if self.update_covariance => Some(CovarianceSource::Updated(other.names[0].clone())),
            Some(other) => {
                let (options, chosen) = choose_covariance(record, &other.records[0], &used)?;
                used = options;
                Some(CovarianceSource::Chosen(other.names[0].clone(), chosen))
            }
        };
        let trace = match (&other, self.update_covariance) {
            (Some(other), true) => {
                track_validated(record, &other.records[0], &used, &CovarianceUpdates::default(), every)?
            }
            _ => track(record, &used, every)?,
        };
        let rows = self.averaged_rows(every, record)?;
        let trace: Trace = trace.moving_average(rows);
        let verdict = trace.verdict(record, choice.as_ref())?;
        let verdict = verdict.prepend(findings_of_quality(account, record, SystemKind::Person));
        let inputs: Vec<&str> = used.further.iter().map(|further| further.channel.as_str()).collect();
        let verdict = verdict.append(data.loop_findings(used.controlled_element.as_ref(), None, &inputs));
        let verdict = with_answers(verdict, &trace_answers(&trace), &[]).map_messages(in_recursion);
        let mut settings = settings_of_recursion(&self.recursion, &plan, &used, choice.as_ref());
        let own = OwnSettings {
            trace: &trace,
            options: &used,
            covariance: covariance.as_ref(),
            start_given: self.start_span_s.is_some() || self.recursion.start != RequestedStart::Default,
            update_given: self.update_from_s.is_some(),
            rows,
            every: (every, self.every != 1),
            rate: self.rate,
        };
        settings.extend(own.list(&data));
        Ok(TrackingResult {
            verdict,
            span: span.ok().filter(|_| trace.start().is_some()),
            operators: trace.operators(),
            trace,
            choice,
            covariance,
            settings,
            data,
        })
    }

    /// Checks the plan and the record for contradictions.
    fn check(&self, plan: &TrackPlan, record: &Record, validated: bool) -> Result<(), AnalysisError> {
        let method = &plan.options().method;
        if validated && plan.options().further.is_some() {
            return Err(options_error(
                "--validate works with only one input; drop --validate, or track with one input".to_owned(),
            ));
        }
        if self.start_span_s.is_some() && matches!(self.recursion.start, RequestedStart::Coefficients(_)) {
            return Err(options_error(
                "--start-span sets the span of the start fit, but --start replaces this fit; drop one of these \
                 options"
                    .to_owned(),
            ));
        }
        if self.start_span_s.is_some() && method.is_self_starting() {
            return Err(options_error(format!(
                "--start-span sets the span of a start fit, but {method} has no start fit; drop --start-span, or use \
                 --method physical"
            )));
        }
        let end = record.time_s(record.len());
        match self.update_from_s {
            Some(t) if t.is_nan() || t >= end => Err(options_error(format!(
                "--update-from {t}: the record ends at {end:.4} s; give an earlier time"
            ))),
            _ => Ok(()),
        }
    }

    /// Returns the length of the moving average in rows.
    fn averaged_rows(&self, every: usize, record: &Record) -> Result<usize, AnalysisError> {
        let Some(length) = self.moving_average_s else {
            return Ok(1);
        };
        let row = every as f64 * record.sample_time().s();
        if !(length >= 0.0 && length <= record.len() as f64 * record.sample_time().s()) {
            return Err(options_error(format!(
                "--moving-average {length}: expected 0 s to the length of the record, {:.4} s",
                record.len() as f64 * record.sample_time().s()
            )));
        }
        Ok((length / row).round().max(1.0) as usize)
    }
}

/// Returns a message with `hoid identify` before each option that a recursion does not have.
fn in_recursion(message: &str) -> String {
    rename_options(message, |option| {
        let of_fit = FIT_OPTIONS.contains(&option.name) || option.name == "structure" && option.value == Some(OPERATOR);
        (of_fit && !option.is_in_command()).then(|| Renamed::Name(format!("hoid identify --{}", option.name)))
    })
}

/// Returns the plan of a recursion; its errors are reported as errors of the options.
fn recursion_plan(asked: &TrackRequest, sample_time: SampleTime) -> Result<TrackPlan, AnalysisError> {
    asked.plan(sample_time).map_err(recursion_options_error)
}

/// Converts an error of a requested recursion to an error of its options.
pub fn recursion_options_error(error: IdentError) -> AnalysisError {
    match error {
        IdentError::BadStart { reason } => options_error(format!("--start: {reason}")),
        other => options_error(other.to_string()),
    }
}

fn options_error(reason: String) -> AnalysisError {
    AnalysisError::Options { reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_of_fits_name_their_command() {
        for (typed, expected) in [
            (
                "use --change sigmoid or a tracker",
                "use hoid identify --change sigmoid or a tracker",
            ),
            (
                "use --structure operator to find the form",
                "use hoid identify --structure operator to find the form",
            ),
            (
                "use --structure bj; shorten with --from",
                "use --structure bj; shorten with --from",
            ),
            ("use hoid identify --form lead", "use hoid identify --form lead"),
        ] {
            assert_eq!(in_recursion(typed), expected);
        }
    }
}
