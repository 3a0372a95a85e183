//! A damped Gauss-Newton search by reverse communication: it returns the theta at which it needs the derivatives and
//! continues when it receives them.

use super::{
    objective::{Linearisation, Objective},
    search_options::{SearchMethod, SearchOptions},
    termination::Reason,
};
use crate::criterion::Workspace;
use crate::linalg::{least_squares::solve_symmetric, vectors::dot};

/// Predicted relative decrease in the loss below which the second derivative is estimated from the gradients.
const SECANT_DECREASE_LIMIT: f64 = 1e-2;

/// Relative decrease in the loss that may be hidden by rounding: filters with poles near the unit circle lose five of
/// the sixteen digits.
const ROUNDING_DECREASE: f64 = 1e-10;

/// A search that is driven by its caller, so several searches can run in parallel lanes.
pub(crate) struct GaussNewton<'s> {
    pub(super) objective: &'s dyn Objective,
    pub(super) options: &'s SearchOptions,
    pub(super) loss_to_beat: Option<f64>,
    output_power: f64,
    pub(super) theta: Vec<f64>,
    pub(super) linearisation: Linearisation,
    pub(super) iterations: usize,
    mu: f64,
    growth: f64,
    /// Decrease in the sum of squares that the quadratic model predicts for the undamped step.
    predicted_decrease: f64,
    /// Half the second derivative of the sum of squares minus the Gauss-Newton matrix, estimated from the gradients of
    /// the last steps; empty if it is not used.
    secant: Vec<f64>,
    trial: Trial,
    /// Point at which the derivatives are needed next.
    evaluation_point: Vec<f64>,
}

/// Purpose of the next linearisation.
enum Trial {
    /// Tests whether the start is usable.
    Start,
    /// A Levenberg-Marquardt step, with the decrease that the quadratic model predicts.
    Damped { predicted: f64 },
    /// A fraction of a step; the fraction is halved until the loss decreases.
    Share { delta: Vec<f64>, factor: f64 },
    /// The last step after convergence.
    Last,
}

/// State of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Progress {
    /// The search needs another linearisation.
    Continues,
    /// The search has ended. The reason is `None` if the loss is not finite, or if the search is not predicted to end
    /// below the rival.
    Ended(Option<Reason>),
}

impl<'s> GaussNewton<'s> {
    /// Creates a search from `theta`, which is moved inside the limits; `None` if the moved theta has no predictor.
    pub fn new(
        objective: &'s dyn Objective,
        mut theta: Vec<f64>,
        options: &'s SearchOptions,
        rival: Option<f64>,
    ) -> Option<Self> {
        if let Some(limits) = objective.limits() {
            for (t, (low, high)) in theta.iter_mut().zip(limits) {
                *t = t.max(*low).min(*high);
            }
        }
        objective.is_feasible(&theta).then(|| Self {
            objective,
            options,
            loss_to_beat: rival,
            output_power: objective.output_power(),
            evaluation_point: theta.clone(),
            theta,
            linearisation: Linearisation::default(),
            iterations: 0,
            mu: 1e-6,
            growth: 8.0,
            predicted_decrease: f64::INFINITY,
            secant: Vec::new(),
            trial: Trial::Start,
        })
    }

    /// Returns the theta at which the derivatives are needed.
    pub fn evaluation_point(&self) -> &[f64] {
        &self.evaluation_point
    }

    /// True until the search has received its first linearisation.
    pub fn awaits_first_linearisation(&self) -> bool {
        matches!(self.trial, Trial::Start)
    }

    /// Runs the search to completion.
    pub(super) fn run(&mut self, workspace: &mut Workspace) -> Option<Reason> {
        loop {
            let there = self.objective.linearise(&self.evaluation_point, workspace);
            if let Progress::Ended(reason) = self.update(there) {
                return reason;
            }
        }
    }

    /// Continues with the linearisation at [`GaussNewton::evaluation_point`].
    pub fn update(&mut self, there: Linearisation) -> Progress {
        let finite = there.sum_of_squares.is_finite();
        match std::mem::replace(&mut self.trial, Trial::Last) {
            Trial::Start => {
                self.linearisation = there;
                self.iterate()
            }
            Trial::Damped { predicted } => {
                if finite && there.sum_of_squares < self.linearisation.sum_of_squares {
                    let ratio = (self.linearisation.sum_of_squares - there.sum_of_squares) / predicted;
                    self.mu = (self.mu * (1.0 - (2.0 * ratio - 1.0).powi(3)).clamp(1.0 / 3.0, 2.0)).max(1e-12);
                    self.growth = 2.0;
                    self.move_to(there);
                    self.iterate()
                } else if self.secant.is_empty() {
                    self.damp();
                    self.try_damped()
                } else {
                    self.secant.clear();
                    self.try_damped()
                }
            }
            Trial::Share { delta, factor } => {
                if finite && there.sum_of_squares < self.linearisation.sum_of_squares {
                    self.move_to(there);
                    self.iterate()
                } else {
                    self.try_fraction(delta, 0.5 * factor)
                }
            }
            Trial::Last => {
                // The predicted decrease may be less than the rounding error of the loss, so a small increase is
                // accepted.
                if finite && there.sum_of_squares <= self.linearisation.sum_of_squares * (1.0 + ROUNDING_DECREASE) {
                    self.move_to(there);
                }
                Progress::Ended(Some(Reason::SmallDecrease))
            }
        }
    }

    fn move_to(&mut self, there: Linearisation) {
        if self.options.method == SearchMethod::Automatic
            && self.predicted_decrease <= SECANT_DECREASE_LIMIT * self.linearisation.sum_of_squares
        {
            self.update_secant(&there);
        } else {
            self.secant.clear();
        }
        std::mem::swap(&mut self.theta, &mut self.evaluation_point);
        self.linearisation = there;
    }

    /// Corrects the secant by a symmetric matrix of rank one, so `(H + S) s = g - g'` for the last step s.
    fn update_secant(&mut self, there: &Linearisation) {
        let p = self.theta.len();
        self.secant.resize(p * p, 0.0);
        let step: Vec<f64> = self
            .evaluation_point
            .iter()
            .zip(&self.theta)
            .map(|(new, old)| new - old)
            .collect();
        let missing: Vec<f64> = (0..p)
            .map(|i| {
                let known = dot(&there.gram[i * p..(i + 1) * p], &step) + dot(&self.secant[i * p..(i + 1) * p], &step);
                self.linearisation.descent[i] - there.descent[i] - known
            })
            .collect();
        let along = dot(&missing, &step);
        let scale = |i: usize| there.gram[i * p + i];
        let size_of_step: f64 = (0..p).map(|i| scale(i) * step[i] * step[i]).sum();
        let size_of_missing: f64 = (0..p).map(|i| missing[i] * missing[i] / scale(i)).sum();
        // The correction is nearly orthogonal to the step, and rounding would dominate it.
        if along.is_nan() || along * along <= 1e-16 * size_of_step * size_of_missing {
            return;
        }
        for i in 0..p {
            for j in 0..p {
                self.secant[i * p + j] += missing[i] * missing[j] / along;
            }
        }
    }

    /// Requests the first trial of the next step, or ends the search.
    fn iterate(&mut self) -> Progress {
        if !self.linearisation.sum_of_squares.is_finite() {
            return Progress::Ended(None);
        }
        // Rounding leaves residuals of about 1e-15 of the output.
        if self.linearisation.sum_of_squares <= 1e-26 * self.output_power {
            return Progress::Ended(Some(Reason::ExactFit));
        }
        let undamped = self.damped_step(0.0, &[]);
        if let (Some(rival), Some(step)) = (self.loss_to_beat, &undamped) {
            let close = self.linearisation.sum_of_squares < rival * (1.0 + 1e-3);
            if close && self.linearisation.sum_of_squares - step.predicted > rival * (1.0 - 1e-7) {
                return Progress::Ended(None);
            }
        }
        if let Some(step) = &undamped
            && step.predicted <= self.options.tolerance * self.linearisation.sum_of_squares
        {
            return if self.try_step(&step.delta, 1.0) {
                self.trial = Trial::Last;
                Progress::Continues
            } else {
                Progress::Ended(Some(Reason::SmallDecrease))
            };
        }
        if self.iterations >= self.options.max_iterations {
            return Progress::Ended(Some(Reason::IterationLimit));
        }
        self.predicted_decrease = undamped.as_ref().map_or(f64::INFINITY, |step| step.predicted);
        self.iterations += 1;
        let delta = match self.options.method {
            SearchMethod::Automatic | SearchMethod::LevenbergMarquardt => return self.try_damped(),
            SearchMethod::GaussNewton => undamped.map(|step| step.delta),
            SearchMethod::SteepestDescent => self.scaled_gradient(),
        };
        match delta {
            Some(delta) => self.try_fraction(delta, 1.0),
            None => self.stop_without_descent(),
        }
    }

    /// Increases the damping until the end of the damped step has a predictor, and requests the derivatives there.
    fn try_damped(&mut self) -> Progress {
        while self.mu <= 1e16 {
            let step = match &self.secant[..] {
                [] => None,
                secant => self.damped_step(self.mu, secant),
            };
            if step.is_none() {
                self.secant.clear();
            }
            if let Some(step) = step.or_else(|| self.damped_step(self.mu, &[]))
                && self.try_step(&step.delta, 1.0)
            {
                // Most trials are accepted: computing the derivatives immediately costs less than a second pass.
                self.trial = Trial::Damped {
                    predicted: step.predicted,
                };
                return Progress::Continues;
            }
            self.damp();
        }
        self.stop_without_descent()
    }

    fn damp(&mut self) {
        self.mu *= self.growth;
        self.growth *= 2.0;
    }

    /// Halves the fraction of a step until its end has a predictor, and requests the derivatives there.
    fn try_fraction(&mut self, delta: Vec<f64>, mut factor: f64) -> Progress {
        while factor > 1e-12 {
            if self.try_step(&delta, factor) {
                self.trial = Trial::Share { delta, factor };
                return Progress::Continues;
            }
            factor *= 0.5;
        }
        self.stop_without_descent()
    }

    fn stop_without_descent(&self) -> Progress {
        // The predicted decrease may be hidden by the rounding of the loss.
        let lost = self.predicted_decrease <= ROUNDING_DECREASE * self.linearisation.sum_of_squares;
        Progress::Ended(Some(if lost { Reason::SmallDecrease } else { Reason::NoDescent }))
    }

    /// Makes the end of a step the next evaluation point; returns false if there is no predictor at this point.
    fn try_step(&mut self, delta: &[f64], factor: f64) -> bool {
        self.evaluation_point.clear();
        self.evaluation_point
            .extend(self.theta.iter().zip(delta).map(|(t, s)| t + factor * s));
        if let Some(limits) = self.objective.limits() {
            // Corrects rounding: a step that was cut at a bound ends exactly on the bound.
            for (t, (low, high)) in self.evaluation_point.iter_mut().zip(limits) {
                *t = t.max(*low).min(*high);
            }
        }
        self.objective.is_feasible(&self.evaluation_point)
    }

    /// Returns the step `(H + S + mu diag H)^-1 g` of the free parameters, cut at the bounds, and the decrease in the
    /// sum of squares that the quadratic model predicts. `None` if the matrix is not positive definite.
    fn damped_step(&self, mu: f64, secant: &[f64]) -> Option<Step> {
        let p = self.theta.len();
        let mut free = self.free_indices();
        loop {
            let mut delta = vec![0.0; p];
            if !free.is_empty() {
                let lacking = |i: usize, j: usize| secant.get(i * p + j).copied().unwrap_or(0.0);
                let gram = |i: usize, j: usize| {
                    self.linearisation.gram[i * p + j] * if i == j { 1.0 + mu } else { 1.0 } + lacking(i, j)
                };
                let damped: Vec<f64> = free
                    .iter()
                    .flat_map(|&i| free.iter().map(move |&j| gram(i, j)))
                    .collect();
                let descent: Vec<f64> = free.iter().map(|&i| self.linearisation.descent[i]).collect();
                for (&i, value) in free.iter().zip(solve_symmetric(&damped, &descent)?) {
                    delta[i] = value;
                }
            }
            if let Some(limits) = self.objective.limits() {
                let leaves = |i: usize| {
                    let ((low, high), t, d) = (limits[i], self.theta[i], delta[i]);
                    (t <= low && d < 0.0) || (t >= high && d > 0.0)
                };
                let before = free.len();
                free.retain(|&i| !leaves(i));
                if free.len() < before {
                    continue;
                }
                let room = fraction_within_limits(&self.theta, &delta, limits);
                delta.iter_mut().for_each(|d| *d *= room);
            }
            return self.step(delta, secant);
        }
    }

    /// Returns the step `alpha (diag H)^-1 g`, with the alpha that is optimal for the quadratic model; `None` if there
    /// is no such alpha.
    fn scaled_gradient(&self) -> Option<Vec<f64>> {
        let p = self.theta.len();
        let mut delta = vec![0.0; p];
        for i in self.free_indices() {
            let curvature = self.linearisation.gram[i * p + i];
            if curvature > 0.0 {
                delta[i] = self.linearisation.descent[i] / curvature;
            }
        }
        let mut alpha = dot(&self.linearisation.descent, &delta) / curvature(&self.linearisation.gram, &delta);
        if !(alpha.is_finite() && alpha > 0.0) {
            return None;
        }
        delta.iter_mut().for_each(|d| *d *= alpha);
        if let Some(limits) = self.objective.limits() {
            alpha = fraction_within_limits(&self.theta, &delta, limits);
            delta.iter_mut().for_each(|d| *d *= alpha);
        }
        Some(delta)
    }

    /// Returns the step with its predicted decrease, from `V(theta + step) ~ V - 2 g' step + step' H step`.
    fn step(&self, delta: Vec<f64>, secant: &[f64]) -> Option<Step> {
        let mut predicted =
            2.0 * dot(&self.linearisation.descent, &delta) - curvature(&self.linearisation.gram, &delta);
        if !secant.is_empty() {
            predicted -= curvature(secant, &delta);
        }
        (predicted >= 0.0 && delta.iter().all(|s| s.is_finite())).then_some(Step { delta, predicted })
    }

    fn free_indices(&self) -> Vec<usize> {
        free_parameters(self.objective, &self.theta, &self.linearisation.descent)
    }
}

/// Returns `delta' M delta`.
fn curvature(matrix: &[f64], delta: &[f64]) -> f64 {
    let p = delta.len();
    (0..p).map(|i| delta[i] * dot(&matrix[i * p..(i + 1) * p], delta)).sum()
}

/// Returns the indices of the parameters that may change, i.e. that are neither fixed nor at a bound beyond which the
/// loss decreases.
pub(crate) fn free_parameters(objective: &dyn Objective, theta: &[f64], descent: &[f64]) -> Vec<usize> {
    let Some(limits) = objective.limits() else {
        return (0..theta.len()).collect();
    };
    (0..theta.len())
        .filter(|&i| {
            let ((low, high), t, outward) = (limits[i], theta[i], descent[i]);
            low < high && !(t <= low && outward < 0.0) && !(t >= high && outward > 0.0)
        })
        .collect()
}

/// Returns the largest fraction of a step that stays within the limits.
fn fraction_within_limits(theta: &[f64], delta: &[f64], limits: &[(f64, f64)]) -> f64 {
    let room = |((t, d), (low, high)): ((&f64, &f64), &(f64, f64))| match *d {
        d if d > 0.0 => (high - t) / d,
        d if d < 0.0 => (low - t) / d,
        _ => f64::INFINITY,
    };
    theta.iter().zip(delta).zip(limits).map(room).fold(1.0, f64::min)
}

struct Step {
    delta: Vec<f64>,
    predicted: f64,
}
