//! Minimisation of a sum of squares over theta.
//!
//! With `g = psi' eps` and the Gauss-Newton matrix `H = psi' psi` at theta, the methods differ in their step:
//!
//! | method | step |
//! |---|---|
//! | Levenberg-Marquardt | `(H + mu diag H)^-1 g`, mu by the ratio of gained to promised decrease (H. B. Nielsen, *Damping parameter in Marquardt's method*, IMM-REP-1999-05, DTU) |
//! | Gauss-Newton | `H^-1 g`, halved until the loss falls |
//! | steepest descent | `alpha (diag H)^-1 g`, alpha best for the quadratic model, halved until the loss falls |
//! | automatic | Levenberg-Marquardt, near the minimum with a secant; where it finds no lower loss although the gradient is not zero, it goes on in coordinates in which the border of stability is a bound ([`crate::stable_coordinates`]) |
//!
//! **The secant.** Gauss and Newton leave the part of the second derivative out that vanishes with white residuals of the right model. Where
//! the model is not right (a delay that is off by a few samples) they converge by a constant factor a step only. Near the minimum a
//! matrix S takes the place of what is left out, `(H + S) s = g(theta) - g(theta + s)` for each step s, by symmetric corrections of rank one (J. E. Dennis, D. M. Gay
//! and R. E. Welsch, *ACM Trans. Mathematical Software* 7 (1981) 348-368, with the correction of C. G. Broyden, *Math. Computation* 21 (1967) 368-381). It decides about
//! steps alone; a step with it that does not lower the loss is made without it.
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
    theta: Vec<f64>,
    options: &SearchOptions,
    rival: Option<f64>,
    workspace: &mut Workspace,
) -> Option<Minimum> {
    let mut descent = Descent::new(objective, theta, options, rival)?;
    let reason = descent.run(workspace)?;
    descent.finish(reason, workspace)
}

/// True when a start of that loss lies in the basin of a minimum that is known: its loss is what the quadratic model around the minimum
/// says of it, so that a search from there would end in the same place.
pub(crate) fn lies_in_basin(minimum: &Minimum, start: &[f64], sum_of_squares: f64) -> bool {
    let p = start.len();
    let delta: Vec<f64> = start.iter().zip(&minimum.theta).map(|(a, b)| a - b).collect();
    let rise: f64 = (0..p)
        .map(|i| delta[i] * dot(&minimum.at.gram[i * p..(i + 1) * p], &delta))
        .sum();
    let found = sum_of_squares - minimum.at.sum_of_squares;
    rise <= BASIN * minimum.at.sum_of_squares && (found - rise).abs() <= 0.1 * rise
}

/// Relative rise of the loss up to which a start is held against the quadratic model of a minimum.
const BASIN: f64 = 0.05;

/// Relative decrease of the loss that a step promises from which on the second derivative is learnt from the gradients.
const NEAR: f64 = 1e-2;

/// Relative decrease of the loss that its rounding may hide: filters with poles near the unit circle lose five of the sixteen
/// digits.
const ROUNDING: f64 = 1e-10;

/// A search that asks for one linearisation after the other, so that several can go on side by side.
pub(crate) struct Descent<'s, O> {
    objective: &'s O,
    options: &'s SearchOptions,
    rival: Option<f64>,
    output_power: f64,
    theta: Vec<f64>,
    at: Linearisation,
    iterations: usize,
    mu: f64,
    growth: f64,
    /// Decrease that the undamped step of this iteration promises.
    promise: f64,
    /// What the Gauss-Newton matrix lacks of half the second derivative, from the gradients of the last steps; empty where that is not
    /// used.
    secant: Vec<f64>,
    trial: Trial,
    /// Where the derivatives are wanted next.
    asked: Vec<f64>,
}

/// What the linearisation that is asked for decides.
enum Trial {
    /// Whether the start is any good.
    Start,
    /// A step of Levenberg and Marquardt, and the decrease that it promises.
    Damped { promised: f64 },
    /// A share of a step that is halved until the loss falls.
    Share { delta: Vec<f64>, factor: f64 },
    /// The step that is left when the search has converged.
    Last,
}

/// Whether a search goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Progress {
    /// It asks for another linearisation.
    GoesOn,
    /// It has ended; without a reason where the loss is not finite or the rival will not be beaten.
    Ended(Option<Reason>),
}

impl<'s, O: Objective> Descent<'s, O> {
    /// A search from `theta`, drawn inside the limits; `None` when the predictor does not exist there.
    pub fn new(objective: &'s O, mut theta: Vec<f64>, options: &'s SearchOptions, rival: Option<f64>) -> Option<Self> {
        if let Some(limits) = objective.limits() {
            for (t, (low, high)) in theta.iter_mut().zip(limits) {
                *t = t.max(*low).min(*high);
            }
        }
        objective.is_feasible(&theta).then(|| Self {
            objective,
            options,
            rival,
            output_power: objective.output_power(),
            asked: theta.clone(),
            theta,
            at: Linearisation::default(),
            iterations: 0,
            mu: 1e-6,
            growth: 8.0,
            promise: f64::INFINITY,
            secant: Vec::new(),
            trial: Trial::Start,
        })
    }

    /// Where the derivatives are wanted.
    pub fn asked(&self) -> &[f64] {
        &self.asked
    }

    /// True while nothing is known of it but its start.
    pub fn is_at_its_start(&self) -> bool {
        matches!(self.trial, Trial::Start)
    }

    /// Until it ends, alone.
    fn run(&mut self, workspace: &mut Workspace) -> Option<Reason> {
        loop {
            let there = self.objective.linearise(&self.asked, workspace);
            if let Progress::Ended(reason) = self.take(there) {
                return reason;
            }
        }
    }

    /// Takes what was found where it was asked for.
    pub fn take(&mut self, there: Linearisation) -> Progress {
        let finite = there.sum_of_squares.is_finite();
        match std::mem::replace(&mut self.trial, Trial::Last) {
            Trial::Start => {
                self.at = there;
                self.iterate()
            }
            Trial::Damped { promised } => {
                if finite && there.sum_of_squares < self.at.sum_of_squares {
                    let ratio = (self.at.sum_of_squares - there.sum_of_squares) / promised;
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
                if finite && there.sum_of_squares < self.at.sum_of_squares {
                    self.move_to(there);
                    self.iterate()
                } else {
                    self.try_share(delta, 0.5 * factor)
                }
            }
            Trial::Last => {
                // It promises less than the rounding of the loss may hide, which must not decide about it.
                if finite && there.sum_of_squares <= self.at.sum_of_squares * (1.0 + ROUNDING) {
                    self.move_to(there);
                }
                Progress::Ended(Some(Reason::SmallDecrease))
            }
        }
    }

    fn move_to(&mut self, there: Linearisation) {
        if self.options.method == SearchMethod::Automatic && self.promise <= NEAR * self.at.sum_of_squares {
            self.learn(&there);
        } else {
            self.secant.clear();
        }
        std::mem::swap(&mut self.theta, &mut self.asked);
        self.at = there;
    }

    /// Symmetric rank-one correction of the secant, so that `(H + S) s = g - g'` for the step s just made.
    fn learn(&mut self, there: &Linearisation) {
        let p = self.theta.len();
        self.secant.resize(p * p, 0.0);
        let step: Vec<f64> = self.asked.iter().zip(&self.theta).map(|(new, old)| new - old).collect();
        let missing: Vec<f64> = (0..p)
            .map(|i| {
                let known = dot(&there.gram[i * p..(i + 1) * p], &step) + dot(&self.secant[i * p..(i + 1) * p], &step);
                self.at.descent[i] - there.descent[i] - known
            })
            .collect();
        let along = dot(&missing, &step);
        let scale = |i: usize| there.gram[i * p + i];
        let size_of_step: f64 = (0..p).map(|i| scale(i) * step[i] * step[i]).sum();
        let size_of_missing: f64 = (0..p).map(|i| missing[i] * missing[i] / scale(i)).sum();
        // Nearly orthogonal to the step: rounding would decide.
        if along.is_nan() || along * along <= 1e-16 * size_of_step * size_of_missing {
            return;
        }
        for i in 0..p {
            for j in 0..p {
                self.secant[i * p + j] += missing[i] * missing[j] / along;
            }
        }
    }

    /// The first trial of the next step, or the end.
    fn iterate(&mut self) -> Progress {
        if !self.at.sum_of_squares.is_finite() {
            return Progress::Ended(None);
        }
        // Rounding leaves residuals of about 1e-15 of the output.
        if self.at.sum_of_squares <= 1e-26 * self.output_power {
            return Progress::Ended(Some(Reason::ExactFit));
        }
        let undamped = self.damped_step(0.0, &[]);
        if let (Some(rival), Some(step)) = (self.rival, &undamped) {
            let close = self.at.sum_of_squares < rival * (1.0 + 1e-3);
            if close && self.at.sum_of_squares - step.promised > rival * (1.0 - 1e-7) {
                return Progress::Ended(None);
            }
        }
        if let Some(step) = &undamped
            && step.promised <= self.options.tolerance * self.at.sum_of_squares
        {
            return if self.ask(&step.delta, 1.0) {
                self.trial = Trial::Last;
                Progress::GoesOn
            } else {
                Progress::Ended(Some(Reason::SmallDecrease))
            };
        }
        if self.iterations >= self.options.max_iterations {
            return Progress::Ended(Some(Reason::IterationLimit));
        }
        self.promise = undamped.as_ref().map_or(f64::INFINITY, |step| step.promised);
        self.iterations += 1;
        let delta = match self.options.method {
            SearchMethod::Automatic | SearchMethod::LevenbergMarquardt => return self.try_damped(),
            SearchMethod::GaussNewton => undamped.map(|step| step.delta),
            SearchMethod::SteepestDescent => self.scaled_gradient(),
        };
        match delta {
            Some(delta) => self.try_share(delta, 1.0),
            None => self.give_up(),
        }
    }

    /// Steps with more and more damping until one can be tried.
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
                && self.ask(&step.delta, 1.0)
            {
                // Most trials are accepted: derivatives at once cost less than a second pass.
                self.trial = Trial::Damped {
                    promised: step.promised,
                };
                return Progress::GoesOn;
            }
            self.damp();
        }
        self.give_up()
    }

    fn damp(&mut self) {
        self.mu *= self.growth;
        self.growth *= 2.0;
    }

    /// Shares of a step, halved until one can be tried.
    fn try_share(&mut self, delta: Vec<f64>, mut factor: f64) -> Progress {
        while factor > 1e-12 {
            if self.ask(&delta, factor) {
                self.trial = Trial::Share { delta, factor };
                return Progress::GoesOn;
            }
            factor *= 0.5;
        }
        self.give_up()
    }

    fn give_up(&self) -> Progress {
        // What is promised may be lost in the rounding of the loss.
        let lost = self.promise <= ROUNDING * self.at.sum_of_squares;
        Progress::Ended(Some(if lost { Reason::SmallDecrease } else { Reason::NoDescent }))
    }

    /// Asks for theta behind a step; false where there is no predictor.
    fn ask(&mut self, delta: &[f64], factor: f64) -> bool {
        self.asked.clear();
        self.asked
            .extend(self.theta.iter().zip(delta).map(|(t, s)| t + factor * s));
        if let Some(limits) = self.objective.limits() {
            // Against rounding: a step that was cut at a bound ends on it.
            for (t, (low, high)) in self.asked.iter_mut().zip(limits) {
                *t = t.max(*low).min(*high);
            }
        }
        self.objective.is_feasible(&self.asked)
    }

    /// Where it came to rest, once it has ended for this reason; the automatic search may go on along the border of stability.
    pub fn finish(mut self, reason: Reason, workspace: &mut Workspace) -> Option<Minimum> {
        let reason = if self.options.method == SearchMethod::Automatic && reason == Reason::NoDescent {
            self.follow_the_border(workspace)?
        } else {
            reason
        };
        Some(Minimum {
            theta: self.theta,
            at: self.at,
            termination: Termination {
                reason,
                iterations: self.iterations,
            },
        })
    }

    /// Goes on in coordinates in which the border of stability is a bound. `None` where the loss is not finite or the rival will
    /// not be beaten.
    fn follow_the_border(&mut self, workspace: &mut Workspace) -> Option<Reason> {
        let Some((coordinates, kappa)) = StableCoordinates::of(self.objective, &self.theta) else {
            return Some(Reason::NoDescent);
        };
        let Some(mut along) = Descent::new(&coordinates, kappa, self.options, self.rival) else {
            return Some(Reason::NoDescent);
        };
        along.iterations = self.iterations;
        let reason = along.run(workspace)?;
        let (kappa, iterations) = (along.theta, along.iterations);
        let theta = coordinates.theta(&kappa);
        let there = self.objective.linearise(&theta, workspace);
        self.iterations = iterations;
        if there.sum_of_squares <= self.at.sum_of_squares {
            (self.theta, self.at) = (theta, there);
        }
        Some(match reason {
            Reason::SmallDecrease if coordinates.is_on_border(&kappa) => Reason::Border,
            reason => reason,
        })
    }

    /// `(H + S + mu diag H)^-1 g` of the free parameters, cut where it meets a bound, and the decrease of the sum of squares that
    /// the quadratic model promises for it. `None` when the matrix is not positive definite.
    fn damped_step(&self, mu: f64, secant: &[f64]) -> Option<Step> {
        let p = self.theta.len();
        let mut free = self.free();
        loop {
            let mut delta = vec![0.0; p];
            if !free.is_empty() {
                let lacking = |i: usize, j: usize| secant.get(i * p + j).copied().unwrap_or(0.0);
                let gram =
                    |i: usize, j: usize| self.at.gram[i * p + j] * if i == j { 1.0 + mu } else { 1.0 } + lacking(i, j);
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
            return self.promise(delta, secant);
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
        let mut alpha = dot(&self.at.descent, &delta) / curvature(&self.at.gram, &delta);
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
    fn promise(&self, delta: Vec<f64>, secant: &[f64]) -> Option<Step> {
        let mut promised = 2.0 * dot(&self.at.descent, &delta) - curvature(&self.at.gram, &delta);
        if !secant.is_empty() {
            promised -= curvature(secant, &delta);
        }
        (promised >= 0.0 && delta.iter().all(|s| s.is_finite())).then_some(Step { delta, promised })
    }

    fn free(&self) -> Vec<usize> {
        free_parameters(self.objective, &self.theta, &self.at.descent)
    }
}

/// `delta' M delta`.
fn curvature(matrix: &[f64], delta: &[f64]) -> f64 {
    let p = delta.len();
    (0..p).map(|i| delta[i] * dot(&matrix[i * p..(i + 1) * p], delta)).sum()
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
