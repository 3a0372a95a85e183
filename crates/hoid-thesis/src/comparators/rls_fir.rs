//! A finite impulse response estimated by recursive least squares and converted to a frequency response over time (M.
//! Olivari, J. Venrooij, F. M. Nieuwenhuizen, L. Pollini and H. H. Bülthoff, *Identifying time-varying pilot responses:
//! a regularized recursive least-squares algorithm*, AIAA SciTech 2016).
//!
//! The model is `u(t) = sum_{i=0}^{nb-1} g_i e(t - i) + n(t)`; after every sample, g minimises
//!
//! `sum_k lambda^(t-k) (u(k) - g' phi(k))^2 + p var(u) g' K^-1 g`.
//!
//! The forcing function has ten lines, which excite only twenty of the nb directions. Without the second term of the
//! criterion, noise and rounding errors would determine the other directions, along which the covariance of the
//! standard recursion would grow as lambda^-t until it was no longer positive definite. K is the *tuned-correlated*
//! kernel `K_ij = decay^max(i, j)` (T. Chen, H. Ohlsson and L. Ljung, *Automatica* 48 (2012) 1525-1535), the covariance
//! of a smooth, decaying response. The inverse of K corresponds to independent increments of g:
//!
//! `g' K^-1 g = sum_i (g_i - g_{i+1})^2/(decay^i - decay^(i+1)) + g_{nb-1}^2/decay^(nb-1)`.
//!
//! The recursion is in information form: `R(t) = lambda R(t-1) + phi phi'`, with a corresponding recursion for `phi u`.
//! R stays positive semidefinite for any excitation; the equations are solved when an estimate is requested. The
//! response is the Fourier transform of g, `H = sum g_i e^(-j omega i Ts)`. The response has no poles and therefore
//! gives no operator parameters.

use hoid_ident::{settings, settings::Bounds};
use nalgebra::DMatrix;
use num_complex::Complex64;

use super::{
    comparator::{Comparator, ComparatorDescription, Task, TrackingResult},
    least_squares::NormalEquations,
};
use crate::ThesisError;

const NAME: &str = "rls-fir";

settings! {
    /// Options of the finite impulse response.
    pub struct RlsFir {
        /// Coefficients of the impulse response
        #[setting(unit("samples"), bounds(Bounds::AtLeast(1.0)))]
        pub nb: usize = 192,
        /// Memory 1/(1 - lambda)
        #[setting(unit("samples"), bounds(Bounds::AtLeast(2.0)))]
        pub memory: f64 = 1024.0,
        /// Weight p of the prior
        #[setting(bounds(Bounds::PositiveFinite))]
        pub penalty: f64 = 0.3,
        /// Decay of the kernel from one sample to the next
        #[setting(bounds(Bounds::Between(0.0, 1.0)))]
        pub decay: f64 = 0.98,
    }
}

impl RlsFir {
    /// Returns K^-1, which is tridiagonal.
    fn inverse_kernel(&self) -> DMatrix<f64> {
        let mut inverse = DMatrix::zeros(self.nb, self.nb);
        let mut size = 1.0;
        for i in 0..self.nb {
            let next = size * self.decay;
            if i + 1 == self.nb {
                inverse[(i, i)] += 1.0 / size;
                break;
            }
            let weight = 1.0 / (size - next);
            inverse[(i, i)] += weight;
            inverse[(i + 1, i + 1)] += weight;
            inverse[(i + 1, i)] -= weight;
            size = next;
        }
        inverse
    }

    /// Returns the impulse responses after the requested samples.
    fn impulse_responses(&self, task: &Task<'_>) -> Result<Vec<Vec<f64>>, ThesisError> {
        let (e, u) = task.signals(NAME, self.nb)?;
        let lambda = 1.0 - 1.0 / self.memory;
        let power = u.iter().map(|u| u * u).sum::<f64>() / u.len() as f64;
        let prior = self.inverse_kernel() * (self.penalty * power.max(f64::MIN_POSITIVE));
        let mut equations = NormalEquations::new(self.nb, 1);
        let mut regressors = vec![0.0; self.nb];
        let (mut found, mut asked) = (
            Vec::with_capacity(task.requested_samples.len()),
            task.requested_samples.iter().peekable(),
        );
        for k in 0..e.len() {
            regressors.rotate_right(1);
            regressors[0] = e[k];
            // The signals before the record are unknown, so the regressors are complete only from this sample on.
            if k + 1 >= self.nb {
                equations.add(lambda, &regressors, &[u[k]]);
            }
            while asked.next_if(|at| **at == k).is_some() {
                let g = equations.solve(NAME, &prior)?;
                found.push(g.column(0).iter().copied().collect());
            }
        }
        Ok(found)
    }
}

impl Comparator for RlsFir {
    fn description(&self) -> ComparatorDescription {
        ComparatorDescription {
            name: NAME,
            help: "regularised recursive least squares for a finite impulse response",
            source: "Olivari et al. 2016",
            extra_information: "",
        }
    }

    fn track(&self, task: &Task<'_>) -> Result<TrackingResult, ThesisError> {
        let ts = task.record.sample_time().s();
        let of = |g: &Vec<f64>| {
            let at = |omega: &f64| {
                let terms = g.iter().enumerate();
                terms
                    .map(|(i, g)| Complex64::from_polar(*g, -omega * ts * i as f64))
                    .sum()
            };
            task.omega_rad_s.iter().map(at).collect()
        };
        let all = self.impulse_responses(task)?;
        Ok(TrackingResult::without_operator(all.iter().map(of).collect()))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_sim::RunSeed;

    use super::{super::tests::*, *};

    /// The same minimum is computed in another way: the regularised sum of squares is a tall least-squares problem,
    /// with rows for the prior in addition to those for the data, which is solved by Householder reflections.
    #[test]
    fn recursion_minimises_its_criterion() {
        let method = RlsFir {
            nb: 6,
            memory: 50.0,
            penalty: 0.2,
            decay: 0.8,
        };
        let e = RunSeed::default().white_noise(120);
        let u = RunSeed {
            cell: 1,
            ..RunSeed::default()
        }
        .white_noise(120);
        let record = test_record(&e, &u);
        let task = test_task(&record, &[59, 119], &[]);
        let found = method.impulse_responses(&task).unwrap();
        let power = u.iter().map(|u| u * u).sum::<f64>() / 120.0;
        for (at, found) in task.requested_samples.iter().zip(&found) {
            let mut rows: Vec<[f64; 6]> = Vec::new();
            let mut right = Vec::new();
            for k in 5..=*at {
                let weight = (1.0f64 - 1.0 / 50.0).powi((at - k) as i32).sqrt();
                rows.push(std::array::from_fn(|i| weight * e[k - i]));
                right.push(weight * u[k]);
            }
            for i in 0..6 {
                let size = (0.2 * power).sqrt();
                let (here, next) = (0.8f64.powi(i), 0.8f64.powi(i + 1));
                let i = i as usize;
                let mut row = [0.0; 6];
                if i < 5 {
                    row[i] = size / (here - next).sqrt();
                    row[i + 1] = -row[i];
                } else {
                    row[i] = size / here.sqrt();
                }
                rows.push(row);
                right.push(0.0);
            }
            let phi = DMatrix::from_fn(rows.len(), 6, |i, j| rows[i][j]);
            let qr = phi.qr();
            let rotated = qr.q().transpose() * nalgebra::DVector::from_vec(right);
            let expected = qr.r().solve_upper_triangular(&rotated).unwrap();
            for (a, b) in found.iter().zip(expected.iter()) {
                assert!((a - b).abs() < 1e-10, "{a} {b}");
            }
        }
    }

    #[test]
    fn coefficients_follow_a_change_of_gain() {
        // u = g(t) e(t - 20) with white e; the gain doubles in the middle.
        let e = RunSeed::default().white_noise(8000);
        let gain = |k: usize| if k < 4000 { 0.5 } else { 1.0 };
        let u: Vec<f64> = (0..8000)
            .map(|k| gain(k) * if k >= 20 { e[k - 20] } else { 0.0 })
            .collect();
        let method = RlsFir {
            nb: 256,
            memory: 600.0,
            penalty: 1e-6,
            decay: 0.99,
        };
        let record = test_record(&e, &u);
        let task = test_task(&record, &[3999, 7999], &[3.0]);
        let found = method.track(&task).unwrap();
        for (row, gain) in found.response.iter().zip([0.5, 1.0]) {
            let expected = Complex64::from_polar(gain, -3.0 * 0.01 * 20.0);
            // A fraction exp(-4000/600) of the old gain remains.
            assert!((row[0] - expected).norm() < 3e-3, "{row:?} {expected}");
        }
    }

    #[test]
    fn few_lines_stay_finite_and_zero_input_is_refused() {
        // Two lines excite only four of 256 directions.
        let e: Vec<f64> = (0..3000)
            .map(|k| (0.02 * k as f64).sin() + (0.005 * k as f64).cos())
            .collect();
        let record = test_record(&e, &e);
        let method = RlsFir {
            nb: 256,
            ..RlsFir::default()
        };
        let found = method.track(&test_task(&record, &[2999], &[2.0])).unwrap();
        // With u = e, the response at the line is near 1, however uncertain the response at other frequencies is.
        assert!((found.response[0][0] - 1.0).norm() < 0.05, "{:?}", found.response);
        let silent = test_record(&[0.0; 500], &[1.0; 500]);
        let refused = method
            .track(&test_task(&silent, &[499], &[2.0]))
            .unwrap_err()
            .to_string();
        assert!(refused.contains("rls-fir") && refused.contains("zero"), "{refused}");
        assert!(
            method
                .track(&test_task(&test_record(&e[..200], &e[..200]), &[0], &[]))
                .is_err()
        );
    }
}
