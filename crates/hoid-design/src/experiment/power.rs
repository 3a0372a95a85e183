//! Exact power of the t test, from the noncentral t distribution.
//!
//! For n people, the mean difference divided by its standard error has the noncentral t distribution with n - 1 degrees
//! of freedom and `delta = D sqrt(n)/sigma`, where D is the true difference and sigma the standard deviation of the
//! difference of one person. The two-sided test detects D with the probability
//!
//! `1 - F(t_c; n - 1, delta) + F(-t_c; n - 1, delta)`, where `t_c` is the quantile of Student's t at `1 - alpha/2`.
//!
//! For `t >= 0` (R. V. Lenth, *Applied Statistics* 38 (1989) 185-189, algorithm AS 243), with `x = t^2/(t^2 + nu)` and
//! the regularised incomplete beta function I,
//!
//! `F = Phi(-delta) + 1/2 sum_j [p_j I_x(j + 1/2, nu/2) + q_j I_x(j + 1, nu/2)]`,
//!
//! `p_j = e^-l l^j/j!`, `q_j = delta e^-l l^j/(sqrt(2) Gamma(j + 3/2))`, `l = delta^2/2`; for negative t,
//! `F(t; delta) = 1 - F(-t; -delta)`.

use statrs::{
    distribution::{ContinuousCDF, Normal, StudentsT},
    function::{beta::beta_reg, gamma::ln_gamma},
};

/// Largest excess of delta over the critical value for which the power is computed; beyond it, the power is one.
const LARGEST_DELTA: f64 = 60.0;

/// Returns the distribution function of the noncentral t distribution.
pub fn noncentral_t_cdf(t: f64, degrees: f64, delta: f64) -> f64 {
    if t < 0.0 {
        return 1.0 - noncentral_t_cdf(-t, degrees, -delta);
    }
    let base = Normal::standard().cdf(-delta);
    if t == 0.0 {
        return base;
    }
    let x = t * t / (t * t + degrees);
    let half = 0.5 * delta * delta;
    // The terms are those of a Poisson distribution, and only those near its mean are summed.
    let reach = 12.0 * half.sqrt() + 40.0;
    let (from, to) = ((half - reach).max(0.0) as usize, (half + reach) as usize);
    let term = |j: usize| {
        let k = j as f64;
        // 0 ln 0 is zero.
        let power = if j == 0 { 0.0 } else { k * half.ln() };
        let p = (power - half - ln_gamma(k + 1.0)).exp();
        let q = delta * (power - half - ln_gamma(k + 1.5)).exp() / std::f64::consts::SQRT_2;
        p * beta_reg(k + 0.5, 0.5 * degrees, x) + q * beta_reg(k + 1.0, 0.5 * degrees, x)
    };
    let sum: f64 = (from..=to).map(term).filter(|v| v.is_finite()).sum();
    (base + 0.5 * sum).clamp(0.0, 1.0)
}

/// Returns the probability that the two-sided paired t test detects a difference; `effect` is the difference divided by
/// the standard deviation of the difference of one person. `None` for fewer than two people.
pub fn power(effect: f64, people: usize, alpha: f64) -> Option<f64> {
    let degrees = people.checked_sub(1).filter(|d| *d > 0)? as f64;
    let critical = StudentsT::new(0.0, 1.0, degrees).ok()?.inverse_cdf(1.0 - 0.5 * alpha);
    let delta = effect.abs() * (people as f64).sqrt();
    if delta > LARGEST_DELTA + critical {
        return Some(1.0);
    }
    Some(1.0 - noncentral_t_cdf(critical, degrees, delta) + noncentral_t_cdf(-critical, degrees, delta))
}

/// Largest number of people considered.
pub const MAX_PEOPLE: usize = 1000;

/// Returns the smallest number of people with at least this power; `None` if it exceeds a thousand.
pub fn people_needed(effect: f64, wanted: f64, alpha: f64) -> Option<usize> {
    let suffices = |people: usize| power(effect, people, alpha).is_some_and(|found| found >= wanted);
    if !suffices(MAX_PEOPLE) {
        return None;
    }
    // The power increases with the number of people, so the number is found by bisection.
    let (mut few, mut enough) = (1, MAX_PEOPLE);
    while enough - few > 1 {
        let middle = few.midpoint(enough);
        match suffices(middle) {
            true => enough = middle,
            false => few = middle,
        }
    }
    Some(enough)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Values computed with scipy and statsmodels by `make.py` in the same directory.
    const REFERENCE_TABLE: &str = include_str!("../../../../fixtures/power/power.csv");

    #[test]
    fn power_matches_scipy_and_statsmodels() {
        let mut worst = [0.0_f64; 2];
        for row in REFERENCE_TABLE.lines().skip(1) {
            let (kind, numbers) = row.split_once(',').unwrap();
            let numbers: Vec<f64> = numbers.split(',').map(|n| n.parse().unwrap()).collect();
            let [a, b, c, expected] = numbers[..] else {
                panic!("{row}")
            };
            let (k, found) = match kind {
                "cdf" => (0, noncentral_t_cdf(a, b, c)),
                _ => (1, power(a, b as usize, c).unwrap()),
            };
            let error = (found - expected).abs();
            assert!(error < 1e-8, "{row}: {found}");
            worst[k] = worst[k].max(error);
        }
        println!("largest error of F {:.1e}, of the power {:.1e}", worst[0], worst[1]);
    }

    #[test]
    fn smallest_sufficient_number_of_people_is_found() {
        for (effect, wanted) in [(0.5, 0.8), (1.0, 0.8), (0.2, 0.9), (3.0, 0.8)] {
            let people = people_needed(effect, wanted, 0.05).unwrap();
            assert!(power(effect, people, 0.05).unwrap() >= wanted);
            assert!(power(effect, people - 1, 0.05).is_none_or(|found| found < wanted));
        }
        // From a table for paired tests: d_z = .5 requires 34 people, and d_z = 1 requires 10.
        assert_eq!(people_needed(0.5, 0.8, 0.05), Some(34));
        assert_eq!(people_needed(1.0, 0.8, 0.05), Some(10));
        assert_eq!(people_needed(0.01, 0.8, 0.05), None);
        assert_eq!(people_needed(1e9, 0.8, 0.05), Some(2));
        assert_eq!(power(1.0, 1, 0.05), None);
    }
}
