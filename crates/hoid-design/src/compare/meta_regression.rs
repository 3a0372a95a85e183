//! Meta-regression: regression of estimates with standard errors, one per person, on properties in which people differ.
//!
//! The model is `y_i = x_i' beta + u_i + e_i` with `u_i ~ N(0, tau^2)` between people and `e_i ~ N(0, v_i)` within
//! people, where `v_i` is the squared standard error. With `w_i = 1/(v_i + tau^2)`, `W = diag(w)` and
//! `P = W - W X (X'W X)^-1 X'W`:
//!
//! - **tau^2** maximises the restricted likelihood (REML; D. A. Harville, *J. Am. Stat. Assoc.* 72 (1977) 320-338)
//!   `l = -1/2 sum log(v_i + tau^2) - 1/2 log |X'W X| - 1/2 y'P y`, whose slope is `1/2 (y'P P y - tr P)`. The search
//!   takes the best point of a grid and then the adjacent zero of the slope, since l may have two maxima if the errors
//!   differ much.
//! - **The weights** use the tau^2 that maximises `l + log tau^2`, which is never zero (following Y. Chung, S.
//!   Rabe-Hesketh and I.-H. Choi, *Stat. Med.* 32 (2013) 4071-4089, who add `log tau`). With few people l often has its
//!   maximum at zero by chance, and the person with the smallest error would then dominate. For three people whose
//!   errors are .1, .3 and .5 and who differ by .4, the intervals cover the true difference in 87 % of cases with the
//!   weights from l, and in 95 % with these weights (`tests/coverage.rs`, which also has other numbers of people and
//!   other values of tau). With one or two degrees of freedom all weights are equal, so that two or three people give a
//!   t test.
//! - **beta** is `(X'W X)^-1 X'W y`, with the covariance `s^2 (X'W X)^-1`, `s^2 = y'P y/(n - p)`, and Student's
//!   interval with n - p degrees of freedom (J. Hartung and G. Knapp, *Stat. Med.* 20 (2001) 3875-3889; for regression,
//!   G. Knapp and J. Hartung, *Stat. Med.* 22 (2003) 2693-2710). If all errors are equal and X is a column of ones,
//!   this is the one-sample t test for any tau^2. s^2 is not limited to one or more, since this limit would make the
//!   intervals for few people too wide.
//! - **Q** is `y'P y` at tau^2 = 0, which is chi-squared with n - p degrees of freedom if all people are the same, and
//!   `I^2 = tau^2/(tau^2 + v)` with the typical variance `v = (n - p)/tr P`, where P is evaluated at tau^2 = 0 (J. P.
//!   T. Higgins and S. G. Thompson, *Stat. Med.* 21 (2002) 1539-1558).
//!
//! If the standard errors are not known, all `v_i` are zero, tau^2 is the sample variance, and Q is missing.

use hoid_model::named_choice;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

use super::CompareError;

/// The estimate for one person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// Value of the estimate.
    pub value: f64,
    /// Squared standard error of the value; zero if it is not known.
    pub variance: f64,
}

/// Choice of the tau^2 from which the weights are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Weights {
    /// tau^2 at the maximum of the penalised likelihood, which is never zero.
    #[default]
    Penalised,
    /// tau^2 at the maximum of the restricted likelihood.
    Restricted,
}

named_choice!(Weights, "choice of weights", 2, {
    Penalised => "penalised",
    Restricted => "reml",
});

/// A coefficient with its standard error, test and confidence interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Coefficient {
    /// Value of the coefficient.
    pub value: f64,
    /// Standard error of the coefficient.
    pub standard_error: f64,
    /// `value/standard_error`.
    pub t: f64,
    /// Two-sided p-value from Student's t distribution.
    pub p: f64,
    /// The 95 % confidence interval.
    pub interval: (f64, f64),
}

/// Result of a meta-regression.
#[derive(Debug, Clone, PartialEq)]
pub struct MetaRegression {
    /// Coefficients, in the order of the columns of X.
    pub coefficients: Vec<Coefficient>,
    /// Variance between people, by restricted maximum likelihood (REML).
    pub tau_squared: f64,
    /// The tau^2 from which the weights are computed.
    pub tau_squared_of_weights: f64,
    /// Degrees of freedom n - p.
    pub degrees_of_freedom: usize,
    /// Share of tau^2 in the total variance of a typical estimate.
    pub i_squared: Option<f64>,
    /// Heterogeneity Q, and its p-value under the hypothesis that all people are equal.
    pub heterogeneity: Option<(f64, f64)>,
    /// Covariance of the coefficients, `s^2 (X'W X)^-1`.
    pub covariance: DMatrix<f64>,
}

/// Computes the mean over people, which is the regression on a column of ones.
///
/// # Errors
/// As [`meta_regression`].
pub fn meta_mean(observations: &[Observation], weights: Weights) -> Result<MetaRegression, CompareError> {
    meta_regression(observations, &vec![vec![1.0]; observations.len()], weights)
}

/// Computes the regression; `x` contains the rows of X.
///
/// # Errors
/// [`CompareError::TooFew`] if there are not more observations than columns, [`CompareError::NotFinite`],
/// [`CompareError::Collinear`], [`CompareError::NoScatter`] if all values are equal.
pub fn meta_regression(
    observations: &[Observation],
    x: &[Vec<f64>],
    weights: Weights,
) -> Result<MetaRegression, CompareError> {
    let (model, scatter, known) = checked_model(observations, x)?;
    let (n, p) = model.x.shape();
    let search = |penalty: f64| match known {
        true => model.tau_squared(scatter, penalty).ok_or(CompareError::Collinear),
        false => Ok(scatter),
    };
    let tau_squared = search(0.0)?;
    let tau_squared_of_weights = match weights {
        Weights::Penalised => search(1.0)?,
        Weights::Restricted => tau_squared,
    };
    let at = model.at(tau_squared_of_weights).ok_or(CompareError::Collinear)?;
    let dof = n - p;
    let covariance = &at.inverse * (at.q / dof as f64);
    let coefficients = (0..p)
        .map(|j| Coefficient::of(at.beta[j], covariance[(j, j)].sqrt(), dof))
        .collect();
    let fixed = if known { model.at(0.0) } else { None };
    Ok(MetaRegression {
        coefficients,
        tau_squared,
        tau_squared_of_weights,
        degrees_of_freedom: dof,
        i_squared: fixed.as_ref().map(|at| {
            let typical = dof as f64 / at.trace;
            tau_squared / (tau_squared + typical)
        }),
        heterogeneity: fixed.map(|at| (at.q, chi_squared_upper_tail(at.q, dof))),
        covariance,
    })
}

/// Returns the variance between people at the maximum of `l + log tau`. It is never zero, and it overestimates the
/// variance less often than the tau^2 used for the weights.
///
/// # Errors
/// As [`meta_regression`].
pub fn variance_between_people(observations: &[Observation]) -> Result<f64, CompareError> {
    let (model, scatter, known) = checked_model(observations, &vec![vec![1.0]; observations.len()])?;
    match known {
        true => model.tau_squared(scatter, 0.5).ok_or(CompareError::Collinear),
        false => Ok(scatter),
    }
}

/// Returns the model, the residual variance of y with equal weights, and whether the standard errors are known.
fn checked_model(observations: &[Observation], x: &[Vec<f64>]) -> Result<(Model, f64, bool), CompareError> {
    let (n, p) = (observations.len(), x.first().map_or(1, Vec::len));
    if n <= p {
        return Err(CompareError::TooFew {
            found: n,
            expected: p + 1,
        });
    }
    let finite = |o: &Observation| o.value.is_finite() && o.variance.is_finite() && o.variance >= 0.0;
    if !observations.iter().all(finite) || !x.iter().flatten().all(|v| v.is_finite()) {
        return Err(CompareError::NotFinite);
    }
    let model = Model {
        x: DMatrix::from_fn(n, p, |i, j| x[i][j]),
        y: DVector::from_iterator(n, observations.iter().map(|o| o.value)),
        v: observations.iter().map(|o| o.variance).collect(),
    };
    let known = model.v.iter().all(|v| *v > 0.0);
    let scatter = model.scatter().ok_or(CompareError::Collinear)?;
    let size = model.y.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
    if scatter <= (8.0 * f64::EPSILON * size).powi(2) {
        return Err(CompareError::NoScatter);
    }
    Ok((model, scatter, known))
}

impl Coefficient {
    /// Creates a coefficient with its test and interval from Student's t distribution.
    pub(super) fn of(value: f64, standard_error: f64, dof: usize) -> Self {
        let t = value / standard_error;
        let reach = student_quantile(0.975, dof as f64) * standard_error;
        Self {
            value,
            standard_error,
            t,
            p: student_two_sided_p(t, dof as f64),
            interval: (value - reach, value + reach),
        }
    }
}

/// Returns a quantile of Student's t distribution; infinite for zero degrees of freedom.
pub(super) fn student_quantile(share: f64, dof: f64) -> f64 {
    StudentsT::new(0.0, 1.0, dof).map_or(f64::INFINITY, |d| d.inverse_cdf(share))
}

fn student_two_sided_p(t: f64, dof: f64) -> f64 {
    StudentsT::new(0.0, 1.0, dof).map_or(f64::NAN, |d| 2.0 * d.cdf(-t.abs()))
}

fn chi_squared_upper_tail(q: f64, dof: usize) -> f64 {
    ChiSquared::new(dof as f64).map_or(f64::NAN, |d| d.sf(q))
}

struct Model {
    x: DMatrix<f64>,
    y: DVector<f64>,
    v: Vec<f64>,
}

/// The model evaluated at one tau^2.
struct FitAtTau {
    beta: DVector<f64>,
    /// `(X'W X)^-1`.
    inverse: DMatrix<f64>,
    /// y'P y.
    q: f64,
    /// tr P.
    trace: f64,
    /// Restricted log-likelihood without constants.
    likelihood: f64,
    /// Derivative of the likelihood with respect to tau^2.
    slope: f64,
}

/// Range of the grid of tau^2, in decades relative to the scatter or the mean variance (whichever is larger), and the
/// number of steps per decade.
const DECADE_RANGE: (i32, i32) = (-8, 6);
const STEPS_PER_DECADE: i32 = 3;

impl Model {
    fn at(&self, tau_squared: f64) -> Option<FitAtTau> {
        let (n, p) = self.x.shape();
        let w: Vec<f64> = self.v.iter().map(|v| 1.0 / (v + tau_squared)).collect();
        let weighted = |power: i32| {
            DMatrix::from_fn(p, p, |a, b| {
                (0..n).map(|i| self.x[(i, a)] * w[i].powi(power) * self.x[(i, b)]).sum()
            })
        };
        let information: DMatrix<f64> = weighted(1);
        let factor = information.cholesky()?;
        let right = DVector::from_fn(p, |a, _| (0..n).map(|i| self.x[(i, a)] * w[i] * self.y[i]).sum());
        let beta = factor.solve(&right);
        let inverse = factor.inverse();
        let residuals = &self.y - &self.x * &beta;
        let q = (0..n).map(|i| w[i] * residuals[i] * residuals[i]).sum();
        let trace = w.iter().sum::<f64>() - (&inverse * weighted(2)).trace();
        let log_determinant: f64 = 2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        let squares: f64 = (0..n).map(|i| (w[i] * residuals[i]).powi(2)).sum();
        Some(FitAtTau {
            beta,
            q,
            trace,
            likelihood: 0.5 * (w.iter().map(|w| w.ln()).sum::<f64>() - log_determinant - q),
            slope: 0.5 * (squares - trace),
            inverse,
        })
    }

    /// Returns the residual variance of y with equal weights; `None` if X is singular.
    fn scatter(&self) -> Option<f64> {
        let (n, p) = self.x.shape();
        let information = self.x.transpose() * &self.x;
        // Because of rounding, a factorisation may succeed even if columns are multiples of each other.
        let scale = DVector::from_fn(p, |j, _| information[(j, j)].sqrt());
        if scale.iter().any(|s| *s == 0.0) {
            return None;
        }
        let correlation = DMatrix::from_fn(p, p, |a, b| information[(a, b)] / (scale[a] * scale[b]));
        let least = correlation.symmetric_eigenvalues().min();
        if least < 1e-10 {
            return None;
        }
        let beta = information.cholesky()?.solve(&(self.x.transpose() * &self.y));
        Some((&self.y - &self.x * beta).norm_squared() / (n - p) as f64)
    }

    /// Returns the tau^2 that maximises `l + penalty log tau^2`, if the standard errors are known.
    fn tau_squared(&self, scatter: f64, penalty: f64) -> Option<f64> {
        let unit = scatter.max(self.v.iter().sum::<f64>() / self.v.len() as f64);
        let steps = (DECADE_RANGE.0 * STEPS_PER_DECADE..=DECADE_RANGE.1 * STEPS_PER_DECADE)
            .map(|k| unit * 10f64.powf(f64::from(k) / f64::from(STEPS_PER_DECADE)));
        let zero = (penalty == 0.0).then_some(0.0);
        let grid: Vec<f64> = zero.into_iter().chain(steps).collect();
        let height = |tau: f64| Some(self.at(tau)?.likelihood + if penalty > 0.0 { penalty * tau.ln() } else { 0.0 });
        let slope = |tau: f64| Some(self.at(tau)?.slope + if penalty > 0.0 { penalty / tau } else { 0.0 });
        let heights: Vec<f64> = grid.iter().map(|tau| height(*tau)).collect::<Option<_>>()?;
        let best = (0..grid.len()).max_by(|a, b| heights[*a].total_cmp(&heights[*b]))?;
        let rises = slope(grid[best])? > 0.0;
        // A maximum at an end of the grid has a neighbour on one side only.
        if (best == 0 && !rises) || (best + 1 == grid.len() && rises) {
            return Some(grid[best]);
        }
        let (mut low, mut high) = if rises {
            (grid[best], grid[best + 1])
        } else {
            (grid[best - 1], grid[best])
        };
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if slope(middle)? > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(0.5 * (low + high))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::collections::BTreeMap;

    use super::*;

    /// Returns y, v and x of each case in fixtures/compare.
    fn cases() -> BTreeMap<&'static str, Vec<[f64; 3]>> {
        let mut all: BTreeMap<&str, Vec<[f64; 3]>> = BTreeMap::new();
        for line in include_str!("../../../../fixtures/compare/cases.csv").lines().skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            let number = |k: usize| cells[k].parse().unwrap();
            all.entry(cells[0]).or_default().push([number(1), number(2), number(3)]);
        }
        all
    }

    fn observations(case: &[[f64; 3]]) -> Vec<Observation> {
        let one = |[value, variance, _]: &[f64; 3]| Observation {
            value: *value,
            variance: *variance,
        };
        case.iter().map(one).collect()
    }

    #[test]
    fn results_match_metafor() {
        let cases = cases();
        let mut seen = 0;
        for line in include_str!("../../../../fixtures/compare/expected.csv")
            .lines()
            .skip(1)
        {
            let cells: Vec<&str> = line.split(',').collect();
            let (case, model, name) = (&cases[cells[0]], cells[1], cells[2]);
            let expected: f64 = cells[3].parse().unwrap();
            let row = |c: &[f64; 3]| if model == "x" { vec![1.0, c[2]] } else { vec![1.0] };
            let x: Vec<Vec<f64>> = case.iter().map(row).collect();
            let found = meta_regression(&observations(case), &x, Weights::Restricted).unwrap();
            let (word, k) = name.split_at(name.len() - 1);
            let of = |k: &str| found.coefficients[k.parse::<usize>().unwrap()];
            let value = match (name, word) {
                ("tau2", _) => found.tau_squared,
                ("I2", _) => 100.0 * found.i_squared.unwrap(),
                ("QE", _) => found.heterogeneity.unwrap().0,
                ("QEp", _) => found.heterogeneity.unwrap().1,
                (_, "b") => of(k).value,
                (_, "se") => of(k).standard_error,
                (_, "zval") => of(k).t,
                (_, "pval") => of(k).p,
                (_, "ci.lb") => of(k).interval.0,
                (_, "ci.ub") => of(k).interval.1,
                _ => panic!("{name}"),
            };
            // metafor stops its search at a step of 1e-12; the likelihood is so flat there that tau is accurate to only
            // about 1e-8.
            let tolerance = 1e-7 * expected.abs().max(1e-2);
            assert!(
                (value - expected).abs() < tolerance,
                "{} {model} {name}: {value} for {expected}",
                cells[0]
            );
            seen += 1;
        }
        assert_eq!(seen, 156);
    }

    #[test]
    fn equal_errors_give_the_t_test() {
        // R: t.test(c(.9, 1.4, .2, .7)): t = 3.2215, df = 3.
        let values = [0.9, 1.4, 0.2, 0.7];
        for variance in [0.0, 0.01, 4.0] {
            let all = values.map(|value| Observation { value, variance });
            let found = meta_mean(&all, Weights::default()).unwrap();
            let c = found.coefficients[0];
            assert!(
                (c.value - 0.8).abs() < 1e-12 && (c.t - 0.8 / (0.74_f64 / 12.0).sqrt()).abs() < 1e-9,
                "{c:?}"
            );
            assert_eq!(found.degrees_of_freedom, 3);
            let scatter = 0.74 / 3.0;
            assert!((found.tau_squared - (scatter - variance).max(0.0)).abs() < 1e-9);
            assert_eq!(found.heterogeneity.is_some(), variance > 0.0);
        }
    }

    #[test]
    fn slope_agrees_with_finite_differences() {
        let cases = cases();
        let case = &cases["six"];
        let model = Model {
            x: DMatrix::from_fn(6, 2, |i, j| if j == 0 { 1.0 } else { case[i][2] }),
            y: DVector::from_fn(6, |i, _| case[i][0]),
            v: case.iter().map(|c| c[1]).collect(),
        };
        for tau in [0.05, 0.3, 2.0] {
            let step = 1e-5 * tau;
            let difference =
                (model.at(tau + step).unwrap().likelihood - model.at(tau - step).unwrap().likelihood) / (2.0 * step);
            assert!((difference / model.at(tau).unwrap().slope - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn penalised_weights_are_not_dominated_by_one_person() {
        // l has its maximum at zero, where the second person has 20 to 25 times the weight of the others.
        let all = [(0.3, 0.25), (-0.2, 0.01), (-0.4, 0.25), (0.1, 0.2)];
        let all = all.map(|(value, variance)| Observation { value, variance });
        let [penalised, restricted] = [Weights::Penalised, Weights::Restricted].map(|w| meta_mean(&all, w).unwrap());
        assert_eq!((restricted.tau_squared_of_weights, penalised.tau_squared), (0.0, 0.0));
        assert!(penalised.tau_squared_of_weights > 0.01);
        assert!(penalised.coefficients[0].standard_error > restricted.coefficients[0].standard_error);
        // With one or two degrees of freedom, all weights are equal.
        for n in [2, 3] {
            let few = meta_mean(&all[..n], Weights::Penalised).unwrap();
            let mean = all[..n].iter().map(|o| o.value).sum::<f64>() / n as f64;
            assert!((few.coefficients[0].value - mean).abs() < 1e-5, "{n}");
        }
    }

    #[test]
    fn invalid_observations_are_refused() {
        let of = |values: &[f64], variance| -> Vec<Observation> {
            values
                .iter()
                .map(|value| Observation {
                    value: *value,
                    variance,
                })
                .collect()
        };
        let mean = |values: &[f64], variance| meta_mean(&of(values, variance), Weights::default());
        assert!(matches!(
            mean(&[1.0], 0.1),
            Err(CompareError::TooFew { found: 1, expected: 2 })
        ));
        assert!(matches!(
            mean(&[], 0.1),
            Err(CompareError::TooFew { found: 0, expected: 2 })
        ));
        assert!(matches!(mean(&[1.0, f64::NAN], 0.1), Err(CompareError::NotFinite)));
        assert!(matches!(mean(&[1.0, 2.0], -0.1), Err(CompareError::NotFinite)));
        assert!(matches!(mean(&[2.0, 2.0, 2.0], 0.0), Err(CompareError::NoScatter)));
        assert!(matches!(mean(&[2.0, 2.0, 2.0], 0.1), Err(CompareError::NoScatter)));
        let x = vec![vec![1.0, 2.0]; 4];
        assert!(matches!(
            meta_regression(&of(&[1.0, 2.0, 3.0, 5.0], 0.1), &x, Weights::default()),
            Err(CompareError::Collinear)
        ));
        let huge = mean(&[1e150, -1e150, 2e150], 1.0).unwrap();
        assert!(huge.coefficients[0].t.is_finite());
    }
}
