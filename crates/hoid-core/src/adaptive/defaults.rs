//! Default settings, with times in seconds: the prior for a person without an earlier fit.
//!
//! The default operator (lag 3 s, neuromuscular system with 11 rad/s and damping 0.25, form
//! `(T_L s + 1)^2/(T_I s + 1)`) is typical of recorded people. All other values were chosen on simulated people (whose
//! operator has a lag, whose delay is not a whole number of samples, and whose remnant is an autoregression with a
//! level that may change) and on the conditions C1 to C6, seed 9000. None was chosen on recorded people.

use super::{
    basis::Point,
    detector::DetectorSettings,
    last_blocks::BLOCK_S,
    mixture::ChangePrior,
    prior::{AdaptivePrior, DelayPrior},
    sizes::{DYNAMICS_COUNT, START_COUNT},
};

/// Lag T_I of the default person in s.
pub const LAG_S: f64 = 3.0;
/// Natural frequency of the neuromuscular system in rad/s.
pub const OMEGA_RAD_S: f64 = 11.0;
/// Damping ratio of the neuromuscular system.
pub const ZETA: f64 = 0.25;
/// Prior standard deviations of omega and zeta (relative) and of the delay (in s) if no delay is given.
pub const PRIOR_DEVIATIONS: [f64; DYNAMICS_COUNT] = [0.3, 0.5, 0.1];
/// Prior standard deviation of a given delay in s.
pub const GIVEN_DELAY_DEVIATION_S: f64 = 0.02;
/// Order of the noise model.
pub const NOISE_ORDER: usize = 16;
/// Limit of an innovation, in standard deviations. It is large because people with a dead zone act in pulses, which are
/// part of their response and not outliers.
pub const INNOVATION_LIMIT: f64 = 8.0;
/// Time in s after which the estimate starts.
pub const START_TIME_S: f64 = 1.0;
/// Span in s of the data that are replayed.
pub const REPLAY_SPAN_S: f64 = 100.0;

/// Default prior of the changes in the operator.
const CHANGE_PRIOR: ChangePrior = ChangePrior {
    block: 0.32,
    mean_interval_s: 180.0,
    change_deviation: [0.3, 0.4],
    drift: [0.003, 0.05],
    settling: [0.1, 3.0],
    level: 0.01,
    variance: [20.0, 2.0],
    steady: 0.6,
    free_numerator: 0.4,
    protected_blocks: 4,
    limit: INNOVATION_LIMIT,
    detector_limit: DETECTOR_LIMIT,
};
/// Memory of the noise model in s.
const NOISE_MEMORY_S: f64 = 100.0;
/// Limit of an innovation in the change detector, in standard deviations.
const DETECTOR_LIMIT: f64 = 3.5;
/// Starting points of the first estimate: delay in s relative to the delay of the person, natural frequency in rad/s,
/// and damping ratio. If the delay is given, all starting points have this delay.
const STARTING_POINTS: [[f64; 3]; START_COUNT] = [
    [0.0, OMEGA_RAD_S, ZETA],
    [0.1, 11.0, 0.3],
    [0.2, 9.0, 0.4],
    [-0.08, 11.0, 0.3],
    [0.0, 7.0, 0.5],
    [0.1, 8.0, 0.5],
    [0.0, 16.0, 0.25],
    [0.1, 16.0, 0.3],
];
/// Delays of a further input at the starting points, in s relative to its delay: with the delays above, the starting
/// points cover longer and shorter delays of either input.
const FURTHER_STARTING_DELAYS: [f64; START_COUNT] = [0.0, -0.08, 0.1, 0.1, -0.08, 0.1, 0.1, 0.0];
/// Shortest delay of a starting point in s.
const SHORTEST_DELAY_S: f64 = 0.03;
/// Spans of the detector in s: `PRESENT_LENGTHS_S` contains the lengths of the short and the long present,
/// `PAST_LENGTHS_S` the smallest and the largest length of the past, and `REFRACTORY_PERIOD_S` is the time after a
/// change in which no other change is declared.
const PRESENT_LENGTHS_S: [f64; 2] = [4.0, 8.0];
const PAST_LENGTHS_S: [f64; 2] = [15.0, 40.0];
const REFRACTORY_PERIOD_S: f64 = 8.0;
/// Threshold in nats for an accepted rate of one false alarm per hour; `THRESHOLD_SLOPE` is its decrease per unit of
/// the logarithm of the rate. By chance alone, on average one of the 7200 blocks in an hour exceeds 8.9 nats, but
/// people vary more than the model. In 3.8 hours of recordings of three pilots without a change, there were 2.5 alarms
/// per hour at 15 nats and 10 at 10.2 nats.
const THRESHOLD_NATS: f64 = 15.0;
const THRESHOLD_SLOPE: f64 = 3.3;
/// Prior standard deviation of a change in the delay in s.
const DELAY_CHANGE_DEVIATION_S: f64 = 0.05;

/// Returns the prior of the delay of a further input, for a delay in s as in [`DefaultOperator::with_delay`];
/// `is_given` is true if the user gave this delay.
pub fn further_delay(tau: f64, is_given: bool) -> DelayPrior {
    DelayPrior {
        tau,
        deviation: if is_given {
            GIVEN_DELAY_DEVIATION_S
        } else {
            PRIOR_DEVIATIONS[2]
        },
        starts: FURTHER_STARTING_DELAYS.map(|later| (tau + if is_given { 0.0 } else { later }).max(SHORTEST_DELAY_S)),
    }
}

/// Operator and settings assumed before the first sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DefaultOperator {
    /// Delay, natural frequency, damping and lag of the operator.
    pub point: Point,
    /// Prior standard deviations of omega and zeta (relative) and of the delay (in s).
    pub spread: [f64; DYNAMICS_COUNT],
    /// Order of the noise model.
    pub order: usize,
    /// Limit of an innovation, in standard deviations.
    pub limit: f64,
    /// Accepted number of false alarms per hour.
    pub false_alarms: f64,
}

impl DefaultOperator {
    /// Returns the defaults with a delay in s, for an error that is interpolated linearly between samples. If the error
    /// is held over each sample, add half a sample to the delay.
    pub fn with_delay(tau: f64) -> Self {
        Self {
            point: Point {
                tau,
                omega: OMEGA_RAD_S,
                zeta: ZETA,
                lag: LAG_S,
            },
            spread: PRIOR_DEVIATIONS,
            order: NOISE_ORDER,
            limit: INNOVATION_LIMIT,
            false_alarms: 1.0,
        }
    }

    /// Returns the threshold of the detector in nats for the accepted number of false alarms.
    fn threshold(&self) -> f64 {
        (THRESHOLD_NATS - THRESHOLD_SLOPE * libm::log(self.false_alarms)).max(1.0)
    }

    /// Returns the prior for a sample time in s.
    pub fn prior(&self, sample_time: f64) -> AdaptivePrior {
        let blocks = |seconds: f64| libm::round(seconds / BLOCK_S) as usize;
        let given = self.spread[2] < PRIOR_DEVIATIONS[2];
        AdaptivePrior {
            person: self.point,
            spread: self.spread,
            sample_time,
            order: self.order,
            noise_memory: NOISE_MEMORY_S,
            hold: START_TIME_S,
            changes: ChangePrior {
                limit: self.limit,
                ..CHANGE_PRIOR
            },
            starts: STARTING_POINTS.map(|[later, omega, zeta]| Point {
                tau: (self.point.tau + if given { 0.0 } else { later }).max(SHORTEST_DELAY_S),
                omega,
                zeta,
                ..self.point
            }),
            detection: DetectorSettings {
                recent: PRESENT_LENGTHS_S.map(blocks),
                least: blocks(PAST_LENGTHS_S[0]),
                most: blocks(PAST_LENGTHS_S[1]),
                threshold: self.threshold(),
                dynamics: [
                    OMEGA_RAD_S * PRIOR_DEVIATIONS[0],
                    ZETA * PRIOR_DEVIATIONS[1],
                    DELAY_CHANGE_DEVIATION_S,
                ],
                refractory: blocks(REFRACTORY_PERIOD_S) as u64,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_false_alarms_give_a_higher_threshold() {
        let of = |false_alarms: f64| {
            let default = DefaultOperator {
                false_alarms,
                ..DefaultOperator::with_delay(0.2)
            };
            default.prior(0.01).detection.threshold
        };
        assert!(of(0.5) > of(1.0) && of(1.0) > of(30.0));
        assert!(of(1e9) > 0.0);
    }

    #[test]
    fn starts_respect_the_shortest_delay() {
        let prior = DefaultOperator::with_delay(0.05).prior(0.01);
        assert!(prior.is_valid());
        assert!(prior.starts.iter().all(|start| start.tau >= SHORTEST_DELAY_S));
    }
}
