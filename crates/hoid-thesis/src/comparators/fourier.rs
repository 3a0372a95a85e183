//! Fourier coefficients at the lines of the forcing function, in a moving window (M. M. van Paassen and M. Mulder,
//! *Identification of human operator control behaviour in multiple-loop tracking tasks*, IFAC Man-Machine Systems,
//! 1998).
//!
//! The forcing function is a sum of sinusoids, and so are e and u except for the remnant. In a window of length T
//! around t, the model
//!
//! `x(k) = sum_i (a_i cos omega_i t_k + b_i sin omega_i t_k) + r(k)`
//!
//! is fitted to x = e and x = u by least squares for all lines at once. Over a whole period of the forcing function the
//! estimates are the Fourier coefficients of x; over less than a period the lines are separated as far as their
//! distances allow. The response is `H(j omega_i) = U(j omega_i)/E(j omega_i)` with `X = a_i - j b_i`. The window
//! extends T/2 to either side of t; near the ends of the record it is the first or the last interval of length T.

use hoid_ident::{settings, settings::Bounds};
use num_complex::Complex64;

use super::{
    comparator::{Comparator, ComparatorDescription, Task, TrackingResult},
    least_squares::NormalEquations,
};
use crate::ThesisError;

const NAME: &str = "fourier";
/// Ridge, as a fraction of the power of a line; it regularises lines that a short window cannot separate.
const RIDGE_SHARE: f64 = 1e-4;

settings! {
    /// Options of the Fourier coefficients.
    pub struct FourierCoefficients {
        /// Length T of the window
        #[setting(unit("s"), bounds(Bounds::PositiveFinite))]
        pub window: f64 = 30.72,
    }
}

impl FourierCoefficients {
    /// Returns the coefficients of e and u at the lines over a span of samples.
    fn coefficients(
        task: &Task<'_>,
        (e, u): (&[f64], &[f64]),
        span: std::ops::Range<usize>,
    ) -> Result<Vec<[Complex64; 2]>, ThesisError> {
        let ts = task.record.sample_time().s();
        let mut equations = NormalEquations::new(2 * task.lines_rad_s.len(), 2);
        for k in span {
            let of = |omega: &f64| {
                let (sin, cos) = (omega * ts * k as f64).sin_cos();
                [cos, sin]
            };
            let regressors: Vec<f64> = task.lines_rad_s.iter().flat_map(of).collect();
            equations.add(1.0, &regressors, &[e[k], u[k]]);
        }
        let theta = equations.solve(NAME, &equations.ridge(RIDGE_SHARE))?;
        let of = |i: usize| [0, 1].map(|j| Complex64::new(theta[(2 * i, j)], -theta[(2 * i + 1, j)]));
        Ok((0..task.lines_rad_s.len()).map(of).collect())
    }
}

impl Comparator for FourierCoefficients {
    fn description(&self) -> ComparatorDescription {
        ComparatorDescription {
            name: NAME,
            help: "Fourier coefficients at the lines, in a moving window",
            source: "van Paassen and Mulder 1998",
            extra_information: "the lines of the forcing function, and half a window of data after each time",
        }
    }

    fn track(&self, task: &Task<'_>) -> Result<TrackingResult, ThesisError> {
        let signals = task.signals(NAME, 2 * task.lines_rad_s.len())?;
        let n = task.record.len();
        let length = ((self.window / task.record.sample_time().s()).round() as usize).clamp(1, n);
        let mut response = Vec::with_capacity(task.requested_samples.len());
        for at in task.requested_samples {
            let first = at.saturating_sub(length / 2).min(n - length);
            let all = Self::coefficients(task, signals, first..first + length)?;
            let at_line = |omega: &f64| {
                let line = task.lines_rad_s.iter().position(|line| (line - omega).abs() < 1e-9);
                line.map_or(Complex64::new(f64::NAN, f64::NAN), |i| all[i][1] / all[i][0])
            };
            response.push(task.omega_rad_s.iter().map(at_line).collect());
        }
        Ok(TrackingResult::without_operator(response))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::{super::tests::*, *};

    #[test]
    fn whole_period_window_gives_exact_coefficients() {
        // Lines 3 and 8 of a period of 512 samples; in u the first line has twice the amplitude, and the second line is
        // delayed.
        let omega = [3.0, 8.0].map(|n| n * std::f64::consts::TAU / 5.12);
        let at = |n: usize, k: f64| (omega[n] * 0.01 * k).sin();
        let e: Vec<f64> = (0..512).map(|k| at(0, f64::from(k)) + at(1, f64::from(k))).collect();
        let u: Vec<f64> = (0..512)
            .map(|k| 2.0 * at(0, f64::from(k)) + at(1, f64::from(k) - 20.0))
            .collect();
        let record = test_record(&e, &u);
        let task = Task {
            lines_rad_s: &omega,
            ..test_task(&record, &[255], &omega)
        };
        let found = FourierCoefficients { window: 5.12 }.track(&task).unwrap();
        // The ridge reduces e and u by the same fraction.
        let expected = [Complex64::new(2.0, 0.0), Complex64::from_polar(1.0, -omega[1] * 0.2)];
        for (found, expected) in found.response[0].iter().zip(expected) {
            assert!((found - expected).norm() < 1e-9, "{found} {expected}");
        }
        // A frequency that is not a line has no coefficient.
        let other = Task {
            omega_rad_s: &[1.0],
            ..task
        };
        assert!(
            FourierCoefficients { window: 5.12 }.track(&other).unwrap().response[0][0]
                .re
                .is_nan()
        );
    }

    #[test]
    fn window_is_limited_to_the_record() {
        let run = Run::of(hoid_model::scenario::Condition::C1, 1, 0.0);
        let whole = FourierCoefficients { window: 1e4 }.track(&run.task()).unwrap();
        let truth = run.responses();
        // 81.92 s is a whole period, so without remnant each line is exact except for the ridge.
        for (found, expected) in whole.response[0].iter().zip(&truth[0]) {
            assert!((found / expected - 1.0).norm() < 1e-3, "{found} {expected}");
        }
        assert!(
            FourierCoefficients::default()
                .track(&test_task(&test_record(&[0.0; 99], &[0.0; 99]), &[9], &[]))
                .is_err()
        );
    }
}
