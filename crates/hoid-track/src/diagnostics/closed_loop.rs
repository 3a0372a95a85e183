//! Tests whether e responds to u beyond chance.
//!
//! In a closed loop the latest u improves the prediction of e from earlier errors and outputs ([`loop_response()`]).
//! The share of the prediction errors that it explains may be small: the target, which cannot be predicted either, and
//! the resolution of the recorder also contribute to these errors. The share is therefore compared with chance: the
//! largest share of [`SHIFT_COUNT`] copies of u that are shifted circularly in time. A shift keeps the spectrum of u,
//! and with it what sinusoids common to e and u explain, but removes a response. Jumps of the target are removed from
//! e, which does not change how e responds to u. The test is done at the rate of the record and, since the mean of a
//! block has less noise, with means at [`SLOW_RATE_HZ`]; a response at either rate counts.

use hoid_ident::diagnostics::loop_response;
use hoid_model::{Finding, Record};
use hoid_numerics::statistics::{mean, upper_median};

use crate::trace::Trace;

/// Lower of the two rates at which the signals are compared, Hz.
const SLOW_RATE_HZ: f64 = 12.5;
/// Number of shifted copies of u.
const SHIFT_COUNT: usize = 24;
/// Share that chance does not reach; the copies are not examined for a larger share.
const CLEAR_SHARE: f64 = 0.2;
/// Ratio to the share by chance above which e is considered to respond to u. For u of another run it is rarely above
/// 1.2.
const CHANCE_RATIO: f64 = 1.4;
/// Longest span (in s) that is examined, at the end of the record.
const MAX_SPAN_S: f64 = 120.0;
/// Second difference of e, in standard deviations, above which it is a jump.
const JUMP_DEVIATIONS: f64 = 8.0;
/// Ratio of the standard deviation to the median magnitude of a Gaussian variable.
const DEVIATION_TO_MEDIAN: f64 = 1.4826;

/// Shares of the part of e that past e and u do not explain.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LoopShare {
    /// Share that the latest u explains.
    own: f64,
    /// Largest share that the latest u of a shifted copy explains.
    chance: f64,
}

impl LoopShare {
    /// Compares u with its shifted copies; `None` if there are too few data.
    fn of(e: &[f64], u: &[f64], sample_time_s: f64) -> Option<Self> {
        let own = loop_response(e, u, 0, sample_time_s)?.share;
        let copies = 1..=if own < CLEAR_SHARE { SHIFT_COUNT } else { 0 };
        let share = |copy: usize| {
            let mut shifted = u.to_vec();
            shifted.rotate_right(copy * u.len() / (SHIFT_COUNT + 1));
            loop_response(e, &shifted, 0, sample_time_s).map(|found| found.share)
        };
        let chance = copies.filter_map(share).fold(0.0, f64::max);
        Some(Self { own, chance })
    }

    fn is_response(&self) -> bool {
        self.own > CHANCE_RATIO * self.chance
    }
}

/// Tests whether e responds to u; returns the shares at the rate of the record if it does not. `None` if it does, and
/// if there are too few data.
fn missing_response(e: &[f64], u: &[f64], sample_time_s: f64) -> Option<LoopShare> {
    let first = u.len().saturating_sub((MAX_SPAN_S / sample_time_s) as usize);
    let (e, u) = (without_jumps(e.get(first..)?), u.get(first..)?);
    let fast = LoopShare::of(&e, u, sample_time_s)?;
    let length = ((1.0 / (sample_time_s * SLOW_RATE_HZ)).round() as usize).max(1);
    let means = |of: &[f64]| of.chunks_exact(length).map(mean).collect::<Vec<_>>();
    let slow = || LoopShare::of(&means(&e), &means(u), length as f64 * sample_time_s);
    (!fast.is_response() && !slow().is_some_and(|slow| slow.is_response())).then_some(fast)
}

/// Removes jumps from a signal.
fn without_jumps(values: &[f64]) -> Vec<f64> {
    let steps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    let sizes = steps.windows(2).map(|w| (w[1] - w[0]).abs());
    let mut sizes: Vec<f64> = sizes.filter(|size| *size > 0.0).collect();
    let limit = upper_median(&mut sizes).map_or(f64::INFINITY, |m| JUMP_DEVIATIONS * DEVIATION_TO_MEDIAN * m);
    let (mut last, mut jumps) = (steps.first().copied().unwrap_or(0.0), 0.0);
    let follow = |(value, step): (&f64, &f64)| {
        if (step - last).abs() > limit {
            jumps += step - last;
        } else {
            last = *step;
        }
        value - jumps
    };
    let first = values.iter().take(1).copied();
    first.chain(values.iter().skip(1).zip(&steps).map(follow)).collect()
}

impl Trace {
    /// Finding that e does not respond to u.
    pub(super) fn loop_response_finding(&self, record: &Record) -> Option<Finding> {
        let clean = self.longest_span_without_faults(record);
        let (e, u) = (record.input().get(clean.clone())?, record.output().get(clean)?);
        let found = missing_response(e, u, self.sample_time().s())?;
        Some(Finding::warning(
            "no-answer",
            format!(
                "e does not respond to u as it would in a closed loop (the latest u explains {:.1} % of the \
                 innovations of e; copies of u that are shifted in time explain up to {:.1} %): check whether u and e \
                 are from the same run",
                100.0 * found.own,
                100.0 * found.chance
            ),
        ))
    }
}
