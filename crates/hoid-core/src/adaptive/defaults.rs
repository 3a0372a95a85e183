//! Default values for people, in seconds: where the recursion starts for a person of whom nothing is known.
//!
//! The default person (lag 3 s, neuromuscular system of 11 rad/s and .25, their form `(T_L s + 1)^2/(T_I s + 1)`) is
//! what recorded people have been found to be. All other numbers were set on simulated people: those whose operator has
//! a lag, whose delay is not a whole number of samples, and whose remnant is an autoregression with a level that may
//! change, and those of the conditions C1 to C6, seed 9000; none on recorded people.

use super::{
    basis::Point,
    detector::Detection,
    last_blocks::BLOCK_S,
    mixture::ChangePrior,
    prior::AdaptivePrior,
    sizes::{DYNAMICS, STARTS},
};

/// Lag T_I in s, natural frequency in rad/s and damping of the default person.
pub const LAG_S: f64 = 3.0;
/// Natural frequency of the neuromuscular system, rad/s.
pub const OMEGA_RAD_S: f64 = 11.0;
/// Its damping.
pub const ZETA: f64 = 0.25;
/// How far people are from that: shares of omega and zeta, and s for the delay, where that is not given
/// and where it is.
pub const SPREAD: [f64; DYNAMICS] = [0.3, 0.5, 0.1];
/// See [`SPREAD`].
pub const GIVEN_DELAY_S: f64 = 0.02;
/// Order of the noise model.
pub const ORDER: usize = 16;
/// Limit of an innovation in standard deviations: of people with a dead zone the pulses are the response, so
/// that it is far out.
pub const LIMIT: f64 = 8.0;
/// Time after which the estimate starts, s.
pub const HOLD_S: f64 = 1.0;
/// Time that is replayed, s.
pub const REPLAYED_S: f64 = 100.0;

/// How the operator changes.
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
/// Where estimates start: delay, s more than that of the person; natural frequency, rad/s; damping. A delay
/// that is given is kept.
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
/// Shortest delay of them, s.
const EARLIEST_S: f64 = 0.03;
/// Seconds that are now, a short and a long present; seconds before, at least and at most; seconds after a change
/// in which none is declared.
const NOW_S: [f64; 2] = [4.0, 8.0];
const BEFORE_S: [f64; 2] = [15.0, 40.0];
const REFRACTORY_S: f64 = 8.0;
/// What must have as log significance at one false alarm an hour, nats, and by how much it falls with each logarithm of
/// the rate. By chance alone 7200 blocks an hour pass 8.9 nats once; people vary more. In 3.8 hours of three pilots
/// without a change 12.5 and 11.0 nats were passed 2.6 and 3.9 times an hour.
const THRESHOLD: f64 = 12.5;
const SLOPE: f64 = 2.2;
/// Standard deviation of a change of the delay, s.
const DELAY_CHANGE_S: f64 = 0.05;

/// A person before the first sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DefaultOperator {
    /// Where the basis is made.
    pub point: Point,
    /// How far the person may be from that: shares of omega and zeta, and s for the delay.
    pub spread: [f64; DYNAMICS],
    /// Order of the noise model.
    pub order: usize,
    /// Standard deviations beyond which an innovation moves the estimate no further.
    pub limit: f64,
    /// False alarms in an hour that are accepted.
    pub false_alarms: f64,
}

impl DefaultOperator {
    /// Someone with this delay, s, for an error that is straight between samples: one that is held comes half a sample
    /// later.
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

    /// Threshold of the detector.
    fn threshold(&self) -> f64 {
        (THRESHOLD - SLOPE * libm::log(self.false_alarms)).max(1.0)
    }

    /// What is supposed of them, at a sample time in s.
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
