//! Selection of the forms that the data do not reject, and of the best form.
//!
//! Each form has a value of Akaike's criterion: `chi^2 + 2 p` at the lines of an excitation, or `n ln V/kappa + 2 p`
//! from the prediction error, where kappa is the inflation of variances. With little noise Schwarz's criterion is used
//! instead ([`super::comparison`]). Estimates are averaged over forms with weights that follow from the criterion
//! ([`super::mixture`]). The reported parameters are the parameters of the best form. The best form is the simplest
//! form within 2 of the smallest value, since a difference of up to 2 is no evidence against a form (K. P. Burnham and
//! D. R. Anderson, *Model Selection and Multimodel Inference*, 2002, section 2.6).

use hoid_model::Form;

/// Criteria of a form.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FormFigures {
    /// The form.
    pub form: Form,
    /// Loss of the prediction error fit.
    pub loss: Option<f64>,
    /// Akaike's criterion: `chi^2 + 2 p` at the lines, or `n ln V/kappa + 2 p` without lines. With little noise,
    /// Schwarz's criterion, which has `ln n` in place of 2.
    pub criterion: Option<f64>,
    /// Weight in averages over forms; zero for a form that the data reject or do not determine.
    pub weight: f64,
    /// chi^2 of each held-out run at the lines, computed with the fit to the other runs and summed over all runs.
    pub held_out: Option<f64>,
    /// chi^2 of the fit at the lines.
    pub chi_squared: Option<f64>,
    /// Degrees of freedom of chi^2.
    pub degrees_of_freedom: Option<usize>,
    /// True if the prediction error search converged within the search range.
    pub converged: bool,
}

/// Difference from the smallest value of Akaike's criterion up to which there is no evidence against a form.
pub const NEGLIGIBLE_AIC_DIFFERENCE: f64 = 2.0;
/// Weight below which a form is omitted from averages, because its contribution would be smaller than the error of the
/// mean.
pub const MIN_WEIGHT: f64 = 0.02;
/// Maximum number of forms that are averaged.
const MAX_FORMS: usize = 4;

/// Returns the index of the best form, given the criteria of all forms with the simplest form first. A criterion of
/// `None` excludes a form. `None` if all forms are excluded.
pub(super) fn best_form(criteria: &[Option<f64>]) -> Option<usize> {
    let least = criteria.iter().flatten().copied().min_by(f64::total_cmp)?;
    criteria
        .iter()
        .position(|c| c.is_some_and(|c| c - least <= NEGLIGIBLE_AIC_DIFFERENCE))
}

/// Returns the weight of each form; a criterion of `None` excludes a form, and `best` is the best form.
pub(super) fn weights(criteria: &[Option<f64>], best: usize) -> Vec<f64> {
    let least = criteria.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    // Akaike weights, exp(-Delta/2) (Burnham and Anderson 2002, section 2.9).
    let mut weights: Vec<f64> = (criteria.iter())
        .map(|c| c.map_or(0.0, |c| (0.5 * (least - c)).exp()))
        .collect();
    let mut order: Vec<usize> = (0..weights.len()).collect();
    order.sort_by(|a, b| weights[*b].total_cmp(&weights[*a]));
    let total: f64 = weights.iter().sum();
    for (rank, &i) in order.iter().enumerate() {
        if i != best && (rank >= MAX_FORMS || weights[i] < MIN_WEIGHT * total) {
            weights[i] = 0.0;
        }
    }
    let total: f64 = weights.iter().sum();
    weights.iter().map(|w| w / total).collect()
}

/// Returns the Akaike weight of the forms that satisfy a condition, among all forms with a criterion. Unlike the weight
/// in averages, it includes forms that the data do not reject but whose parameters they do not determine.
pub(super) fn evidence_for<'f>(
    figures: impl Iterator<Item = &'f FormFigures> + Clone,
    is_meant: impl Fn(Form) -> bool,
) -> f64 {
    let known = || figures.clone().filter_map(|of| Some((of.form, of.criterion?)));
    let least = known().map(|(_, c)| c).fold(f64::INFINITY, f64::min);
    let weight = |(_, c): (Form, f64)| (0.5 * (least - c)).exp();
    let total: f64 = known().map(weight).sum();
    if total > 0.0 {
        known().filter(|(form, _)| is_meant(*form)).map(weight).sum::<f64>() / total
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn weigh(criteria: &[Option<f64>]) -> Option<(usize, Vec<f64>)> {
        let best = best_form(criteria)?;
        Some((best, weights(criteria, best)))
    }

    #[test]
    fn akaike_weights_and_preference_for_the_simplest_form() {
        let (best, weights) = weigh(&[Some(13.0), Some(2.5), Some(1.0), None]).unwrap();
        assert_eq!(best, 1);
        let of_second = 1.0 / (1.0 + (-0.75_f64).exp());
        let expected = [0.0, 1.0 - of_second, of_second, 0.0];
        assert!(
            weights.iter().zip(expected).all(|(w, e)| (w - e).abs() < 1e-12),
            "{weights:?}"
        );
        assert_eq!(weigh(&[Some(4.0), Some(1.5), Some(1.0)]).unwrap().0, 1);
        assert_eq!(weigh(&[None, None]), None);
        assert_eq!(weigh(&[]), None);
        assert_eq!(weigh(&[None, Some(5.0)]), Some((1, vec![0.0, 1.0])));
    }

    /// A form without a weight in averages counts as evidence.
    #[test]
    fn evidence_includes_forms_with_undetermined_parameters() {
        let figures = |form, criterion, weight| FormFigures {
            form,
            loss: Some(1.0),
            criterion,
            weight,
            held_out: None,
            chi_squared: None,
            degrees_of_freedom: None,
            converged: true,
        };
        let all = [
            figures(Form::LeadDroop, Some(10.0), 1.0),
            figures(Form::LeadLag, Some(12.0), 0.0),
            figures(Form::Gain, None, 0.0),
        ];
        let without_lag = evidence_for(all.iter(), |form| !form.has_lag());
        assert!((without_lag - 1.0 / (1.0 + (-1.0_f64).exp())).abs() < 1e-12);
        assert_eq!(evidence_for(all[..1].iter(), |form| !form.has_lag()), 1.0);
        assert_eq!(evidence_for([].iter(), |_| false), 1.0);
    }

    #[test]
    fn number_of_weighed_forms_is_limited() {
        let (_, weights) = weigh(&[Some(1.0); 8]).unwrap();
        assert_eq!(weights.iter().filter(|w| **w > 0.0).count(), 4);
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
}
