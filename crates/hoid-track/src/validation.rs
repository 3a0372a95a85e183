//! What a trace explains of another run, and the covariance at the start that this chooses.
//!
//! The reference text measures models by the variance accounted for (eq. 39) and proposes that "the
//! covariance matrix could be updated based on VAF from a validation data set, in order to reduce the
//! strong oscillations" (section VII); how, it leaves open. Here: a second run of the same person in
//! the same task, with its own remnant, is simulated with the estimates of the first as they changed
//! in time,
//!
//! `w(t) = sum_j b_j(t) e(t - nk - j) - sum_i g_i(t) w(t - i)`,  `G = A F`,
//!
//! `VAF = max(0, 1 - sum (u - w)^2/sum u^2) 100 %`,
//!
//! and of a grid of `P_0 = p I` that p is taken whose trace explains most of it. An estimate that
//! follows the remnant of the first run explains less of the second, for that has another one; one
//! that is too stiff explains less where the person changes. Runs are laid on one another from their
//! first samples on, so that what changes in the task has to change at the same time in both.
//!
//! The VAF removes no mean. The first seconds are left out: the simulation begins at rest, and the
//! person does not.

use hoid_ident::{IdentError, validation::vaf};
use hoid_model::{Orders, Record};

use crate::{forgetting::ForgettingRule, method::bad, options::TrackOptions, over_record::track_from, trace::Trace};

/// Values of p that are tried, in units of the innovation variance; the text's is 0.1.
pub const COVARIANCES: [f64; 9] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0];
/// Time behind which the simulation has forgotten that it began at rest, s.
const SETTLING_S: f64 = 2.0;
/// Shortest span that is compared, s.
const SHORTEST_S: f64 = 5.0;
/// Option that is chosen.
const COVARIANCE: &str = "covariance";

/// A covariance at the start that was chosen by a second run.
#[derive(Debug, Clone, PartialEq)]
pub struct CovarianceChoice {
    /// Each p that was tried, ascending, with the VAF of the second run by its trace in %.
    pub candidates: Vec<(f64, f64)>,
    /// The p that was taken.
    pub covariance: f64,
    /// Label of the second run.
    pub label: String,
    /// Span of the second run that was compared, in s from its first sample.
    pub span_s: (f64, f64),
}

impl CovarianceChoice {
    /// VAF of the p that was taken, %.
    pub fn vaf(&self) -> f64 {
        let taken = self.candidates.iter().find(|(p, _)| *p == self.covariance);
        taken.map_or(f64::NAN, |(_, vaf)| *vaf)
    }
}

impl Trace {
    /// VAF (eq. 39, no mean removed) of another run that is simulated with the estimates of this trace,
    /// each at its time from the first sample on, in %, and the span that was compared, in s from the
    /// first sample.
    ///
    /// # Errors
    /// [`IdentError`] for a run that is sampled otherwise, has no input, or too few samples in common,
    /// and for a trace whose delay moves.
    pub fn vaf_of(&self, other: &Record) -> Result<(f64, (f64, f64)), IdentError> {
        let ts = self.sample_time();
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
                structure: self.options().structure.label(),
                label: other.label().to_owned(),
            });
        }
        if self.options().method.track_delay_s().is_some() || self.options().method.starts_itself() {
            return Err(bad(
                "the validation of a trace",
                "a delay that moves".to_owned(),
                "a method with a delay that is given, without track_delay",
            ));
        }
        let o = self.options().polynomial_orders();
        let rows = (self.len() * self.every()).min(other.len());
        let first = o.nk + (SETTLING_S / ts.s()).ceil() as usize;
        let span_s = (first as f64 * ts.s(), rows as f64 * ts.s());
        if span_s.1 - span_s.0 < SHORTEST_S {
            return Err(bad(
                "the run for validation",
                format!("{} s in common with the run that is tracked", span_s.1),
                &format!(
                    "at least {} s: a longer run of the same person in the same task",
                    span_s.0 + SHORTEST_S
                ),
            ));
        }
        let response = self.simulated(&o, &other.input()[..rows]);
        let found = vaf(&other.output()[first..rows], &response[first..]);
        Ok((if found.is_finite() { found } else { 0.0 }, span_s))
    }

    /// The response to an input, the coefficients as they changed in time.
    fn simulated(&self, o: &Orders, e: &[f64]) -> Vec<f64> {
        let mut w = vec![0.0; e.len()];
        for k in 0..e.len() {
            let row = ((k + 1) / self.every()).saturating_sub(1).min(self.len() - 1);
            let theta = self.theta(row);
            let (a, b) = (&theta[..o.na], &theta[o.na..o.na + o.nb]);
            let f = &theta[theta.len() - o.nf..];
            let input = |lag: usize| if k >= lag { e[k - lag] } else { 0.0 };
            let past = |lag: usize| if k >= lag { w[k - lag] } else { 0.0 };
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
}

/// The options with the covariance at the start whose trace of the record explains most of a second
/// run; of two that explain the same, the smaller.
///
/// # Errors
/// [`IdentError`] for a method without such a covariance, one that is given already, and as
/// [`track_from`] and [`Trace::vaf_of`].
pub fn choose_covariance(
    record: &Record,
    validation: &Record,
    options: &TrackOptions,
) -> Result<(TrackOptions, CovarianceChoice), IdentError> {
    let method = &options.method;
    let has_p = method
        .settings()
        .list()
        .iter()
        .any(|setting| setting.name == COVARIANCE);
    let forgets = method.inner().forgetting();
    if !has_p || matches!(forgets, ForgettingRule::Window | ForgettingRule::Gradient(_)) {
        return Err(bad(
            "the run for validation",
            format!("{method}, whose gain does not begin with a covariance that can be chosen"),
            "a method with the option covariance, as rls or rpem, and a way of forgetting that has P",
        ));
    }
    if let Some(given) = method.covariance() {
        return Err(bad(
            COVARIANCE,
            format!("{given}, and a run for validation, which chooses it"),
            "one of the two",
        ));
    }
    let mut candidates = Vec::new();
    let mut best: Option<(f64, f64, TrackOptions)> = None;
    let mut start = None;
    let mut span_s = (0.0, 0.0);
    for p in COVARIANCES {
        let options = options.clone().with(&[(COVARIANCE, &p.to_string())])?;
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
        return Err(bad(
            "the run for validation",
            format!("a VAF of 0 % of {} with every covariance", validation.label()),
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
