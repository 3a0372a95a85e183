//! The discrete model of an operator of the family for an error that is linear between samples.
//!
//! With a hold, the operator responds to a staircase. If its step response starts with a slope (relative degree 1), the
//! model has a kink at every delay of an integer number of samples, and a search over the delay of a recorded person
//! often ends at such a kink. A person does not see a staircase. Here the error `e(t)` is linear from sample to sample,
//! and the operator acts on `e(t - tau - Ts/2)`. The additional half sample is the mean delay of a hold; with it, tau
//! has the same meaning in both models. At frequency omega the gains of the two models differ by the factor `sin(x)/x`,
//! `x = omega Ts/2` (0.5 % at 20 rad/s and 60 Hz); their phases are equal.
//!
//! With `tau + Ts/2 = l Ts + delta`, `0 <= delta < Ts`, and times in samples,
//!
//! `x(k+1) = Phi x(k) + Gamma_a e(k-l-1) + Gamma_b e(k-l) + Gamma_c e(k-l+1)`,
//! `Gamma_a = Phi_2 (delta G_0(delta) - G_1(delta))`,
//! `Gamma_b = Phi_2 ((1 - delta) G_0(delta) + G_1(delta)) + G_0(1 - delta) - G_1(1 - delta)`,
//! `Gamma_c = G_1(1 - delta)`
//!
//! where G_0 and G_1 are the responses to a step and to a ramp of slope one (first-order hold; K. J.
//! Astrom and B. Wittenmark, *Computer-Controlled Systems*, 1997, section 3.4), from the exponential
//! of `[A B 0; 0 0 1; 0 0 0]`.

use super::{
    dual::Dual,
    matrices::{
        MATRIX_SIZE, Vector, characteristic_polynomial, companion_matrix, exponential, matrix_vector_product, product,
    },
    operator::FamilyOperator,
    zoh::ZohFamilyOperator,
};
use crate::{ModelError, SampleTime, delayed_operator::whole_samples};

impl FamilyOperator {
    /// Returns the numbers of coefficients of B and F in the model of this operator for an interpolated error.
    pub fn interpolated_orders(&self) -> (usize, usize) {
        (self.order() + 2, self.order())
    }

    /// Returns the discrete model for an error that is interpolated between samples.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if an exponential overflows or the delay is too long in samples.
    pub fn interpolate(&self, sample_time: SampleTime) -> Result<ZohFamilyOperator, ModelError> {
        let late = self.tau_e_s() + 0.5 * sample_time.s();
        self.interpolate_with_delay_samples(whole_samples(late, sample_time)?, sample_time)
    }

    /// As [`FamilyOperator::interpolate`], with a given number l of whole samples in `tau + Ts/2`.
    ///
    /// # Errors
    /// As [`FamilyOperator::interpolate`].
    pub fn interpolate_with_delay_samples(
        &self,
        sample: usize,
        sample_time: SampleTime,
    ) -> Result<ZohFamilyOperator, ModelError> {
        let variables = self.variables();
        let ts = sample_time.s();
        let (zero, one) = (Dual::constant(0.0), Dual::constant(1.0));
        let delay = variables[variables.len() - 1];
        let delta = delay.scaled(1.0 / ts) - Dual::constant(sample as f64 - 0.5);
        let rest = one - delta;
        let (numerator, denominator) = self.scaled_polynomials(&variables, ts);
        let order = self.order();
        let direct = if self.has_direct_part() { numerator[order] } else { zero };
        let output: Vec<Dual> = (0..order).map(|i| numerator[i] - direct * denominator[i]).collect();

        let mut phi = [[zero; MATRIX_SIZE]; MATRIX_SIZE];
        let (mut oldest, mut middle, mut newest) = ([zero; MATRIX_SIZE], [zero; MATRIX_SIZE], [zero; MATRIX_SIZE]);
        if order > 0 {
            let system = companion_matrix(&denominator, order);
            let (first, second) = (exponential(&system, delta), exponential(&system, rest));
            phi = product(&second, &first, order);
            let column = |m: &super::matrices::Matrix, j: usize| -> Vector { std::array::from_fn(|i| m[i][j]) };
            let (step, ramp) = (column(&first, order), column(&first, order + 1));
            let (last_step, last_ramp) = (column(&second, order), column(&second, order + 1));
            let combined = |f: &dyn Fn(usize) -> Dual| matrix_vector_product(&second, &std::array::from_fn(f), order);
            oldest = combined(&|i| delta * step[i] - ramp[i]);
            let held = combined(&|i| rest * step[i] + ramp[i]);
            middle = std::array::from_fn(|i| held[i] + last_step[i] - last_ramp[i]);
            newest = last_ramp;
        }
        let f = characteristic_polynomial(&phi, order);

        let (nb, _) = self.interpolated_orders();
        let mut impulse = vec![zero; nb];
        for (late, start) in [newest, middle, oldest].into_iter().enumerate() {
            let mut state = start;
            for value in impulse.iter_mut().skip(late) {
                *value = (0..order).fold(*value, |sum, i| sum + output[i] * state[i]);
                state = matrix_vector_product(&phi, &state, order);
            }
        }
        impulse[0] = impulse[0] + direct * rest;
        impulse[1] = impulse[1] + direct * delta;
        ZohFamilyOperator::from_impulse_response(sample, &impulse, &f)
    }
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::{
        operator_family::{Form, examples::operators},
        polynomial,
    };

    fn all() -> Vec<FamilyOperator> {
        operators(&[0.1437, 0.16, 0.002])
    }

    fn response(model: &ZohFamilyOperator, omega: f64, ts: f64) -> Complex64 {
        let backward = Complex64::from_polar(1.0, -omega * ts);
        let f = [&[1.0][..], &model.f].concat();
        polynomial::value(&model.b, backward) / polynomial::value(&f, backward) * backward.powi(model.nk as i32)
    }

    #[test]
    fn response_matches_operator_delayed_by_half_a_sample() {
        for ts in [1e-3, 1.0 / 60.0] {
            let sample_time = SampleTime::new(ts).unwrap();
            for operator in all() {
                let model = operator.interpolate(sample_time).unwrap();
                for omega in [0.5, 4.0, 15.0] {
                    let half: f64 = 0.5 * omega * ts;
                    let smooth = Complex64::from_polar((half.sin() / half).powi(2), -half);
                    let expected = operator.response(omega) * smooth;
                    let error = (response(&model, omega, ts) - expected).norm() / expected.norm();
                    // The aliases of the interpolated error decrease with the square of their frequency. The operator
                    // passes them with its gain at high frequency, here relative to its gain at omega.
                    let aliases = 0.3 + operator.response(1e7).norm() / expected.norm();
                    assert!(
                        error < aliases * (omega * ts).powi(2) + 1e-9,
                        "{operator:?} {omega} {error}"
                    );
                }
            }
        }
    }

    #[test]
    fn jacobian_agrees_with_finite_differences() {
        let ts = SampleTime::new(1.0 / 60.0).unwrap();
        for operator in all() {
            let sample = whole_samples(operator.tau_e_s() + 0.5 * ts.s(), ts).unwrap();
            let exact = operator.interpolate(ts).unwrap();
            for i in 0..operator.coordinates().len() {
                let h = 1e-6;
                let at = |by: f64| {
                    let mut x = operator.coordinates().to_vec();
                    x[i] = (x[i] + by).max(if i + 1 == x.len() { 0.0 } else { f64::MIN });
                    let moved = FamilyOperator::new(operator.form(), operator.has_neuromuscular(), &x).unwrap();
                    let model = moved.interpolate_with_delay_samples(sample, ts).unwrap();
                    ([model.b, model.f].concat(), x[i])
                };
                let ((up, above), (down, below)) = (at(h), at(-h));
                let scale = exact.jacobian.iter().map(|row| row[i].abs()).fold(1e-3, f64::max);
                for ((row, up), down) in exact.jacobian.iter().zip(up).zip(down) {
                    // At a delay of zero the difference is one-sided, with a truncation error of order h.
                    let error = (row[i] - (up - down) / (above - below)).abs();
                    assert!(error < 1e-5 * scale + 1e-7, "{operator:?} {i} {error}");
                }
            }
        }
    }

    #[test]
    fn delay_derivative_is_continuous_across_sample_borders() {
        let ts = SampleTime::new(1.0 / 60.0).unwrap();
        let slope = |tau: f64| {
            let x = [6.0, 0.65, 0.5, 2.5, -0.7, tau];
            let operator = FamilyOperator::new(Form::Lead2Lag, true, &x).unwrap();
            let model = operator.interpolate(ts).unwrap();
            let column: Vec<f64> = model.jacobian[..model.b.len()].iter().map(|row| row[5]).collect();
            [vec![0.0; model.nk], column, vec![0.0; 2]].concat()
        };
        let border = 9.5 / 60.0;
        let (below, above) = (slope(border - 1e-10), slope(border + 1e-10));
        let largest = above.iter().map(|v| v.abs()).fold(0.0, f64::max);
        for i in 0..below.len().min(above.len()) {
            assert!((below[i] - above[i]).abs() < 1e-6 * largest, "{i}");
        }
    }
}
