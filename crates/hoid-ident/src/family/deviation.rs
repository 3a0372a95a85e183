//! Smooth deviation of a person's response from the fitted form.
//!
//! A form describes a person only approximately: it does not represent a dead zone, pulses or slow adaptation. If the
//! lines of the excitation are known better than the form fits them, chi^2 exceeds its degrees of freedom, and the
//! standard errors, which assume the form, are too small. The sampled response is therefore
//!
//! `H(omega) = Y(omega) Z(omega) (1 + delta(omega))`
//!
//! where the real and imaginary parts of delta are independent Gaussian processes of `ln omega` with variance s^2 and
//! correlation `R = (1 + a) e^{-a}`, `a = sqrt(3) |ln(omega/omega')|/L`; L is an octave (M. C. Kennedy and A. O'Hagan,
//! *J. Royal Statistical Society B* 63 (2001) 425-464). This Matern process is differentiable once but not twice; the
//! slope is needed for the error of the crossover.
//!
//! **Variance.** Let `H_j` be the lines with variance v_j and `N = diag(v_j/(2 |Y_j Z_j|^2))`, G the slopes
//! `d ln Y_j/dx`, and C the covariance of the fit at the lines. Then, with the sum over the real and imaginary parts,
//!
//! `E chi^2 = nu + s^2 (tr N^-1 R - tr C M)`,  `M = sum G' N^-1 R N^-1 G`
//!
//! and s^2 follows from the chi^2 of the fit at the lines, at least zero (R. DerSimonian and N. Laird, *Controlled
//! Clinical Trials* 7 (1986) 177-188). If the form fits, s^2 is zero or small.
//!
//! **Deviation.** With `d_j = H_j/(Y_j Z_j) - 1` for the final estimate of Y and `k_j = s^2 R(omega, omega_j)`,
//!
//! `delta = k' (s^2 R + N)^-1 d`,  `var delta = s^2 - k' (s^2 R + N)^-1 k`
//!
//! in each part: at a line that is accurately known the response is that of the line; far from all lines it is that of
//! the form, with an additional variance s^2. The same deviation shifts the coordinates of the form by
//! `C G' N^-1 delta`. This variance, `s^2 C M C`, is added to the errors of the parameters.

use hoid_model::{Complex64, FamilyOperator, SampleTime};
use nalgebra::{DMatrix, DVector};

use super::{intersample::Intersample, response_fit::MeasuredResponse};

/// Length L over which deviations are correlated, in ln omega.
const CORRELATION_LENGTH: f64 = std::f64::consts::LN_2;

/// Variance of the deviation, and its effect on the coordinates.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Misfit {
    /// Variance s^2 of each part of delta, greater than zero.
    pub variance: f64,
    /// Variance of each coordinate of the operator due to delta.
    pub(super) of_coordinates: Vec<f64>,
}

/// The deviation of the response, given the lines.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ResponseDeviation {
    variance: f64,
    ln_omega: Vec<f64>,
    /// Real and imaginary parts of `(s^2 R + N)^-1 d`.
    weights: Vec<[f64; 2]>,
    /// `(s^2 R + N)^-1` by rows.
    precision: Vec<f64>,
}

/// Sample time, and the behaviour of the error between samples.
type Sampling = (SampleTime, Intersample);

fn hold((sample_time, intersample): Sampling, omega_rad_s: f64) -> Complex64 {
    intersample.response(omega_rad_s, sample_time)
}

fn correlation(ln_omega: f64, other: f64) -> f64 {
    let a = 3.0_f64.sqrt() * (ln_omega - other).abs() / CORRELATION_LENGTH;
    (1.0 + a) * (-a).exp()
}

fn ln_frequencies(points: &[MeasuredResponse]) -> Vec<f64> {
    points.iter().map(|point| point.omega_rad_s.ln()).collect()
}

/// Returns the variance of the real and of the imaginary part of a line, relative to a response.
fn relative_variance(point: &MeasuredResponse, sampled: Complex64) -> f64 {
    point.variance / (2.0 * sampled.norm_sqr())
}

impl Misfit {
    /// Returns the variance of the deviation from a fit at the lines with its chi^2, degrees of freedom and covariance
    /// of the coordinates; `None` if the form fits within the errors of the lines.
    pub(super) fn of(
        points: &[MeasuredResponse],
        operator: &FamilyOperator,
        sampling: Sampling,
        (chi_squared, degrees_of_freedom): (f64, usize),
        covariance: &[f64],
    ) -> Option<Self> {
        let excess = chi_squared - degrees_of_freedom as f64;
        if degrees_of_freedom == 0 || excess.is_nan() || excess <= 0.0 {
            return None;
        }
        let (n, p) = (points.len(), operator.coordinates().len());
        let ln_omega = ln_frequencies(points);
        let whitened_slopes: Vec<(f64, Vec<Complex64>)> = (points.iter())
            .map(|point| {
                let found = operator.response_and_gradient(point.omega_rad_s);
                let sampled = found.value * hold(sampling, point.omega_rad_s);
                let precision = 1.0 / relative_variance(point, sampled);
                let slopes = found.gradient.iter().map(|g| g / found.value * precision);
                (precision, slopes.collect())
            })
            .collect();
        let r = DMatrix::from_fn(n, n, |i, j| correlation(ln_omega[i], ln_omega[j]));
        let parts: [fn(Complex64) -> f64; 2] = [|z| z.re, |z| z.im];
        let m = parts.into_iter().fold(DMatrix::zeros(p, p), |sum, part| {
            let g = DMatrix::from_fn(n, p, |i, k| part(whitened_slopes[i].1[k]));
            sum + g.transpose() * &r * g
        });
        let c = DMatrix::from_row_slice(p, p, covariance);
        let (c_m, total) = (
            &c * m,
            2.0 * whitened_slopes.iter().map(|(precision, _)| precision).sum::<f64>(),
        );
        let variance = excess / (total - c_m.trace());
        (variance.is_finite() && variance > 0.0).then(|| Self {
            variance,
            of_coordinates: (c_m * c).diagonal().iter().map(|v| variance * v.max(0.0)).collect(),
        })
    }

    /// Returns the deviation of the lines from the estimate of an operator; `None` if a response is not finite.
    pub(super) fn deviation(
        &self,
        points: &[MeasuredResponse],
        operator: &FamilyOperator,
        sampling: Sampling,
    ) -> Option<ResponseDeviation> {
        let (n, ln_omega) = (points.len(), ln_frequencies(points));
        let sampled: Vec<Complex64> = (points.iter())
            .map(|point| operator.response(point.omega_rad_s) * hold(sampling, point.omega_rad_s))
            .collect();
        let whole = DMatrix::from_fn(n, n, |i, j| {
            let own = if i == j {
                relative_variance(&points[i], sampled[i])
            } else {
                0.0
            };
            self.variance * correlation(ln_omega[i], ln_omega[j]) + own
        });
        let precision = whole.cholesky()?.inverse();
        let d = |part: fn(Complex64) -> f64| {
            &precision * DVector::from_fn(n, |i, _| part(points[i].response / sampled[i] - 1.0))
        };
        let (re, im) = (d(|z| z.re), d(|z| z.im));
        let weights: Vec<[f64; 2]> = (0..n).map(|i| [re[i], im[i]]).collect();
        let is_finite = weights.iter().flatten().all(|w| w.is_finite());
        is_finite.then(|| ResponseDeviation {
            variance: self.variance,
            ln_omega,
            weights,
            precision: precision.iter().copied().collect(),
        })
    }
}

impl ResponseDeviation {
    /// Returns the standard deviation s of each part of delta.
    pub fn size(&self) -> f64 {
        self.variance.sqrt()
    }

    /// Returns delta at a frequency, and the variance of each of its parts.
    pub fn at(&self, omega_rad_s: f64) -> (Complex64, f64) {
        let n = self.ln_omega.len();
        let k: Vec<f64> = (self.ln_omega.iter())
            .map(|own| self.variance * correlation(*own, omega_rad_s.ln()))
            .collect();
        let part = |part: usize| k.iter().zip(&self.weights).map(|(k, w)| k * w[part]).sum::<f64>();
        let known: f64 = (0..n)
            .map(|i| k[i] * (0..n).map(|j| self.precision[i * n + j] * k[j]).sum::<f64>())
            .sum();
        (
            Complex64::new(part(0), part(1)),
            (self.variance - known).clamp(0.0, self.variance),
        )
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::{Form, SampleTime};

    use super::*;
    use crate::{
        SearchOptions,
        family::{
            intersample::Intersample, prior::OperatorPrior, response_fit::ResponseCriterion,
            simulated_operator::Uniform,
        },
    };

    const SAMPLING: Sampling = (SampleTime::AT_100_HZ, Intersample::Auto);
    const OMEGA: [f64; 10] = [0.23, 0.38, 0.61, 1.0, 1.69, 2.61, 4.07, 6.6, 10.7, 17.6];
    const ERROR: f64 = 0.06;

    fn truth() -> FamilyOperator {
        FamilyOperator::new(Form::Lead, true, &[0.1, 0.4, 2.35, -1.2, 0.25]).unwrap()
    }

    /// Lines of a person with a given deviation and errors of 6 % in each part.
    fn lines(deviation: impl Fn(f64) -> Complex64, seed: u64) -> Vec<MeasuredResponse> {
        let mut numbers = Uniform(seed);
        let mut line = |&omega_rad_s: &f64| {
            let exact = truth().response(omega_rad_s) * hold(SAMPLING, omega_rad_s);
            let error = Complex64::new(numbers.normal(), numbers.normal()) * ERROR;
            MeasuredResponse {
                omega_rad_s,
                response: exact * (deviation(omega_rad_s) + 1.0 + error),
                variance: 2.0 * ERROR * ERROR * exact.norm_sqr(),
            }
        };
        OMEGA.iter().map(&mut line).collect()
    }

    fn fitted(points: &[MeasuredResponse]) -> (FamilyOperator, Option<Misfit>) {
        let criterion = ResponseCriterion::new(Form::Lead, true, points, &OperatorPrior::none(), (0.02, 0.8), SAMPLING);
        let found = criterion.fit(&SearchOptions::default()).unwrap();
        let operator = FamilyOperator::new(Form::Lead, true, &found.coordinates).unwrap();
        let covariance = criterion.covariance(&found).unwrap();
        let misfit = Misfit::of(points, &operator, SAMPLING, (found.chi_squared, 15), &covariance);
        (operator, misfit)
    }

    #[test]
    fn deviation_of_a_known_size_is_found_and_covered() {
        // The deviation is a slow wave in ln omega with an amplitude of 20 %.
        let wave = |omega: f64| Complex64::from_polar(0.2, 2.2 * omega.ln());
        let (mut variances, mut squares, mut plain) = (0.0, 0.0, 0.0);
        let people = 40;
        for seed in 0..people {
            let points = lines(wave, seed);
            let (operator, misfit) = fitted(&points);
            let misfit = misfit.unwrap();
            variances += misfit.variance / people as f64;
            let deviation = misfit.deviation(&points, &operator, SAMPLING).unwrap();
            for omega in [0.8, 1.3, 2.0, 3.3] {
                let ratio = truth().response(omega) * (wave(omega) + 1.0) / operator.response(omega);
                let (delta, variance) = deviation.at(omega);
                let off = ratio - (delta + 1.0);
                let n = (8 * people) as f64;
                squares += off.norm_sqr() / (variance * n);
                plain += (ratio - 1.0).norm_sqr() / (ERROR * ERROR * n);
            }
        }
        // The variance is 0.02 in each part; the form absorbs some of it.
        assert!((0.008..0.04).contains(&variances), "{variances}");
        // These are mean squares in units of the variances: the form alone is far off, and with its deviation the
        // errors are covered.
        assert!(plain > 4.0 && (0.3..1.3).contains(&squares), "{plain} {squares}");
    }

    #[test]
    fn form_that_fits_has_a_small_deviation() {
        let people = 60;
        let all: Vec<f64> = (0..people)
            .map(|seed| {
                fitted(&lines(|_| Complex64::new(0.0, 0.0), seed))
                    .1
                    .map_or(0.0, |m| m.variance)
            })
            .collect();
        let none = all.iter().filter(|v| **v == 0.0).count();
        let mean = all.iter().sum::<f64>() / people as f64;
        assert!((20..=45).contains(&none) && mean < 0.4 * ERROR * ERROR, "{none} {mean}");
    }

    #[test]
    fn deviation_follows_well_known_lines_and_vanishes_far_from_them() {
        let points = lines(|omega| Complex64::new(if omega > 2.0 { 0.3 } else { 0.0 }, 0.1), 3);
        let exact: Vec<MeasuredResponse> = (points.iter())
            .map(|p| MeasuredResponse {
                variance: 1e-6 * p.variance,
                ..*p
            })
            .collect();
        let misfit = Misfit {
            variance: 0.05,
            of_coordinates: Vec::new(),
        };
        let deviation = misfit.deviation(&exact, &truth(), SAMPLING).unwrap();
        for point in &exact {
            let (delta, variance) = deviation.at(point.omega_rad_s);
            let expected =
                point.response / (truth().response(point.omega_rad_s) * hold(SAMPLING, point.omega_rad_s)) - 1.0;
            assert!(
                (delta - expected).norm() < 1e-4 && variance < 1e-6,
                "{delta} {expected} {variance}"
            );
        }
        let (delta, variance) = deviation.at(2000.0);
        assert!(delta.norm() < 1e-2 && (variance / 0.05 - 1.0).abs() < 1e-2);
    }
}
