//! An estimate averaged over the forms that the data do not reject.
//!
//! Form f has the weight `w_f = exp(-Delta_f/2)/sum exp(-Delta_g/2)`, where Delta_f is its value of Akaike's criterion
//! minus the smallest value (H. Akaike, *J. Econometrics* 16 (1981) 3-14). The estimate of a quantity x that several
//! forms have in common is
//!
//! `x = sum w_f x_f`,  `s^2 = sum w_f (s_f^2 + (x_f - x)^2)`
//!
//! with s the unconditional standard error (K. P. Burnham and D. R. Anderson, *Sociological Methods and Research* 33
//! (2004) 261-304, eq. 9), which includes the uncertainty in the choice of the form. A form without x is omitted, and
//! the other weights are scaled to a sum of one. The 95 % interval is computed for the mixture of the distributions of
//! all forms. Each distribution consists of two halves of Student's distribution that meet at `x_f` and are scaled to
//! the ends of the interval of that form, which may be asymmetric.

use hoid_model::uncertainty::Estimate;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::clusters::{degrees_of_freedom, quantile};

/// Number of bisection steps for each end of an interval.
const BISECTION_STEPS: usize = 80;
/// Distance from the intervals, in widths of their union, beyond which Student's distribution leaves less than a
/// hundredth of [`TAIL_PROBABILITY`].
const TAIL_DISTANCE: f64 = 50.0;
/// Probability in each tail outside the interval.
const TAIL_PROBABILITY: f64 = 0.025;

/// Estimate of a quantity in one form.
#[derive(Debug, Clone, Copy)]
pub(super) struct Component {
    /// Weight of the form.
    pub weight: f64,
    /// Estimate of the quantity.
    pub estimate: Estimate,
    /// 95 % interval of the quantity.
    pub interval: Option<(f64, f64)>,
}

/// Estimate of a quantity, averaged over the forms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mixture {
    pub estimate: Estimate,
    pub interval: Option<(f64, f64)>,
}

impl Mixture {
    /// Averages the estimates of a quantity over forms; `None` without forms. `clusters` is the number of clusters on
    /// which the errors are based.
    pub fn of(components: &[Component], clusters: usize) -> Option<Self> {
        let total: f64 = components.iter().map(|c| c.weight).sum();
        if let [only] = components {
            return Some(Self {
                estimate: only.estimate,
                interval: only.interval,
            });
        }
        if total <= 0.0 || total.is_nan() {
            return None;
        }
        let over = |of: &dyn Fn(&Component) -> f64| components.iter().map(|c| c.weight / total * of(c)).sum::<f64>();
        let value = over(&|c| c.estimate.value);
        // A missing standard error must not count as zero.
        let known = components.iter().all(|c| c.estimate.standard_error.is_some()) && value.is_finite();
        let variance = over(&|c| {
            let s = c.estimate.standard_error.unwrap_or(0.0);
            s * s + (c.estimate.value - value).powi(2)
        });
        Some(Self {
            estimate: Estimate {
                value,
                standard_error: known.then(|| variance.sqrt()),
            },
            interval: interval(components, total, clusters),
        })
    }
}

/// Weight, estimate and interval of a form.
type WeightedInterval = (f64, f64, (f64, f64));

/// Returns the 95 % interval of the mixture; `None` if a form has no interval.
fn interval(components: &[Component], total: f64, clusters: usize) -> Option<(f64, f64)> {
    let student = StudentsT::new(0.0, 1.0, degrees_of_freedom(clusters)).ok()?;
    let quantile = quantile(clusters);
    let parts: Option<Vec<WeightedInterval>> = (components.iter())
        .map(|c| Some((c.weight / total, c.estimate.value, c.interval?)))
        .collect();
    let parts = parts?;
    // Probability of a value below x in one form.
    let below = |x: f64, value: f64, (low, high): (f64, f64)| -> f64 {
        let reach = if x < value { value - low } else { high - value };
        match (x - value) / reach {
            z if z.is_finite() => student.cdf(quantile * z),
            // The form has no standard error, or its estimate is infinite.
            _ if x < value => 0.0,
            _ => 1.0,
        }
    };
    let share = |x: f64| parts.iter().map(|&(w, v, i)| w * below(x, v, i)).sum::<f64>();
    let finite = |pick: fn(f64, f64) -> f64, from: f64| {
        let all = parts.iter().flat_map(|&(_, v, (low, high))| [v, low, high]);
        all.filter(|x| x.is_finite()).fold(from, pick)
    };
    let (least, most) = (finite(f64::min, f64::INFINITY), finite(f64::max, f64::NEG_INFINITY));
    // Far beyond the finite ends, only forms with an infinite end have any remaining probability.
    let reach = TAIL_DISTANCE * (most - least).max(most.abs().max(least.abs()) * f64::EPSILON);
    let place = |wanted: f64| {
        let (mut low, mut high) = (least - reach, most + reach);
        for _ in 0..BISECTION_STEPS {
            let middle = 0.5 * (low + high);
            if share(middle) < wanted {
                low = middle;
            } else {
                high = middle;
            }
        }
        let found = 0.5 * (low + high);
        // An end that is zero except for rounding is set to zero, for example for a time constant at its bound.
        if found.abs() < 1e-12 * (most - least) {
            0.0
        } else {
            found
        }
    };
    let low = if share(least - reach) > TAIL_PROBABILITY {
        f64::NEG_INFINITY
    } else {
        place(TAIL_PROBABILITY)
    };
    let high = if share(most + reach) < 1.0 - TAIL_PROBABILITY {
        f64::INFINITY
    } else {
        place(1.0 - TAIL_PROBABILITY)
    };
    Some((low, high))
}

/// Returns the estimate and interval for a larger standard error: the distances of the ends from the estimate grow in
/// proportion to the standard error.
pub(super) fn widen_interval(
    of: Estimate,
    interval: Option<(f64, f64)>,
    error: Option<f64>,
) -> (Estimate, Option<(f64, f64)>) {
    let ratio = match (error, of.standard_error) {
        (Some(wide), Some(own)) if own > 0.0 => (wide / own).max(1.0),
        _ => 1.0,
    };
    let moved = |end: f64| of.value + ratio * (end - of.value);
    let wide = Estimate {
        standard_error: error.or(of.standard_error),
        ..of
    };
    (wide, interval.map(|(low, high)| (moved(low), moved(high))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn component(weight: f64, value: f64, s: f64, clusters: usize) -> Component {
        let reach = quantile(clusters) * s;
        Component {
            weight,
            estimate: Estimate::with_variance(value, s * s),
            interval: Some((value - reach, value + reach)),
        }
    }

    #[test]
    fn mixture_of_equal_forms_equals_one_form() {
        let one = component(0.3, 2.0, 0.1, 8);
        let alone = Mixture::of(&[one], 8).unwrap();
        assert_eq!((alone.estimate, alone.interval), (one.estimate, one.interval));
        let both = Mixture::of(&[one, Component { weight: 0.5, ..one }], 8).unwrap();
        assert!((both.estimate.value - 2.0).abs() < 1e-14);
        assert!((both.estimate.standard_error.unwrap() - 0.1).abs() < 1e-14);
        let (low, high) = both.interval.unwrap();
        let expected = one.interval.unwrap();
        assert!((low - expected.0).abs() < 1e-9 && (high - expected.1).abs() < 1e-9);
        assert_eq!(Mixture::of(&[], 8), None);
    }

    /// Two forms differ by several standard errors: the mean and the variance are computed by hand, and the interval is
    /// checked by its probability.
    #[test]
    fn differing_forms_increase_the_error() {
        let many = 1_000_000;
        let all = [component(0.75, 1.0, 0.1, many), component(0.25, 1.4, 0.2, many)];
        let found = Mixture::of(&all, many).unwrap();
        assert!((found.estimate.value - 1.1).abs() < 1e-14);
        let variance: f64 = 0.75 * (0.01 + 0.01) + 0.25 * (0.04 + 0.09);
        assert!((found.estimate.standard_error.unwrap() - variance.sqrt()).abs() < 1e-14);
        let normal = statrs::distribution::Normal::new(0.0, 1.0).unwrap();
        let share = |x: f64| 0.75 * normal.cdf((x - 1.0) / 0.1) + 0.25 * normal.cdf((x - 1.4) / 0.2);
        let (low, high) = found.interval.unwrap();
        assert!(
            (share(low) - 0.025).abs() < 1e-5 && (share(high) - 0.975).abs() < 1e-5,
            "{low} {high}"
        );
    }

    #[test]
    fn infinite_limit_of_a_weighted_form_is_kept() {
        let closed = component(0.9, 5.0, 0.5, 8);
        let open = |weight| Component {
            weight,
            estimate: Estimate::with_variance(6.0, 1.0),
            interval: Some((4.0, f64::INFINITY)),
        };
        let high = |weight| Mixture::of(&[closed, open(weight)], 8).unwrap().interval.unwrap().1;
        assert!(high(0.2).is_infinite());
        assert!(high(0.01).is_finite());
        // One form is a pure integration.
        let infinite = Component {
            estimate: Estimate::fixed(f64::INFINITY),
            ..open(0.2)
        };
        let found = Mixture::of(&[closed, infinite], 8).unwrap();
        assert!(found.estimate.value.is_infinite() && found.interval.unwrap().1.is_infinite());
    }
}
