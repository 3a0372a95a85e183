//! How parameters change over time.
//!
//! `p(t) = p_i + (p_f - p_i) / (1 + e^{-G (t - t_M)})`   (eq. 5)

use crate::ModelError;

/// The change from the initial to the final value of every parameter of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Schedule {
    /// The initial value throughout.
    #[default]
    Constant,
    /// The sigmoid of eq. 5.
    Sigmoid {
        /// Transition rate G, 1/s.
        rate_per_s: f64,
        /// Time of the largest rate of change t_M, s from the start of the measurement.
        midpoint_s: f64,
    },
}

impl Schedule {
    /// Checks rate and midpoint.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] unless the rate is positive and both are finite.
    pub fn check(&self) -> Result<(), ModelError> {
        let Self::Sigmoid { rate_per_s, midpoint_s } = *self else {
            return Ok(());
        };
        if !(rate_per_s.is_finite() && rate_per_s > 0.0) {
            return Err(ModelError::OutOfRange {
                quantity: "transition rate G in 1/s",
                found: rate_per_s,
                expected: "a positive finite number; exchange the initial and the final state to go the other way",
            });
        }
        if !midpoint_s.is_finite() {
            return Err(ModelError::OutOfRange {
                quantity: "time of the largest rate of change t_M in s",
                found: midpoint_s,
                expected: "a finite number",
            });
        }
        Ok(())
    }

    /// p(t) between `initial` and `finally`. Far from t_M it is either of them to the last bit.
    pub fn value(&self, initial: f64, finally: f64, t_s: f64) -> f64 {
        match *self {
            Self::Constant => initial,
            Self::Sigmoid { rate_per_s, midpoint_s } => {
                let x = rate_per_s * (t_s - midpoint_s);
                // The exponential of the nearer end: it cannot overflow, and that end is met exactly.
                let far = (-x.abs()).exp();
                let part = (finally - initial) * (far / (1.0 + far));
                if x < 0.0 { initial + part } else { finally - part }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAST: Schedule = Schedule::Sigmoid {
        rate_per_s: 100.0,
        midpoint_s: 40.96,
    };
    const SLOW: Schedule = Schedule::Sigmoid {
        rate_per_s: 0.5,
        midpoint_s: 40.96,
    };

    #[test]
    fn is_the_sigmoid_as_printed() {
        for t in [0.0, 30.0, 40.0, 40.96, 41.5, 60.0, 81.91] {
            let printed = 0.09 + (0.07 - 0.09) / (1.0 + (-0.5 * (t - 40.96f64)).exp());
            assert!((SLOW.value(0.09, 0.07, t) - printed).abs() < 1e-16);
        }
        assert_eq!(SLOW.value(90.0, 30.0, 40.96), 60.0);
    }

    #[test]
    fn ends_are_exact_and_nothing_overflows() {
        for t in [-1e300, -10.0, 30.0] {
            assert_eq!(FAST.value(0.09, 0.07, t), 0.09);
        }
        for t in [50.0, 1e300] {
            assert_eq!(FAST.value(0.09, 0.07, t), 0.07);
        }
        assert_eq!(Schedule::Constant.value(0.09, 0.07, 60.0), 0.09);
    }

    #[test]
    fn steepest_slope_is_a_quarter_of_the_rate() {
        let slope = (SLOW.value(0.0, 1.0, 40.961) - SLOW.value(0.0, 1.0, 40.959)) / 0.002;
        // The third derivative, G^3/8, leaves 2e-9.
        assert!((slope - 0.125).abs() < 1e-8);
    }

    #[test]
    fn bad_rates_are_refused() {
        for (rate_per_s, midpoint_s) in [(0.0, 1.0), (-1.0, 1.0), (f64::INFINITY, 1.0), (1.0, f64::NAN)] {
            assert!(Schedule::Sigmoid { rate_per_s, midpoint_s }.check().is_err());
        }
        assert!(FAST.check().is_ok() && Schedule::Constant.check().is_ok());
    }
}
