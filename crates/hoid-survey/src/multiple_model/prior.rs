//! Prior of a person and of their changes, in seconds, and the initial hypothesis.

use std::ops::RangeInclusive;

use hoid_core::innovation_variance::InnovationVariance;
use hoid_ident::IdentError;
use hoid_model::SampleTime;
use hoid_track::building::{Setup, StartState, physical_bounds};

use crate::kernel::multiple_model::{
    hypothesis::Hypothesis,
    prior::{ChangePrior, DelayPrior, PARAMETER_COUNT},
};

/// Time between two births, s.
const BIRTH_INTERVAL_S: f64 = 0.32;
/// Mean time between two changes, s.
const MEAN_CHANGE_INTERVAL_S: f64 = 60.0;
/// Prior standard deviations of a change in K_e and in K_e_dot, in the units of [`ChangePrior::gain_jump`].
const CHANGE_SD: [f64; 2] = [0.15, 0.5];
/// Standard deviation of the drift of each gain in one second, in the units of [`ChangePrior::gain_drift`].
const GAIN_DRIFT: f64 = 0.005;
/// Standard deviations of the drift in one second just after a change, in the units of
/// [`ChangePrior::transient_drift`]; `TRANSIENT_TIME_CONSTANT_S` is the time constant of its decay, s.
const TRANSIENT_DRIFT: [f64; PARAMETER_COUNT] = [0.05, 0.25, 0.2, 0.2];
const TRANSIENT_TIME_CONSTANT_S: f64 = 3.0;
/// Prior standard deviations of a relative change in omega_nm and in zeta_nm. A hypothesis that omega_nm and zeta_nm
/// also changed is created every `NEUROMUSCULAR_BIRTH_INTERVAL` births; `NEUROMUSCULAR_ODDS` are the odds of this
/// change against a change in the gains alone.
const NEUROMUSCULAR_CHANGE_SD: [f64; 2] = [0.25, 0.4];
const NEUROMUSCULAR_BIRTH_INTERVAL: u32 = 4;
const NEUROMUSCULAR_ODDS: f64 = 0.3;
/// Crossover frequency, which scales K_e_dot relative to K_e, rad/s.
const CROSSOVER_RAD_S: f64 = 2.0;
/// Memory length of the innovation variance (s); `RETAINED_MEMORY_S` is the part of this length that remains after a
/// change.
const LEVEL_MEMORY_S: f64 = 20.0;
const RETAINED_MEMORY_S: f64 = 1.0;
/// Number of birth intervals for which a hypothesis is kept regardless of its predictions.
const PROTECTED_BIRTHS: f64 = 4.0;
/// Age from which a hypothesis can identify the changed parameters, s.
const SETTLING_TIME_S: f64 = 0.5;
/// Largest age at which a hypothesis represents a recent change, s.
const MAX_RECENT_AGE_S: f64 = 4.0;

/// Interval between proposals of other delays, in births. The following constants are the number of delays proposed,
/// the odds of a change in the delay against a change in the gains alone, the standard deviation of that change in s,
/// and the probability of a delay next to the likeliest delay.
const DELAY_BIRTH_INTERVAL: u32 = 4;
const PROPOSED_DELAY_COUNT: usize = 8;
const DELAY_ODDS: f64 = 1.0;
const DELAY_CHANGE_SD_S: f64 = 0.05;
const NEIGHBOUR_PROBABILITY: f64 = 0.15;
/// Effect of a delay error of 0.01 s on K_e, K_e_dot, omega_nm and zeta_nm, in the units of
/// [`DelayPrior::error_per_sample`].
const DELAY_ERROR_EFFECT: [f64; PARAMETER_COUNT] = [0.01, 0.03, 0.04, 0.08];

/// Candidate delays as values of nk: nk itself, or all values of the tracked range.
pub(super) fn candidate_delays(setup: &Setup, sample_time: SampleTime) -> RangeInclusive<usize> {
    match setup.track_delay_s {
        None => setup.orders.nk..=setup.orders.nk,
        Some((low, high)) => sample_time.nk(low)..=sample_time.nk(high),
    }
}

/// Returns the prior of changes, with times in samples.
///
/// # Errors
/// The errors of [`physical_bounds`].
pub(super) fn change_prior(alarm: f64, setup: &Setup, sample_time: SampleTime) -> Result<ChangePrior, IdentError> {
    let ts = sample_time.s();
    let spacing = (BIRTH_INTERVAL_S / ts).round().max(1.0);
    Ok(ChangePrior {
        sample_time: ts,
        bounds: physical_bounds::<PARAMETER_COUNT>(setup, sample_time)?,
        birth_interval: spacing as u32,
        // The probability of a change between two births is at most one half.
        hazard: (ts / MEAN_CHANGE_INTERVAL_S).min(0.5 / spacing),
        gain_jump: CHANGE_SD,
        gain_drift: GAIN_DRIFT * ts.sqrt(),
        transient_drift: TRANSIENT_DRIFT.map(|u| u * ts.sqrt()),
        transient_time_constant: TRANSIENT_TIME_CONSTANT_S / ts,
        neuromuscular_jump: NEUROMUSCULAR_CHANGE_SD,
        neuromuscular_every: NEUROMUSCULAR_BIRTH_INTERVAL,
        neuromuscular_odds: NEUROMUSCULAR_ODDS,
        crossover: CROSSOVER_RAD_S,
        residuals_after_change: (RETAINED_MEMORY_S / ts).max(4.0),
        pruning_age: (PROTECTED_BIRTHS * spacing) as u64,
        outlier_limit: setup.limit,
        settling_time: (SETTLING_TIME_S / ts).round() as u64,
        change_window: (MAX_RECENT_AGE_S / ts).round().max(2.0 * spacing) as u64,
        log_odds_threshold: alarm,
        delay: match candidate_delays(setup, sample_time).count() {
            1 => DelayPrior::KNOWN_DELAY,
            count => DelayPrior {
                count,
                propose_every: DELAY_BIRTH_INTERVAL,
                change_odds: DELAY_ODDS,
                proposals: PROPOSED_DELAY_COUNT,
                jump: DELAY_CHANGE_SD_S / ts,
                neighbour_probability: NEIGHBOUR_PROBABILITY,
                error_per_sample: DELAY_ERROR_EFFECT.map(|w| w * ts / 0.01),
            },
        },
    })
}

/// Returns the initial hypothesis, from the batch fit of the start span with its covariance multiplied by `times`.
///
/// # Errors
/// [`IdentError::BadStart`] if the start is not a batch fit or its covariance is not positive definite.
pub(super) fn first_hypothesis(
    from: &StartState,
    times: f64,
    sample_time: SampleTime,
) -> Result<Hypothesis, IdentError> {
    if !from.from_fit {
        return Err(invalid_prior(
            "multiple-model needs the noise model of a batch fit; start it from the fit of a span",
        ));
    }
    let p = from.values.len();
    let covariance = std::array::from_fn(|i| std::array::from_fn(|j| times * from.variance * from.spread[i * p + j]));
    let memory = (LEVEL_MEMORY_S / sample_time.s()).max(10.0);
    let level = InnovationVariance::new(from.variance, from.residuals.clamp(1.0, memory), 1.0 - 1.0 / memory);
    Hypothesis::new(std::array::from_fn(|i| from.values[i]), &covariance, level).ok_or_else(out_of_range_error)
}

pub(super) fn invalid_prior(reason: &str) -> IdentError {
    IdentError::BadStart {
        reason: reason.to_owned(),
    }
}

pub(super) fn out_of_range_error() -> IdentError {
    invalid_prior("it lies outside the bounds of the physical parameters, or its covariance is not positive")
}
