//! Minimisation of a sum of squares over theta.
//!
//! With `g = psi' eps` and the Gauss-Newton matrix `H = psi' psi` at theta, the methods differ in their step:
//!
//! | method | step |
//! |---|---|
//! | Levenberg-Marquardt | `(H + mu diag H)^-1 g`, mu by the ratio of gained to promised decrease (H. B. Nielsen, *Damping parameter in Marquardt's method*, IMM-REP-1999-05, DTU) |
//! | Gauss-Newton | `H^-1 g`, halved until the loss falls |
//! | steepest descent | `alpha (diag H)^-1 g`, alpha best for the quadratic model, halved until the loss falls |
//! | automatic | Levenberg-Marquardt; where it finds no lower loss although the gradient is not zero, it goes on in coordinates in which the border of stability is a bound ([`crate::stable_coordinates`]) |
//!
//! A step that makes the predictor unstable counts as one that does not lower the loss.
//!
//! **Limits.** A parameter with equal bounds is fixed. Else a step is cut where it meets a bound, and a parameter that rests at
//! a bound while the loss falls outwards takes no part in it (an active set; J. Nocedal and S. J. Wright, *Numerical
//! Optimization*, 2006, section 16.5).
//!
//! The search has converged when the undamped Gauss-Newton step of the free parameters promises less than `tolerance` of
//! relative decrease of the loss: `g' H^-1 g <= tolerance V`. In units of standard errors the distance left is about
//! `sqrt(tolerance N)`, 1e-4 for the default and 8192 samples; that last step is still taken. Where no step lowers the loss any
//! more and the promise is as small as the rounding of the loss, it has converged as well.

use std::{fmt, ops::Range};

use crate::{
    least_squares::{dot, solve_symmetric},
    prediction_error::{Linearisation, Workspace},
    stable_coordinates::StableCoordinates,
};

/// A sum of squares over theta with its derivatives: what the search needs to know of a model.
pub(crate) trait Objective {
    /// True where the predictor exists: finite theta, stable polynomials.
    fn is_feasible(&self, theta: &[f64]) -> bool;
    /// Sum of squares, `psi' eps` and `psi' psi` at a feasible theta.
    fn linearise(&self, theta: &[f64], workspace: &mut Workspace) -> Linearisation;
    /// Sum of squares of the output, against which residuals count as zero.
    fn output_power(&self) -> f64;
    /// Lower and upper bound of each parameter; equal bounds fix it. By default there are none.
    fn limits(&self) -> Option<&[(f64, f64)]> {
        None
    }
    /// Places of the polynomials in theta that must be stable and have no limits of their own.
    fn stable_blocks(&self) -> Vec<Range<usize>> {
        Vec::new()
    }
}

/// How a step is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SearchMethod {
    /// Levenberg-Marquardt, along the border of stability where that is in the way.
    #[default]
    Automatic,
    /// Gauss-Newton with halved steps.
    GaussNewton,
    /// Levenberg-Marquardt.
    LevenbergMarquardt,
    /// Steepest descent, scaled by the diagonal of the Gauss-Newton matrix.
    SteepestDescent,
}

/// Method and limits of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// How a step is made. Default automatic.
    pub method: SearchMethod,
    /// Largest number of steps from each start. Default 100.
    pub max_iterations: usize,
    /// Relative decrease of the loss below which the search has converged. Default 1e-12.
    pub tolerance: f64,
}

impl Default for SearchOptions {
    fn default() -> Self {
        Self {
            method: SearchMethod::Automatic,
            max_iterations: 100,
            tolerance: 1e-12,
        }
    }
}

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// A linear problem, solved directly.
    Direct,
    /// The next step promises no decrease that matters.
    SmallDecrease,
    /// The loss is smallest on the border of stability: a root of C or F lies on the unit circle.
    Border,
    /// The residuals are zero up to rounding.
    ExactFit,
    /// The limit of iterations was reached first.
    IterationLimit,
    /// No step lowers the loss although the gradient is not zero; often the loss falls only across the border of stability.
    NoDescent,
    /// An iteration of instrumental variables that moves the parameters no more.
    Settled,
    /// Instrumental variables came to rest with a pole outside the unit circle, which was then reflected into it.
    UnstableEstimate,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Direct => "solved directly (linear least squares)",
            Self::SmallDecrease => "converged: the next step promises no decrease of the loss",
            Self::Border => {
                "converged at the border of stability: a root of C or F lies on the unit circle, and standard errors mean little"
            }
            Self::ExactFit => "converged: the residuals are zero up to rounding",
            Self::IterationLimit => "not converged: iteration limit reached",
            Self::NoDescent => "not converged: no step inside the region of stable C and F lowers the loss",
            Self::Settled => "converged: a further iteration does not move the parameters",
            Self::UnstableEstimate => {
                "not converged: the estimate had a pole outside the unit circle, reflected into it"
            }
        })
    }
}

/// How a search ended, and after how many steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Termination {
    /// Why it ended.
    pub reason: Reason,
    /// Steps taken from the start that won.
    pub iterations: usize,
}

impl Termination {
    /// True when a minimum was reached.
    pub fn converged(&self) -> bool {
        matches!(
            self.reason,
            Reason::Direct | Reason::SmallDecrease | Reason::Border | Reason::ExactFit | Reason::Settled
        )
    }
}

/// Where a search came to rest.
#[derive(Debug, Clone)]
pub(crate) struct Minimum {
    pub theta: Vec<f64>,
    pub at: Linearisation,
    pub termination: Termination,
}

/// Searches from `theta`. `None` when the start is unstable or its loss is not finite, or when the search comes close to
/// `rival`, the sum of squares of a minimum that is known already, and promises to end no lower.
pub(crate) fn minimise(
    objective: &impl Objective,
    mut theta: Vec<f64>,
    options: &SearchOptions,
    rival: Option<f64>,
    workspace: &mut Workspace,
) -> Option<Minimum> {
    if let Some(limits) = objective.limits() {
        for (t, (low, high)) in theta.iter_mut().zip(limits) {
            *t = t.max(*low).min(*high);
        }
    }
    if !objective.is_feasible(&theta) {
        return None;
    }
    let at = objective.linearise(&theta, workspace);
    let mut search = Search {
        objective,
        workspace,
        options,
        rival,
        theta,
        at,
        iterations: 0,
    };
    let reason = match options.method {
        SearchMethod::Automatic => {
            let reason = search.descend(SearchMethod::LevenbergMarquardt, options.max_iterations)?;
            if reason == Reason::NoDescent {
                search.follow_the_border()?
            } else {
                reason
            }
        }
        method => search.descend(method, options.max_iterations)?,
    };
    Some(Minimum {
        theta: search.theta,
        at: search.at,
        termination: Termination {
            reason,
            iterations: search.iterations,
        },
    })
}

/// True when a start lies in the basin of a minimum that is known: its loss is what the quadratic model around the minimum says
/// of it, so that a search from there would end in the same place.
pub(crate) fn leads_to(
    minimum: &Minimum,
    objective: &impl Objective,
    start: &[f64],
    workspace: &mut Workspace,
) -> bool {
    let p = start.len();
    let delta: Vec<f64> = start.iter().zip(&minimum.theta).map(|(a, b)| a - b).collect();
    let rise: f64 = (0..p)
        .map(|i| delta[i] * dot(&minimum.at.gram[i * p..(i + 1) * p], &delta))
        .sum();
    if !objective.is_feasible(start) || rise.is_nan() || rise > BASIN * minimum.at.sum_of_squares {
        return false;
    }
    let found = objective.linearise(start, workspace).sum_of_squares - minimum.at.sum_of_squares;
    (found - rise).abs() <= 0.1 * rise
}

/// Relative rise of the loss up to which a start is held against the quadratic model of a minimum.
const BASIN: f64 = 0.05;

/// Relative decrease of the loss that its rounding may hide: filters with poles near the unit circle lose five of the sixteen
/// digits.
const ROUNDING: f64 = 1e-10;

struct Search<'s, O> {
    objective: &'s O,
    workspace: &'s mut Workspace,
    options: &'s SearchOptions,
    rival: Option<f64>,
    theta: Vec<f64>,
    at: Linearisation,
    iterations: usize,
}

impl<O: Objective> Search<'_, O> {
    /// Goes on in coordinates in which the border of stability is a bound. `None` as in [`Search::descend`].
    fn follow_the_border(&mut self) -> Option<Reason> {
        let Some((coordinates, kappa)) = StableCoordinates::of(self.objective, &self.theta) else {
            return Some(Reason::NoDescent);
        };
        if !coordinates.is_feasible(&kappa) {
            return Some(Reason::NoDescent);
        }
        let at = coordinates.linearise(&kappa, self.workspace);
        let mut along = Search {
            objective: &coordinates,
            workspace: self.workspace,
            options: self.options,
            rival: self.rival,
            theta: kappa,
            at,
            iterations: self.iterations,
        };
        let reason = along.descend(SearchMethod::LevenbergMarquardt, self.options.max_iterations)?;
        let (kappa, iterations) = (along.theta, along.iterations);
        let theta = coordinates.theta(&kappa);
        let there = self.objective.linearise(&theta, self.workspace);
        self.iterations = iterations;
        if there.sum_of_squares <= self.at.sum_of_squares {
            (self.theta, self.at) = (theta, there);
        }
        Some(match reason {
            Reason::SmallDecrease if coordinates.is_on_border(&kappa) => Reason::Border,
            reason => reason,
        })
    }

    /// Steps of one method until it ends. `None` when the loss is not finite or the rival will not be beaten.
    fn descend(&mut self, method: SearchMethod, max_iterations: usize) -> Option<Reason> {
        let power = self.objective.output_power();
        let (mut mu, mut growth) = (1e-6, 8.0);
        loop {
            if !self.at.sum_of_squares.is_finite() {
                return None;
            }
            // Rounding leaves residuals of about 1e-15 of the output.
            if self.at.sum_of_squares <= 1e-26 * power {
                return Some(Reason::ExactFit);
            }
            let undamped = self.damped_step(0.0);
            if let (Some(rival), Some(step)) = (self.rival, &undamped) {
                let close = self.at.sum_of_squares < rival * (1.0 + 1e-3);
                if close && self.at.sum_of_squares - step.promised > rival * (1.0 - 1e-7) {
                    return None;
                }
            }
            if let Some(step) = &undamped
                && step.promised <= self.options.tolerance * self.at.sum_of_squares
            {
                if let Some((last, there)) = self.try_step(&step.delta, 1.0)
                    && there.sum_of_squares <= self.at.sum_of_squares * (1.0 + 1e-14)
                {
                    (self.theta, self.at) = (last, there);
                }
                return Some(Reason::SmallDecrease);
            }
            if self.iterations >= max_iterations {
                return Some(Reason::IterationLimit);
            }
            let undamped_promise = undamped.as_ref().map_or(f64::INFINITY, |step| step.promised);
            self.iterations += 1;
            let accepted = match method {
                SearchMethod::Automatic | SearchMethod::LevenbergMarquardt => {
                    self.levenberg_marquardt(&mut mu, &mut growth)
                }
                SearchMethod::GaussNewton => undamped.and_then(|step| self.halve(&step.delta)),
                SearchMethod::SteepestDescent => self.scaled_gradient().and_then(|delta| self.halve(&delta)),
            };
            match accepted {
                // What is promised is lost in the rounding of the loss.
                None if undamped_promise <= ROUNDING * self.at.sum_of_squares => return Some(Reason::SmallDecrease),
                None => return Some(Reason::NoDescent),
                Some((theta, at)) => (self.theta, self.at) = (theta, at),
            }
        }
    }

    fn levenberg_marquardt(&mut self, mu: &mut f64, growth: &mut f64) -> Option<(Vec<f64>, Linearisation)> {
        while *mu <= 1e16 {
            if let Some(step) = self.damped_step(*mu)
                // Most trials are accepted: derivatives at once cost less than a second pass.
                && let Some((theta, there)) = self.try_step(&step.delta, 1.0)
                && there.sum_of_squares < self.at.sum_of_squares
            {
                let ratio = (self.at.sum_of_squares - there.sum_of_squares) / step.promised;
                *mu = (*mu * (1.0 - (2.0 * ratio - 1.0).powi(3)).clamp(1.0 / 3.0, 2.0)).max(1e-12);
                *growth = 2.0;
                return Some((theta, there));
            }
            *mu *= *growth;
            *growth *= 2.0;
        }
        None
    }

    /// The step, halved until the loss falls.
    fn halve(&mut self, delta: &[f64]) -> Option<(Vec<f64>, Linearisation)> {
        let mut factor = 1.0;
        while factor > 1e-12 {
            if let Some((theta, there)) = self.try_step(delta, factor)
                && there.sum_of_squares < self.at.sum_of_squares
            {
                return Some((theta, there));
            }
            factor *= 0.5;
        }
        None
    }

    /// Theta behind a step and the loss there; `None` where there is none.
    fn try_step(&mut self, delta: &[f64], factor: f64) -> Option<(Vec<f64>, Linearisation)> {
        let mut trial: Vec<f64> = self.theta.iter().zip(delta).map(|(t, s)| t + factor * s).collect();
        if let Some(limits) = self.objective.limits() {
            // Against rounding: a step that was cut at a bound ends on it.
            for (t, (low, high)) in trial.iter_mut().zip(limits) {
                *t = t.max(*low).min(*high);
            }
        }
        if !self.objective.is_feasible(&trial) {
            return None;
        }
        let there = self.objective.linearise(&trial, self.workspace);
        there.sum_of_squares.is_finite().then_some((trial, there))
    }

    /// `(H + mu diag H)^-1 g` of the free parameters, cut where it meets a bound, and the decrease of the sum of squares that
    /// the quadratic model promises for it. `None` when the matrix is not positive definite.
    fn damped_step(&self, mu: f64) -> Option<Step> {
        let p = self.theta.len();
        let mut free = self.free();
        loop {
            let mut delta = vec![0.0; p];
            if !free.is_empty() {
                let gram = |i: usize, j: usize| self.at.gram[i * p + j] * if i == j { 1.0 + mu } else { 1.0 };
                let damped: Vec<f64> = free
                    .iter()
                    .flat_map(|&i| free.iter().map(move |&j| gram(i, j)))
                    .collect();
                let descent: Vec<f64> = free.iter().map(|&i| self.at.descent[i]).collect();
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
                let room = cut(&self.theta, &delta, limits);
                delta.iter_mut().for_each(|d| *d *= room);
            }
            return self.promise(delta);
        }
    }

    /// `alpha (diag H)^-1 g` with the alpha that is best for the quadratic model.
    fn scaled_gradient(&self) -> Option<Vec<f64>> {
        let p = self.theta.len();
        let mut delta = vec![0.0; p];
        for i in self.free() {
            let curvature = self.at.gram[i * p + i];
            if curvature > 0.0 {
                delta[i] = self.at.descent[i] / curvature;
            }
        }
        let mut alpha = dot(&self.at.descent, &delta) / self.curvature(&delta);
        if !(alpha.is_finite() && alpha > 0.0) {
            return None;
        }
        delta.iter_mut().for_each(|d| *d *= alpha);
        if let Some(limits) = self.objective.limits() {
            alpha = cut(&self.theta, &delta, limits);
            delta.iter_mut().for_each(|d| *d *= alpha);
        }
        Some(delta)
    }

    /// `V(theta + step) ~ V - 2 g' step + step' H step`.
    fn promise(&self, delta: Vec<f64>) -> Option<Step> {
        let promised = 2.0 * dot(&self.at.descent, &delta) - self.curvature(&delta);
        (promised >= 0.0 && delta.iter().all(|s| s.is_finite())).then_some(Step { delta, promised })
    }

    fn curvature(&self, delta: &[f64]) -> f64 {
        let p = delta.len();
        (0..p)
            .map(|i| delta[i] * dot(&self.at.gram[i * p..(i + 1) * p], delta))
            .sum()
    }

    fn free(&self) -> Vec<usize> {
        free_parameters(self.objective, &self.theta, &self.at.descent)
    }
}

/// Parameters that may move: neither fixed nor at a bound beyond which the loss falls.
pub(crate) fn free_parameters(objective: &impl Objective, theta: &[f64], descent: &[f64]) -> Vec<usize> {
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

/// The share of a step that stays within the limits.
fn cut(theta: &[f64], delta: &[f64], limits: &[(f64, f64)]) -> f64 {
    let room = |((t, d), (low, high)): ((&f64, &f64), &(f64, f64))| match *d {
        d if d > 0.0 => (high - t) / d,
        d if d < 0.0 => (low - t) / d,
        _ => f64::INFINITY,
    };
    theta.iter().zip(delta).zip(limits).map(room).fold(1.0, f64::min)
}

struct Step {
    delta: Vec<f64>,
    promised: f64,
}

#[cfg(test)]
mod tests;
