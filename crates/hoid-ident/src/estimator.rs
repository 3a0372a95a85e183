//! From records to a fit.

use std::collections::BTreeMap;

use hoid_lanes::InstructionSet;
use hoid_model::{Orders, PolynomialModel, Record, SampleTime, Structure, polynomial::reflected_inside};

use crate::{
    Constraint, Fit, IdentError, InitialState, Loss, Prior, Reason, SearchOptions, Termination, checks,
    initial_guess::{guesses::initial_guesses, start::Start},
    linalg::information::inverse_of_free,
    linalg::least_squares::dot,
    optimize::{Minimum, Objective, free_parameters, minimise},
    pem::arx,
    pem::batched::{self},
    pem::constraints::ConstrainedCriterion,
    pem::criterion::{Criterion, Data, Workspace, first_residual, output_variance},
    pem::fit_problem::FitProblem,
    pem::linearisation_client::LinearisationClient,
    pem::robust::{ROUNDS, Reweighting},
    pem::simulation_focus,
};

/// Rounds of the robust loss end when theta moves by less than this share of its standard errors.
const SETTLED: f64 = 1e-5;

/// What the fitted model is to be good at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Focus {
    /// One-step-ahead prediction: the prediction error method, efficient where the structure is right.
    #[default]
    Prediction,
    /// Simulation from the input alone: the system from e to u minimises the simulation error, and the noise model is fitted to
    /// what is left. In a closed loop the system is then biased by the feedback.
    Simulation,
}

/// What is to be estimated, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimator {
    /// The structure.
    pub structure: Structure,
    /// The orders.
    pub orders: Orders,
    /// Initial states of each record. Default (`None`): automatic, which is estimated where there is an input and backcast for
    /// an output alone, whose past is as stationary as its present.
    pub initial_state: Option<InitialState>,
    /// Method and limits of the search.
    pub search: SearchOptions,
    /// Number of own starts from which the search runs to its end; the best minimum wins. Default 2.
    pub starts: usize,
    /// Start of the search instead of the estimator's own; theta in the order of [`Orders::parameter_names`].
    pub start: Option<Vec<f64>>,
    /// Fixed and bounded coefficients, by name.
    pub constraints: BTreeMap<String, Constraint>,
    /// Coefficients that are drawn to a guess, by name.
    pub priors: BTreeMap<String, Prior>,
    /// How a residual counts. Default: by its square.
    pub loss: Loss,
    /// What the model is to be good at. Default: prediction.
    pub focus: Focus,
    /// True when A must be stable too, so that the model from e to u is. C and F always are. Default false.
    pub stable: bool,
}

impl Estimator {
    /// An estimator with the default options.
    pub fn new(structure: Structure, orders: Orders) -> Self {
        Self {
            structure,
            orders,
            initial_state: None,
            search: SearchOptions::default(),
            starts: 2,
            start: None,
            constraints: BTreeMap::new(),
            priors: BTreeMap::new(),
            loss: Loss::default(),
            focus: Focus::default(),
            stable: false,
        }
    }

    /// The same estimator with other orders, and without a start (which would not fit them).
    pub fn with_orders(&self, orders: Orders) -> Self {
        Self {
            orders,
            start: None,
            ..self.clone()
        }
    }

    /// Checks structure, orders and options against each other.
    ///
    /// # Errors
    /// [`IdentError`] with what is wrong.
    pub fn check(&self) -> Result<(), IdentError> {
        self.orders.check(self.structure)?;
        checks::options(self)
    }

    /// The rule for initial states, the automatic one decided.
    pub fn initial_state_in_use(&self) -> InitialState {
        self.initial_state.unwrap_or(if self.structure.has_input() {
            InitialState::Estimate
        } else {
            InitialState::Backcast
        })
    }

    /// Fits one model to all records: a common theta, initial states of each.
    ///
    /// # Errors
    /// [`IdentError`]; how a search ended is part of the fit.
    pub fn fit(&self, records: &[Record]) -> Result<Fit, IdentError> {
        self.fit_from(records, 0)
    }

    /// As [`Estimator::fit`], with residuals that count from sample `first` of each record at the earliest, so that models of
    /// different orders are compared on the same samples.
    ///
    /// # Errors
    /// As [`Estimator::fit`].
    pub fn fit_from(&self, records: &[Record], first: usize) -> Result<Fit, IdentError> {
        if self.focus == Focus::Simulation && self.structure != Structure::OutputError {
            self.check()?;
            return simulation_focus::fit(self, records, first);
        }
        let (criterion, sample_time) = self.criterion(records, first)?;
        if self.is_direct(criterion.initial) {
            self.fit_linear(&criterion, sample_time)
        } else {
            self.fit_iteratively(&criterion, sample_time)
        }
    }

    /// Fits a model to each record alone.
    ///
    /// Box-Jenkins models of records of one length are searched side by side, in about half of the time of one after the other. What a
    /// fit finds does not depend on what it is searched beside; it differs from that of [`Estimator::fit`] by rounding, less than 1e-7 of a
    /// standard error.
    ///
    /// # Errors
    /// Those of [`Estimator::fit`], for each record by itself.
    pub fn fit_each(&self, records: &[&Record]) -> Vec<Result<Fit, IdentError>> {
        batched::fit_each(self, records, InstructionSet::Best).unwrap_or_else(|| {
            let alone = |record: &&Record| self.fit(std::slice::from_ref(*record));
            records.iter().map(alone).collect()
        })
    }

    /// The criterion over these records, once all is checked.
    pub(crate) fn criterion<'r>(
        &self,
        records: &'r [Record],
        first: usize,
    ) -> Result<(Criterion<'r>, SampleTime), IdentError> {
        self.check()?;
        let sample_time = checks::common_sample_time(records)?;
        let initial = self.initial_state_in_use();
        let first = first.max(first_residual(&self.orders, initial));
        for record in records {
            checks::record(self.structure, &self.orders, record, first)?;
        }
        let criterion = Criterion {
            orders: self.orders,
            data: Data::of(records),
            initial,
            first,
            weights: None,
        };
        checks::degrees_of_freedom(&criterion, records)?;
        Ok((criterion, sample_time))
    }

    /// True when least squares gives the fit in one step.
    fn is_direct(&self, initial: InitialState) -> bool {
        self.structure.is_linear() && initial != InitialState::Backcast && self.knows_nothing_beforehand()
    }

    /// True for the plain sum of squares without bounds.
    pub(crate) fn knows_nothing_beforehand(&self) -> bool {
        self.constraints.is_empty() && self.priors.is_empty() && self.loss == Loss::Quadratic && !self.stable
    }

    fn fit_linear(&self, criterion: &Criterion<'_>, sample_time: SampleTime) -> Result<Fit, IdentError> {
        let solved = arx::regress(&self.orders, &criterion.data, criterion.first)?;
        let termination = Termination {
            reason: Reason::Direct,
            iterations: 0,
        };
        let all_free = vec![false; solved.theta.len()];
        let fit = self.result(
            criterion,
            sample_time,
            solved.theta,
            solved.sum_of_squares,
            termination,
            all_free,
        )?;
        let sigma2 = fit.innovation_variance;
        Ok(Fit {
            covariance: Some(solved.inverse_gram.iter().map(|g| sigma2 * g).collect()),
            start: "none needed".to_owned(),
            ..fit
        })
    }

    fn fit_iteratively(&self, criterion: &Criterion<'_>, sample_time: SampleTime) -> Result<Fit, IdentError> {
        let mut workspace = Workspace::of_thread();
        let informed = self.inform(criterion);
        let own = || initial_guesses(criterion, sample_time, &mut workspace);
        let mut quest = FitProblem::new(self, &informed, sample_time, own)?;
        while let Some(theta) = quest.asked() {
            let there = match quest.block() {
                Some(block) => criterion.linearise_block(theta, block, &mut workspace),
                None => informed.linearise(theta, &mut workspace),
            };
            quest.take(there, &mut workspace);
        }
        quest.fit(&mut workspace)
    }

    /// Rounds of reweighted searches from the minimum of the squares.
    pub(crate) fn fit_robustly(
        &self,
        informed: &ConstrainedCriterion<'_, '_>,
        sample_time: SampleTime,
        mut minimum: Minimum,
        threshold: f64,
        workspace: &mut Workspace,
    ) -> Result<Fit, IdentError> {
        let criterion = informed.criterion;
        let mut rounds = Reweighting::new(threshold);
        let mut residuals = all_residuals(criterion, &minimum.theta, workspace);
        let (mut iterations, mut settled) = (minimum.termination.iterations, false);
        for _ in 0..ROUNDS {
            let Some(weights) = rounds.next(&residuals) else { break };
            let weighted = Criterion {
                weights: Some(&weights),
                ..criterion.clone()
            };
            let objective = ConstrainedCriterion {
                criterion: &weighted,
                limits: informed.limits.clone(),
                prior: informed.prior.clone(),
                stable: informed.stable,
            };
            let next = minimise(&objective, minimum.theta.clone(), &self.search, None, workspace)
                .ok_or(IdentError::NoFiniteLoss)?;
            iterations += next.termination.iterations;
            let step: Vec<f64> = next.theta.iter().zip(&minimum.theta).map(|(a, b)| a - b).collect();
            let p = step.len();
            let curvature: f64 = (0..p)
                .map(|i| step[i] * dot(&next.at.gram[i * p..(i + 1) * p], &step))
                .sum();
            settled = curvature * criterion.residuals() as f64 <= SETTLED * SETTLED * next.at.sum_of_squares;
            minimum = next;
            residuals = all_residuals(&weighted, &minimum.theta, workspace);
            if settled {
                break;
            }
        }
        let reason = match minimum.termination.reason {
            Reason::SmallDecrease if !settled => Reason::IterationLimit,
            reason => reason,
        };
        let free = free_parameters(informed, &minimum.theta, &minimum.at.descent);
        let names = self.orders.parameter_names();
        let plain = informed.linearise(&minimum.theta, workspace);
        let inverse = inverse_of_free(&plain.gram, &free, &names)?;
        let variance = rounds.variance(&residuals, names.len() + criterion.states());
        let sum_of_squares = residuals.iter().map(|r| dot(r, r)).sum();
        let termination = Termination { reason, iterations };
        let held = held(&free, names.len());
        let fit = self.result(criterion, sample_time, minimum.theta, sum_of_squares, termination, held)?;
        Ok(Fit {
            covariance: Some(inverse.iter().map(|g| variance * g).collect()),
            innovation_variance: rounds.scale * rounds.scale,
            robust: true,
            ..fit
        })
    }

    pub(crate) fn inform<'c, 'a>(&self, criterion: &'c Criterion<'a>) -> ConstrainedCriterion<'c, 'a> {
        let names = self.orders.parameter_names();
        let unlimited = (f64::NEG_INFINITY, f64::INFINITY);
        let limit = |name: &String| self.constraints.get(name).map_or(unlimited, |c| c.limits());
        let n = criterion.residuals() as f64;
        let guess = |(i, name): (usize, &String)| {
            let prior = self.priors.get(name)?;
            Some((
                i,
                Prior {
                    weight: n * prior.weight,
                    ..*prior
                },
            ))
        };
        ConstrainedCriterion {
            criterion,
            limits: (!self.constraints.is_empty()).then(|| names.iter().map(limit).collect()),
            prior: names.iter().enumerate().filter_map(guess).collect(),
            stable: self.stable,
        }
    }

    pub(crate) fn result(
        &self,
        criterion: &Criterion<'_>,
        sample_time: SampleTime,
        theta: Vec<f64>,
        sum_of_squares: f64,
        termination: Termination,
        held: Vec<bool>,
    ) -> Result<Fit, IdentError> {
        let n = criterion.residuals();
        let free = held.iter().filter(|held| !**held).count();
        let freedom = n - free - criterion.states();
        Ok(Fit {
            held,
            model: PolynomialModel::new(self.structure, self.orders, sample_time, theta)?,
            covariance: None,
            loss: sum_of_squares / n as f64,
            innovation_variance: sum_of_squares / freedom as f64,
            residuals: n,
            states: criterion.states(),
            initial_state: criterion.initial,
            termination,
            start: String::new(),
            output_variance: output_variance(&criterion.data, criterion.first),
            robust: false,
            physical: None,
        })
    }

    /// The start with a stable A where that was asked for.
    pub(crate) fn stabilised(&self, mut start: Start) -> Option<Start> {
        if self.stable {
            let a = reflected_inside(&start.theta[..self.orders.na])?;
            start.theta[..self.orders.na].copy_from_slice(&a);
        }
        Some(start)
    }

    pub(crate) fn check_start(
        &self,
        theta: &[f64],
        objective: &ConstrainedCriterion<'_, '_>,
    ) -> Result<Vec<f64>, IdentError> {
        let bad = |reason: &str| IdentError::BadStart {
            reason: reason.to_owned(),
        };
        if theta.len() != self.orders.parameters() {
            return Err(bad(&format!(
                "it has {} coefficients, the orders {} need {}",
                theta.len(),
                self.orders,
                self.orders.parameters()
            )));
        }
        if !objective.is_feasible(theta) {
            return Err(bad(
                "C or F (or a polynomial that was asked to be stable) has a root on or outside the unit circle; give a stable \
                 start or none",
            ));
        }
        Ok(theta.to_vec())
    }
}

/// Which of p parameters are not free.
pub(crate) fn held(free: &[usize], p: usize) -> Vec<bool> {
    (0..p).map(|i| !free.contains(&i)).collect()
}

fn all_residuals(criterion: &Criterion<'_>, theta: &[f64], workspace: &mut Workspace) -> Vec<Vec<f64>> {
    (0..criterion.data.len())
        .map(|record| criterion.residuals_of(theta, record, workspace))
        .collect()
}
