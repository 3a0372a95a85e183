//! Do methods agree that rest on different statistics?
//!
//! The prediction error fit uses every sample and needs a noise model; the fit at the lines uses the
//! excited frequencies alone and needs none. Both see the same records, so that they agree better
//! than two independent measurements: a difference is judged against `s_1^2 + s_2^2`, which is on
//! the safe side of a false alarm. Over the coordinates that the data determine,
//! `d' (P_1 + P_2)^-1 d` is chi-square at most.

use hoid_model::{Form, operator_family::Coordinate};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::linalg::least_squares::{dot, solve_symmetric};

/// Two methods side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Agreement {
    /// Coordinate, prediction error, lines, and the difference in combined standard errors.
    pub rows: Vec<AgreementRow>,
    /// `d' (P_1 + P_2)^-1 d` over the rows.
    pub statistic: f64,
    /// Probability of a statistic as large where both are right.
    pub p_value: f64,
}

/// One coordinate of both methods.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AgreementRow {
    /// The coordinate.
    pub coordinate: Coordinate,
    /// Value and standard error of the prediction error fit.
    pub prediction_error: (f64, f64),
    /// Value and standard error of the fit at the lines.
    pub lines: (f64, f64),
    /// Their difference in combined standard errors.
    pub difference_in_errors: f64,
}

/// Coordinates and their covariance.
pub(super) type Measured<'a> = (&'a [f64], &'a [f64]);

/// The test over the coordinates that count; `None` where there are none, or no errors.
pub(super) fn agreement(
    form: Form,
    neuromuscular: bool,
    one: Measured<'_>,
    other: Measured<'_>,
    counts: impl Fn(usize) -> bool,
) -> Option<Agreement> {
    let all = form.coordinates(neuromuscular);
    let p = all.len();
    let variance = |c: &[f64], i: usize| c[i * p + i];
    let used: Vec<usize> = (0..p)
        .filter(|&i| counts(i) && variance(one.1, i) > 0.0 && variance(other.1, i) > 0.0)
        .collect();
    let difference: Vec<f64> = used.iter().map(|&i| one.0[i] - other.0[i]).collect();
    let sum: Vec<f64> = used
        .iter()
        .flat_map(|&i| used.iter().map(move |&j| i * p + j))
        .map(|at| one.1[at] + other.1[at])
        .collect();
    if used.is_empty() {
        return None;
    }
    let statistic = dot(&difference, &solve_symmetric(&sum, &difference)?);
    let distribution = ChiSquared::new(used.len() as f64).ok()?;
    let row = |(&i, d): (&usize, &f64)| AgreementRow {
        coordinate: all[i],
        prediction_error: (one.0[i], variance(one.1, i).sqrt()),
        lines: (other.0[i], variance(other.1, i).sqrt()),
        difference_in_errors: d / (variance(one.1, i) + variance(other.1, i)).sqrt(),
    };
    Some(Agreement {
        rows: used.iter().zip(&difference).map(row).collect(),
        statistic,
        p_value: distribution.sf(statistic),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_estimates_agree_and_distant_ones_do_not() {
        let mut covariance = vec![0.0; 36];
        (0..6).for_each(|i| covariance[i * 7] = 0.01);
        let here = [5.0, 0.6, 0.1, 2.4, -1.2, 0.15];
        let mut there = here;
        let test = |there: &[f64]| {
            agreement(Form::LeadLag, true, (&here, &covariance), (there, &covariance), |i| {
                i < 3
            })
            .unwrap()
        };
        assert_eq!(test(&there).p_value, 1.0);
        there[1] += 0.1 * 2f64.sqrt() * 4.0;
        there[5] += 99.0;
        let apart = test(&there);
        assert!((apart.statistic - 16.0).abs() < 1e-9 && apart.p_value < 0.002 && apart.rows.len() == 3);
        assert!((apart.rows[1].difference_in_errors + 4.0).abs() < 1e-9);
        assert!(
            agreement(Form::LeadLag, true, (&here, &covariance), (&there, &covariance), |_| {
                false
            })
            .is_none()
        );
    }
}
