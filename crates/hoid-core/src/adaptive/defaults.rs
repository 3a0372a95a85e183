//! Defaults for people, in seconds: the prior of a person without an earlier fit.
//!
//! The default operator (lag 3 s, neuromuscular system of 11 rad/s and .25, form `(T_L s + 1)^2/(T_I s + 1)`) is typical of
//! recorded people. All other numbers were set on simulated people (whose operator has a lag, whose delay is not a whole
//! number of samples, and whose remnant is an autoregression with a level that may change) and on the conditions C1 to C6,
//! seed 9000; none on recorded people.

use super::{
    basis::Point,
    detector::Detection,
    last_blocks::BLOCK_S,
    mixture::ChangePrior,
    prior::AdaptivePrior,
    sizes::{DYNAMICS, STARTS},
};

/// Lag T_I of the default person, s.
pub const LAG_S: f64 = 3.0;
/// Natural frequency of the neuromuscular system, rad/s.
pub const OMEGA_RAD_S: f64 = 11.0;
/// Its damping.
pub const ZETA: f64 = 0.25;
/// Prior standard deviations: relative for omega and zeta, in s for a delay that is not given.
pub const SPREAD: [f64; DYNAMICS] = [0.3, 0.5, 0.1];
/// Prior standard deviation of a given delay, s.
pub const GIVEN_DELAY_S: f64 = 0.02;
/// Order of the noise model.
pub const ORDER: usize = 16;
/// Limit of an innovation, in standard deviations. It is large because people with a dead zone act in pulses, which are
/// their response and not outliers.
pub const LIMIT: f64 = 8.0;
/// Time after which the estimate starts, s.
pub const HOLD_S: f64 = 1.0;
/// Span of the replays, s.
pub const REPLAYED_S: f64 = 100.0;

/// Prior of changes.
const CHANGES: ChangePrior = ChangePrior {
    block: 0.32,
    between: 180.0,
    jump: [0.3, 0.4],
    drift: [0.003, 0.05],
    settling: [0.1, 3.0],
    level: 0.01,
    variance: [20.0, 2.0],
    steady: 0.6,
    any: 0.4,
    protected: 4,
    limit: LIMIT,
    detector_limit: DETECTOR_LIMIT,
};
/// Memory of the noise model, s.
const NOISE_MEMORY_S: f64 = 100.0;
/// Limit of an innovation in the detector, in standard deviations.
const DETECTOR_LIMIT: f64 = 3.5;
/// Starting points of the first estimate: delay, s more than that of the person; natural frequency, rad/s; damping. A
/// given delay is kept.
const STARTING_POINTS: [[f64; 3]; STARTS] = [
    [0.0, OMEGA_RAD_S, ZETA],
    [0.1, 11.0, 0.3],
    [0.2, 9.0, 0.4],
    [-0.08, 11.0, 0.3],
    [0.0, 7.0, 0.5],
    [0.1, 8.0, 0.5],
    [0.0, 16.0, 0.25],
    [0.1, 16.0, 0.3],
];
/// Shortest delay of a starting point, s.
const EARLIEST_S: f64 = 0.03;
/// Length of the short and of the long present, s; least and largest length of the past, s; time after a change in
/// which no other is declared, s.
const NOW_S: [f64; 2] = [4.0, 8.0];
const BEFORE_S: [f64; 2] = [15.0, 40.0];
const REFRACTORY_S: f64 = 8.0;
/// Threshold at one false alarm per hour, nats, and its decrease per logarithm of the rate. By chance alone 7200 blocks
/// an hour pass 8.9 nats once; people vary more. In 3.8 hours of three pilots without a change 12.5 and 11.0 nats were
/// passed 2.6 and 3.9 times an hour.
const THRESHOLD: f64 = 12.5;
const SLOPE: f64 = 2.2;
/// Prior standard deviation of a change of the delay, s.
const DELAY_CHANGE_S: f64 = 0.05;

/// The operator before the first sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DefaultOperator {
    /// Point of the basis.
    pub point: Point,
    /// Prior standard deviations: relative for omega and zeta, in s for the delay.
    pub spread: [f64; DYNAMICS],
    /// Order of the noise model.
    pub order: usize,
    /// Limit of an innovation, in standard deviations.
    pub limit: f64,
    /// Accepted false alarms per hour.
    pub false_alarms: f64,
}

impl DefaultOperator {
    /// Returns the defaults with this delay, s, for an error that is linear between samples; a held error adds half a
    /// sample.
    pub fn with_delay(tau: f64) -> Self {
        Self {
            point: Point {
                tau,
                omega: OMEGA_RAD_S,
                zeta: ZETA,
                lag: LAG_S,
            },
            spread: SPREAD,
            order: ORDER,
            limit: LIMIT,
            false_alarms: 1.0,
        }
    }

    /// Returns the threshold of the detector.
    fn threshold(&self) -> f64 {
        (THRESHOLD - SLOPE * libm::log(self.false_alarms)).max(1.0)
    }

    /// Returns the prior for a sample time in s.
    pub fn prior(&self, sample_time: f64) -> AdaptivePrior {
        let blocks = |seconds: f64| libm::round(seconds / BLOCK_S) as usize;
        let given = self.spread[2] < SPREAD[2];
        AdaptivePrior {
            person: self.point,
            spread: self.spread,
            sample_time,
            order: self.order,
            noise_memory: NOISE_MEMORY_S,
            hold: HOLD_S,
            changes: ChangePrior {
                limit: self.limit,
                ..CHANGES
            },
            starts: STARTING_POINTS.map(|[later, omega, zeta]| Point {
                tau: (self.point.tau + if given { 0.0 } else { later }).max(EARLIEST_S),
                omega,
                zeta,
                ..self.point
            }),
            detection: Detection {
                recent: NOW_S.map(blocks),
                least: blocks(BEFORE_S[0]),
                most: blocks(BEFORE_S[1]),
                threshold: self.threshold(),
                dynamics: [OMEGA_RAD_S * SPREAD[0], ZETA * SPREAD[1], DELAY_CHANGE_S],
                refractory: blocks(REFRACTORY_S) as u64,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_false_alarms_need_a_higher_threshold_and_any_number_has_one() {
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
    fn starts_of_a_short_delay_stay_where_a_basis_can_be_made() {
        let prior = DefaultOperator::with_delay(0.05).prior(0.01);
        assert!(prior.is_sound());
        assert!(prior.starts.iter().all(|start| start.tau >= EARLIEST_S));
    }
}
