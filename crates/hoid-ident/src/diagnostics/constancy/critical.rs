//! p-values of the supremum of a statistic over all instants of change.
//!
//! If the parameters are constant, `T^2` as a function of pi, the share of the information before the change, is the
//! square of a one-dimensional standardised tied-down Bessel process. For large c its supremum over
//! `pi_0 <= pi <= 1 - pi_0` has the tail (D. M. De Long, *Comm. Statist. A* 10 (1981) 2197-2213; A. Estrella,
//! *Econometric Theory* 19 (2003) 1128-1143, who computes D. W. K. Andrews' critical values from it)
//!
//! `P(sup T^2 > c) = sqrt(c/2) e^(-c/2)/Gamma(1/2) [(1 - 1/c) ln lambda + 2/c]`,
//! `lambda = ((1 - pi_0)/pi_0)^2`.
//!
//! For m instants the p-value of the supremum is at most m times the smallest p-value of a single instant (Bonferroni's
//! inequality). For few instants this bound is below De Long's tail.

use std::f64::consts::PI;

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Returns the two-sided p-value of a t statistic.
pub(super) fn student_p_value(t: f64, freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom).map_or(1.0, |d| 2.0 * d.sf(t.abs()))
}

/// Returns the p-value of the supremum over `instants` instants, given the p-value of a single instant;
/// `smallest_share` is pi_0.
pub(super) fn supremum_p_value(p_one: f64, instants: usize, smallest_share: f64) -> f64 {
    let bonferroni = p_one * instants as f64;
    let Ok(normal) = Normal::new(0.0, 1.0) else {
        return bonferroni.min(1.0);
    };
    let c = normal.inverse_cdf(0.5 * p_one.max(1e-300)).powi(2);
    let continuous = if c > 1.0 {
        de_long_probability(c, smallest_share)
    } else {
        1.0
    };
    bonferroni.min(continuous).min(1.0)
}

/// Returns De Long's probability that the supremum exceeds c.
fn de_long_probability(c: f64, pi_0: f64) -> f64 {
    let log_lambda = 2.0 * ((1.0 - pi_0) / pi_0).ln();
    (0.5 * c / PI).sqrt() * (-0.5 * c).exp() * ((1.0 - 1.0 / c) * log_lambda + 2.0 / c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tail_probability_matches_andrews_table() {
        // D. W. K. Andrews, Econometrica 71 (2003) 395-397, p = 1, pi_0 = 0.15: the 10, 5 and 1 % points.
        for (level, c) in [(0.1, 7.12), (0.05, 8.68), (0.01, 12.16)] {
            let found = de_long_probability(c, 0.15);
            // The table comes from simulation; the tail is asymptotic.
            assert!((found / level - 1.0).abs() < 0.1, "{c}: {found}");
        }
    }

    #[test]
    fn few_instants_use_the_bonferroni_bound() {
        assert!((supremum_p_value(1e-6, 3, 0.05) - 3e-6).abs() < 1e-12);
        assert!(supremum_p_value(1e-6, 100_000, 0.05) < 1e-3);
        assert_eq!(supremum_p_value(1.0, 3, 0.05), 1.0);
        assert!(supremum_p_value(0.0, 3, 0.05) <= 1e-300);
        assert!((student_p_value(2.228, 10.0) - 0.05).abs() < 1e-4);
    }
}
