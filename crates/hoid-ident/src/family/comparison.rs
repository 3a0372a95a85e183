//! Which form of those that were tried: what [`super::choice`] decides by.
//!
//! Where an excitation was recorded, forms are compared at its lines; else by their prediction
//! errors, all in units of one inflation kappa and one innovation variance, so that a form does not
//! look well by its own large variance.

use hoid_model::{FamilyOperator, Form};

use super::{
    choice::{Candidate, FormFigures, choose},
    clusters::ClusterKind,
    covariances,
    judgement::MOST_DAMPED,
    line_fit::LineFit,
    lines::LineData,
    prediction_fit::PredictionFit,
};
use crate::{IdentError, criterion::Workspace};

/// Runs from which on each can be held out.
const FEWEST_HELD_OUT: usize = 3;

/// A form with what was found of it.
pub(super) struct Tried<'a> {
    pub form: Form,
    pub lines: Option<LineFit>,
    pub fit: Result<PredictionFit<'a>, IdentError>,
}

/// What all forms are worth, and which of them is the choice.
pub(super) struct Comparison {
    /// Place of the choice among the forms; `None` where none could be fitted.
    pub chosen: Option<usize>,
    /// Of each form, in their order.
    pub figures: Vec<FormFigures>,
}

impl Comparison {
    /// The forms are ordered from the simplest.
    pub fn of(tried: &[Tried<'_>], lines: Option<&LineData<'_>>, workspace: &mut Workspace) -> Self {
        let scale = CommonScale::of(tried);
        let mut candidates: Vec<(usize, Candidate)> = tried
            .iter()
            .enumerate()
            .filter_map(|(i, t)| Some((i, candidate(t, lines, &scale, workspace)?)))
            .collect();
        let figures = tried.iter().map(|t| figures(t, &candidates)).collect();
        // A form that lacks a lag, where there is one, takes the neuromuscular poles for it.
        if candidates.iter().any(|(i, _)| !has_lost_its_muscles(&tried[*i])) {
            candidates.retain(|(i, _)| !has_lost_its_muscles(&tried[*i]));
        }
        let (places, only): (Vec<usize>, Vec<Candidate>) = candidates.into_iter().unzip();
        Self {
            chosen: choose(&only).and_then(|i| places.get(i).copied()),
            figures,
        }
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

/// One kappa and one innovation variance for all forms, so that their figures can be compared: the
/// median of the one, the least of the other.
struct CommonScale {
    inflation: f64,
    innovation_variance: f64,
}

impl CommonScale {
    fn of(tried: &[Tried<'_>]) -> Self {
        let fits = || tried.iter().filter_map(|t| t.fit.as_ref().ok());
        let mut all: Vec<f64> = fits().map(|fit| fit.inflation).collect();
        all.sort_by(f64::total_cmp);
        Self {
            inflation: all.get(all.len() / 2).copied().unwrap_or(1.0),
            innovation_variance: fits().map(|fit| fit.innovation_variance).fold(f64::INFINITY, f64::min),
        }
    }
}

/// What a parameter costs: Schwarz's `ln n`, and Akaike's 2 where there are too few runs to hold
/// any out. The form is then chosen to predict, since one that is too simple bends the response.
fn cost(n: f64, runs: usize) -> f64 {
    if runs >= FEWEST_HELD_OUT { n.ln() } else { 2.0 }
}

fn candidate(
    tried: &Tried<'_>,
    lines: Option<&LineData<'_>>,
    scale: &CommonScale,
    workspace: &mut Workspace,
) -> Option<Candidate> {
    let fit = tried.fit.as_ref().ok()?;
    let elements = fit.layout().operator_elements() as f64;
    let (held_out, criterion) = match (&tried.lines, lines) {
        (Some(of_lines), Some(lines)) => {
            let equations = (2 * lines.points.len() * lines.runs()) as f64;
            (
                of_lines.held_out.clone(),
                of_lines.chi_squared + elements * cost(equations, lines.runs()),
            )
        }
        _ => {
            let n = fit.residuals as f64;
            let held_out = held_out(fit, scale, workspace);
            let runs = held_out.as_ref().map_or(1, Vec::len);
            (held_out, n * fit.loss.ln() / scale.inflation + elements * cost(n, runs))
        }
    };
    Some(Candidate {
        form: tried.form,
        held_out,
        criterion,
    })
}

/// Squared prediction errors of each run under the fit without it, in units of the innovation
/// variance; for clusters that are runs.
fn held_out(fit: &PredictionFit<'_>, scale: &CommonScale, workspace: &mut Workspace) -> Option<Vec<f64>> {
    if fit.clusters.kind != ClusterKind::Runs {
        return None;
    }
    let others = covariances::without_each(fit)?;
    let of = |(run, eta): (usize, &Vec<f64>)| Some(fit.squares_of(eta, run, workspace)? / scale.innovation_variance);
    others.iter().enumerate().map(of).collect()
}

fn figures(tried: &Tried<'_>, candidates: &[(usize, Candidate)]) -> FormFigures {
    let own = candidates.iter().find(|(_, c)| c.form == tried.form).map(|(_, c)| c);
    FormFigures {
        form: tried.form,
        loss: tried.fit.as_ref().ok().map(|f| f.loss),
        criterion: own.map(|c| c.criterion),
        held_out: own.and_then(|c| c.held_out.as_ref()).map(|h| h.iter().sum()),
        chi_squared: tried.lines.as_ref().map(|l| l.chi_squared),
        degrees_of_freedom: tried.lines.as_ref().map(|l| l.degrees_of_freedom),
        converged: tried.fit.as_ref().is_ok_and(|f| f.minimum.termination.converged()),
    }
}
