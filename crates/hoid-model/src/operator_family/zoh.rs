//! The exact discrete model of an operator of the family after a zero-order hold, with a delay of
//! any fraction of a sample, and its derivatives.
//!
//! In controllable canonical form `x' = A x + B e(t - tau)`, `u = C x + D e(t - tau)` with `tau = l Ts + delta`,
//! `0 <= delta < Ts`. Within a sample the delayed input is `e(k-l-1)` for a time delta and `e(k-l)` for the rest, so
//! that
//!
//! `x(k+1) = Phi x(k) + Gamma_1 e(k-l-1) + Gamma_0 e(k-l)`,
//! `Phi = Phi_2 Phi_1`, `Gamma_1 = Phi_2 Gamma(delta)`, `Gamma_0 = Gamma(Ts - delta)`
//!
//! (K. J. Astrom and B. Wittenmark, *Computer-Controlled Systems*, 1997, section 3.2). The matrices are blocks of the
//! exponential of `[A B; 0 0] h`, computed by scaling and squaring of its series. F is the characteristic polynomial of
//! Phi, and B is the product of F and the impulse response. All computations use dual numbers ([`super::dual`]), which
//! carry the derivatives with respect to the coordinates.
//!
//! **Direct part.** If the numerator and the denominator of a form have the same degree, the operator has a direct
//! feedthrough of e. With a held error, the output would jump from one value of e to the next when the delay passes an
//! integer number of samples. The direct part is therefore computed from the error interpolated linearly between the
//! samples around `t - tau - Ts/2`. The additional delay Ts/2 is the delay that the hold adds to all other parts.

use super::{
    dual::{Dual, PARTIAL_COUNT},
    form::{POWER_COUNT, Rational},
    matrices::{
        MATRIX_SIZE, Matrix, Vector, characteristic_polynomial, companion_matrix, exponential, matrix_vector_product,
        product,
    },
    operator::FamilyOperator,
};
use crate::{ModelError, SampleTime, delayed_operator::whole_samples};

/// Discrete model `q^-nk B/F` of an operator, with the derivatives of its coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct ZohFamilyOperator {
    /// Delay of the first coefficient of B, in samples.
    pub nk: usize,
    /// Coefficients of B.
    pub b: Vec<f64>,
    /// Coefficients of F without the leading 1.
    pub f: Vec<f64>,
    /// Derivatives of the coefficients of B, then of F: one row for each coefficient, with one column for each
    /// coordinate.
    pub jacobian: Vec<[f64; PARTIAL_COUNT]>,
}

/// Dynamics of the poles and the delay over one sample, independent of the numerator.
struct ZohPoles {
    /// Numerator omega^2 of the neuromuscular part; `None` without a neuromuscular part.
    gain: Option<Dual>,
    f: Vec<Dual>,
    denominator: Vector,
    /// Fraction delta of the delay, in samples.
    delta: Dual,
    phi: Matrix,
    gamma_old: Vector,
    gamma_new: Vector,
}

impl ZohFamilyOperator {
    /// Returns the model with the denominator F whose impulse response, from lag nk on, is `impulse`: `B = F h`.
    pub(super) fn from_impulse_response(nk: usize, impulse: &[Dual], f: &[Dual]) -> Result<Self, ModelError> {
        let order = f.len();
        let b: Vec<Dual> = (0..impulse.len())
            .map(|k| (1..=order.min(k)).fold(impulse[k], |sum, i| sum + f[i - 1] * impulse[k - i]))
            .collect();
        if b.iter().chain(f).any(|c| !c.value.is_finite()) {
            return Err(ModelError::OutOfRange {
                quantity: "the discrete model of the operator",
                found: f64::INFINITY,
                expected: "finite numbers; check omega_nm, zeta_nm and 1/T_I against the sample time",
            });
        }
        Ok(Self {
            nk,
            jacobian: b.iter().chain(f).map(|c| c.partials).collect(),
            b: b.iter().map(|c| c.value).collect(),
            f: f.iter().map(|c| c.value).collect(),
        })
    }
}

impl FamilyOperator {
    /// Returns three numbers that do not depend on the values of the parameters: the numbers of coefficients of B and
    /// of F in the discrete model, and the difference between nk and the number of whole samples in tau.
    pub fn zoh_orders(&self) -> (usize, usize, usize) {
        let order = self.order();
        if self.has_direct_part() {
            (order + 3, order, 0)
        } else {
            (order + 1, order, 1)
        }
    }

    /// Returns the number of poles of the operator.
    pub fn order(&self) -> usize {
        usize::from(self.form().has_pole()) + if self.has_neuromuscular() { 2 } else { 0 }
    }

    pub(super) fn has_direct_part(&self) -> bool {
        self.form().degree() == self.order()
    }

    /// Returns the exact discrete model of the operator after a zero-order hold.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if an exponential overflows or the delay is too long in samples.
    pub fn zoh(&self, sample_time: SampleTime) -> Result<ZohFamilyOperator, ModelError> {
        self.zoh_with_delay_samples(whole_samples(self.tau_e_s(), sample_time)?, sample_time)
    }

    /// As [`FamilyOperator::zoh`], with a given number of whole samples in the delay. `delta = tau - sample Ts` may be
    /// 0 or Ts; the models for neighbouring values of `sample` are equal where their intervals meet.
    ///
    /// # Errors
    /// As [`FamilyOperator::zoh`].
    pub fn zoh_with_delay_samples(
        &self,
        sample: usize,
        sample_time: SampleTime,
    ) -> Result<ZohFamilyOperator, ModelError> {
        let variables = self.variables();
        let Rational { numerator, .. } = self.form().rational(&variables);
        let poles = self.zoh_poles(&variables, sample, sample_time.s());
        self.zoh_model(&poles, numerator, sample, sample_time.s())
    }

    /// Returns exact discrete models with the numerators `s^i`, i from 0 to the degree of the numerator, and with the
    /// poles and the delay of this operator. All models have the same F: the response from e to u is
    /// `sum_i n_i(t) (B_i/F) q^-nk e` even if the coefficients n_i of the numerator change with time, as long as the
    /// poles do not.
    ///
    /// # Errors
    /// As [`FamilyOperator::zoh`].
    pub fn zoh_powers_with_delay_samples(
        &self,
        sample: usize,
        sample_time: SampleTime,
    ) -> Result<Vec<ZohFamilyOperator>, ModelError> {
        let poles = self.zoh_poles(&self.variables(), sample, sample_time.s());
        let power = |i: usize| std::array::from_fn(|j| Dual::constant(f64::from(u8::from(i == j))));
        (0..=self.form().degree())
            .map(|i| self.zoh_model(&poles, power(i), sample, sample_time.s()))
            .collect()
    }

    /// Returns the dynamics of the poles and the delay over one sample.
    fn zoh_poles(&self, variables: &[Dual], sample: usize, ts: f64) -> ZohPoles {
        let delay = variables[variables.len() - 1];
        // Time is in samples, which keeps the entries of all matrices at moderate size.
        let delta = delay.scaled(1.0 / ts) - Dual::constant(sample as f64);
        let denominator = self.scaled_denominator(variables, ts);
        let order = self.order();
        let zero = Dual::constant(0.0);
        let rest = Dual::constant(1.0) - delta;
        let (mut phi, mut gamma_old, mut gamma_new) = (
            [[zero; MATRIX_SIZE]; MATRIX_SIZE],
            [zero; MATRIX_SIZE],
            [zero; MATRIX_SIZE],
        );
        if order > 0 {
            let first = exponential(&companion_matrix(&denominator, order), delta);
            let second = exponential(&companion_matrix(&denominator, order), rest);
            phi = product(&second, &first, order);
            for i in 0..order {
                gamma_new[i] = second[i][order];
                gamma_old[i] = (0..order).fold(zero, |sum, j| sum + second[i][j] * first[j][order]);
            }
        }
        ZohPoles {
            gain: self.numerator_gain(variables),
            f: characteristic_polynomial(&phi, order),
            denominator,
            delta,
            phi,
            gamma_old,
            gamma_new,
        }
    }

    /// Returns the model with the given numerator and poles.
    fn zoh_model(
        &self,
        poles: &ZohPoles,
        numerator: [Dual; POWER_COUNT],
        sample: usize,
        ts: f64,
    ) -> Result<ZohFamilyOperator, ModelError> {
        let (zero, one) = (Dual::constant(0.0), Dual::constant(1.0));
        let order = self.order();
        let numerator = self.scaled_numerator(numerator, poles.gain, ts);
        let direct = if self.has_direct_part() { numerator[order] } else { zero };
        // Output row of the strictly proper part, c_i = n_i - D d_i.
        let output: Vec<Dual> = (0..order)
            .map(|i| numerator[i] - direct * poles.denominator[i])
            .collect();

        // The impulse response h starts at lag nk and has as many values as B; then B = F h.
        let (nb, _, shift) = self.zoh_orders();
        let first_dynamic = 1 - shift;
        let mut impulse = vec![zero; nb];
        let mut state = poles.gamma_new;
        let mut late = poles.gamma_old;
        for j in first_dynamic..nb {
            let value = |x: &Vector| (0..order).fold(zero, |sum, i| sum + output[i] * x[i]);
            impulse[j] = impulse[j] + value(&state);
            if j + 1 < nb {
                impulse[j + 1] = impulse[j + 1] + value(&late);
            }
            state = matrix_vector_product(&poles.phi, &state, order);
            late = matrix_vector_product(&poles.phi, &late, order);
        }
        if self.has_direct_part() {
            // The delay of the direct part is tau + Ts/2 = (sample + whole + part) Ts.
            let late_by = poles.delta + Dual::constant(0.5);
            let whole = usize::from(late_by.value >= 1.0);
            let part = late_by - Dual::constant(whole as f64);
            impulse[whole] = impulse[whole] + direct * (one - part);
            impulse[whole + 1] = impulse[whole + 1] + direct * part;
        }
        ZohFamilyOperator::from_impulse_response(sample + shift, &impulse, &poles.f)
    }

    /// Returns the numerator and the monic denominator of the operator in ascending powers of `s Ts`.
    pub(super) fn scaled_polynomials(&self, variables: &[Dual], ts: f64) -> (Vector, Vector) {
        let Rational { numerator, .. } = self.form().rational(variables);
        (
            self.scaled_numerator(numerator, self.numerator_gain(variables), ts),
            self.scaled_denominator(variables, ts),
        )
    }

    /// Returns omega^2, the factor of the neuromuscular part in the numerator; `None` without a neuromuscular part.
    fn numerator_gain(&self, variables: &[Dual]) -> Option<Dual> {
        self.neuromuscular_variables(variables).map(|(omega, _)| omega * omega)
    }

    fn scaled_numerator(&self, numerator: [Dual; POWER_COUNT], gain: Option<Dual>, ts: f64) -> Vector {
        let mut num = [Dual::constant(0.0); MATRIX_SIZE];
        num[..POWER_COUNT].copy_from_slice(&numerator);
        if let Some(square) = gain {
            num = num.map(|c| c * square);
        }
        std::array::from_fn(|i| num[i].scaled(self.scale_factor(i, ts)))
    }

    fn scaled_denominator(&self, variables: &[Dual], ts: f64) -> Vector {
        let zero = Dual::constant(0.0);
        let one = Dual::constant(1.0);
        let Rational { pole, .. } = self.form().rational(variables);
        let mut den = [zero; MATRIX_SIZE];
        den[0] = one;
        if let Some(a) = pole {
            (den[0], den[1]) = (a, one);
        }
        if let Some((omega, zeta)) = self.neuromuscular_variables(variables) {
            let square = omega * omega;
            let middle = (zeta * omega).scaled(2.0);
            let before = den;
            den = std::array::from_fn(|i| {
                let shifted = |by: usize| if i >= by { before[i - by] } else { zero };
                square * shifted(0) + middle * shifted(1) + shifted(2)
            });
        }
        std::array::from_fn(|i| den[i].scaled(self.scale_factor(i, ts)))
    }

    /// Factor that converts a coefficient of s^i to the coefficient of `(s Ts)^i`, for a denominator that remains
    /// monic.
    fn scale_factor(&self, i: usize, ts: f64) -> f64 {
        ts.powi(self.order() as i32 - i as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        delayed_operator::delayed_operator,
        operator_family::{
            Form,
            examples::{operator, operators},
        },
        polynomial,
    };
    use num_complex::Complex64;

    fn ts() -> SampleTime {
        SampleTime::new(1.0 / 60.0).unwrap()
    }

    fn all() -> Vec<FamilyOperator> {
        operators(&[0.1437, 0.16])
    }

    #[test]
    fn lead_form_matches_delayed_operator() {
        for tau in [0.0, 0.1, 0.1437, 0.2] {
            let of_family = operator(Form::Lead, true, tau).zoh(ts()).unwrap();
            let known = delayed_operator([4.0, 2.4, 11.0, 0.25, tau], ts()).unwrap();
            assert_eq!(of_family.nk, known.nk);
            let pairs = of_family.b.iter().zip(&known.b).chain(of_family.f.iter().zip(&known.f));
            for (a, b) in pairs {
                assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{a} {b}");
            }
        }
    }

    #[test]
    fn jacobian_agrees_with_finite_differences() {
        for operator in all() {
            let sample = whole_samples(operator.tau_e_s(), ts()).unwrap();
            let exact = operator.zoh(ts()).unwrap();
            for i in 0..operator.coordinates().len() {
                let h = 1e-6;
                let at = |by: f64| {
                    let mut x = operator.coordinates().to_vec();
                    x[i] += by;
                    let moved = FamilyOperator::new(operator.form(), operator.has_neuromuscular(), &x).unwrap();
                    let held = moved.zoh_with_delay_samples(sample, ts()).unwrap();
                    [held.b, held.f].concat()
                };
                let scale = exact.jacobian.iter().map(|row| row[i].abs()).fold(1e-3, f64::max);
                for ((row, up), down) in exact.jacobian.iter().zip(at(h)).zip(at(-h)) {
                    // The error of the difference consists of a truncation error of order h^2 and a rounding error of
                    // order eps/h.
                    let error = (row[i] - (up - down) / (2.0 * h)).abs();
                    assert!(error < 1e-8 * scale + 1e-7, "{operator:?} {i} {error}");
                }
            }
        }
    }

    #[test]
    fn response_matches_the_operator_after_a_hold() {
        let ts_s = 1e-3;
        let fine = SampleTime::new(ts_s).unwrap();
        for operator in all() {
            let held = operator.zoh(fine).unwrap();
            for omega in [0.5, 4.0, 15.0] {
                let backward = Complex64::from_polar(1.0, -omega * ts_s);
                let f = [&[1.0][..], &held.f].concat();
                let h = polynomial::value(&held.b, backward) / polynomial::value(&f, backward)
                    * backward.powi(held.nk as i32);
                let hold = Complex64::from_polar(1.0, -omega * ts_s / 2.0);
                let expected = operator.response(omega) * hold;
                // The hold and the aliases contribute at most (omega Ts)^2. The response of a derivative form is small
                // at low frequencies, where the relative error is larger.
                let small = if operator.form().is_derivative() {
                    omega.min(1.0)
                } else {
                    1.0
                };
                let error = (h - expected).norm() / expected.norm();
                assert!(
                    error < (omega * ts_s).powi(2) + 2e-5 / small,
                    "{operator:?} {omega} {error}"
                );
            }
        }
    }

    #[test]
    fn weighted_powers_sum_to_the_operator() {
        for operator in all() {
            let sample = whole_samples(operator.tau_e_s(), ts()).unwrap();
            let whole = operator.zoh(ts()).unwrap();
            let powers = operator.zoh_powers_with_delay_samples(sample, ts()).unwrap();
            let x = operator.coordinates();
            let (shape, _) = operator.form().shape(&x[1..]);
            assert_eq!(powers.len(), operator.form().degree() + 1);
            for (k, b) in whole.b.iter().enumerate() {
                let sum: f64 = powers.iter().zip(shape).map(|(p, m)| x[0] * m * p.b[k]).sum();
                let size: f64 = powers.iter().zip(shape).map(|(p, m)| (x[0] * m * p.b[k]).abs()).sum();
                assert!((sum - b).abs() <= 1e-12 * size, "{operator:?} {k}: {sum} {b}");
            }
            // These models do not depend on the coordinates of the numerator.
            let of_numerator = 1 + operator.form().shape_coordinate_count();
            for power in &powers {
                assert_eq!((power.nk, &power.f), (whole.nk, &whole.f));
                assert!(
                    power
                        .jacobian
                        .iter()
                        .all(|row| row[..of_numerator].iter().all(|d| *d == 0.0))
                );
            }
        }
    }

    #[test]
    fn model_has_static_gain_and_is_continuous_in_the_delay() {
        for form in [Form::Gain, Form::Lead, Form::LeadLag, Form::Lead2Lag] {
            let held = operator(form, true, 0.13).zoh(ts()).unwrap();
            let sum: f64 = held.b.iter().sum::<f64>() / (1.0 + held.f.iter().sum::<f64>());
            let expected = if form.has_lag() { 20.0 } else { 4.0 };
            assert!((sum - expected).abs() < 1e-8 * expected, "{form} {sum}");
        }
        for operator_at in [
            |tau| operator(Form::LeadLag, true, tau),
            |tau| operator(Form::LeadLag, false, tau),
        ] {
            let border = 9.0 / 60.0;
            let shifted = |held: ZohFamilyOperator| [vec![0.0; held.nk], held.b].concat();
            let below = shifted(operator_at(border - 1e-12).zoh(ts()).unwrap());
            let above = shifted(operator_at(border + 1e-12).zoh(ts()).unwrap());
            for i in 0..below.len().max(above.len()) {
                let at = |b: &[f64]| b.get(i).copied().unwrap_or(0.0);
                assert!((at(&below) - at(&above)).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn extreme_parameters_stay_finite_or_are_refused() {
        let with = |log_omega: f64, log_zeta: f64, rate: f64| {
            FamilyOperator::new(Form::LeadLag, true, &[1.0, 0.5, rate, log_omega, log_zeta, 0.2]).unwrap()
        };
        for (log_omega, log_zeta, rate) in [(5.2, -4.0, 0.0), (5.2, 3.0, 40.0), (-3.0, 0.0, 0.0), (2.0, 0.0, 1e-12)] {
            let held = with(log_omega, log_zeta, rate).zoh(ts()).unwrap();
            let roots = polynomial::roots(&[&[1.0][..], &held.f].concat()).unwrap();
            // The pole of a pure integration is on the unit circle, up to the rounding of a root that is close to two
            // others.
            assert!(roots.iter().all(|z| z.norm() < 1.0 + 1e-9), "{roots:?}");
        }
        assert!(with(400.0, 0.0, 0.1).zoh(ts()).is_err());
    }
}
