//! Minimisation of a sum of squares over theta.
//!
//! With `g = psi' eps` and the Gauss-Newton matrix `H = psi' psi` at theta, the methods use different steps:
//!
//! | method | step |
//! |---|---|
//! | Levenberg-Marquardt | `(H + mu diag H)^-1 g`, with mu adapted to the ratio of actual to predicted decrease (H. B. Nielsen, *Damping parameter in Marquardt's method*, IMM-REP-1999-05, DTU) |
//! | Gauss-Newton | `H^-1 g`, halved until the loss falls |
//! | steepest descent | `alpha (diag H)^-1 g`, with the alpha that is optimal for the quadratic model, halved until the loss falls |
//! | automatic | Levenberg-Marquardt, near the minimum with a secant; if it finds no lower loss although the gradient is not zero, it continues in coordinates in which the border of stability is a bound ([`reflection_coefficients`]) |
//!
//! **The secant.** The Gauss-Newton method neglects the part of the second derivative that vanishes for white residuals
//! of the correct model. If the model is wrong (for example, with a delay off by a few samples), Gauss-Newton steps
//! converge only linearly. Near the minimum a matrix S replaces the neglected part; symmetric corrections of rank one
//! ensure that `(H + S) s = g(theta) - g(theta + s)` for each step s (J. E. Dennis, D. M. Gay and R. E. Welsch, *ACM
//! Trans. Mathematical Software* 7 (1981) 348-368, with the correction of C. G. Broyden, *Math. Computation* 21 (1967)
//! 368-381). S affects only the steps; if a step with S does not decrease the loss, it is repeated without S.
//!
//! A step to an unstable predictor counts as a step that does not decrease the loss.
//!
//! **Limits.** A parameter with equal bounds is fixed. Otherwise a step is cut at a bound, and a parameter is held at a
//! bound if the loss decreases beyond it (an active set method; J. Nocedal and S. J. Wright, *Numerical Optimization*,
//! 2006, section 16.5).
//!
//! The search has converged when the undamped Gauss-Newton step of the free parameters predicts a relative decrease in
//! the loss of less than `tolerance`: `g' H^-1 g <= tolerance V`. The remaining distance is about `sqrt(tolerance N)`
//! standard errors, which is 1e-4 for the default tolerance and 8192 samples; this last step is still taken. The search
//! has also converged if no step decreases the loss and the predicted decrease is no larger than the rounding error of
//! the loss.

pub mod basin;
mod border;
pub mod gauss_newton;
mod objective;
pub mod reflection_coefficients;
mod search_options;
mod termination;

pub(crate) use basin::lies_in_basin;
pub(crate) use border::minimise;
pub(crate) use gauss_newton::free_parameters;
pub(crate) use objective::{Linearisation, Minimum, Objective};
pub use search_options::{SearchMethod, SearchOptions};
pub use termination::{Reason, Termination};

#[cfg(test)]
mod tests;
