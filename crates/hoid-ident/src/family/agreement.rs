//! Agreement of estimation methods that use different statistics.
//!
//! The prediction error fit uses every sample and needs a noise model. The fit at the lines uses only the excited
//! frequencies and needs no noise model. Refined instrumental variables use, at every sample, the part of e that
//! follows the excitation. For each pair of methods, the difference d of the coordinates that the data determine is
//! compared with its covariance V: `T = d' V^-1 d`.
//!
//! **V**, the covariance assumed for d, is the sum of three terms:
//!
//! 1. and 2. The covariances of the two methods, each from all residuals (times kappa) or from all lines together. A
//!    jackknife over n runs has a rank of at most n - 1: with five runs and four coordinates, chance gives a very small
//!    variance in some direction (H. Hotelling, *Annals of Mathematical Statistics* 2 (1931) 360-378). Both methods use
//!    the same records, so their errors are correlated: the sum of the covariances overestimates the covariance of d,
//!    and false alarms are rarer than the significance level.
//! 3. The squared bias of the prediction error fit, in the pairs that contain it. In a closed loop this fit is biased
//!    if its noise model is wrong, and the scatter between runs does not show the bias. The squared bias is estimated
//!    as `sum d_k d_k'` over the differences d_k from fits with other noise models ([`super::sensitivity`]). It is
//!    included in the reported errors, and is therefore no evidence against the result.
//!
//! **Compared coordinates** are the gain and those coordinates that the data determine, if their prior share is at most
//! a quarter both in the fit at the lines and with instrumental variables. A resonance above the lines, for example,
//! may be determined by the prior in one method and by the data in another.
//!
//! The gain is compared as `ln |Y|` in the middle of the band of manual control. Gain and lead time, or gain and lag,
//! can compensate each other along a curve such as K T_L = constant, so two distant points on this curve may be
//! equivalent. A linear test of the gain itself would report a difference between them.
//!
//! T has a chi-square distribution with as many degrees of freedom as there are compared coordinates. For several pairs
//! the smallest p-value is multiplied by the number of pairs (Bonferroni): at a level of 1 %, a disagreement is
//! reported for at most one in a hundred people whose operator has this form.

use hoid_model::{FamilyOperator, operator_family::Coordinate};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::linalg::{least_squares::solve_symmetric, vectors::dot};

/// Method in a comparison of estimation methods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum AgreementMethod {
    /// Prediction error method, over all samples.
    PredictionError,
    /// Fit at the lines of the excitation.
    Lines,
    /// Refined instrumental variables.
    Instrumental,
}

impl AgreementMethod {
    /// Returns the name of the method for use in a sentence.
    pub fn phrase(self) -> &'static str {
        match self {
            Self::PredictionError => "the prediction error fit",
            Self::Lines => "the fit at the lines",
            Self::Instrumental => "RIV-BJ",
        }
    }

    /// Returns the name of the method as a key.
    pub fn name(self) -> &'static str {
        match self {
            Self::PredictionError => "prediction_error",
            Self::Lines => "lines",
            Self::Instrumental => "riv_bj",
        }
    }
}

/// Comparison of the estimates by several methods.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Agreement {
    /// Compared coordinates, each with its estimates by all methods.
    pub rows: Vec<AgreementRow>,
    /// Tests of all pairs of methods.
    pub pairs: Vec<AgreementPair>,
    /// Statistic T of the pair with the least agreement.
    pub statistic: f64,
    /// p-value of the pair with the least agreement, times the number of pairs, limited to one: an upper bound on the
    /// probability of such a disagreement if all methods are unbiased.
    pub p_value: f64,
}

/// Estimates of one coordinate by all methods.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct AgreementRow {
    /// The coordinate.
    pub coordinate: Coordinate,
    /// Value and standard error of each method.
    pub values: Vec<(AgreementMethod, (f64, f64))>,
    /// Difference between the methods of the first pair, in standard errors of the difference.
    pub difference_in_errors: f64,
}

impl AgreementRow {
    /// Returns the value and the standard error of the estimate by a method; `None` if the method has no estimate.
    pub fn of(&self, method: AgreementMethod) -> Option<(f64, f64)> {
        self.values.iter().find(|(m, _)| *m == method).map(|(_, v)| *v)
    }
}

/// Comparison of two methods.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct AgreementPair {
    /// The two methods.
    pub methods: (AgreementMethod, AgreementMethod),
    /// The statistic `T = d' V^-1 d`.
    pub statistic: f64,
    /// Probability of a statistic at least as large if both methods are unbiased.
    pub p_value: f64,
    /// The coordinate with the largest difference, and this difference in standard errors of the difference.
    pub most: (Coordinate, f64),
}

impl Agreement {
    /// Returns the pair with the least agreement.
    pub fn worst_pair(&self) -> Option<&AgreementPair> {
        self.pairs.iter().min_by(|a, b| a.p_value.total_cmp(&b.p_value))
    }
}

/// Estimate by one method.
#[derive(Debug, Clone)]
pub(super) struct MethodEstimate {
    pub method: AgreementMethod,
    /// Estimated coordinates; the first one is the level `ln |Y|` in place of the gain.
    pub coordinates: Vec<f64>,
    /// Covariance of these coordinates by rows, from all residuals or all lines.
    pub covariance: Vec<f64>,
    /// Coordinates with their reported standard errors; the first one is the gain itself.
    pub reported: Vec<(f64, f64)>,
}

impl MethodEstimate {
    /// Creates the estimate from an operator, the covariance for the test, and the reported covariance.
    pub fn of(method: AgreementMethod, operator: &FamilyOperator, covariance: &[f64], reported: &[f64]) -> Self {
        let p = operator.coordinates().len();
        let gradient = log_gain(operator).1;
        // The covariance is transformed by a matrix whose first row is the gradient of the level; the other rows are
        // rows of the identity matrix.
        let times = |c: &[f64], i: usize, j: usize| -> f64 {
            match i {
                0 => (0..p).map(|k| gradient[k] * c[k * p + j]).sum(),
                _ => c[i * p + j],
            }
        };
        let once: Vec<f64> = (0..p * p).map(|at| times(covariance, at / p, at % p)).collect();
        let turned: Vec<f64> = (0..p * p).map(|at| once[(at % p) * p + at / p]).collect();
        Self {
            method,
            coordinates: coordinates_with_log_gain(operator),
            covariance: (0..p * p).map(|at| times(&turned, at / p, at % p)).collect(),
            reported: (operator.coordinates().iter().enumerate())
                .map(|(i, x)| (*x, reported[i * p + i].max(0.0).sqrt()))
                .collect(),
        }
    }
}

/// Frequency at which the gain is compared, rad/s: the middle of the band of manual control.
const COMPARISON_FREQUENCY_RAD_S: f64 = 2.4;

/// Returns `ln |Y|` at [`COMPARISON_FREQUENCY_RAD_S`] and its gradient with respect to the coordinates.
fn log_gain(operator: &FamilyOperator) -> (f64, Vec<f64>) {
    let response = operator.response_and_gradient(COMPARISON_FREQUENCY_RAD_S);
    let gradient = response.gradient.iter().map(|g| (g / response.value).re);
    (response.value.norm().ln(), gradient.collect())
}

/// Returns the coordinates with the level `ln |Y|` in place of the gain, which is the first coordinate of every form.
pub(super) fn coordinates_with_log_gain(operator: &FamilyOperator) -> Vec<f64> {
    let mut x = operator.coordinates().to_vec();
    x[0] = log_gain(operator).0;
    x
}

/// Tests the agreement of all pairs of methods in the coordinates for which `counts` is true. `bias` is the squared
/// bias of the prediction error fit, as a matrix by rows. `None` if no coordinate counts, or if there are fewer than
/// two methods.
pub(super) fn agreement(
    all: &[Coordinate],
    sides: &[MethodEstimate],
    bias: &[f64],
    counts: impl Fn(usize) -> bool,
) -> Option<Agreement> {
    let p = all.len();
    let used: Vec<usize> = (0..p)
        .filter(|&i| counts(i) && sides.iter().all(|s| s.covariance[i * p + i] > 0.0))
        .collect();
    let pairs: Vec<(AgreementPair, Vec<f64>)> = (0..sides.len())
        .flat_map(|i| (i + 1..sides.len()).map(move |j| (i, j)))
        .filter_map(|(i, j)| compare_pair(all, &used, (&sides[i], &sides[j]), bias))
        .collect();
    let (first, in_errors) = pairs.first()?;
    let least = (pairs.iter()).fold(
        first,
        |least, (pair, _)| if pair.p_value < least.p_value { pair } else { least },
    );
    let row = |(k, &i): (usize, &usize)| AgreementRow {
        coordinate: all[i],
        values: (sides.iter()).map(|s| (s.method, s.reported[i])).collect(),
        difference_in_errors: in_errors[k],
    };
    Some(Agreement {
        statistic: least.statistic,
        p_value: (least.p_value * pairs.len() as f64).min(1.0),
        rows: used.iter().enumerate().map(row).collect(),
        pairs: pairs.iter().map(|(pair, _)| pair.clone()).collect(),
    })
}

/// Tests the agreement of two methods in the coordinates with the indices `used`. Also returns the difference of each
/// of these coordinates, in standard errors of the difference.
fn compare_pair(
    all: &[Coordinate],
    used: &[usize],
    (one, other): (&MethodEstimate, &MethodEstimate),
    bias: &[f64],
) -> Option<(AgreementPair, Vec<f64>)> {
    let (p, q) = (all.len(), used.len());
    if q == 0 {
        return None;
    }
    let part = |c: &dyn Fn(usize) -> f64| -> Vec<f64> {
        used.iter()
            .flat_map(|&i| used.iter().map(move |&j| i * p + j))
            .map(c)
            .collect()
    };
    let biased = [one.method, other.method].contains(&AgreementMethod::PredictionError);
    let covariance = part(&|at| one.covariance[at] + other.covariance[at] + if biased { bias[at] } else { 0.0 });
    let difference: Vec<f64> = used
        .iter()
        .map(|&i| one.coordinates[i] - other.coordinates[i])
        .collect();
    let statistic = dot(&difference, &solve_symmetric(&covariance, &difference)?);
    let p_value = ChiSquared::new(q as f64).ok()?.sf(statistic);
    let in_errors: Vec<f64> = (0..q).map(|k| difference[k] / covariance[k * q + k].sqrt()).collect();
    let most = (0..q).max_by(|&a, &b| in_errors[a].abs().total_cmp(&in_errors[b].abs()))?;
    let found = AgreementPair {
        methods: (one.method, other.method),
        statistic,
        p_value,
        most: (all[used[most]], in_errors[most]),
    };
    p_value.is_finite().then_some((found, in_errors))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hoid_model::Form;

    fn estimate(method: AgreementMethod, x: &[f64], variance: f64) -> MethodEstimate {
        let p = x.len();
        let mut covariance = vec![0.0; p * p];
        (0..p).for_each(|i| covariance[i * (p + 1)] = variance);
        MethodEstimate {
            method,
            coordinates: x.to_vec(),
            reported: x.iter().map(|x| (*x, variance.sqrt())).collect(),
            covariance,
        }
    }

    const OPERATOR: [f64; 6] = [5.0, 0.6, 0.1, 2.4, -1.2, 0.15];

    #[test]
    fn equal_estimates_agree_and_distant_ones_do_not() {
        let all = Form::LeadLag.coordinates(true);
        let mut there = OPERATOR;
        let test = |there: &[f64]| {
            let sides = [
                estimate(AgreementMethod::PredictionError, &OPERATOR, 0.01),
                estimate(AgreementMethod::Lines, there, 0.01),
            ];
            agreement(&all, &sides, &[0.0; 36], |i| i < 3).unwrap()
        };
        assert_eq!(test(&there).p_value, 1.0);
        there[1] += 0.1 * 2f64.sqrt() * 4.0;
        there[5] += 99.0;
        let apart = test(&there);
        assert!((apart.statistic - 16.0).abs() < 1e-9 && apart.p_value < 0.002 && apart.rows.len() == 3);
        assert!((apart.rows[1].difference_in_errors + 4.0).abs() < 1e-9);
        assert_eq!(apart.worst_pair().unwrap().most.0, Coordinate::Lead);
        assert_eq!(apart.rows[1].of(AgreementMethod::Lines).unwrap().0, there[1]);
        assert_eq!(apart.rows[1].of(AgreementMethod::Instrumental), None);
        let one = [estimate(AgreementMethod::Lines, &OPERATOR, 0.01)];
        assert!(agreement(&all, &one, &[0.0; 36], |_| true).is_none());
        let two = [one[0].clone(), estimate(AgreementMethod::Instrumental, &there, 0.01)];
        assert!(agreement(&all, &two, &[0.0; 36], |_| false).is_none());
        // A zero variance means that the coordinate is at a bound.
        let held = [one[0].clone(), estimate(AgreementMethod::Instrumental, &there, 0.0)];
        assert!(agreement(&all, &held, &[0.0; 36], |_| true).is_none());
    }

    #[test]
    fn estimate_covariance_matches_finite_differences() {
        let operator = |x: &[f64]| FamilyOperator::new(Form::LeadLag, true, x).unwrap();
        // The covariance is a sum over three directions; the third is the gain alone.
        let directions = [
            [0.2, 0.05, 0.01, 0.1, 0.0, 0.004],
            [0.0, -0.08, 0.03, 0.0, 0.2, 0.01],
            [0.3, 0.0, 0.0, 0.0, 0.0, 0.0],
        ];
        let outer = |steps: &[Vec<f64>]| -> Vec<f64> {
            (0..36)
                .map(|at| steps.iter().map(|d| d[at / 6] * d[at % 6]).sum())
                .collect()
        };
        let covariance = outer(&directions.map(|d| d.to_vec()));
        let method = AgreementMethod::Lines;
        let side = MethodEstimate::of(method, &operator(&OPERATOR), &covariance, &covariance);
        let moved = directions.map(|d| {
            let at = |by: f64| {
                let x: Vec<f64> = OPERATOR.iter().zip(d).map(|(x, d)| x + by * d).collect();
                coordinates_with_log_gain(&operator(&x))
            };
            let (up, down) = (at(1e-4), at(-1e-4));
            up.iter().zip(down).map(|(a, b)| (a - b) / 2e-4).collect()
        });
        for (a, b) in side.covariance.iter().zip(outer(&moved)) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
        assert_eq!(side.reported[0].0, OPERATOR[0]);
        assert!((side.reported[0].1 - 0.13_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn bias_applies_only_to_the_prediction_error_fit() {
        let all = Form::LeadLag.coordinates(true);
        let mut there = OPERATOR;
        there[0] += 1.0;
        let sides = [
            estimate(AgreementMethod::PredictionError, &OPERATOR, 0.01),
            estimate(AgreementMethod::Lines, &there, 0.01),
            estimate(AgreementMethod::Instrumental, &there, 0.02),
        ];
        let mut bias = [0.0; 36];
        bias[0] = 1.0;
        let found = agreement(&all, &sides, &bias, |i| i == 0).unwrap();
        let statistics: Vec<f64> = found.pairs.iter().map(|p| p.statistic).collect();
        for (statistic, expected) in statistics.iter().zip([1.0 / 1.02, 1.0 / 1.03, 0.0]) {
            assert!((statistic - expected).abs() < 1e-12, "{statistics:?}");
        }
        // There are three pairs, so the smallest p-value is multiplied by three.
        let least = found.worst_pair().unwrap();
        assert!((found.p_value - (3.0 * least.p_value).min(1.0)).abs() < 1e-15);
        let without = agreement(&all, &sides, &[0.0; 36], |i| i == 0).unwrap();
        assert!(without.p_value < 1e-6 && without.worst_pair().unwrap().methods.1 == AgreementMethod::Lines);
    }

    #[test]
    fn agreement_test_has_nominal_size() {
        // The differences of three coordinates are independent and nearly normal: sums of twelve deviates from a linear
        // congruential generator (D. E. Knuth, MMIX).
        let mut state = 11_u64;
        let mut normal = || {
            let mut sum = -6.0;
            for _ in 0..12 {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
            }
            sum
        };
        let all = Form::LeadLag.coordinates(true);
        let mut doubted = 0;
        for _ in 0..4000 {
            let mut sides = [
                estimate(AgreementMethod::PredictionError, &OPERATOR, 0.01),
                estimate(AgreementMethod::Lines, &OPERATOR, 0.04),
            ];
            for (side, s) in sides.iter_mut().zip([0.1, 0.2]) {
                side.coordinates.iter_mut().for_each(|x| *x += s * normal());
            }
            let found = agreement(&all, &sides, &[0.0; 36], |i| i < 3).unwrap();
            doubted += usize::from(found.p_value < 0.01);
        }
        // The expected number is 40 of 4000, with a standard error of 6.3; sums of twelve uniform deviates have thinner
        // tails.
        assert!((20..=60).contains(&doubted), "{doubted}");
    }
}
