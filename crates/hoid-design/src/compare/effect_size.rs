//! Effect sizes of differences, with confidence intervals.
//!
//! | name | data | value |
//! |---|---|---|
//! | `d_z` | differences within n people | mean of the differences divided by their standard deviation, `t/sqrt(n)` |
//! | Hedges `g` | two groups of people | difference of the means divided by the pooled standard deviation, times `J(n_1 + n_2 - 2)` |
//!
//! Both effect sizes use unweighted estimates, one per person (J. Cohen, *Statistical Power Analysis*, 1988, sections
//! 2.2 and 2.3; L. V. Hedges, *J. Educ. Stat.* 6 (1981) 107-128). `J(m) = Gamma(m/2)/(sqrt(m/2) Gamma((m-1)/2))`
//! removes the bias of small groups. The 95 % confidence intervals follow from inversion of the noncentral t
//! distribution (J. H. Steiger and R. T. Fouladi, 1997): t has the noncentrality `delta = d sqrt(n)`, or
//! `d sqrt(n_1 n_2/(n_1 + n_2))` for two groups, and the ends of the interval are the two values of delta for which t
//! is the .975 and the .025 quantile.
//!
//! With the density `f(s)` of `s = sqrt(chi^2_nu/nu)`, the distribution is `P(T <= t) = int Phi(t s - delta) f(s) ds`,
//! computed by Simpson's rule over the range in which f is not negligible.

use hoid_numerics::statistics::{mean, sample_variance, sum_of_squared_deviations};
use serde::{Deserialize, Serialize};
use statrs::{
    distribution::{ContinuousCDF, Normal},
    function::gamma::ln_gamma,
};

/// An effect size with its confidence interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectSize {
    /// Name of the effect size, `d_z` or `g`.
    pub name: String,
    /// Value of the effect size.
    pub value: f64,
    /// The 95 % confidence interval.
    pub interval: (f64, f64),
}

/// Returns d_z of the differences of several people; `None` if there are fewer than two people or if all differences
/// are equal.
pub fn d_z(differences: &[f64]) -> Option<EffectSize> {
    let n = differences.len() as f64;
    let deviation = sample_variance(differences).sqrt();
    of("d_z", mean(differences) / deviation, n.sqrt(), n - 1.0, 1.0)
}

/// Returns Hedges' g of the second group of people relative to the first; `None` if the groups are too small or do not
/// vary.
pub fn hedges_g(first: &[f64], second: &[f64]) -> Option<EffectSize> {
    let (n1, n2) = (first.len() as f64, second.len() as f64);
    if n1 < 1.0 || n2 < 1.0 {
        return None;
    }
    let dof = n1 + n2 - 2.0;
    let pooled = ((sum_of_squared_deviations(first) + sum_of_squared_deviations(second)) / dof).sqrt();
    let root = (n1 * n2 / (n1 + n2)).sqrt();
    of("g", (mean(second) - mean(first)) / pooled, root, dof, correction(dof))
}

fn of(name: &str, d: f64, root: f64, dof: f64, correction: f64) -> Option<EffectSize> {
    if !(d.is_finite() && dof >= 1.0 && correction.is_finite()) {
        return None;
    }
    let t = d * root;
    let end = |share: f64| correction * noncentrality(t, dof, share) / root;
    Some(EffectSize {
        name: name.to_owned(),
        value: correction * d,
        interval: (end(0.975), end(0.025)),
    })
}

/// Returns J(m), which removes the bias of small groups; NaN for one degree of freedom or fewer.
fn correction(m: f64) -> f64 {
    if m <= 1.0 {
        return f64::NAN;
    }
    (ln_gamma(0.5 * m) - ln_gamma(0.5 * (m - 1.0))).exp() / (0.5 * m).sqrt()
}

/// Returns the delta for which `P(T <= t) = share`.
fn noncentrality(t: f64, dof: f64, share: f64) -> f64 {
    let reach = 40.0 + 8.0 * t.abs();
    let (mut low, mut high) = (t - reach, t + reach);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        // P(T > t) increases with delta.
        if noncentral_t(t, dof, middle) > share {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Number of intervals of Simpson's rule.
const INTERVAL_COUNT: usize = 600;

/// Returns `P(T <= t)` of the noncentral t distribution.
pub(super) fn noncentral_t(t: f64, dof: f64, delta: f64) -> f64 {
    let normal = Normal::standard();
    // log f(s) = log(2) + nu/2 log(nu/2) - log Gamma(nu/2) + (nu - 1) log s - nu s^2/2
    let constant = 2f64.ln() + 0.5 * dof * (0.5 * dof).ln() - ln_gamma(0.5 * dof);
    let density = |s: f64| {
        let power = if dof == 1.0 { 0.0 } else { (dof - 1.0) * s.ln() };
        (constant + power - 0.5 * dof * s * s).exp()
    };
    // s has a standard deviation of about 1/sqrt(2 nu).
    let width = 9.0 / (2.0 * dof).sqrt();
    let (from, to) = ((1.0 - width).max(0.0), 1.0 + width);
    let step = (to - from) / INTERVAL_COUNT as f64;
    let at = |k: usize| {
        let s = from + step * k as f64;
        let f = density(s);
        if f == 0.0 { 0.0 } else { f * normal.cdf(t * s - delta) }
    };
    let inner: f64 = (1..INTERVAL_COUNT)
        .map(|k| if k % 2 == 1 { 4.0 * at(k) } else { 2.0 * at(k) })
        .sum();
    (step / 3.0 * (at(0) + inner + at(INTERVAL_COUNT))).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn read_case(case: &str) -> [Vec<f64>; 3] {
        let mut all = [Vec::new(), Vec::new(), Vec::new()];
        for line in include_str!("../../../../fixtures/compare/cases.csv").lines().skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            if cells[0] == case {
                let y: f64 = cells[1].parse().unwrap();
                all[0].push(y);
                all[if cells[3] == "0" { 1 } else { 2 }].push(y);
            }
        }
        all
    }

    #[test]
    fn effect_sizes_match_r() {
        let mut seen = 0;
        for line in include_str!("../../../../fixtures/compare/effects.csv").lines().skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            let number = |k: usize| cells[k].parse::<f64>().unwrap();
            let close = |found: f64, k: usize, tolerance: f64| {
                assert!((found - number(k)).abs() < tolerance, "{line}: {found}");
            };
            let [all, first, second] = read_case(cells[1]);
            let found = match cells[0] {
                // R's own algorithm is no more accurate in the tails.
                "pt" => {
                    close(noncentral_t(number(2), number(3), number(4)), 5, 1e-8);
                    seen += 1;
                    continue;
                }
                "d_z" => d_z(&all),
                _ => hedges_g(&first, &second),
            };
            if cells[1] == "three" && cells[0] == "g" {
                assert!(found.is_none(), "one degree of freedom");
                continue;
            }
            let found = found.unwrap();
            close(found.value, 5, 1e-12);
            close(found.interval.0, 6, 1e-6);
            close(found.interval.1, 7, 1e-6);
            seen += 1;
        }
        assert_eq!(seen, 108);
    }

    #[test]
    fn few_people_or_no_scatter_give_no_effect_size() {
        assert!(d_z(&[1.0]).is_none() && d_z(&[]).is_none() && d_z(&[1.0, 1.0]).is_none());
        assert!(hedges_g(&[1.0], &[2.0]).is_none() && hedges_g(&[], &[2.0, 3.0, 4.0]).is_none());
        let two = d_z(&[1.0, 2.0]).unwrap();
        assert!(two.interval.0 < two.value && two.value < two.interval.1);
    }
}
