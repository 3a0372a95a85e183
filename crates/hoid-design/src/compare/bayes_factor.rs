//! Bayes factor of a difference: how many times more probable the observed t is with a difference than without one.
//!
//! Without a difference the effect size delta is 0; with a difference it is drawn from a Cauchy distribution of scale r
//! = sqrt(2)/2 (the prior of Jeffreys, Zellner and Siow). For t with nu degrees of freedom, and N = n people or N = n_1
//! n_2/(n_1 + n_2) for two groups,
//!
//! ```text
//!           int_0^inf (1 + N g r^2)^(-1/2) (1 + t^2/((1 + N g r^2) nu))^(-(nu + 1)/2) p(g) dg
//! BF_10 = --------------------------------------------------------------------------------- ,
//!                              (1 + t^2/nu)^(-(nu + 1)/2)
//!
//! p(g) = (2 pi)^(-1/2) g^(-3/2) e^(-1/(2 g))
//! ```
//!
//! (J. N. Rouder et al., *Psychonomic Bulletin & Review* 16 (2009) 225-237, eq. 1). As a function of x = log g the
//! integrand falls at least exponentially on both sides, so that the trapezoidal rule is exact to rounding.

use std::f64::consts::PI;

/// Scale of the prior distribution of effect sizes.
const R: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Number of steps of the trapezoidal rule per unit of log g.
const STEPS_PER_UNIT: usize = 64;

/// Returns BF_10 of a t test of one group of people (`second` is 0) or of two groups; `None` if there are too few
/// people or t is not finite.
pub fn bayes_factor(t: f64, first: usize, second: usize) -> Option<f64> {
    let (n1, n2) = (first as f64, second as f64);
    let (people, nu) = match second {
        0 => (n1, n1 - 1.0),
        _ => (n1 * n2 / (n1 + n2), n1 + n2 - 2.0),
    };
    if !t.is_finite() || first == 0 || nu < 1.0 {
        return None;
    }
    let power = 0.5 * (nu + 1.0);
    let without = -power * (t * t / nu).ln_1p();
    let with = |x: f64| {
        let spread = people * R * R * x.exp();
        -0.5 * (x + (-x).exp() + (2.0 * PI).ln() + spread.ln_1p()) - power * (t * t / ((1.0 + spread) * nu)).ln_1p()
    };
    // Below log g = -8, e^(-1/(2 g)) is negligible; at the upper end the integrand falls as e^(-x), once N g r^2
    // exceeds t^2.
    let (from, to) = (-8.0, 45.0 + (t * t).ln_1p());
    let count = ((to - from) * STEPS_PER_UNIT as f64).ceil() as usize;
    let sum: f64 = (0..=count)
        .map(|k| (with(from + k as f64 / STEPS_PER_UNIT as f64) - without).exp())
        .sum();
    let found = sum / STEPS_PER_UNIT as f64;
    found.is_finite().then_some(found)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// The reference values were computed with pingouin (scipy's adaptive quadrature).
    #[test]
    fn bayes_factors_match_pingouin() {
        let mut seen = 0;
        for line in include_str!("../../../../fixtures/compare/bayes.csv").lines().skip(1) {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            let found = bayes_factor(cells[0], cells[1] as usize, cells[2] as usize).unwrap();
            assert!((found / cells[3] - 1.0).abs() < 1e-7, "{line}: {found}");
            seen += 1;
        }
        assert_eq!(seen, 63);
    }

    #[test]
    fn invalid_statistics_give_no_bayes_factor() {
        for (t, first, second) in [
            (f64::NAN, 5, 0),
            (f64::INFINITY, 5, 0),
            (1.0, 0, 0),
            (1.0, 1, 0),
            (1.0, 1, 1),
            (1.0, 0, 5),
        ] {
            assert_eq!(bayes_factor(t, first, second), None, "{t} {first} {second}");
        }
        // The first factor exceeds the range of floating-point numbers.
        assert_eq!(bayes_factor(1e12, 400, 0), None);
        assert!(bayes_factor(1e6, 3, 0).is_some());
    }
}
