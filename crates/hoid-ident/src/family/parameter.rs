//! A reported parameter: its interval, its prior share, and whether the data determine it.
//!
//! Estimates are nearly normally distributed in the coordinates of the family, but not in the parameters: for a long
//! lag, `1/T_I` has a symmetric error, but T_I does not. Intervals are therefore computed in the coordinates and then
//! transformed. If an interval of `1/T_I` includes zero, the intervals of T_I and K have no upper limit.
//!
//! **Determined** means determined by the data. The posterior variance must be at most half of the prior variance
//! ([`Parameter::prior_share`]), the parameter must not be at a bound of the search range, and its interval must
//! exclude zero. For omega_nm and zeta_nm, which are positive by definition, the interval must instead be within a
//! factor of two of the estimate.

use hoid_model::{
    FamilyOperator, Form,
    operator_family::{Coordinate, NamedParameter},
    uncertainty::Estimate,
};

use super::mixture::{Component, Mixture, widen_interval};

/// Total weight of the forms with a parameter up to which the parameter counts as undetermined.
const MIN_WEIGHT: f64 = 0.5;
/// Name of the gain (at zero frequency in forms with a lag, in the band in other forms), and the total weight of the
/// forms with the same meaning up to which it counts as undetermined.
pub(super) const DC_GAIN_NAME: &str = "K";
const MIN_WEIGHT_OF_DC_GAIN: f64 = 0.95;
/// Largest ratio of the posterior to the prior variance of a determined parameter.
const LARGEST_PRIOR_SHARE: f64 = 0.5;
/// Largest standard error of the logarithm of a determined parameter.
const LARGEST_LOG_ERROR: f64 = 0.35;

/// Names of the low-frequency gain. It is called `K_e` in the form with one lead, and K in the others.
pub(super) fn is_dc_gain(name: &str) -> bool {
    name == DC_GAIN_NAME || name == "K_e"
}

/// Returns the total weight of the forms with a parameter up to which the parameter counts as undetermined.
pub(super) fn min_weight(name: &str) -> f64 {
    if name == DC_GAIN_NAME {
        MIN_WEIGHT_OF_DC_GAIN
    } else {
        MIN_WEIGHT
    }
}

/// One parameter of an operator.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Parameter {
    /// Name of the parameter: K, K_over_T_I, T_L, T_I, omega_nm, zeta_nm, tau_e, ...
    pub name: String,
    /// Unit of the parameter.
    #[serde(deserialize_with = "hoid_model::static_names::name")]
    pub unit: hoid_model::static_names::Name,
    /// Value of the parameter; infinite for T_I of a pure integration.
    pub value: f64,
    /// First-order standard error for the operator in these runs; `None` at a bound or without a covariance.
    pub standard_error: Option<f64>,
    /// Standard error for the person, whose gain varies from run to run.
    pub standard_error_person: Option<f64>,
    /// The 95 % interval; an open end is infinite.
    pub interval: Option<(f64, f64)>,
    /// Ratio of the posterior to the prior variance; 0 without a prior.
    pub prior_share: f64,
    /// True if the data determine the parameter.
    pub determined: bool,
    /// The forms over which the estimate is averaged; empty for a single form.
    pub averaged_over: Vec<Form>,
}

impl Parameter {
    /// Returns the parameter with the standard error and interval for the person instead of for these runs.
    #[must_use]
    pub fn as_of_person(&self) -> Self {
        let (estimate, interval) = widen_interval(self.estimate(), self.interval, self.standard_error_person);
        Self {
            standard_error: estimate.standard_error,
            interval,
            ..self.clone()
        }
    }

    /// Returns the value of the parameter with its standard error.
    pub fn estimate(&self) -> Estimate {
        Estimate {
            value: self.value,
            standard_error: self.standard_error,
        }
    }

    /// Returns the weighted mean of a parameter over the forms. `each` contains the form, the weight and the parameter,
    /// with the best form first.
    pub(super) fn average(each: &[(Form, f64, &Self)], clusters: usize) -> Option<Self> {
        let (_, _, front) = *each.first()?;
        // A parameter at a bound has no error and is omitted from the mean, but not from the interval.
        let all = each;
        let with_error: Vec<_> = each
            .iter()
            .filter(|(_, _, p)| p.standard_error.is_some())
            .copied()
            .collect();
        let each = if with_error.is_empty() { each } else { &with_error };
        if all.len() == 1 {
            let (_, weight, only) = all[0];
            return Some(Self {
                determined: only.determined && weight > MIN_WEIGHT,
                ..only.clone()
            });
        }
        let total: f64 = each.iter().map(|(_, weight, _)| weight).sum();
        let component = |&(_, weight, p): &(Form, f64, &Self)| Component {
            weight,
            estimate: p.estimate(),
            interval: p.interval,
        };
        let components: Vec<Component> = each.iter().map(component).collect();
        let Mixture { estimate, mut interval } = Mixture::of(&components, clusters)?;
        if each.len() < all.len() {
            let at_bound = |p: &Self| p.interval.unwrap_or((p.value, p.value));
            let with_bounds: Vec<Component> = (all.iter())
                .map(|&(_, weight, p)| Component {
                    weight,
                    estimate: p.estimate(),
                    interval: Some(at_bound(p)),
                })
                .collect();
            interval = Mixture::of(&with_bounds, clusters).map_or(interval, |m| m.interval);
        }
        let of_person: Vec<Component> = (components.iter().zip(each))
            .map(|(c, (_, _, p))| Component {
                estimate: Estimate {
                    standard_error: p.standard_error_person,
                    ..c.estimate
                },
                ..*c
            })
            .collect();
        let share = |of: &dyn Fn(&Self) -> f64| each.iter().map(|(_, w, p)| w / total * of(p)).sum::<f64>();
        // As in a single form, the interval must exclude zero, and omega_nm and zeta_nm must be known within a factor
        // of two.
        let one_sign = interval.is_some_and(|(low, high)| low * high > 0.0);
        let known = match estimate.standard_error {
            Some(s) if matches!(front.name.as_str(), "omega_nm" | "zeta_nm") => s < LARGEST_LOG_ERROR * estimate.value,
            error => error.is_some(),
        };
        Some(Self {
            value: estimate.value,
            standard_error: estimate.standard_error,
            standard_error_person: Mixture::of(&of_person, clusters)?.estimate.standard_error,
            interval,
            prior_share: share(&|p| p.prior_share),
            // The parameter is not determined if the forms without it are more likely than the forms with it.
            determined: total > MIN_WEIGHT && share(&|p| f64::from(p.determined)) > 0.5 && one_sign && known,
            averaged_over: each.iter().map(|(form, ..)| *form).collect(),
            ..front.clone()
        })
    }
}

/// Estimated coordinates of one operator.
pub(super) struct CoordinateEstimate<'a> {
    pub operator: &'a FamilyOperator,
    pub covariance: Option<&'a [f64]>,
    /// Prior share of each coordinate.
    pub prior_share: &'a [f64],
    /// Search range of each coordinate.
    pub limits: &'a [(f64, f64)],
    /// Interval of each coordinate by profile likelihood; `None` if it was not computed.
    pub profile: &'a [Option<(f64, f64)>],
    /// 97.5 % quantile of Student's distribution.
    pub quantile: f64,
    /// Relative standard deviation of the mean gain of these runs that their scatter does not show.
    pub run_to_run: f64,
}

impl CoordinateEstimate<'_> {
    pub fn parameters(&self) -> Vec<Parameter> {
        let made = |named: &NamedParameter| {
            let made = self.parameter(named);
            // The variation applies to all gains and to products that contain a gain.
            let scales = matches!(named.coordinate, None | Some(Coordinate::Gain));
            let share = if scales {
                self.run_to_run * made.value.abs()
            } else {
                0.0
            };
            Parameter {
                standard_error_person: made.standard_error.map(|own| own.hypot(share)),
                ..made
            }
        };
        self.operator.named_parameters().iter().map(made).collect()
    }

    fn coordinate_index(&self, wanted: Coordinate) -> Option<usize> {
        let all = self.operator.form().coordinates(self.operator.has_neuromuscular());
        all.iter().position(|c| *c == wanted)
    }

    /// Returns the standard error of a coordinate; `None` at a bound. For a delay with an interval of its own, it is
    /// the error to which the width of the interval corresponds.
    fn standard_error(&self, i: usize) -> Option<f64> {
        let x = self.operator.coordinates();
        let (low, high) = self.limits[i];
        if let Some((from, to)) = self.profile[i]
            && Some(i) == self.coordinate_index(Coordinate::Delay)
        {
            return Some(0.5 * (to - from) / self.quantile);
        }
        let c = self.covariance?;
        let inside = low < x[i] && x[i] < high;
        (inside && c[i * x.len() + i] > 0.0).then(|| c[i * x.len() + i].sqrt())
    }

    /// Returns the 95 % interval of a coordinate, limited to the search range.
    fn interval(&self, i: usize) -> Option<(f64, f64)> {
        let x = self.operator.coordinates()[i];
        if let Some(profile) = self.profile[i] {
            return Some(profile);
        }
        let s = self.standard_error(i)?;
        let (low, high) = self.limits[i];
        Some(((x - self.quantile * s).max(low), (x + self.quantile * s).min(high)))
    }

    fn is_determined(&self, i: usize) -> bool {
        let coordinate = self.operator.form().coordinates(self.operator.has_neuromuscular())[i];
        if self.prior_share[i] > LARGEST_PRIOR_SHARE {
            return false;
        }
        let (Some(s), Some((low, high))) = (self.standard_error(i), self.interval(i)) else {
            return false;
        };
        match coordinate {
            Coordinate::LogOmega | Coordinate::LogZeta => s < LARGEST_LOG_ERROR,
            Coordinate::Gain | Coordinate::Linear | Coordinate::Quadratic => low * high > 0.0,
            _ => low > self.limits[i].0 && low > 0.0,
        }
    }

    fn parameter(&self, named: &NamedParameter) -> Parameter {
        let x = self.operator.coordinates();
        let p = x.len();
        let mut made = Parameter {
            name: named.name.to_owned(),
            unit: named.unit,
            value: named.value,
            standard_error: None,
            standard_error_person: None,
            interval: None,
            prior_share: 0.0,
            determined: false,
            averaged_over: Vec::new(),
        };
        let Some(coordinate) = named.coordinate else {
            return self.with_product_errors(made);
        };
        let Some(i) = self.coordinate_index(coordinate) else {
            return made;
        };
        let s = self.standard_error(i);
        made.prior_share = self.prior_share[i];
        made.determined = self.is_determined(i);
        let interval = self.interval(i);
        match coordinate {
            Coordinate::LagRate => {
                // A rate at or below the lower bound of the search range means a pure integration.
                let end = |rate: f64| {
                    if rate <= self.limits[i].0 {
                        f64::INFINITY
                    } else {
                        1.0 / rate
                    }
                };
                made.value = end(x[i]);
                made.standard_error = s.map(|s| s / (x[i] * x[i]));
                made.interval = interval.map(|(low, high)| (1.0 / high, end(low)));
            }
            Coordinate::LogOmega | Coordinate::LogZeta => {
                made.standard_error = s.map(|s| s * made.value);
                made.interval = interval.map(|(low, high)| (low.exp(), high.exp()));
            }
            _ => {
                made.standard_error = s;
                made.interval = interval;
            }
        }
        debug_assert!(i < p);
        made
    }

    /// Adds the errors of a parameter that is a product of two others: K = (K/T_I) T_I, or K_e_dot = K_e T_L.
    fn with_product_errors(&self, mut made: Parameter) -> Parameter {
        let x = self.operator.coordinates();
        let p = x.len();
        let (Some(c), Some(gain)) = (self.covariance, self.coordinate_index(Coordinate::Gain)) else {
            return made;
        };
        let (other, sign) = match (
            self.coordinate_index(Coordinate::LagRate),
            self.coordinate_index(Coordinate::Lead),
        ) {
            (Some(rate), _) => (rate, -1.0),
            (None, Some(lead)) => (lead, 1.0),
            (None, None) => return made,
        };
        if self.standard_error(gain).is_none() || self.standard_error(other).is_none() {
            if sign < 0.0 && x[other] <= self.limits[other].0 {
                made.value = f64::INFINITY.copysign(x[gain]);
            }
            return made;
        }
        // Change in the logarithm of the product y: d ln y = dx_g/x_g +- dx_o/x_o, with the gain x_g and the other
        // factor x_o.
        let variance = c[gain * p + gain] / (x[gain] * x[gain])
            + c[other * p + other] / (x[other] * x[other])
            + 2.0 * sign * c[gain * p + other] / (x[gain] * x[other]);
        let relative = variance.max(0.0).sqrt();
        made.standard_error = Some(relative * made.value.abs());
        made.prior_share = self.prior_share[gain].max(self.prior_share[other]);
        made.determined = self.is_determined(gain) && self.is_determined(other);
        let Some((low, high)) = self.product_interval(gain, other, sign) else {
            return made;
        };
        let ends = [made.value / low.exp(), made.value * high.exp()];
        let (mut low, mut high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        if let Some((rate, _)) = self.interval(other)
            && sign < 0.0
            && rate <= self.limits[other].0
        {
            // K grows without bound as 1/T_I approaches zero.
            if made.value > 0.0 {
                high = f64::INFINITY;
            } else {
                low = f64::NEG_INFINITY;
            }
        }
        made.interval = Some((low, high));
        made
    }

    /// Returns the distances by which the interval of `ln|x_g| +- ln x_o` extends below and above the estimate. They
    /// are computed from the intervals of x_g and x_o, which may be asymmetric (G. Y. Zou and A. Donner, *Statistics in
    /// Medicine* 27 (2008) 1693-1702). With the distances a below and b above and the correlation r, the lower distance
    /// is `sqrt(a_g^2 + a_o^2 + 2 r a_g a_o)` for the sum and `sqrt(a_g^2 + b_o^2 - 2 r a_g b_o)` for the difference. A
    /// distance is infinite if an interval end from which it is computed reaches zero.
    fn product_interval(&self, gain: usize, other: usize, sign: f64) -> Option<(f64, f64)> {
        let x = self.operator.coordinates();
        let p = x.len();
        let c = self.covariance?;
        let reach = |i: usize| {
            let (low, high) = self.interval(i)?;
            let (near, far) = if x[i] > 0.0 { (low, high) } else { (-high, -low) };
            let size = x[i].abs();
            let below = if near > 0.0 { (size / near).ln() } else { f64::INFINITY };
            Some((below, (far / size).ln()))
        };
        let (of_gain, of_other) = (reach(gain)?, reach(other)?);
        let of_other = if sign < 0.0 { (of_other.1, of_other.0) } else { of_other };
        let scale = (c[gain * p + gain] * c[other * p + other]).sqrt() * x[gain].signum();
        let r = (sign * c[gain * p + other] / scale).clamp(-1.0, 1.0);
        let both = |a: f64, b: f64| {
            if a.is_finite() && b.is_finite() {
                (a * a + b * b + 2.0 * r * a * b).max(0.0).sqrt()
            } else {
                f64::INFINITY
            }
        };
        Some((both(of_gain.0, of_other.0), both(of_gain.1, of_other.1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hoid_model::Form;

    fn parameters_with_lag(rate: f64, error: f64) -> Vec<Parameter> {
        let operator = FamilyOperator::new(Form::LeadLag, true, &[5.0, 0.6, rate, 2.4, -1.2, 0.15]).unwrap();
        let mut covariance = vec![0.0; 36];
        for (i, s) in [0.2, 0.03, error, 0.1, 0.45, 0.01].iter().enumerate() {
            covariance[i * 7] = s * s;
        }
        CoordinateEstimate {
            operator: &operator,
            covariance: Some(&covariance),
            prior_share: &[0.0, 0.0, 0.0, 0.1, 0.8, 0.05],
            limits: &[
                (f64::NEG_INFINITY, f64::INFINITY),
                (0.0, 30.0),
                (1e-3, 30.0),
                (0.7, 5.0),
                (-4.0, 1.6),
                (0.0, 0.8),
            ],
            profile: &[None; 6],
            quantile: 2.0,
            run_to_run: 0.05,
        }
        .parameters()
    }

    fn of<'p>(all: &'p [Parameter], name: &str) -> &'p Parameter {
        all.iter().find(|p| p.name == name).unwrap()
    }

    #[test]
    fn determined_lag_has_a_finite_interval() {
        let all = parameters_with_lag(0.2, 0.02);
        let t_i = of(&all, "T_I");
        assert_eq!((t_i.value, t_i.determined), (5.0, true));
        let (low, high) = t_i.interval.unwrap();
        assert!((low - 1.0 / 0.24).abs() < 1e-12 && (high - 1.0 / 0.16).abs() < 1e-12);
        let k = of(&all, "K");
        assert!(k.determined && (k.value - 25.0).abs() < 1e-12);
        // The relative errors are .04 and .1. K is lowest where K/T_I is low and 1/T_I is high.
        let (low, high) = k.interval.unwrap();
        let below = ((5.0_f64 / 4.6).ln().powi(2) + (0.24_f64 / 0.2).ln().powi(2)).sqrt();
        let above = ((5.4_f64 / 5.0).ln().powi(2) + (0.2_f64 / 0.16).ln().powi(2)).sqrt();
        assert!((low - 25.0 * (-below).exp()).abs() < 1e-9 && (high - 25.0 * above.exp()).abs() < 1e-9);
        assert!((k.standard_error.unwrap() - 25.0 * (0.04_f64.powi(2) + 0.01).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn gain_error_for_the_person_includes_run_to_run_variation() {
        let all = parameters_with_lag(0.2, 0.02);
        let (gain, tau) = (of(&all, "K_over_T_I"), of(&all, "tau_e"));
        assert!((gain.standard_error_person.unwrap() - 0.2_f64.hypot(0.25)).abs() < 1e-12);
        assert_eq!(tau.standard_error_person, tau.standard_error);
        let person = gain.as_of_person();
        assert_eq!(person.standard_error, gain.standard_error_person);
        let (low, high) = person.interval.unwrap();
        let reach = 0.4 * person.standard_error.unwrap() / 0.2;
        assert!((low - (5.0 - reach)).abs() < 1e-12 && (high - (5.0 + reach)).abs() < 1e-12);
        assert_eq!(tau.as_of_person(), *tau);
    }

    #[test]
    fn parameter_is_averaged_over_the_forms_that_have_it() {
        let near = parameters_with_lag(0.2, 0.02);
        let mut far = of(&near, "tau_e").clone();
        far.value += 0.04;
        far.interval = far.interval.map(|(low, high)| (low + 0.04, high + 0.04));
        let tau = of(&near, "tau_e");
        let averaged = |weights: [f64; 2]| {
            Parameter::average(
                &[(Form::LeadLag, weights[0], tau), (Form::Lead2, weights[1], &far)],
                1000,
            )
            .unwrap()
        };
        let both = averaged([0.75, 0.25]);
        assert!((both.value - 0.16).abs() < 1e-12 && both.determined);
        // The variance exceeds the variance in each form by .75 .25 .04^2.
        assert!((both.standard_error.unwrap() - (1e-4_f64 + 3e-4).sqrt()).abs() < 1e-12);
        assert_eq!(both.averaged_over, [Form::LeadLag, Form::Lead2]);
        // The forms without this parameter are more likely.
        assert!(!averaged([0.2, 0.2]).determined);
        assert_eq!(Parameter::average(&[(Form::LeadLag, 1.0, tau)], 8).as_ref(), Some(tau));
        assert_eq!(Parameter::average(&[], 8), None);
    }

    /// T_I of a pure integration has no standard error. It is not part of the mean, but the interval has no upper
    /// limit.
    #[test]
    fn interval_includes_a_weighted_form_at_a_bound() {
        let known = parameters_with_lag(0.2, 0.02);
        let lag = of(&known, "T_I");
        let infinite = Parameter {
            value: f64::INFINITY,
            standard_error: None,
            standard_error_person: None,
            interval: None,
            determined: false,
            ..lag.clone()
        };
        let averaged = |weight: f64| {
            let forms = [(Form::LeadLag, 1.0 - weight, lag), (Form::Lead2Lag, weight, &infinite)];
            Parameter::average(&forms, 1000).unwrap()
        };
        let found = averaged(0.3);
        assert_eq!((found.value, found.standard_error), (lag.value, lag.standard_error));
        let (low, high) = found.interval.unwrap();
        assert!(low > 0.0 && low < lag.value && high.is_infinite(), "{low} {high}");
        assert!(averaged(0.01).interval.unwrap().1.is_finite());
    }

    #[test]
    fn undetermined_lag_has_no_upper_limit() {
        let all = parameters_with_lag(0.02, 0.03);
        for name in ["T_I", "K"] {
            let open = of(&all, name);
            assert!(!open.determined && open.interval.unwrap().1.is_infinite(), "{name}");
        }
        let ratio = of(&all, "K_over_T_I");
        assert!(ratio.determined && ratio.interval.unwrap() == (4.6, 5.4));
        // The prior determines the damping ratio, the data determine the frequency.
        assert!(!of(&all, "zeta_nm").determined && of(&all, "omega_nm").determined);
        // At the bound the lag is a pure integration.
        let at_bound = parameters_with_lag(1e-3, 0.02);
        assert!(of(&at_bound, "T_I").value.is_infinite() && of(&at_bound, "K").value.is_infinite());
    }
}
