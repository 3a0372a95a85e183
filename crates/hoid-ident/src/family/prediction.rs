//! Prediction error fit of an operator of the family with its noise model.
//!
//! The model is `u = Y e + (C/D) eps`, where Y is the exact discretisation of the operator for the intersample
//! behaviour of the error. The criterion of the general model ([`crate::criterion`]) is used as a function of the
//! coordinates of the family. A prior is added to the sum of squares as `kappa sigma^2 sum_i (g_i - m_i)^2/s_i^2`. Here
//! sigma^2 is the innovation variance, and kappa is the ratio of the variances from clusters (runs, or blocks of runs)
//! to the variances for white residuals. People vary in ways that no stationary noise describes, so their samples
//! contain less information than as many samples of a simulation (M. Ribatet, D. Cooley and A. C. Davison, *Statistica
//! Sinica* 22 (2012) 813-845, the magnitude adjustment).

use hoid_model::{
    SampleTime,
    operator_family::{Coordinate, Form},
};

use super::{
    channel::Channel,
    clusters::Clusters,
    coordinates, covariances,
    intersample::Intersample,
    layout::FamilyLayout,
    noise::{Autoregression, NoiseProducts},
    prediction_fit::{PredictionFit, UNDETERMINED_RIDGE},
    prior::OperatorPrior,
};
use crate::{
    IdentError, InitialState, Reason, SearchOptions,
    criterion::{Data, Workspace, first_residual},
    grey_box::{
        objective::{Penalty, PhysicalCriterion},
        parametrisation::Parametrisation,
    },
    linalg::vectors::dot,
    optimize::Minimum,
};

/// Residual power relative to the power of u below which the residual is not noise but rounding errors of the file.
pub(super) const ROUNDING_POWER: f64 = 1e-8;
/// Relative residual power below which forms count as equal, because chance determines where a noise-free search ends.
pub(super) const EQUAL_RESIDUAL_POWER: f64 = 1e-18;
/// Maximum number of rounds in which the weight kappa sigma^2 of the prior is updated.
const MAX_ROUNDS: usize = 3;
/// Number of steps after which a search from a further start ends if its objective is above the known one.
const TRIAL_STEPS: usize = 30;
/// Relative change in the weight of the prior below which no further round is needed.
const WEIGHT_TOLERANCE: f64 = 0.05;

/// The records, and the settings common to all forms.
#[derive(Debug, Clone)]
pub(super) struct PredictionProblem<'a> {
    pub data: Vec<Data<'a>>,
    /// Further inputs.
    pub channels: Vec<Channel<'a>>,
    pub sample_time: SampleTime,
    /// Intersample behaviour of the error.
    pub intersample: Intersample,
    /// True if the intersample behaviour was given by the user or determined from the data.
    pub course_is_known: bool,
    /// Coordinates of the forms for the other intersample behaviour, if there is little noise and both behaviours fit.
    pub other_intersample: Vec<(Form, Vec<f64>)>,
    /// Residual power of an output error fit relative to the power of u, if there is little noise.
    pub little_noise: Option<f64>,
    pub initial: InitialState,
    /// First sample of each record whose residual counts, the same for all forms.
    pub first: usize,
    pub delay_range_s: (f64, f64),
    pub prior: OperatorPrior,
    pub individual: Vec<Coordinate>,
    pub search: SearchOptions,
}

/// Orders (nc, nd) of the noise model.
pub(super) type NoiseOrders = (usize, usize);

impl<'a> PredictionProblem<'a> {
    /// Returns the first sample whose residual can be computed for all these forms and orders.
    pub fn first_residual(
        forms: &[(Form, bool)],
        (nc, nd): NoiseOrders,
        delay_range_s: (f64, f64),
        initial: InitialState,
        (sample_time, intersample): (SampleTime, Intersample),
    ) -> Result<usize, IdentError> {
        let mut first = 0;
        for &(form, neuromuscular) in forms {
            let limits = coordinates::limits(form, neuromuscular, delay_range_s, sample_time);
            let layout = FamilyLayout::new(
                (form, neuromuscular),
                (nc, nd),
                1,
                &[],
                &limits,
                (sample_time, intersample),
            );
            first = first.max(first_residual(&layout.orders(layout.longest_nk()?), initial));
        }
        Ok(first)
    }

    fn layout(&self, form: (Form, bool), noise: NoiseOrders) -> FamilyLayout {
        let limits = coordinates::limits(form.0, form.1, self.delay_range_s, self.sample_time);
        let records = self.data.len();
        let sampling = (self.sample_time, self.intersample);
        FamilyLayout::new(form, noise, records, &self.individual, &limits, sampling)
            .with_channels(&self.channels.iter().map(Channel::layout_entry).collect::<Vec<_>>())
    }

    pub fn criterion(&self, form: (Form, bool), noise: NoiseOrders) -> PhysicalCriterion<'a, FamilyLayout> {
        PhysicalCriterion {
            further: self.channels.iter().map(|channel| channel.values.clone()).collect(),
            ..PhysicalCriterion::new(self.layout(form, noise), self.data.clone(), self.initial, self.first)
        }
    }

    /// Returns the part of u in each record that an operator does not explain: `v = u - Y e`, with the initial states
    /// of Y estimated.
    pub fn unexplained_output(
        &self,
        form: (Form, bool),
        coordinates: &[f64],
        workspace: &mut Workspace,
    ) -> Result<Vec<Vec<f64>>, IdentError> {
        let criterion = self.criterion(form, (0, 0));
        let eta = criterion.layout.common_eta(coordinates, &[]);
        (0..self.data.len())
            .map(|record| {
                let mapped = criterion.model_of(&eta, record)?;
                Ok(criterion
                    .record_criterion(&mapped, record)
                    .residuals_of(&mapped.theta, 0, workspace))
            })
            .collect()
    }

    /// Fits a form, starting from these coordinates and from the autoregression of the part of u that they do not
    /// explain.
    ///
    /// # Errors
    /// [`IdentError::NoFiniteLoss`], and the errors of the discrete-time model.
    pub fn fit(
        &self,
        form: (Form, bool),
        noise: NoiseOrders,
        start: &[f64],
        workspace: &mut Workspace,
    ) -> Result<PredictionFit<'a>, IdentError> {
        let found = self.fit_below(f64::INFINITY, form, noise, start, workspace)?;
        found.ok_or(IdentError::NoFiniteLoss)
    }

    /// Like [`PredictionProblem::fit`], but returns `None` if the objective remains above `known`, the objective of a
    /// fit of the same form from another start. The first steps decide: later rounds give the prior more weight, which
    /// increases the objective.
    ///
    /// # Errors
    /// Same as [`PredictionProblem::fit`].
    pub fn fit_below(
        &self,
        known: f64,
        form: (Form, bool),
        noise: NoiseOrders,
        start: &[f64],
        workspace: &mut Workspace,
    ) -> Result<Option<PredictionFit<'a>>, IdentError> {
        let series = self.unexplained_output(form, start, workspace)?;
        let products = NoiseProducts::new(&series, noise.1);
        let start_of_noise = match products.fit_up_to(noise.1) {
            Some(found) => found,
            // Only rounding errors remain: no noise model is needed.
            None if self.noise_free_share().is_some() => Autoregression {
                d: vec![0.0; noise.1],
                loss: self.rounding_floor(),
            },
            None => return Err(IdentError::NoFiniteLoss),
        };
        let mut criterion = self.criterion(form, noise);
        let coefficients = [vec![0.0; noise.0], start_of_noise.d].concat();
        let mut eta = criterion.layout.common_eta(start, &coefficients);
        let unit = self.penalties(&criterion.layout);
        // The weight kappa sigma^2 of the prior is known only after a fit; a few rounds make the fit and the weight
        // consistent.
        let mut weight = start_of_noise.loss;
        let mut found = None;
        for round in 0..MAX_ROUNDS {
            criterion.penalty = unit.iter().map(|p| p.weighted(weight)).collect();
            if round == 0 && known.is_finite() {
                let first_steps = SearchOptions {
                    max_iterations: TRIAL_STEPS.min(self.search.max_iterations),
                    ..self.search
                };
                let reached = criterion
                    .search(eta, &first_steps, None, workspace)
                    .ok_or(IdentError::NoFiniteLoss)?;
                if reached.linearisation.sum_of_squares > known {
                    return Ok(None);
                }
                eta = reached.theta;
            }
            let mut minimum = criterion
                .search(eta, &self.search, None, workspace)
                .ok_or(IdentError::NoFiniteLoss)?;
            let is_common = criterion.layout.operator_element_count() == criterion.layout.coordinate_count();
            let mut ordered = minimum.theta.clone();
            if is_common && coordinates::order_zeros(form.0, &mut ordered) {
                minimum = criterion
                    .search(ordered, &self.search, None, workspace)
                    .ok_or(IdentError::NoFiniteLoss)?;
            }
            // Without a residual no step can decrease the loss.
            if minimum.linearisation.sum_of_squares < self.equality_threshold() {
                minimum.termination.reason = Reason::ExactFit;
            }
            let fit = self.fit_at_minimum(criterion.clone(), minimum, workspace)?;
            let next = fit.innovation_variance * fit.inflation;
            eta = fit.minimum.theta.clone();
            found = Some(fit);
            if unit.is_empty() || (next / weight - 1.0).abs() < WEIGHT_TOLERANCE || round + 1 == MAX_ROUNDS {
                break;
            }
            weight = next;
        }
        Ok(found)
    }

    /// Repeats the search with another noise model, starting from the operator of a fit and with the same weight of the
    /// prior. Returns eta; `None` if the search fails.
    pub fn refit(
        &self,
        fit: &PredictionFit<'_>,
        noise: NoiseOrders,
        coefficients: &[f64],
        (max_iterations, tolerance): (usize, f64),
        workspace: &mut Workspace,
    ) -> Option<Vec<f64>> {
        let layout = fit.layout();
        let mut criterion = self.criterion((layout.form, layout.neuromuscular), noise);
        criterion.penalty.clone_from(&fit.criterion.penalty);
        let operators = &fit.eta()[..layout.noise_offset()];
        let search = SearchOptions {
            max_iterations,
            tolerance,
            ..self.search
        };
        let found = criterion.search([operators, coefficients].concat(), &search, None, workspace)?;
        found.theta.iter().all(|x| x.is_finite()).then_some(found.theta)
    }

    /// Returns the terms `(g_i - m_i)^2/s_i^2` of the prior for the elements of eta, with the weight one.
    fn penalties(&self, layout: &FamilyLayout) -> Vec<Penalty> {
        let all = layout.form.coordinates(layout.neuromuscular);
        let unit = self.prior.penalties(layout.form, layout.neuromuscular);
        let places = |penalty: Penalty| {
            let coordinate = all[penalty.index];
            let own = layout
                .elements
                .iter()
                .enumerate()
                .filter(move |(_, e)| e.0 == coordinate);
            own.map(move |(place, _)| Penalty {
                index: place,
                ..penalty
            })
            .collect::<Vec<_>>()
        };
        unit.into_iter().flat_map(places).collect()
    }

    /// Returns the number of samples that count.
    pub fn sample_count(&self) -> usize {
        self.data.iter().map(|d| d.u.len().saturating_sub(self.first)).sum()
    }

    /// Returns the sum of squares of u over the samples that count.
    pub fn power(&self) -> f64 {
        let of = |d: &Data<'_>| d.u.get(self.first..).map_or(0.0, |u| dot(u, u));
        self.data.iter().map(of).sum()
    }

    /// Returns the residual power relative to the power of u if the residual is not noise; `None` if there is noise.
    pub fn noise_free_share(&self) -> Option<f64> {
        self.little_noise.filter(|share| *share < ROUNDING_POWER)
    }

    /// Returns the sum of squares below which forms count as equal; zero if there is noise.
    pub fn equality_threshold(&self) -> f64 {
        self.noise_free_share()
            .map_or(0.0, |_| EQUAL_RESIDUAL_POWER * self.power())
    }

    /// Returns a mean square far below rounding errors, used in place of zero, whose logarithm does not exist.
    fn rounding_floor(&self) -> f64 {
        f64::EPSILON.powi(2) * self.power() / self.sample_count().max(1) as f64
    }

    /// Returns the fit at a minimum: loss, innovation variance, clusters and their inflation.
    pub(super) fn fit_at_minimum(
        &self,
        criterion: PhysicalCriterion<'a, FamilyLayout>,
        minimum: Minimum,
        workspace: &mut Workspace,
    ) -> Result<PredictionFit<'a>, IdentError> {
        let (n, states) = (criterion.residual_count(), criterion.state_count());
        let penalty: f64 = criterion.penalty.iter().map(|p| p.at(&minimum.theta)).sum();
        let additional = criterion.linearise_additional(&minimum.theta, workspace).sum_of_squares;
        // The noise variance is computed from the residuals alone, without the prior and the lines.
        let mut squares = minimum.linearisation.sum_of_squares - penalty - additional;
        if self.noise_free_share().is_some() {
            squares = squares.max(self.rounding_floor() * n as f64);
        }
        let p = minimum.theta.len();
        let freedom = n
            .checked_sub(p + states)
            .filter(|f| *f > 0)
            .ok_or(IdentError::NoFiniteLoss)?;
        let clusters = Clusters::of(&criterion, &minimum.theta, workspace)?;
        let mut fit = PredictionFit {
            loss: squares / n as f64,
            innovation_variance: squares / freedom as f64,
            residuals: n,
            states,
            inflation: 1.0,
            ridge: 0.0,
            weight_of_lines: 0.0,
            criterion,
            minimum,
            clusters,
        };
        if !covariances::is_regular(&fit) {
            fit.ridge = UNDETERMINED_RIDGE;
        }
        fit.inflation = covariances::inflation(&fit).unwrap_or(1.0);
        Ok(fit)
    }
}
