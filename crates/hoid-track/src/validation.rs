//! Prediction of another run by a trace, and choice of the initial covariance by this prediction.
//!
//! The thesis measures models by the variance accounted for (eq. 39) and proposes that "the covariance matrix could be
//! updated based on VAF from a validation data set, in order to reduce the strong oscillations" (section VII), but does
//! not specify how. Here a second run of the same person in the same task, with its own remnant, is simulated with the
//! time-varying estimates of the first run,
//!
//! `w(t) = sum_j b_j(t) e(t - nk - j) - sum_i g_i(t) w(t - i)`,  `G = A F`,
//!
//! `VAF = max(0, 1 - sum (u - w)^2/sum u^2) 100 %`,
//!
//! The initial covariance is `P_0 = p I`, with the p of a grid whose trace explains the second run best. An estimate
//! that follows the remnant of the first run explains less of the second run, which has another remnant; an estimate
//! that changes too slowly explains less after a change in the person. The runs are aligned at their first samples, so
//! changes of the task must occur at the same time in both runs.
//!
//! [`track_validated`] follows the proposal literally: P is updated during the run. At regular times the current model
//! and the model of one interval earlier are both simulated over the last few seconds of the second run; if the current
//! model explains less,
//!
//! `P <- P max(least, ((1 - VAF_before)/(1 - VAF_now))^power)`,
//!
//! so that the estimate changes less until this reduction of P has been forgotten; if the current model explains more,
//! P is left unchanged. The share of the second run that the remnant leaves unexplained is the same for both models, so
//! noise does not penalise a correct model.
//!
//! No mean is removed for the VAF. The first 2 s are excluded, since the simulation starts at rest and the person does
//! not.

use hoid_ident::{IdentError, validation::vaf};
use hoid_model::{Orders, Record, SampleTime};

use crate::{
    forgetting::ForgettingRule,
    method::invalid_option,
    options::TrackOptions,
    over_record::{track_from, track_with},
    trace::Trace,
};

/// Values of p that are tried, in units of the innovation variance; the thesis uses 0.1.
pub const CANDIDATE_COVARIANCES: [f64; 9] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0];
/// Time after which the initial state of the simulation has decayed, s.
const SETTLING_S: f64 = 2.0;
/// Shortest span of the second run that is compared, s.
const MIN_SPAN_S: f64 = 5.0;
/// Name of the option that the second run determines.
const COVARIANCE_OPTION: &str = "covariance";

/// An initial covariance that was chosen by prediction of a second run.
#[derive(Debug, Clone, PartialEq)]
pub struct CovarianceChoice {
    /// Each p that was tried, in ascending order, and the VAF in % with which its trace explains the second run.
    pub candidates: Vec<(f64, f64)>,
    /// The chosen p.
    pub covariance: f64,
    /// Label of the second run.
    pub label: String,
    /// Span of the second run that was compared, in s from its first sample.
    pub span_s: (f64, f64),
}

impl CovarianceChoice {
    /// Returns the VAF of the chosen p, %.
    pub fn vaf(&self) -> f64 {
        let taken = self.candidates.iter().find(|(p, _)| *p == self.covariance);
        taken.map_or(f64::NAN, |(_, vaf)| *vaf)
    }
}

impl Trace {
    /// Returns the VAF (eq. 39, no mean removed) of another run in %, and the span of that run that was compared, in s
    /// from its first sample. The run is simulated with the estimates of this trace at the same times from the first
    /// sample on.
    ///
    /// # Errors
    /// [`IdentError`] for a run with another sample time, without an input, or with too few samples in common, and for
    /// a trace with a tracked delay.
    pub fn vaf_of(&self, other: &Record) -> Result<(f64, (f64, f64)), IdentError> {
        let ts = self.sample_time();
        check_second_run(other, self.options(), ts)?;
        let o = self.options().polynomial_orders();
        let rows = (self.len() * self.row_interval()).min(other.len());
        let first = o.nk + (SETTLING_S / ts.s()).ceil() as usize;
        let span_s = (first as f64 * ts.s(), rows as f64 * ts.s());
        if span_s.1 - span_s.0 < MIN_SPAN_S {
            return Err(invalid_option(
                "the run for validation",
                format!("{} s in common with the tracked run", span_s.1),
                &format!(
                    "at least {} s: a longer run of the same person in the same task",
                    span_s.0 + MIN_SPAN_S
                ),
            ));
        }
        let row_at = |k: usize| ((k + 1) / self.row_interval()).saturating_sub(1).min(self.len() - 1);
        let response = simulate(&o, &other.input()[..rows], 0, |k| self.theta(row_at(k)));
        let found = vaf(&other.output()[first..rows], &response[first..]);
        Ok((if found.is_finite() { found } else { 0.0 }, span_s))
    }
}

/// Checks a second run and its trace.
fn check_second_run(other: &Record, options: &TrackOptions, ts: SampleTime) -> Result<(), IdentError> {
    let found = other.sample_time();
    if !found.matches(ts) {
        return Err(IdentError::MixedSampling {
            label: other.label().to_owned(),
            found: found.s(),
            expected: ts.s(),
        });
    }
    if other.input_channel().is_none() {
        return Err(IdentError::NoInput {
            structure: options.structure.label(),
            label: other.label().to_owned(),
        });
    }
    if options.method.track_delay_s().is_some() || options.method.is_self_starting() {
        return Err(invalid_option(
            "the validation of a trace",
            "a tracked delay".to_owned(),
            "a method with a fixed delay, without track_delay",
        ));
    }
    Ok(())
}

/// Simulates the response to an input from sample `first` on, at rest before it, with the coefficients of each sample.
fn simulate<'t>(o: &Orders, e: &[f64], first: usize, theta_at: impl Fn(usize) -> &'t [f64]) -> Vec<f64> {
    let mut w = vec![0.0; e.len()];
    for k in first..e.len() {
        let theta = theta_at(k);
        let (a, b) = (&theta[..o.na], &theta[o.na..o.na + o.nb]);
        let f = &theta[theta.len() - o.nf..];
        let input = |lag: usize| if k >= lag { e[k - lag] } else { 0.0 };
        let past = |lag: usize| if k >= first + lag { w[k - lag] } else { 0.0 };
        let mut now: f64 = b.iter().enumerate().map(|(j, b)| b * input(o.nk + j)).sum();
        // G = A F, term by term.
        for i in 0..=o.na {
            for j in 0..=o.nf {
                if i + j > 0 {
                    let a_i = if i == 0 { 1.0 } else { a[i - 1] };
                    let f_j = if j == 0 { 1.0 } else { f[j - 1] };
                    now -= a_i * f_j * past(i + j);
                }
            }
        }
        w[k] = now;
    }
    w
}

/// Checks that the gain of the method has a covariance.
fn check_method(options: &TrackOptions) -> Result<(), IdentError> {
    let method = &options.method;
    let has_p = method
        .settings()
        .list()
        .iter()
        .any(|setting| setting.name == COVARIANCE_OPTION);
    let forgets = method.forgetting();
    if !has_p || matches!(forgets, ForgettingRule::Window | ForgettingRule::Gradient(_)) {
        return Err(invalid_option(
            "the run for validation",
            format!("{method}, whose gain has no start covariance to choose"),
            "a method with the option covariance, such as rls or rpem, and a type of forgetting that has P",
        ));
    }
    Ok(())
}

/// Returns the options with the initial covariance whose trace of the record explains a second run best; if two
/// covariances explain it equally well, the smaller one is chosen.
///
/// # Errors
/// [`IdentError`] for a method without such a covariance, or if a covariance is given; the errors of [`track_from`] and
/// [`Trace::vaf_of`].
pub fn choose_covariance(
    record: &Record,
    validation: &Record,
    options: &TrackOptions,
) -> Result<(TrackOptions, CovarianceChoice), IdentError> {
    check_method(options)?;
    let method = &options.method;
    if let Some(given) = method.initial_covariance() {
        return Err(invalid_option(
            COVARIANCE_OPTION,
            format!("{given}, and a run for validation, which chooses the covariance"),
            "only one of the two",
        ));
    }
    let mut candidates = Vec::new();
    let mut best: Option<(f64, f64, TrackOptions)> = None;
    let mut start = None;
    let mut span_s = (0.0, 0.0);
    for p in CANDIDATE_COVARIANCES {
        let options = options.clone().with(&[(COVARIANCE_OPTION, &p.to_string())])?;
        let trace = track_from(record, &options, 1, start.as_ref())?;
        let (found, of) = trace.vaf_of(validation)?;
        start = trace.start().cloned();
        span_s = of;
        candidates.push((p, found));
        if best.as_ref().is_none_or(|(most, ..)| found > *most) {
            best = Some((found, p, options));
        }
    }
    let Some((_, covariance, options)) = best.filter(|(most, ..)| *most > 0.0) else {
        return Err(invalid_option(
            "the run for validation",
            format!("a VAF of 0 % for {} with every covariance", validation.label()),
            "a run of the same person in the same task, with the same columns, signs and units",
        ));
    };
    let choice = CovarianceChoice {
        candidates,
        covariance,
        label: validation.label().to_owned(),
        span_s,
    };
    Ok((options, choice))
}

/// Settings for the reduction of P by the VAF of a second run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CovarianceUpdates {
    /// Time between two comparisons with the second run, s.
    pub interval_s: f64,
    /// Length of the span of the second run that is simulated, s.
    pub window_s: f64,
    /// Smallest factor by which P is multiplied.
    pub least: f64,
    /// Power of the ratio of the unexplained shares; 0 leaves P unchanged.
    pub power: f64,
}

/// The defaults were chosen with separate runs (`research/notes/survey-methods.md`).
impl Default for CovarianceUpdates {
    fn default() -> Self {
        Self {
            interval_s: 0.5,
            window_s: 5.12,
            least: 0.1,
            power: 4.0,
        }
    }
}

/// Like [`crate::track()`], with a covariance that is reduced when the estimate explains less of a second run than
/// before.
///
/// # Errors
/// The errors of [`crate::track()`]; [`IdentError`] for a method without such a covariance or with a tracked delay, and
/// for a second run with another sample time, too few samples, or no input.
pub fn track_validated(
    record: &Record,
    validation: &Record,
    options: &TrackOptions,
    updates: &CovarianceUpdates,
    every: usize,
) -> Result<Trace, IdentError> {
    let ts = record.sample_time();
    check_method(options)?;
    check_second_run(validation, options, ts)?;
    if validation.len() < record.len() {
        return Err(invalid_option(
            "the run for validation",
            format!("{} samples", validation.len()),
            &format!("at least {}, as in the tracked run", record.len()),
        ));
    }
    let samples = |time_s: f64| ((time_s / ts.s()).round() as usize).max(1);
    let [interval, window, settling] = [updates.interval_s, updates.window_s, SETTLING_S].map(samples);
    let o = options.polynomial_orders();
    let (e, u) = (validation.input(), validation.output());
    let unexplained = |theta: &[f64], end: usize| -> f64 {
        let first = end.saturating_sub(window);
        let from = first.saturating_sub(settling);
        // The simulation also needs the input before this span that still acts within it.
        let begin = from.saturating_sub(o.nk + o.nb);
        let w = simulate(&o, &e[begin..end], from - begin, |_| theta);
        let error: f64 = (first..end).map(|k| (u[k] - w[k - begin]).powi(2)).sum();
        error / (first..end).map(|k| u[k] * u[k]).sum::<f64>()
    };
    let mut before: Option<Vec<f64>> = None;
    track_with(record, options, every, None, &mut |tracker, k| {
        let last = before.get_or_insert_with(|| tracker.theta().to_vec());
        if !(k + 1).is_multiple_of(interval) {
            return;
        }
        let ratio = unexplained(last, k + 1) / unexplained(tracker.theta(), k + 1);
        if ratio < 1.0 {
            tracker
                .recursion
                .scale_covariance(ratio.powf(updates.power).max(updates.least));
        }
        last.copy_from_slice(tracker.theta());
    })
}
