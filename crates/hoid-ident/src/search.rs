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

mod descent;
mod ending;

use std::{fmt, ops::Range};

use crate::{
    least_squares::dot,
    prediction_error::{Linearisation, Workspace},
};

pub(crate) use descent::{Descent, Progress, free_parameters};

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

#[cfg(test)]
mod tests;
