//! What the forms that were tried are worth: what [`super::choice`] weighs them by.
//!
//! Where an excitation was recorded, forms are compared at its lines; else by their prediction
//! errors, all in units of one inflation kappa, so that a form does not look well by its own large
//! variance. A form whose parameters the data leave open counts only where all are so.

use hoid_model::{FamilyOperator, Form};

use super::{
    choice::{FormFigures, weigh},
    judgement::MOST_DAMPED,
    line_fit::LineFit,
    prediction_fit::PredictionFit,
};
use crate::IdentError;

/// A form with what was found of it.
pub(super) struct Tried<'a> {
    pub form: Form,
    pub lines: Option<LineFit>,
    pub fit: Result<PredictionFit<'a>, IdentError>,
}

/// What all forms are worth, and which of them stands in front.
pub(super) struct Comparison {
    /// Place of the form in front; `None` where none could be fitted.
    pub front: Option<usize>,
    /// Of each form, in their order.
    pub figures: Vec<FormFigures>,
}

impl Comparison {
    /// The forms are ordered from the simplest.
    pub fn of(tried: &[Tried<'_>]) -> Self {
        let inflation = common_inflation(tried);
        let criteria: Vec<Option<f64>> = tried.iter().map(|t| criterion(t, inflation)).collect();
        let mut counting = criteria.clone();
        // A form that lacks a lag, where there is one, takes the neuromuscular poles for it.
        retain(&mut counting, |i| !has_lost_its_muscles(&tried[i]));
        retain(&mut counting, |i| tried[i].fit.as_ref().is_ok_and(|fit| fit.ridge == 0.0));
        let (front, weights) = weigh(&counting).map_or((None, Vec::new()), |(front, weights)| (Some(front), weights));
        let figures = tried.iter().zip(criteria).enumerate();
        let figures = figures.map(|(i, (t, criterion))| figures_of(t, criterion, weights.get(i).copied().unwrap_or(0.0)));
        Self {
            front,
            figures: figures.collect(),
        }
    }
}

/// Leaves those that are good, where any of those that count is.
fn retain(counting: &mut [Option<f64>], is_good: impl Fn(usize) -> bool) {
    let good: Vec<bool> = (0..counting.len()).map(|i| counting[i].is_some() && is_good(i)).collect();
    if good.contains(&true) {
        counting.iter_mut().zip(good).filter(|(_, good)| !good).for_each(|(c, _)| *c = None);
    }
}

/// True where the neuromuscular poles have become two lags, by prediction error or at the lines.
fn has_lost_its_muscles(tried: &Tried<'_>) -> bool {
    let lags = |operator: &FamilyOperator| operator.neuromuscular().is_some_and(|(_, zeta)| zeta > MOST_DAMPED);
    let of_fit = tried
        .fit
        .as_ref()
        .ok()
        .and_then(|fit| fit.layout().operator(fit.eta(), 0).ok());
    of_fit.is_some_and(|operator| lags(&operator)) || tried.lines.as_ref().is_some_and(|l| lags(&l.operator))
}

/// One kappa for all forms, so that their criteria can be compared: the median.
fn common_inflation(tried: &[Tried<'_>]) -> f64 {
    let fits = tried.iter().filter_map(|t| t.fit.as_ref().ok());
    let mut all: Vec<f64> = fits.map(|fit| fit.inflation).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(1.0)
}

/// Akaike's criterion; `None` for a form that could not be fitted.
fn criterion(tried: &Tried<'_>, inflation: f64) -> Option<f64> {
    let fit = tried.fit.as_ref().ok()?;
    let misfit = match &tried.lines {
        Some(of_lines) => of_lines.chi_squared,
        None => fit.residuals as f64 * fit.loss.ln() / inflation,
    };
    Some(misfit + 2.0 * fit.layout().operator_elements() as f64)
}

fn figures_of(tried: &Tried<'_>, criterion: Option<f64>, weight: f64) -> FormFigures {
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
