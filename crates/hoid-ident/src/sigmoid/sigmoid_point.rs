//! The sigmoid (eq. 5) and the numerator of the operator at one time.

use hoid_model::operator_family::POWER_COUNT;

use super::layout::{Layout, MAX_VARYING};

/// Argument above which `e^-x` is zero in double precision.
const UNDERFLOW_ARGUMENT: f64 = 746.0;

/// The sigmoid and the changing parameters at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SigmoidPoint {
    /// Share of the change that has taken place.
    pub share: f64,
    /// Derivative of the share with respect to t_M, 1/s.
    pub derivative_midpoint: f64,
    /// Derivative of the share with respect to ln G.
    pub derivative_log_rate: f64,
    /// Parameters of the numerator, starting with the gain.
    pub values: [f64; MAX_VARYING],
    /// The numerator divided by its gain, in ascending powers of s.
    pub shape: [f64; POWER_COUNT],
    /// Derivatives of the shape with respect to all parameters except the gain.
    pub slopes: [[f64; POWER_COUNT]; 2],
}

impl SigmoidPoint {
    /// Evaluates eq. 5 at the time `t_s`, like [`hoid_model::schedule::Schedule::value`].
    pub fn at(layout: &Layout, theta: &[f64], t_s: f64) -> Self {
        let rate = theta[layout.log_rate].exp();
        let x = rate * (t_s - theta[layout.midpoint]);
        // For a large argument the exponential underflows to zero and is slow to compute.
        let far = if x.abs() > UNDERFLOW_ARGUMENT {
            0.0
        } else {
            (-x.abs()).exp()
        };
        let rest = far / (1.0 + far);
        let share = if x < 0.0 { rest } else { 1.0 - rest };
        let slope = rest / (1.0 + far);
        let mut values = [0.0; MAX_VARYING];
        for (i, value) in values.iter_mut().enumerate().take(layout.varying) {
            let [first, last] = Layout::end_indices(i);
            let part = (theta[last] - theta[first]) * rest;
            *value = if x < 0.0 {
                theta[first] + part
            } else {
                theta[last] - part
            };
        }
        let by_log_rate = if slope > 0.0 { x * slope } else { 0.0 };
        Self::of(layout, values, share, [-rate * slope, by_log_rate])
    }

    /// Returns the parameters before the change, for a model without a change.
    pub fn constant(layout: &Layout, theta: &[f64]) -> Self {
        let mut values = [0.0; MAX_VARYING];
        for (i, value) in values.iter_mut().enumerate().take(layout.varying) {
            *value = theta[Layout::end_indices(i)[0]];
        }
        Self::of(layout, values, 0.0, [0.0; 2])
    }

    fn of(layout: &Layout, values: [f64; MAX_VARYING], share: f64, [by_midpoint, by_log_rate]: [f64; 2]) -> Self {
        let (shape, slopes) = layout.form.shape(&values[1..]);
        Self {
            share,
            derivative_midpoint: by_midpoint,
            derivative_log_rate: by_log_rate,
            values,
            shape,
            slopes,
        }
    }

    pub fn gain(&self) -> f64 {
        self.values[0]
    }

    /// Returns the coefficient of `s^i` in the numerator.
    pub fn numerator(&self, i: usize) -> f64 {
        self.values[0] * self.shape[i]
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::{Form, schedule::Schedule};

    use super::*;

    fn lead_layout(nd: usize) -> Layout {
        Layout::new(Form::Lead, true, nd)
    }

    #[test]
    fn sigmoid_is_bit_identical_to_the_schedule() {
        let layout = lead_layout(0);
        for rate in [0.5, 100.0] {
            let theta = [0.09, 0.07, 0.4, 1.2, 40.96, f64::ln(rate), 11.25, 0.35, 0.28];
            let schedule = Schedule::Sigmoid {
                rate_per_s: theta[layout.log_rate].exp(),
                midpoint_s: 40.96,
            };
            for t in [0.0, 20.0, 40.9, 40.95, 40.96, 40.97, 43.0, 81.91] {
                let here = SigmoidPoint::at(&layout, &theta, t);
                assert_eq!(here.values[0], schedule.value(0.09, 0.07, t));
                assert_eq!(here.values[1], schedule.value(0.4, 1.2, t));
                assert!((here.share - schedule.value(0.0, 1.0, t)).abs() < 1e-16);
            }
        }
    }

    #[test]
    fn derivatives_of_the_share_agree_with_finite_differences() {
        let layout = lead_layout(0);
        let theta = [0.09, 0.07, 0.4, 1.2, 40.96, f64::ln(3.0), 11.25, 0.35, 0.28];
        for t in [39.0, 40.9, 40.96, 41.5, 44.0] {
            let here = SigmoidPoint::at(&layout, &theta, t);
            for (i, exact) in [
                (layout.midpoint, here.derivative_midpoint),
                (layout.log_rate, here.derivative_log_rate),
            ] {
                let shifted = |h: f64| {
                    let mut moved = theta;
                    moved[i] += h;
                    SigmoidPoint::at(&layout, &moved, t).share
                };
                let h = 1e-3;
                let difference =
                    (8.0 * (shifted(h) - shifted(-h)) - (shifted(2.0 * h) - shifted(-2.0 * h))) / (12.0 * h);
                // The truncation error is h^4 G^5/30, about 1e-11; the rounding error of t_M divided by h is 1e-11.
                assert!((exact - difference).abs() < 1e-9, "{exact} {difference}");
            }
        }
    }
}
