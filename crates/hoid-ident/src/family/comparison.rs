//! Comparison of the candidate forms, the basis of their weights in [`super::choice`].
//!
//! If an excitation was recorded, the forms are compared at its lines, otherwise by their prediction errors. All forms
//! share one inflation kappa, so a form does not profit from a large kappa of its own. Without lines, the noise model
//! biases the prediction errors: the best form is chosen as with lines, but its evidence against the other forms is
//! reduced ([`evidence_bias_ratio`]). With little noise ([`super::low_noise`]) one form is assumed to be true, and a
//! parameter costs Schwarz's `ln n` (G. Schwarz, *Annals of Statistics* 6 (1978) 461-464) instead of Akaike's 2. A form
//! with undetermined parameters counts only if all forms have undetermined parameters.

use hoid_model::{FamilyOperator, Form, operator_family::Coordinate};
use hoid_numerics::statistics::upper_median;

use super::{
    choice::{FormFigures, best_form, weights},
    coordinates::integration_vanishes,
    covariances::{self, Covariances},
    diagnostics::MAX_DAMPING_RATIO,
    line_fit::LineFit,
    parameter::is_dc_gain,
    prediction::PredictionProblem,
    prediction_fit::PredictionFit,
    sensitivity::alternative_fits,
};
use crate::{IdentError, criterion::Workspace};

/// Difference of the criteria below which two forms count as equal.
const CRITERION_TOLERANCE: f64 = 0.05;
/// Ratio of sums of squares up to which forms without noise count as equally good.
const EQUAL_FIT_RATIO: f64 = 1.1;
/// Number of standard errors by which a gain must differ from zero to count as determined.
const MIN_STANDARD_ERRORS: f64 = 2.0;

/// A form with its fits.
pub(super) struct TriedForm<'a> {
    pub form: Form,
    pub lines: Option<LineFit>,
    pub fit: Result<PredictionFit<'a>, IdentError>,
}

impl TriedForm<'_> {
    /// Returns the form with its gain at low frequency in the first record; `None` without such a gain.
    pub fn dc_gain(&self) -> Option<(Form, f64)> {
        let fit = self.fit.as_ref().ok()?;
        let operator = fit.layout().operator(fit.eta(), 0).ok()?;
        let gain = operator.named_parameters().into_iter().find(|p| is_dc_gain(p.name))?;
        Some((self.form, gain.value))
    }

    /// True if the operator of the prediction error fit or of the fit at the lines has a property.
    fn any_operator(&self, has: impl Fn(&FamilyOperator) -> bool) -> bool {
        let fit = self.fit.as_ref().ok();
        let of_fit = fit.and_then(|fit| fit.layout().operator(fit.eta(), 0).ok());
        of_fit.as_ref().is_some_and(&has) || self.lines.as_ref().is_some_and(|lines| has(&lines.operator))
    }
}

/// Criteria of all forms, and the best form.
pub(super) struct Comparison {
    /// Index of the best form; `None` if no form could be fitted.
    pub best: Option<usize>,
    /// Criteria of each form, in the order in which the forms were given.
    pub figures: Vec<FormFigures>,
}

impl Comparison {
    /// Compares the forms, given in the order from the simplest.
    pub fn of(
        tried: &[TriedForm<'_>],
        prediction: &PredictionProblem<'_>,
        highest_order: usize,
        workspace: &mut Workspace,
    ) -> Self {
        let counted = |criteria: &[Option<f64>]| {
            let mut counting = criteria.to_vec();
            let noise_free = prediction.noise_free_share().is_some();
            if noise_free {
                keep_best_fits(&mut counting, tried, prediction.equality_threshold());
            }
            // If a form lacks a lag that the person has, the neuromuscular poles replace this lag.
            retain(&mut counting, |i| !tried[i].any_operator(neuromuscular_poles_are_lags));
            retain(&mut counting, |i| {
                tried[i].fit.as_ref().is_ok_and(|fit| !is_undetermined(fit))
                    && !tried[i].any_operator(integration_vanishes)
            });
            if noise_free {
                keep_simplest(&mut counting, tried);
            }
            exclude_equivalent_form(&mut counting, tried);
            counting
        };
        let mut criteria = self::criteria(tried, prediction, 1.0);
        let best = best_form(&counted(&criteria));
        if let Some(best) = best.filter(|_| comparison_is_biased(tried, prediction)) {
            let bias = evidence_bias_ratio(&tried[best], prediction, highest_order, workspace);
            criteria = self::criteria(tried, prediction, bias);
        }
        let weights = best.map_or(Vec::new(), |best| weights(&counted(&criteria), best));
        let figures = tried.iter().zip(criteria).enumerate();
        let figures =
            figures.map(|(i, (t, criterion))| form_figures(t, criterion, weights.get(i).copied().unwrap_or(0.0)));
        Self {
            best,
            figures: figures.collect(),
        }
    }
}

/// Excludes the quadratic form if it is equivalent to the lead with a droop. The lead with a droop is the quadratic
/// form with real zeros, so both forms can converge to the same operator, which must count only once.
fn exclude_equivalent_form(counting: &mut [Option<f64>], tried: &[TriedForm<'_>]) {
    let place = |form: Form| tried.iter().position(|t| t.form == form);
    if let (Some(quadratic), Some(droop)) = (place(Form::QuadraticIntegral), place(Form::LeadDroop))
        && let (Some(one), Some(two)) = (counting[quadratic], counting[droop])
        && (one - two).abs() < CRITERION_TOLERANCE
    {
        counting[quadratic] = None;
    }
}

/// Keeps only the forms that fit equally well. Without noise, the residual of a wrong form is many times larger than
/// that of the right form, whichever parameters it determines. Sums of squares below `equal` count as equal.
fn keep_best_fits(counting: &mut [Option<f64>], tried: &[TriedForm<'_>], equal: f64) {
    let squares = |i: usize| {
        let fit = tried[i].fit.as_ref().ok();
        fit.map_or(f64::INFINITY, |fit| (fit.loss * fit.residuals as f64).max(equal))
    };
    let those = (0..tried.len()).filter(|i| counting[*i].is_some());
    let least = those.map(squares).fold(f64::INFINITY, f64::min);
    retain(counting, |i| squares(i) <= EQUAL_FIT_RATIO * least);
}

/// Keeps only the forms with the fewest parameters.
fn keep_simplest(counting: &mut [Option<f64>], tried: &[TriedForm<'_>]) {
    let fit = |i: usize| tried[i].fit.as_ref().ok();
    let size = |i: usize| fit(i).map_or(usize::MAX, |fit| fit.layout().operator_element_count());
    let fewest = (0..tried.len()).filter(|i| counting[*i].is_some()).map(size).min();
    retain(counting, |i| Some(size(i)) == fewest);
}

/// Keeps only the forms that satisfy a condition; keeps all forms if none of the remaining forms satisfies it.
fn retain(counting: &mut [Option<f64>], is_good: impl Fn(usize) -> bool) {
    let good: Vec<bool> = (0..counting.len())
        .map(|i| counting[i].is_some() && is_good(i))
        .collect();
    if good.contains(&true) {
        counting
            .iter_mut()
            .zip(good)
            .filter(|(_, good)| !good)
            .for_each(|(c, _)| *c = None);
    }
}

/// True if a combination of parameters is undetermined or a gain does not differ significantly from zero. The other
/// parameters of the form are then meaningless, and a form with fewer parameters is equivalent.
fn is_undetermined(fit: &PredictionFit<'_>) -> bool {
    let p = fit.parameter_count();
    let known = |covariances: Covariances| {
        let mut gains = fit
            .layout()
            .elements
            .iter()
            .enumerate()
            .filter(|(_, (c, _))| *c == Coordinate::Gain);
        gains.all(|(at, _)| MIN_STANDARD_ERRORS * covariances.clustered[at * p + at].sqrt() < fit.eta()[at].abs())
    };
    fit.ridge > 0.0 || !covariances::covariances(fit).is_some_and(known)
}

/// True if the neuromuscular poles have become two separate lags.
fn neuromuscular_poles_are_lags(operator: &FamilyOperator) -> bool {
    operator
        .neuromuscular_parameters()
        .is_some_and(|(_, zeta)| zeta > MAX_DAMPING_RATIO)
}

/// Returns the median of kappa over the forms, used for all forms so that their criteria are comparable.
fn common_inflation(tried: &[TriedForm<'_>]) -> f64 {
    let fits = tried.iter().filter_map(|t| t.fit.as_ref().ok());
    let mut all: Vec<f64> = fits.map(|fit| fit.inflation).collect();
    upper_median(&mut all).unwrap_or(1.0)
}

/// True if the forms are compared by prediction errors alone, so the noise model biases the comparison.
fn comparison_is_biased(tried: &[TriedForm<'_>], prediction: &PredictionProblem<'_>) -> bool {
    tried.len() > 1 && prediction.little_noise.is_none() && tried.iter().all(|t| t.lines.is_none())
}

/// Returns the ratio of the mean squared error of the response, which includes the bias due to the noise model, to its
/// variance, averaged over the band of manual control.
///
/// In a closed loop without lines, an error in the noise model biases the estimate ([`super::sensitivity`]), and a
/// wrong form may fit better than the right one because it compensates for that error. The logarithm of the likelihood
/// ratio of two forms is proportional to a squared distance in units of the errors; if the bias enlarges the errors,
/// this logarithm decreases accordingly.
fn evidence_bias_ratio(
    best: &TriedForm<'_>,
    prediction: &PredictionProblem<'_>,
    highest_order: usize,
    workspace: &mut Workspace,
) -> f64 {
    let ratio = best.fit.as_ref().ok().and_then(|fit| {
        let mut covariances = covariances::covariances(fit)?;
        let operator = fit.layout().operator(fit.eta(), 0).ok()?;
        let errors = |covariances: &Covariances| {
            let own = Covariances::of_operator(&covariances.clustered, fit.layout(), 0);
            covariances::response_errors(&operator, Some(&own))
        };
        let before = errors(&covariances)?;
        for other in alternative_fits(prediction, fit, highest_order, workspace) {
            covariances.add_bias(fit, &other);
        }
        let ratios = errors(&covariances)?
            .into_iter()
            .zip(before)
            .map(|(after, before)| (after / before).powi(2));
        Some(ratios.sum::<f64>() / before.len() as f64)
    });
    ratio.filter(|ratio| ratio.is_finite()).unwrap_or(1.0).max(1.0)
}

/// Returns the criterion of each form; `None` for a form that could not be fitted.
fn criteria(tried: &[TriedForm<'_>], prediction: &PredictionProblem<'_>, bias: f64) -> Vec<Option<f64>> {
    let little_noise = prediction.little_noise.is_some();
    let inflation = if little_noise {
        // The inflation of the form with the smallest loss is used, because the inflation of the other forms results
        // from their misfit.
        let fits = tried.iter().filter_map(|t| t.fit.as_ref().ok());
        let least = fits.min_by(|a, b| a.loss.total_cmp(&b.loss));
        least.map_or(1.0, |fit| fit.inflation)
    } else {
        bias * common_inflation(tried)
    };
    let of = |tried: &TriedForm<'_>| {
        let fit = tried.fit.as_ref().ok()?;
        let n = fit.residuals as f64;
        let misfit = match &tried.lines {
            Some(of_lines) => of_lines.chi_squared,
            None => n * fit.loss.max(prediction.equality_threshold() / n).ln() / inflation,
        };
        let cost = if little_noise { n.ln() } else { 2.0 };
        Some(misfit + cost * fit.layout().operator_element_count() as f64)
    };
    tried.iter().map(of).collect()
}

fn form_figures(tried: &TriedForm<'_>, criterion: Option<f64>, weight: f64) -> FormFigures {
    FormFigures {
        form: tried.form,
        loss: tried.fit.as_ref().ok().map(|f| f.loss),
        criterion,
        weight,
        held_out: tried.lines.as_ref().and_then(LineFit::held_out_total),
        chi_squared: tried.lines.as_ref().map(|l| l.chi_squared),
        degrees_of_freedom: tried.lines.as_ref().map(|l| l.degrees_of_freedom),
        converged: tried.fit.as_ref().is_ok_and(|f| f.minimum.termination.converged()),
    }
}
