//! Order and meaning of the parameters.
//!
//! `theta = [K_e1, K_e2, T_L1, T_L2, t_M, ln G, omega_nm, zeta_nm, tau_e, d1 .. d_nd]`. The rate
//! enters by its logarithm: it is positive, and its likelihood is far more nearly a parabola in ln
//! G than in G.

use std::collections::BTreeMap;

use crate::{Constraint, IdentError};

pub(crate) const K_E: [usize; 2] = [0, 1];
pub(crate) const T_L: [usize; 2] = [2, 3];
pub(crate) const MIDPOINT: usize = 4;
pub(crate) const LOG_RATE: usize = 5;
pub(crate) const OMEGA: usize = 6;
pub(crate) const ZETA: usize = 7;
pub(crate) const DELAY: usize = 8;
/// Place of d1.
pub(crate) const NOISE: usize = 9;
/// Parameters that a model without a change does not have.
pub(crate) const OF_THE_CHANGE: [usize; 4] = [K_E[1], T_L[1], MIDPOINT, LOG_RATE];

/// Names of the parameters before the coefficients d1, d2 ... of the noise model, with their units.
pub const SIGMOID_NAMES: [(&str, &str); NOISE] = [
    ("K_e1", "deg/deg"),
    ("K_e2", "deg/deg"),
    ("T_L1", "s"),
    ("T_L2", "s"),
    ("t_M", "s"),
    ("G", "1/s"),
    ("omega_nm", "rad/s"),
    ("zeta_nm", ""),
    ("tau_e", "s"),
];

/// Bounds of zeta_nm: beyond them the two poles have nothing to do with each other.
const ZETA_LIMITS: (f64, f64) = (1e-4, 100.0);
/// Largest omega_nm as a share of pi/Ts.
const HIGHEST_FREQUENCY: f64 = 0.999;
/// Share of the span at either end in which t_M is not sought by default: less of a record does not
/// determine two gains.
const ENDS: f64 = 0.05;
/// Largest rate times the sample time: four fifths of the change take two samples (2 ln 9 = 4.4). A
/// faster one looks the same, and its likelihood would be a staircase in t_M, with a step for each
/// sample (here its slope varies by 2 % with the place of t_M between two samples, for twice the
/// rate by 50 %).
pub(crate) const FASTEST: f64 = 2.0;
/// Largest rate times the sample time that can be given.
const FASTEST_GIVEN: f64 = 10.0;
/// Smallest rate times the span: nine tenths of the change fill it (2 ln 19 = 5.9), and its ends
/// are hardly told from a line.
const SLOWEST: f64 = 5.0;

/// Argument from which `e^-x` is zero in double precision.
const NOTHING: f64 = 746.0;

/// What bounds depend on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub ts_s: f64,
    /// Time that all records have in common, s.
    pub span_s: (f64, f64),
    pub delay_range_s: (f64, f64),
}

/// Names of theta.
pub(crate) fn names(nd: usize) -> Vec<String> {
    let physical = SIGMOID_NAMES.iter().map(|(name, _)| (*name).to_owned());
    physical.chain((1..=nd).map(|i| format!("d{i}"))).collect()
}

/// Bounds of theta; G by its logarithm.
///
/// # Errors
/// [`IdentError::UnknownParameter`], [`IdentError::BadOption`].
pub(crate) fn limits(
    nd: usize,
    frame: &Frame,
    constraints: &BTreeMap<String, Constraint>,
) -> Result<Vec<(f64, f64)>, IdentError> {
    let names = names(nd);
    if let Some(name) = constraints.keys().find(|name| !names.contains(name)) {
        return Err(IdentError::UnknownParameter {
            name: name.clone(),
            available: names.join(", "),
        });
    }
    let (from, to) = frame.span_s;
    let span = to - from;
    let mut result = Vec::with_capacity(names.len());
    for (i, name) in names.iter().enumerate() {
        // What has a meaning at all, and what is sought unless the user says otherwise.
        let (widest, usual) = match i {
            MIDPOINT => ((from, to), (from + ENDS * span, to - ENDS * span)),
            LOG_RATE => {
                let slowest = (SLOWEST / span).min(FASTEST / frame.ts_s);
                ((slowest, FASTEST_GIVEN / frame.ts_s), (slowest, FASTEST / frame.ts_s))
            }
            OMEGA => {
                let range = (1e-3, HIGHEST_FREQUENCY * std::f64::consts::PI / frame.ts_s);
                (range, range)
            }
            ZETA => (ZETA_LIMITS, ZETA_LIMITS),
            DELAY => (frame.delay_range_s, frame.delay_range_s),
            _ => {
                let all = (f64::NEG_INFINITY, f64::INFINITY);
                (all, all)
            }
        };
        let asked = constraints.get(name).copied();
        let (low, high) = asked.map_or(usual, Constraint::limits);
        let within = (low.max(widest.0), high.min(widest.1));
        let moved = low == high && within != (low, high);
        if asked.is_some_and(|c| !c.is_sound()) || within.0 > within.1 || moved {
            return Err(IdentError::BadOption {
                option: format!("the constraint on {name}"),
                found: format!("{low} to {high}"),
                expected: format!("a value or a range within {:.6} to {:.6}", widest.0, widest.1),
            });
        }
        result.push(if i == LOG_RATE {
            (within.0.ln(), within.1.ln())
        } else {
            within
        });
    }
    Ok(result)
}

/// The sigmoid and what changes with it at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Instant {
    /// Share of the change that has happened.
    pub share: f64,
    /// Derivative of the share with respect to t_M, 1/s.
    pub by_midpoint: f64,
    /// Derivative of the share with respect to ln G.
    pub by_log_rate: f64,
    /// K_e.
    pub k_e: f64,
    /// T_L, s.
    pub t_l: f64,
}

impl Instant {
    /// At the time `t_s`: eq. 5, as [`hoid_model::schedule::Schedule::value`] computes it.
    pub fn at(theta: &[f64], t_s: f64) -> Self {
        let rate = theta[LOG_RATE].exp();
        let x = rate * (t_s - theta[MIDPOINT]);
        // The exponential is zero there, and slow.
        let far = if x.abs() > NOTHING { 0.0 } else { (-x.abs()).exp() };
        let rest = far / (1.0 + far);
        let share = if x < 0.0 { rest } else { 1.0 - rest };
        let slope = rest / (1.0 + far);
        let between = |[first, last]: [usize; 2]| {
            let part = (theta[last] - theta[first]) * rest;
            if x < 0.0 {
                theta[first] + part
            } else {
                theta[last] - part
            }
        };
        Self {
            share,
            by_midpoint: -rate * slope,
            by_log_rate: if slope > 0.0 { x * slope } else { 0.0 },
            k_e: between(K_E),
            t_l: between(T_L),
        }
    }

    /// The first state, as if there were no change.
    pub fn constant(theta: &[f64]) -> Self {
        Self {
            share: 0.0,
            by_midpoint: 0.0,
            by_log_rate: 0.0,
            k_e: theta[K_E[0]],
            t_l: theta[T_L[0]],
        }
    }

    /// K_e_dot = K_e T_L, s.
    pub fn k_e_dot(&self) -> f64 {
        self.k_e * self.t_l
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::schedule::Schedule;

    use super::*;

    fn frame() -> Frame {
        Frame {
            ts_s: 0.01,
            span_s: (0.0, 80.0),
            delay_range_s: (0.05, 0.6),
        }
    }

    #[test]
    fn the_sigmoid_is_that_of_the_schedule_to_the_last_bit() {
        for rate in [0.5, 100.0] {
            let theta = [0.09, 0.07, 0.4, 1.2, 40.96, f64::ln(rate), 11.25, 0.35, 0.28];
            let schedule = Schedule::Sigmoid {
                rate_per_s: theta[LOG_RATE].exp(),
                midpoint_s: 40.96,
            };
            for t in [0.0, 20.0, 40.9, 40.95, 40.96, 40.97, 43.0, 81.91] {
                let here = Instant::at(&theta, t);
                assert_eq!(here.k_e, schedule.value(0.09, 0.07, t));
                assert_eq!(here.t_l, schedule.value(0.4, 1.2, t));
                assert!((here.share - schedule.value(0.0, 1.0, t)).abs() < 1e-16);
            }
        }
    }

    #[test]
    fn derivatives_of_the_share_agree_with_finite_differences() {
        let theta = [0.09, 0.07, 0.4, 1.2, 40.96, f64::ln(3.0), 11.25, 0.35, 0.28];
        for t in [39.0, 40.9, 40.96, 41.5, 44.0] {
            let here = Instant::at(&theta, t);
            for (i, exact) in [(MIDPOINT, here.by_midpoint), (LOG_RATE, here.by_log_rate)] {
                let shifted = |h: f64| {
                    let mut moved = theta;
                    moved[i] += h;
                    Instant::at(&moved, t).share
                };
                let h = 1e-3;
                let difference =
                    (8.0 * (shifted(h) - shifted(-h)) - (shifted(2.0 * h) - shifted(-2.0 * h))) / (12.0 * h);
                // Truncation h^4 G^5/30, about 1e-11; rounding of t_M over h, 1e-11.
                assert!((exact - difference).abs() < 1e-9, "{exact} {difference}");
            }
        }
    }

    #[test]
    fn limits_hold_what_has_a_meaning() {
        let none = BTreeMap::new();
        let usual = limits(1, &frame(), &none).unwrap();
        assert_eq!(usual.len(), 10);
        assert_eq!(usual[MIDPOINT], (4.0, 76.0));
        assert_eq!(usual[DELAY], (0.05, 0.6));
        assert!((usual[LOG_RATE].1.exp() - 200.0).abs() < 1e-9);
        let with = |name: &str, c: Constraint| limits(1, &frame(), &BTreeMap::from([(name.to_owned(), c)]));
        assert_eq!(with("t_M", Constraint::Fixed(79.0)).unwrap()[MIDPOINT], (79.0, 79.0));
        assert_eq!(
            with("G", Constraint::Fixed(0.5)).unwrap()[LOG_RATE],
            (0.5f64.ln(), 0.5f64.ln())
        );
        for (name, c) in [
            ("t_M", Constraint::Fixed(81.0)),
            ("G", Constraint::Fixed(-1.0)),
            ("G", Constraint::Between(2000.0, 3000.0)),
            ("tau_e", Constraint::Fixed(0.7)),
            ("K_e1", Constraint::Fixed(f64::NAN)),
            ("zeta_nm", Constraint::Between(2.0, 1.0)),
        ] {
            assert!(matches!(with(name, c), Err(IdentError::BadOption { .. })), "{name}");
        }
        assert!(matches!(
            with("K_n", Constraint::Fixed(1.0)),
            Err(IdentError::UnknownParameter { .. })
        ));
    }
}
