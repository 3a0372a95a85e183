//! State-space form of the exact zero-order hold of any rational transfer function.
//!
//! `x' = A x + B v(t - delta)`, `y = C x` in controllable canonical form, with an input v that is held over each sample
//! and delayed by a fraction `0 <= delta < Ts` of a sample:
//!
//! `x(k+1) = Phi x(k) + Gamma_0 v(k) + Gamma_1 v(k-1)`,
//! `Phi = e^{A Ts}`, `Gamma_0 = Gamma(Ts - delta)`, `Gamma_1 = e^{A (Ts - delta)} Gamma(delta)`,
//! `Gamma(h) = int_0^h e^{A s} ds B`
//!
//! (K. J. Astrom and B. Wittenmark, *Computer-Controlled Systems*, 1997, section 3.2). The exponential and the integral
//! are blocks of the exponential of `[A B; 0 0] h` (C. F. Van Loan, IEEE Trans. Automatic Control 23 (1978) 395-404).
//! Internally, time is in samples, which keeps the entries at moderate size. Poles may be anywhere: at the origin,
//! multiple, or in the right half plane.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::{ModelError, SampleTime};

/// A rational transfer function after a zero-order hold. It has the state of `1/den`; the numerator determines the
/// output row C.
#[derive(Debug, Clone, PartialEq)]
pub struct ZohSystem {
    order: usize,
    /// The matrix Phi by rows.
    transition: Vec<f64>,
    /// Gamma_0, the factor of v(k).
    gamma_0: Vec<f64>,
    /// Gamma_1, the factor of v(k-1).
    gamma_1: Vec<f64>,
    output: Vec<f64>,
    direct: f64,
    sample_time: SampleTime,
}

impl ZohSystem {
    /// Creates the system `num(s)/den(s)` from coefficients in descending powers of s, where den is monic and the
    /// degree of num does not exceed that of den; `late` is delta/Ts.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if `late` is not in `[0, 1)` or an exponential overflows;
    /// [`ModelError::TransferFunction`] if the degree of num exceeds that of den or den is not monic.
    pub fn new(num: &[f64], den: &[f64], late: f64, sample_time: SampleTime) -> Result<Self, ModelError> {
        if !(0.0..1.0).contains(&late) {
            return Err(ModelError::OutOfRange {
                quantity: "delay of a held input as a fraction of a sample",
                found: late,
                expected: "zero or more, below one",
            });
        }
        if den.first() != Some(&1.0) || num.len() > den.len() {
            return Err(ModelError::TransferFunction {
                found: format!("{num:?} / {den:?}"),
                expected: "expected a monic denominator and a numerator of no higher degree".to_owned(),
            });
        }
        let order = den.len() - 1;
        let ts = sample_time.s();
        // The coefficients belong to ascending powers of s Ts: the state is z^(i) Ts^i / Ts^n.
        let scaled = |p: &[f64], i: usize| {
            let coefficient = if i < p.len() { p[p.len() - 1 - i] } else { 0.0 };
            coefficient * ts.powi((order - i) as i32)
        };
        let direct = scaled(num, order);
        let output = (0..order).map(|i| scaled(num, i) - direct * scaled(den, i)).collect();
        let mut generator = DMatrix::<f64>::zeros(order + 1, order + 1);
        for i in 0..order {
            generator[(i, i + 1)] = 1.0;
        }
        for i in 0..order {
            generator[(order - 1, i)] = -scaled(den, i);
        }
        let rest = (&generator * (1.0 - late)).exp();
        let first = (&generator * late).exp();
        let whole = if late == 0.0 { rest.clone() } else { &rest * &first };
        let inner = rest.view((0, 0), (order, order));
        let late_input = inner * first.view((0, order), (order, 1));
        let held = Self {
            order,
            transition: (0..order * order).map(|at| whole[(at / order, at % order)]).collect(),
            gamma_0: (0..order).map(|i| rest[(i, order)]).collect(),
            gamma_1: (0..order).map(|i| late_input[i]).collect(),
            output,
            direct,
            sample_time,
        };
        let numbers = [&held.transition, &held.gamma_0, &held.gamma_1, &held.output];
        if numbers.into_iter().flatten().all(|c| c.is_finite()) {
            return Ok(held);
        }
        Err(ModelError::OutOfRange {
            quantity: "the held model of a transfer function",
            found: f64::INFINITY,
            expected: "finite numbers; check the poles against the sample time",
        })
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Returns the transition matrix of the state over one sample, by rows.
    pub fn transition_matrix(&self) -> &[f64] {
        &self.transition
    }

    /// Returns Gamma_0, the contribution of the input v(k) to the next state; if the input is not delayed, it is the
    /// only contribution, since Gamma_1 is zero.
    pub fn input_vector(&self) -> &[f64] {
        &self.gamma_0
    }

    /// Returns the row C of the output.
    pub fn output_row(&self) -> &[f64] {
        &self.output
    }

    /// Returns the direct feedthrough.
    pub fn direct_feedthrough(&self) -> f64 {
        self.direct
    }

    /// Returns `C x`, without the direct feedthrough.
    #[inline]
    pub fn output(&self, state: &[f64]) -> f64 {
        self.output.iter().zip(state).map(|(c, x)| c * x).sum()
    }

    /// Computes the state one sample later from the inputs v(k) and v(k-1), and writes it to `next`, which has the
    /// length of `state`.
    #[inline]
    pub fn step(&self, state: &[f64], now: f64, before: f64, next: &mut [f64]) {
        let rows = self.transition.chunks_exact(self.order.max(1));
        for (((next, row), g), h) in next.iter_mut().zip(rows).zip(&self.gamma_0).zip(&self.gamma_1) {
            let own: f64 = row.iter().zip(state).map(|(a, x)| a * x).sum();
            *next = own + g * now + h * before;
        }
    }

    /// Returns `C (z I - Phi)^-1 (Gamma_0 + Gamma_1/z)` at `z = e^{j omega Ts}`, without the direct feedthrough.
    ///
    /// Returns `None` if z is a pole.
    pub fn response(&self, omega_rad_s: f64) -> Option<Complex64> {
        let n = self.order;
        if n == 0 {
            return Some(Complex64::new(0.0, 0.0));
        }
        let z = Complex64::from_polar(1.0, omega_rad_s * self.sample_time.s());
        let matrix = DMatrix::from_fn(n, n, |i, j| {
            let own = if i == j { z } else { Complex64::new(0.0, 0.0) };
            own - self.transition[i * n + j]
        });
        let input = DVector::from_fn(n, |i, _| self.gamma_0[i] + self.gamma_1[i] / z);
        let state = matrix.lu().solve(&input)?;
        Some(self.output.iter().zip(state.iter()).map(|(c, x)| x * *c).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FamilyOperator, Form, polynomial, second_order::ZohStates};

    fn ts() -> SampleTime {
        SampleTime::new(1.0 / 60.0).unwrap()
    }

    fn run(system: &ZohSystem, inputs: &[f64]) -> Vec<f64> {
        let (mut state, mut next) = (vec![0.0; system.order()], vec![0.0; system.order()]);
        let mut before = 0.0;
        inputs
            .iter()
            .map(|v| {
                let y = system.output(&state) + system.direct_feedthrough() * v;
                system.step(&state, *v, before, &mut next);
                std::mem::swap(&mut state, &mut next);
                before = *v;
                y
            })
            .collect()
    }

    #[test]
    fn integrators_sum_held_inputs() {
        // For 1/s, y is the sum of v Ts; for 1/s^2 with v = 1, it is t^2/2. Both are exact for held inputs.
        let one = ZohSystem::new(&[1.0], &[1.0, 0.0], 0.0, ts()).unwrap();
        let two = ZohSystem::new(&[1.0], &[1.0, 0.0, 0.0], 0.0, ts()).unwrap();
        let (first, second) = (run(&one, &[1.0; 200]), run(&two, &[1.0; 200]));
        for k in 0..200 {
            let t = k as f64 / 60.0;
            assert!((first[k] - t).abs() < 1e-13 && (second[k] - t * t / 2.0).abs() < 1e-13);
        }
        // An integrator with a delay of 0.3 samples has integrated 9.7 samples after 10.
        let late = ZohSystem::new(&[1.0], &[1.0, 0.0], 0.3, ts()).unwrap();
        assert!((run(&late, &[1.0; 11])[10] - 9.7 / 60.0).abs() < 1e-14);
    }

    #[test]
    fn second_order_matches_the_closed_form() {
        for (a1, a2) in [(0.7, 9.0), (7.0, 0.0), (0.0, 0.0), (-0.5, 4.0), (30.0, 1.0)] {
            let ours = ZohSystem::new(&[1.0], &[1.0, a1, a2], 0.0, ts()).unwrap();
            let known = ZohStates::new(a1, a2, ts());
            let mut state = [0.0; 2];
            let inputs: Vec<f64> = (0..120).map(|k| f64::from(k % 7) - 3.0).collect();
            for (y, v) in run(&ours, &inputs).into_iter().zip(&inputs) {
                assert!((y - state[0]).abs() < 1e-12 * (1.0 + y.abs()), "{a1} {a2}");
                state = known.step(state, *v);
            }
        }
    }

    #[test]
    fn family_operators_match_their_exact_hold() {
        // The two matrix exponentials are independent: nalgebra uses a Pade approximation, the family a power series.
        let x = [4.0, 0.6, 0.2, 11.0_f64.ln(), 0.25_f64.ln(), 0.1437];
        let operator = FamilyOperator::new(Form::Lead2Lag, true, &x).unwrap();
        let held = operator.zoh(ts()).unwrap();
        let transfer = operator.transfer_function().unwrap();
        let late = (0.1437 * 60.0_f64).fract();
        let ours = ZohSystem::new(transfer.num(), transfer.den(), late, ts()).unwrap();
        for omega in [0.3, 2.0, 9.0, 40.0] {
            let backward = Complex64::from_polar(1.0, -omega / 60.0);
            let f = [&[1.0][..], &held.f].concat();
            let family = polynomial::value(&held.b, backward) / polynomial::value(&f, backward);
            let found = ours.response(omega).unwrap();
            // Without the whole samples of the delay, the first coefficient of B has a lag of one sample.
            let error = (found - family * backward).norm() / found.norm();
            assert!(error < 1e-9, "{omega} {error}");
        }
    }

    #[test]
    fn invalid_systems_are_refused() {
        let new = |num: &[f64], den: &[f64], late| ZohSystem::new(num, den, late, ts());
        assert!(new(&[1.0, 0.0], &[1.0], 0.0).is_err());
        assert!(new(&[1.0], &[2.0, 1.0], 0.0).is_err());
        assert!(new(&[1.0], &[], 0.0).is_err());
        for late in [-0.1, 1.0, f64::NAN] {
            assert!(new(&[1.0], &[1.0, 1.0], late).is_err());
        }
        assert!(new(&[1.0], &[1.0, -1e9], 0.0).is_err());
        let gain = new(&[3.0], &[1.0], 0.5).unwrap();
        assert_eq!(
            (gain.order(), gain.direct_feedthrough(), run(&gain, &[2.0])),
            (0, 3.0, vec![6.0])
        );
        assert_eq!(gain.response(1.0), Some(Complex64::new(0.0, 0.0)));
        // The pole of an integrator is at zero frequency.
        assert_eq!(new(&[1.0], &[1.0, 0.0], 0.0).unwrap().response(0.0), None);
    }
}
