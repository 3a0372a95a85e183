//! What is usual of people, in seconds: where the recursion begins for a person of whom nothing is known.
//!
//! The usual person (lag 3 s, neuromuscular system of 11 rad/s and .25, their form `(T_L s + 1)^2/(T_I s + 1)`)
//! is what recorded people have been found to be. All other numbers were set on simulated people: those
//! whose operator has a lag, whose delay is no whole number of samples, and whose remnant is an
//! autoregression with a level that may change, and those of the conditions C1 to C6, seed 9000; none on
//! recorded people.

use super::{
    basis::Point,
    detector::{BLOCK_S, Detection},
    gains::GainPrior,
    prior::PopulationPrior,
    sizes::{DRIFTS, HELD, RIVALS},
};

/// Lag T_I in s, natural frequency in rad/s and damping of the usual person.
pub const LAG_S: f64 = 3.0;
/// Natural frequency of the neuromuscular system, rad/s.
pub const OMEGA_RAD_S: f64 = 11.0;
/// Its damping.
pub const ZETA: f64 = 0.25;
/// How far people are from that: shares of omega and zeta, and s for the delay.
pub const SPREAD: [f64; HELD] = [0.3, 0.5, 0.02];
/// Order of the noise model.
pub const ORDER: usize = 16;
/// Limit of an innovation in standard deviations.
pub const LIMIT: f64 = 3.5;
/// Time after which the estimate begins, s.
pub const HOLD_S: f64 = 1.0;

/// Standard deviations of the gains' drift in one second, over |Y| at 2 rad/s, and what is supposed
/// of their weights.
const DRIFT: [f64; DRIFTS] = [0.0005, 0.07, 0.3];
const SHARES: [f64; DRIFTS] = [0.9, 0.05, 0.05];
/// Those who have just changed: their drift, the size of the change, their odds, the births that these are
/// worth against what is learnt of the person, and their life, s.
const NEWBORN: [f64; 2] = [0.1, 1.0];
const ODDS: f64 = 0.01;
const BIRTHS: f64 = 60.0;
const LIFE_S: f64 = 2.0;
/// Degrees of freedom of the innovations.
const FREEDOM: f64 = 5.0;
/// Time constants with which the weights of forms and of drifts are forgotten, s.
const FORM_MEMORY_S: f64 = 5.0;
const DRIFT_MEMORY_S: f64 = 5.0;
/// Memory of the noise model, s.
const NOISE_MEMORY_S: f64 = 40.0;
/// Time constants of the innovations' variance for the gains and for the detector, s.
const LEVEL_MEMORY_S: [f64; 2] = [5.0, 10.0];
/// Drifts of the level of u in one second, over the root mean square of u: where the gains hardly
/// move, and else.
const OFFSET_DRIFT: [f64; 2] = [0.005, 0.01];
/// Time after which neuromuscular system and delay are corrected, s.
const REOPEN_S: f64 = 6.0;
/// Time in which the gains do not walk once these are corrected, s.
const STEADY_S: f64 = 9.0;
/// Where else somebody may begin: delay, s more than that of nk; natural frequency, rad/s; damping.
/// Corrections find from one of them to what lies between. The first is the usual person.
const ELSEWHERE: [[f64; 3]; RIVALS] = [
    [0.0, OMEGA_RAD_S, ZETA],
    [-0.1, OMEGA_RAD_S, ZETA],
    [-0.05, OMEGA_RAD_S, ZETA],
    [0.05, OMEGA_RAD_S, ZETA],
    [0.1, OMEGA_RAD_S, ZETA],
    [0.15, OMEGA_RAD_S, ZETA],
    [0.0, 7.5, 0.45],
    [0.05, 7.5, 0.45],
    [0.0, 16.0, 0.2],
    [-0.05, 16.0, 0.2],
];
/// Shortest delay of them, s.
const EARLIEST_S: f64 = 0.03;
/// What a declared change adds to the gains, over |Y| at 2 rad/s.
const JUMP: f64 = 0.3;
/// Frequency in which changes are looked for, rad/s; seconds that are now, a short and a long present;
/// seconds before, at least and at most; blocks that must agree; seconds after a change in which none is
/// declared.
const CHANGE_RAD_S: f64 = 2.5;
const NOW_S: [f64; 2] = [5.0, 8.0];
const BEFORE_S: [f64; 2] = [15.0, 40.0];
const PERSISTENCE: u64 = 2;
const REFRACTORY_S: f64 = 8.0;
/// What must stand against chance at one false alarm an hour, nats, and by how much it falls with each
/// logarithm of the rate: to 8.9 for 2 and 6.7 for 5. In 12.8 hours of simulated people without a change
/// (those of the challenge, open seeds, under all their remnants) two blocks one after another passed 10.7,
/// 8.8 and 6.7 nats 1, 2 and 5 times an hour.
const THRESHOLD: f64 = 9.4;
const SLOPE: f64 = 1.95;
/// Standard deviation of a change of the delay, s.
const DELAY_CHANGE_S: f64 = 0.05;

/// A person before the first sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Usual {
    /// Where the basis is made.
    pub point: Point,
    /// How far the person may be from that: shares of omega and zeta, and s for the delay.
    pub spread: [f64; HELD],
    /// Order of the noise model.
    pub order: usize,
    /// Standard deviations beyond which an innovation moves the estimate no further.
    pub limit: f64,
    /// False alarms in an hour that are accepted.
    pub false_alarms: f64,
}

impl Usual {
    /// Somebody with this delay, s, for an error that is straight between samples: one that is held comes
    /// half a sample later.
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
    pub fn prior(&self, sample_time: f64) -> PopulationPrior {
        let blocks = |seconds: f64| libm::round(seconds / BLOCK_S) as usize;
        PopulationPrior {
            gains: GainPrior {
                drifts: DRIFT,
                shares: SHARES,
                newborn: NEWBORN,
                odds: ODDS,
                births: BIRTHS,
                life: LIFE_S,
                steady: STEADY_S,
                freedom: FREEDOM,
                limit: self.limit,
                forgotten: [FORM_MEMORY_S, DRIFT_MEMORY_S].map(|memory| (sample_time / memory).min(1.0)),
                held: self.spread,
                sample_time,
            },
            order: self.order,
            noise_memory: NOISE_MEMORY_S,
            level_memory: LEVEL_MEMORY_S,
            offset_drift: OFFSET_DRIFT,
            hold: HOLD_S,
            reopen: REOPEN_S,
            jump: JUMP,
            rivals: ELSEWHERE.map(|[later, omega, zeta]| Point {
                tau: (self.point.tau + later).max(EARLIEST_S),
                omega,
                zeta,
                ..self.point
            }),
            detection: Detection {
                frequency: CHANGE_RAD_S,
                recent: NOW_S.map(blocks),
                least: blocks(BEFORE_S[0]),
                most: blocks(BEFORE_S[1]),
                threshold: self.threshold(),
                held: [OMEGA_RAD_S * SPREAD[0], ZETA * SPREAD[1], DELAY_CHANGE_S],
                persistence: PERSISTENCE,
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
            let usual = Usual {
                false_alarms,
                ..Usual::with_delay(0.2)
            };
            usual.prior(0.01).detection.threshold
        };
        assert!(of(0.5) > of(1.0) && of(1.0) > of(30.0));
        assert!(of(1e9) > 0.0);
    }

    #[test]
    fn rivals_of_a_short_delay_stay_where_a_basis_can_be_made() {
        let prior = Usual::with_delay(0.05).prior(0.01);
        assert!(prior.is_sound());
        assert!(prior.rivals.iter().all(|rival| rival.tau >= EARLIEST_S));
    }
}
