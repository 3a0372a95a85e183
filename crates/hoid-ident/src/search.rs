//! Minimisation of the prediction-error criterion by a damped Gauss-Newton search.
//!
//! Levenberg-Marquardt with Marquardt's scaling: the step solves `(H + mu diag H) delta = psi' eps` with the Gauss-Newton
//! matrix `H = psi' psi`; mu follows the ratio of gained to promised decrease (H. B. Nielsen, *Damping parameter in
//! Marquardt's method*, IMM-REP-1999-05, DTU). A step that makes C or F unstable counts as one that does not lower the loss.
//!
//! The search has converged when the undamped Gauss-Newton step promises less than `tolerance` of relative decrease of the
//! loss: `g' H^-1 g <= tolerance V`. In units of standard errors the distance left is about `sqrt(tolerance N)`, 1e-4 for the
//! default and 8192 samples; that last step is still taken.

use std::fmt;

use crate::{
    least_squares::{dot, solve_symmetric},
    prediction_error::{Linearisation, Workspace},
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
}

/// Limits of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// Largest number of Gauss-Newton steps from each start. Default 100.
    pub max_iterations: usize,
    /// Relative decrease of the loss below which the search has converged. Default 1e-12.
    pub tolerance: f64,
}

impl Default for SearchOptions {
    fn default() -> Self {
        Self {
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
    /// The residuals are zero up to rounding.
    ExactFit,
    /// The limit of iterations was reached first.
    IterationLimit,
    /// No step lowers the loss although the gradient is not zero; often the loss falls only across the border of stability.
    NoDescent,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Direct => "solved directly (linear least squares)",
            Self::SmallDecrease => "converged: the next step promises no decrease of the loss",
            Self::ExactFit => "converged: the residuals are zero up to rounding",
            Self::IterationLimit => "not converged: iteration limit reached",
            Self::NoDescent => "not converged: no step inside the region of stable C and F lowers the loss",
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
        matches!(self.reason, Reason::Direct | Reason::SmallDecrease | Reason::ExactFit)
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
    criterion: &impl Objective,
    mut theta: Vec<f64>,
    options: &SearchOptions,
    rival: Option<f64>,
    workspace: &mut Workspace,
) -> Option<Minimum> {
    if !criterion.is_feasible(&theta) {
        return None;
    }
    let power = criterion.output_power();
    let mut at = criterion.linearise(&theta, workspace);
    let (mut mu, mut growth) = (1e-3, 2.0);
    let mut iterations = 0;
    let reason = loop {
        if !at.sum_of_squares.is_finite() {
            return None;
        }
        // Rounding leaves residuals of about 1e-15 of the output.
        if at.sum_of_squares <= 1e-26 * power {
            break Reason::ExactFit;
        }
        let undamped = damped_step(&at, 0.0);
        if let (Some(rival), Some((_, promised))) = (rival, &undamped) {
            let close = at.sum_of_squares < rival * (1.0 + 1e-3);
            if close && at.sum_of_squares - promised > rival * (1.0 - 1e-7) {
                return None;
            }
        }
        if let Some((step, promised)) = undamped
            && promised <= options.tolerance * at.sum_of_squares
        {
            let last: Vec<f64> = theta.iter().zip(&step).map(|(t, s)| t + s).collect();
            if criterion.is_feasible(&last) {
                let there = criterion.linearise(&last, workspace);
                if there.sum_of_squares <= at.sum_of_squares * (1.0 + 1e-14) {
                    (theta, at) = (last, there);
                }
            }
            break Reason::SmallDecrease;
        }
        if iterations >= options.max_iterations {
            break Reason::IterationLimit;
        }
        iterations += 1;
        let accepted = loop {
            if mu > 1e16 {
                break None;
            }
            if let Some((step, promised)) = damped_step(&at, mu) {
                let trial: Vec<f64> = theta.iter().zip(&step).map(|(t, s)| t + s).collect();
                if criterion.is_feasible(&trial) {
                    // Most trials are accepted: derivatives at once cost less than a second pass.
                    let there = criterion.linearise(&trial, workspace);
                    if there.sum_of_squares.is_finite() && there.sum_of_squares < at.sum_of_squares {
                        let ratio = (at.sum_of_squares - there.sum_of_squares) / promised;
                        break Some((trial, there, ratio));
                    }
                }
            }
            mu *= growth;
            growth *= 2.0;
        };
        match accepted {
            None => break Reason::NoDescent,
            Some((trial, there, ratio)) => {
                (theta, at) = (trial, there);
                mu *= (1.0 - (2.0 * ratio - 1.0).powi(3)).clamp(1.0 / 3.0, 2.0);
                mu = mu.max(1e-12);
                growth = 2.0;
            }
        }
    };
    Some(Minimum {
        theta,
        at,
        termination: Termination { reason, iterations },
    })
}

/// `(H + mu diag H)^-1 g` and the decrease of the sum of squares that the quadratic model promises for it. `None` when the
/// matrix is not positive definite.
fn damped_step(at: &Linearisation, mu: f64) -> Option<(Vec<f64>, f64)> {
    let p = at.descent.len();
    let mut damped = at.gram.clone();
    for i in 0..p {
        damped[i * p + i] *= 1.0 + mu;
    }
    let step = solve_symmetric(&damped, &at.descent)?;
    // V(theta + step) ~ V - 2 g' step + step' H step.
    let curvature: f64 = (0..p).map(|i| step[i] * dot(&at.gram[i * p..(i + 1) * p], &step)).sum();
    let promised = 2.0 * dot(&at.descent, &step) - curvature;
    (promised >= 0.0 && step.iter().all(|s| s.is_finite())).then_some((step, promised))
}

#[cfg(test)]
mod tests {
    use hoid_model::Orders;

    use super::*;
    use crate::prediction_error::{Criterion, Data, InitialState, first_residual};

    fn signals(n: usize, noise: f64) -> (Vec<f64>, Vec<f64>) {
        let mut state = 99_u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let e: Vec<f64> = (0..n).map(|_| draw()).collect();
        let (mut w, mut u, mut colour) = (vec![0.0; 3], vec![0.0; 3], 0.0);
        for t in 3..n {
            w.push(1.5 * w[t - 1] - 0.7 * w[t - 2] + 0.5 * e[t - 1] + 0.2 * e[t - 2]);
            colour = 0.8 * colour + noise * draw();
            u.push(w[t] + colour);
        }
        (e, u)
    }

    fn orders() -> Orders {
        Orders {
            nb: 2,
            nd: 1,
            nf: 2,
            nk: 1,
            ..Orders::default()
        }
    }

    fn run(e: &[f64], u: &[f64], start: &[f64]) -> Option<Minimum> {
        let criterion = Criterion {
            orders: orders(),
            data: vec![Data { e, u }],
            initial: InitialState::Estimate,
            first: first_residual(&orders(), InitialState::Estimate),
        };
        minimise(
            &criterion,
            start.to_vec(),
            &SearchOptions::default(),
            None,
            &mut Workspace::default(),
        )
    }

    #[test]
    fn noise_free_parameters_are_found_exactly() {
        let (e, u) = signals(500, 0.0);
        let end = run(&e, &u, &[0.1, 0.1, 0.0, -1.0, 0.3]).unwrap();
        assert_eq!(end.termination.reason, Reason::ExactFit);
        // d1 is free without noise; the system is not.
        for (a, b) in [0, 1, 3, 4].map(|i| end.theta[i]).iter().zip([0.5, 0.2, -1.5, 0.7]) {
            assert!((a - b).abs() < 1e-10);
        }
    }

    #[test]
    fn the_gradient_vanishes_at_the_end() {
        let (e, u) = signals(2000, 0.1);
        let end = run(&e, &u, &[0.1, 0.1, 0.0, -1.0, 0.3]).unwrap();
        assert!(end.termination.converged(), "{:?}", end.termination);
        let p = end.theta.len();
        for i in 0..p {
            let cosine = end.at.descent[i] / (end.at.gram[i * p + i] * end.at.sum_of_squares).sqrt();
            assert!(cosine.abs() < 1e-9, "{i}: {cosine}");
        }
    }

    #[test]
    fn unstable_starts_are_refused_and_limits_are_told() {
        let (e, u) = signals(500, 0.1);
        assert!(run(&e, &u, &[0.1, 0.1, 0.0, -2.1, 1.2]).is_none());
        assert!(run(&e, &u, &[f64::NAN, 0.1, 0.0, -1.0, 0.3]).is_none());
        let criterion = Criterion {
            orders: orders(),
            data: vec![Data { e: &e, u: &u }],
            initial: InitialState::Zero,
            first: 0,
        };
        let limited = SearchOptions {
            max_iterations: 1,
            ..SearchOptions::default()
        };
        let end = minimise(
            &criterion,
            vec![0.1, 0.1, 0.0, -1.0, 0.3],
            &limited,
            None,
            &mut Workspace::default(),
        )
        .unwrap();
        assert_eq!(
            end.termination,
            Termination {
                reason: Reason::IterationLimit,
                iterations: 1
            }
        );
        assert!(!end.termination.converged());
    }
}
