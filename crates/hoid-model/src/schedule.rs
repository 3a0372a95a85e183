//! Change in parameters over time.
//!
//! `p(t) = p_i + (p_f - p_i) / (1 + e^{-G (t - t_M)})`   (eq. 5)
//!
//! Repeated changes are sigmoids of alternating sign, one every T seconds:
//! `p(t) = p_i + (p_f - p_i) sum over k of (-1)^k / (1 + e^{-G (t - t_M - k T)})`.

use crate::ModelError;

/// Change in every parameter of a scenario from its initial to its final value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Schedule {
    /// No change: each parameter keeps its initial value.
    #[default]
    Constant,
    /// One change, by the sigmoid of eq. 5.
    Sigmoid {
        /// Transition rate G, 1/s.
        rate_per_s: f64,
        /// Time t_M of the largest rate of change, in s from the start of the measurement.
        midpoint_s: f64,
    },
    /// Repeated changes back and forth, for the whole run.
    Alternating {
        /// Transition rate G of each change, 1/s.
        rate_per_s: f64,
        /// Time t_M of the first change, in s from the start of the measurement.
        midpoint_s: f64,
        /// Time T between successive changes, s.
        interval_s: f64,
    },
}

/// Number of time constants 1/G after which a transition is complete: e^-40 is below half a unit in the last place.
const COMPLETION_TIME_CONSTANTS: f64 = 40.0;
/// Shortest interval between two changes, in time constants 1/G.
const MIN_INTERVAL_TIME_CONSTANTS: f64 = 1.0;

impl Schedule {
    /// Checks the rate, the time and the interval of the changes.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if the rate is not positive, a number is not finite, or the interval is shorter than
    /// 1/G.
    pub fn check(&self) -> Result<(), ModelError> {
        let (rate_per_s, midpoint_s, interval_s) = match *self {
            Self::Constant => return Ok(()),
            Self::Sigmoid { rate_per_s, midpoint_s } => (rate_per_s, midpoint_s, f64::INFINITY),
            Self::Alternating {
                rate_per_s,
                midpoint_s,
                interval_s,
            } => (rate_per_s, midpoint_s, interval_s),
        };
        if !(rate_per_s.is_finite() && rate_per_s > 0.0) {
            return Err(ModelError::OutOfRange {
                quantity: "transition rate G in 1/s",
                found: rate_per_s,
                expected: "a positive finite number; exchange the initial and the final state to reverse the change",
            });
        }
        if !midpoint_s.is_finite() {
            return Err(ModelError::OutOfRange {
                quantity: "time of the largest rate of change t_M in s",
                found: midpoint_s,
                expected: "a finite number",
            });
        }
        let is_single = matches!(self, Self::Sigmoid { .. });
        let has_time = interval_s.is_finite() && interval_s * rate_per_s >= MIN_INTERVAL_TIME_CONSTANTS;
        if !(is_single || has_time) {
            return Err(ModelError::OutOfRange {
                quantity: "time from one change to the next in s",
                found: interval_s,
                expected: "a finite number of at least 1/G: a change needs time to take place",
            });
        }
        Ok(())
    }

    /// Returns the time t_M of the first change in s; `None` if there is no change.
    pub fn change_s(&self) -> Option<f64> {
        match *self {
            Self::Constant => None,
            Self::Sigmoid { midpoint_s, .. } | Self::Alternating { midpoint_s, .. } => Some(midpoint_s),
        }
    }

    /// Returns the transition rate G in 1/s; `None` if there is no change.
    pub fn rate_per_s(&self) -> Option<f64> {
        match *self {
            Self::Constant => None,
            Self::Sigmoid { rate_per_s, .. } | Self::Alternating { rate_per_s, .. } => Some(rate_per_s),
        }
    }

    /// Returns the times t_M + k T of all changes before `end_s`; a single change is always included.
    pub fn change_times_s(&self, end_s: f64) -> Vec<f64> {
        match *self {
            Self::Constant => Vec::new(),
            Self::Sigmoid { midpoint_s, .. } => vec![midpoint_s],
            Self::Alternating {
                midpoint_s, interval_s, ..
            } => (0..)
                .map(|k| midpoint_s + f64::from(k) * interval_s)
                .take_while(|t| *t < end_s)
                .collect(),
        }
    }

    /// Returns p(t) between `initial` and `final_value`. Far from a single change, p(t) equals one of these values to
    /// the last bit.
    pub fn value(&self, initial: f64, final_value: f64, t_s: f64) -> f64 {
        match *self {
            Self::Constant => initial,
            Self::Sigmoid { rate_per_s, midpoint_s } => {
                let x = rate_per_s * (t_s - midpoint_s);
                // The value is computed from the nearer of the two end values: the exponential cannot overflow, and far
                // from t_M the end value is exact.
                let far = (-x.abs()).exp();
                let part = (final_value - initial) * (far / (1.0 + far));
                if x < 0.0 { initial + part } else { final_value - part }
            }
            Self::Alternating {
                rate_per_s,
                midpoint_s,
                interval_s,
            } => {
                let (since, reach) = (
                    (t_s - midpoint_s) / interval_s,
                    COMPLETION_TIME_CONSTANTS / (rate_per_s * interval_s),
                );
                // Earlier changes are complete, and the sum of their contributions is zero because their number is
                // even.
                let first = 2.0 * ((since - reach).max(0.0) / 2.0).floor();
                let last = (since + reach).ceil();
                let (mut covered, mut k) = (0.0, first);
                while k <= last {
                    let x = rate_per_s * (t_s - midpoint_s - k * interval_s);
                    let sign = if k % 2.0 == 0.0 { 1.0 } else { -1.0 };
                    covered += sign / (1.0 + (-x).exp());
                    k += 1.0;
                }
                initial + (final_value - initial) * covered
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAST_SCHEDULE: Schedule = Schedule::Sigmoid {
        rate_per_s: 100.0,
        midpoint_s: 40.96,
    };
    const SLOW_SCHEDULE: Schedule = Schedule::Sigmoid {
        rate_per_s: 0.5,
        midpoint_s: 40.96,
    };

    #[test]
    fn sigmoid_matches_the_printed_formula() {
        for t in [0.0, 30.0, 40.0, 40.96, 41.5, 60.0, 81.91] {
            let printed = 0.09 + (0.07 - 0.09) / (1.0 + (-0.5 * (t - 40.96f64)).exp());
            assert!((SLOW_SCHEDULE.value(0.09, 0.07, t) - printed).abs() < 1e-16);
        }
        assert_eq!(SLOW_SCHEDULE.value(90.0, 30.0, 40.96), 60.0);
    }

    #[test]
    fn limits_are_exact_without_overflow() {
        for t in [-1e300, -10.0, 30.0] {
            assert_eq!(FAST_SCHEDULE.value(0.09, 0.07, t), 0.09);
        }
        for t in [50.0, 1e300] {
            assert_eq!(FAST_SCHEDULE.value(0.09, 0.07, t), 0.07);
        }
        assert_eq!(Schedule::Constant.value(0.09, 0.07, 60.0), 0.09);
    }

    #[test]
    fn steepest_slope_is_a_quarter_of_the_rate() {
        let slope = (SLOW_SCHEDULE.value(0.0, 1.0, 40.961) - SLOW_SCHEDULE.value(0.0, 1.0, 40.959)) / 0.002;
        // The third derivative, G^3/8, causes a truncation error of 2e-9.
        assert!((slope - 0.125).abs() < 1e-8);
    }

    #[test]
    fn alternating_schedule_switches_at_each_interval() {
        let often = Schedule::Alternating {
            rate_per_s: 5.0,
            midpoint_s: 20.0,
            interval_s: 10.0,
        };
        // Midway between two changes, the deviation due to each of them is e^-25.
        for (t, expected) in [
            (-5.0, 2.0),
            (15.0, 2.0),
            (25.0, 3.0),
            (35.0, 2.0),
            (45.0, 3.0),
            (1e4 + 5.0, 3.0),
        ] {
            assert!((often.value(2.0, 3.0, t) - expected).abs() < 1e-10, "{t}");
        }
        let single = Schedule::Sigmoid {
            rate_per_s: 5.0,
            midpoint_s: 20.0,
        };
        for t in [18.0, 19.7, 20.0, 20.4, 24.0] {
            assert!(
                (often.value(2.0, 3.0, t) - single.value(2.0, 3.0, t)).abs() < 1e-10,
                "{t}"
            );
            // The next change is the mirror image of this one.
            assert!(
                (often.value(2.0, 3.0, t + 10.0) + often.value(2.0, 3.0, t) - 5.0).abs() < 1e-10,
                "{t}"
            );
        }
        assert_eq!(often.change_times_s(45.0), [20.0, 30.0, 40.0]);
        assert_eq!((often.change_s(), often.rate_per_s()), (Some(20.0), Some(5.0)));
        assert!(often.check().is_ok());
        for interval_s in [0.0, 0.1, -3.0, f64::NAN, f64::INFINITY] {
            let bad = Schedule::Alternating {
                rate_per_s: 5.0,
                midpoint_s: 20.0,
                interval_s,
            };
            assert!(bad.check().is_err(), "{interval_s}");
        }
    }

    #[test]
    fn bad_rates_are_refused() {
        for (rate_per_s, midpoint_s) in [(0.0, 1.0), (-1.0, 1.0), (f64::INFINITY, 1.0), (1.0, f64::NAN)] {
            assert!(Schedule::Sigmoid { rate_per_s, midpoint_s }.check().is_err());
        }
        assert!(FAST_SCHEDULE.check().is_ok() && Schedule::Constant.check().is_ok());
    }
}
