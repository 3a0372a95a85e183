//! Starts of the searches for the operator, and the orders of its noise model.
//!
//! The loss of the prediction error has local minima in delay, leads, lags and poles, so a search finds the operator
//! only from a start in its valley. Each form has these starts:
//!
//! 1. **At the lines**, if there are lines: the form fitted to the describing function.
//! 2. **From the response of a high-order ARX model** ([`super::arx_response`]): minima of
//!    `chi^2 = sum_j 2 |H_j - Y(j omega_j)|^2 / v_j`, searched from the best grid point of each delay, with a prior and
//!    without one. With a prior the search avoids minima that are implausible for people; without one it also finds the
//!    operator of an atypical person. The errors of H are correlated between frequencies, which chi^2 ignores, so its
//!    lowest minimum need not belong to the operator. The minima are therefore ranked by their prediction error
//!    `n ln V + sum_i (g_i - m_i)^2/s_i^2`, where V is the innovation variance of an autoregression of `u - Y e`, and
//!    the best of them that differ in their responses are starts.
//!
//! The noise model has the orders that are selected for the start with the smallest prediction error.

use hoid_model::Form;

use super::{
    coordinates::GridDensity,
    line_fit::{LineFit, line_fit},
    lines::LineData,
    noise::{Autoregression, NoiseProducts, Penalty},
    options::FamilyEstimator,
    prediction::{NoiseOrders, PredictionProblem},
    prior::OperatorPrior,
    response_fit::{MeasuredResponse, ResponseCriterion},
};
use crate::{IdentError, criterion::Workspace};

/// Number of minima for the response from which prediction error searches for a form are started; twice as many
/// without a prior.
const SEARCH_COUNT: usize = 2;
/// Relative difference of the responses of two minima below which only one of them is a start.
const SAME_RESPONSE_TOLERANCE: f64 = 0.1;
/// Order of the autoregression with which the minima for the response are compared.
const FIRST_NOISE_ORDER: usize = 8;

/// Starts of the searches for one form.
pub(super) struct Start {
    pub form: Form,
    /// Fit at the lines, if there are lines.
    pub lines: Option<LineFit>,
    /// Starting coordinates, one set per search.
    pub coordinates: Vec<Vec<f64>>,
}

impl FamilyEstimator {
    /// Returns the criterion for the measured response of a form.
    pub(super) fn response_criterion<'p>(
        &self,
        form: Form,
        points: &'p [MeasuredResponse],
        prior: &OperatorPrior,
        prediction: &PredictionProblem<'_>,
    ) -> ResponseCriterion<'p> {
        ResponseCriterion::new(
            form,
            self.neuromuscular,
            points,
            prior,
            prediction.delay_range_s,
            (prediction.sample_time, prediction.intersample),
        )
    }

    /// Returns the fit of a form at the lines and the starting coordinates of its searches: the coordinates of the fit
    /// at the lines, and the minima for the response of the ARX model that have the smallest prediction errors.
    pub(super) fn prepare_start(
        &self,
        form: Form,
        lines: Option<&LineData<'_>>,
        response: &[MeasuredResponse],
        prediction: &PredictionProblem<'_>,
        workspace: &mut Workspace,
    ) -> Result<Start, IdentError> {
        let mut start = Start {
            form,
            lines: None,
            coordinates: Vec::new(),
        };
        if let Some(lines) = lines {
            let criterion = self.response_criterion(form, &lines.points, &self.prior, prediction);
            let (fit, found) = line_fit(lines, &criterion, &self.search)?;
            start.coordinates.push(found.coordinates);
            start.lines = Some(fit);
        }
        if !response.is_empty() {
            let criterion = self.response_criterion(form, response, &self.prior, prediction);
            let (other, searches) = match self.prior.entries() {
                [] => (OperatorPrior::population(), 2 * SEARCH_COUNT),
                _ => (OperatorPrior::none(), SEARCH_COUNT),
            };
            let other = self.response_criterion(form, response, &other, prediction);
            let minima = [&criterion, &other].map(|c| c.minima(&self.search, GridDensity::Default));
            let minima: Vec<Vec<f64>> = minima.into_iter().flatten().map(|found| found.coordinates).collect();
            let cost = |found: &[f64], workspace: &mut Workspace| {
                let error = self.residual_autoregression(prediction, form, found, FIRST_NOISE_ORDER, workspace)?;
                let prior: f64 = criterion.penalty.iter().map(|penalty| penalty.at(found)).sum();
                Some(prediction.sample_count() as f64 * error.loss.ln() + prior)
            };
            let mut minima: Vec<(f64, Vec<f64>)> = minima
                .into_iter()
                .map(|found| (cost(&found, workspace).unwrap_or(f64::INFINITY), found))
                .collect();
            minima.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut chosen: Vec<Vec<f64>> = Vec::new();
            for (_, found) in minima {
                if !chosen
                    .iter()
                    .any(|known| criterion.distance(known, &found) < SAME_RESPONSE_TOLERANCE)
                {
                    chosen.push(found);
                }
            }
            chosen.truncate(searches);
            start.coordinates.extend(chosen);
        }
        Ok(start)
    }

    /// Returns the autoregression, of this order at most, of the part of u that an operator does not explain.
    fn residual_autoregression(
        &self,
        prediction: &PredictionProblem<'_>,
        form: Form,
        coordinates: &[f64],
        order: usize,
        workspace: &mut Workspace,
    ) -> Option<Autoregression> {
        let series = prediction.unexplained_output((form, self.neuromuscular), coordinates, workspace);
        NoiseProducts::new(&series.ok()?, order).fit_up_to(order)
    }

    /// Returns the index of the form with a start whose residual is smallest after whitening by an autoregression of
    /// this order.
    pub(super) fn form_with_smallest_residual(
        &self,
        prediction: &PredictionProblem<'_>,
        starts: &[Start],
        order: usize,
        workspace: &mut Workspace,
    ) -> Result<usize, IdentError> {
        let mut least: Option<(f64, usize)> = None;
        for (i, start) in starts.iter().enumerate() {
            for coordinates in &start.coordinates {
                if let Some(found) = self.residual_autoregression(prediction, start.form, coordinates, order, workspace)
                    && least.is_none_or(|(loss, _)| found.loss < loss)
                {
                    least = Some((found.loss, i));
                }
            }
        }
        least.map(|(_, i)| i).ok_or(IdentError::NoFiniteLoss)
    }

    /// Selects the orders of the noise model by Akaike's criterion, for the form with the smallest residual.
    pub(super) fn noise_orders(
        &self,
        prediction: &PredictionProblem<'_>,
        starts: &[Start],
        workspace: &mut Workspace,
    ) -> Result<NoiseOrders, IdentError> {
        let highest = *self.nd().end();
        let mut left: Vec<(Form, &Vec<f64>, NoiseProducts)> = Vec::new();
        for &Start {
            form, ref coordinates, ..
        } in starts
        {
            for start in coordinates {
                if let Ok(series) = prediction.unexplained_output((form, self.neuromuscular), start, workspace) {
                    left.push((form, start, NoiseProducts::new(&series, highest)));
                }
            }
        }
        let losses = |fit: fn(&NoiseProducts, usize) -> Option<Autoregression>| {
            let of = |(i, (_, _, products)): (usize, &(Form, &Vec<f64>, NoiseProducts))| {
                Some((fit(products, highest)?.loss, i))
            };
            left.iter()
                .enumerate()
                .filter_map(of)
                .min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let (_, least) = losses(NoiseProducts::fit)
            .or_else(|| losses(NoiseProducts::fit_up_to))
            .ok_or(IdentError::NoFiniteLoss)?;
        let (form, start, products) = left.swap_remove(least);
        let autoregression = products
            .best_order(self.nd(), Penalty::Akaike)
            .ok_or(IdentError::NoFiniteLoss)?;
        if *self.nc.end() == 0 {
            return Ok((0, autoregression));
        }
        let mut least: Option<(f64, NoiseOrders)> = None;
        for nc in self.nc.clone() {
            for nd in self.nd() {
                let Ok(fit) = prediction.fit((form, self.neuromuscular), (nc, nd), start, workspace) else {
                    continue;
                };
                let value = fit.residuals as f64 * fit.loss.ln() + 2.0 * (nc + nd) as f64;
                if least.is_none_or(|(known, _)| value < known) {
                    least = Some((value, (nc, nd)));
                }
            }
        }
        least.map(|(_, orders)| orders).ok_or(IdentError::NoFiniteLoss)
    }
}
