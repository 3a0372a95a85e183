//! Description of records: a describing function with its loop and its verdict. All choices are made from the records.
//!
//! | choice | rule |
//! |---|---|
//! | excitation | the given channel; otherwise the first channel with a common name that has lines |
//! | lines | the lines given in the options; otherwise the lines found in that channel |
//! | average | `sum U_i D_i* / sum E_i D_i*`, where D is the coefficient of the channel; without a channel the mean of `U_i/E_i` |
//! | runs | the records, regardless of their number of periods, if there are three or more; otherwise the periods of the records |
//! | delay | the delay of a gain-lead-delay model fitted to the lines: it is used to unwrap the phase, and is removed from the phase before margins are interpolated |
//!
//! Records are used as runs if possible. The remnant of neighbouring periods is one signal, so periods of one run are
//! not independent, and the scatter within one run does not contain the variation of a person from day to day.

use hoid_model::{ContinuousTransferFunction, Detrend, Record, Verdict, uncertainty::Estimate};

use super::{
    describe::{DescribingFunction, describe},
    diagnostics::{DiagnosticInputs, findings},
    excitation::{COMMON_EXCITATIONS, Excitation, LineDetectionOptions, refuse},
    gain_lead_delay::GainLeadDelayOptions,
    open_loop::DescribingMargins,
    options::{Averaging, DescribingOptions, Realisation},
    unwrapping::unwrapped_deg,
    window::Window,
};
use crate::IdentError;

/// Minimum number of records for computing errors from the scatter between records.
const MIN_RUNS: usize = 3;
/// Largest plausible delay; longer delays are artefacts of noise in the phase.
const LONGEST_DELAY_S: f64 = 0.6;

/// Options of a description. By default all choices are made from the records.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecordDescriptionOptions {
    /// Name of the channel with the recorded disturbance or target.
    pub excitation: Option<String>,
    /// Lines of the excitation, rad/s.
    pub lines_rad_s: Option<Vec<f64>>,
    /// Period of the excitation, s. The period is required if the lines are given.
    pub period_s: Option<f64>,
    /// Controlled element, for computing the open loop.
    pub controlled_element: Option<ContinuousTransferFunction>,
    /// Start of the span that is analysed, s.
    pub from_s: Option<f64>,
    /// End of the span that is analysed, s (exclusive).
    pub to_s: Option<f64>,
    /// Offset between the channels: `e[k]` belongs to `u[k + offset_samples]`. The offset need not be an integer.
    pub offset_samples: f64,
    /// Trend removed from e and u of each run before the analysis.
    pub detrend: Detrend,
}

/// A describing function with its margins and its verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct Description {
    /// Describing function, with its lines, runs and remnant.
    pub function: DescribingFunction,
    /// Lines of the excitation, and their period.
    pub excitation: Excitation,
    /// Name of the reference channel of the average; `None` if the mean of the ratios is used.
    pub channel: Option<String>,
    /// Definition of a run: record or period.
    pub realisation: Realisation,
    /// Delay that is removed before phases are unwrapped and interpolated, s.
    pub delay_s: f64,
    /// Crossover and margins, if a controlled element is given.
    pub margins: Option<DescribingMargins>,
    /// Verdict on the describing function.
    pub verdict: Verdict,
}

impl Description {
    /// Returns the phase at each line in deg, without jumps from line to line.
    pub fn phases_deg(&self) -> Vec<Estimate> {
        let known: Vec<Estimate> = self.function.lines.iter().map(|line| line.phase_deg()).collect();
        let omega = self.function.lines.iter().map(|line| line.omega_rad_s);
        let pairs: Vec<(f64, f64)> = omega.zip(known.iter().map(|p| p.value)).collect();
        let unwrapped = unwrapped_deg(&pairs, self.delay_s);
        let whole = |(value, p): (f64, Estimate)| Estimate { value, ..p };
        unwrapped.into_iter().zip(known).map(whole).collect()
    }
}

/// Computes the description of one or several records: describing function, margins and verdict.
///
/// # Errors
/// [`IdentError::BadOption`] if no excitation is found, and the errors of [`describe()`] and [`Excitation::detect`].
pub fn describe_runs(records: &[Record], options: &RecordDescriptionOptions) -> Result<Description, IdentError> {
    let (from_s, to_s) = (options.from_s, options.to_s);
    let cut = |r: &Record| match (from_s, to_s) {
        (None, None) => Ok(r.clone()),
        _ => r.span(from_s.unwrap_or(f64::NEG_INFINITY), to_s.unwrap_or(f64::INFINITY)),
    };
    // Only `parts` are restricted to the span. The whole `records` are passed on, because an offset may need samples
    // beyond the span.
    let parts = records.iter().map(cut).collect::<Result<Vec<Record>, _>>()?;
    let Some(first) = parts.first() else {
        return Err(IdentError::NoRecords);
    };
    let (excitation, channel) = excitation_of(first, options)?;
    let periods: Result<Vec<usize>, IdentError> = parts
        .iter()
        .map(|part| Window::from_span(part, None, None, excitation.period_s()).map(|w| w.periods))
        .collect();
    let realisation = match (parts.len() >= MIN_RUNS, periods?.iter().sum::<usize>()) {
        (false, 2..) => Realisation::Period,
        _ => Realisation::Record,
    };
    let averaging = match &channel {
        Some(channel) => Averaging::Reference {
            channel: channel.clone(),
        },
        None => Averaging::Ratios,
    };
    let describing = DescribingOptions {
        averaging,
        realisation,
        from_s,
        to_s,
        offset_samples: options.offset_samples,
        detrend: options.detrend,
        ..DescribingOptions::default()
    };
    let function = describe(records, &excitation, &describing)?;
    let delay_s = fitted_delay_s(&function);
    let open_loop = options
        .controlled_element
        .as_ref()
        .map(|element| function.open_loop(element));
    let margins = open_loop.as_ref().map(|l| l.margins_with_delay(delay_s));
    let judged = DiagnosticInputs {
        function: &function,
        excitation: &excitation,
        channel: channel.as_deref(),
        realisation,
        open_loop: open_loop
            .as_ref()
            .zip(margins.as_ref().map(|margins| &margins.estimates)),
        offset_samples: options.offset_samples,
    };
    let verdict = Verdict::of(findings(&judged, &parts)?);
    Ok(Description {
        function,
        excitation,
        channel,
        realisation,
        delay_s,
        margins,
        verdict,
    })
}

/// Returns the delay of a gain-lead-delay model fitted to the lines; if the lead is negative, the delay of a model
/// without a lead. Returns zero if the fit fails or the delay is not plausible.
fn fitted_delay_s(function: &DescribingFunction) -> f64 {
    let fit = |lead| {
        let options = GainLeadDelayOptions {
            lead,
            ..GainLeadDelayOptions::default()
        };
        function.fit_gain_lead_delay(&options).ok()
    };
    fit(true)
        .filter(|fit| fit.lead_s.value >= 0.0)
        .or_else(|| fit(false))
        .map(|fit| fit.delay_s.value)
        .filter(|delay| (0.0..=LONGEST_DELAY_S).contains(delay))
        .unwrap_or(0.0)
}

/// Returns the excitation and the name of its channel, which is `None` if only the lines are known.
fn excitation_of(
    record: &Record,
    options: &RecordDescriptionOptions,
) -> Result<(Excitation, Option<String>), IdentError> {
    let search = LineDetectionOptions {
        period_s: options.period_s,
        ..LineDetectionOptions::default()
    };
    let given = match (&options.lines_rad_s, options.period_s) {
        (None, _) => None,
        (Some(lines), Some(period_s)) => Some(Excitation::new(lines, period_s)?),
        (Some(_), None) => {
            return refuse(
                "the lines of the excitation",
                "lines without a period",
                "the period in s of which the lines are harmonics",
            );
        }
    };
    if let Some(channel) = &options.excitation {
        let found = match given {
            Some(given) => given,
            None => Excitation::detect(record, channel, &search)?,
        };
        return Ok((found, Some(channel.clone())));
    }
    let there = || {
        COMMON_EXCITATIONS
            .into_iter()
            .filter(|name| record.channel(name).is_some())
    };
    let mut reason = None;
    for name in there() {
        match (Excitation::detect(record, name, &search), &given) {
            (Ok(found), None) => return Ok((found, Some(name.to_owned()))),
            (Ok(found), Some(given)) if found == *given => return Ok((found, Some(name.to_owned()))),
            (Ok(_), Some(_)) => {}
            // A constant channel, such as a zero target next to a disturbance, is skipped without an error.
            (Err(IdentError::NoExcitation { .. }), _) => {}
            (Err(error), _) => {
                reason.get_or_insert(error);
            }
        }
    }
    match (given, reason) {
        (Some(given), _) => Ok((given, None)),
        (None, Some(error)) => Err(error),
        (None, None) => {
            let names: Vec<&str> = record.channels().map(|c| c.name.as_str()).collect();
            refuse(
                &format!("the excitation of record {}", record.label()),
                format!("none among {}", names.join(", ")),
                "the name of the channel that holds the recorded disturbance or target, or its lines in rad/s and its period",
            )
        }
    }
}
