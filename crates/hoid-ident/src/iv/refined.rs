//! The common iteration of the refined methods.
//!
//! Given a system, its noise-free output is simulated, the filter `D/(C F)` is computed, and the filtered equation
//! gives the next system. The iteration ends when a step delta is smaller than the tolerance in standard errors:
//! `|Z delta| <= tolerance sigma`, where sigma is the standard deviation of the filtered residual.
//!
//! **Start.** Input and output are replaced by their parts that follow the noise-free input (Laguerre expansion). A few
//! iterations of K. Steiglitz and L. E. McBride (*IEEE Trans. Automatic Control* 10 (1965) 461-464) on these signals
//! give a system close to the true system, in open and in closed loop. If this fails, least squares on the original
//! data is used.

use crate::{
    IdentError, Reason, Termination,
    criterion::Data,
    linalg::vectors::{add_scaled, dot},
};

use super::{
    algorithm::IterationLimits,
    equation::{IvProblem, Prefilter},
    external_signal::driven_parts,
    final_iteration::{LastIterate, NoiseModel},
    separate_poles::solve_nonlinear_form,
};

/// Number of iterations for the start.
const START_ITERATIONS: usize = 5;
/// Number of iterations after which only half of each step is taken, to damp oscillations.
const FULL_STEP_COUNT: usize = 20;
/// A zero of the equation does not belong to the operator if its residual variance exceeds the smallest residual
/// variance by this factor.
const MAX_VARIANCE_RATIO: f64 = 1.15;
/// Steps smaller than this share of the output are only rounding errors.
const ROUNDING_SHARE: f64 = 1e-12;

/// Runs the iteration and, if it does not converge, continues in the nonlinear form ([`super::separate_poles`]).
/// `noise_of` returns the noise model of a system.
pub(super) fn iterate_to_convergence(
    limits: IterationLimits,
    problem: &IvProblem<'_>,
    mut noise_of: impl FnMut(&[f64]) -> NoiseModel,
) -> Result<LastIterate, IdentError> {
    let mut whitest = SmallestResidual::default();
    let plain = iterate(limits, problem, &mut noise_of, &mut whitest)?;
    if plain.termination.converged() || limits.max_iterations <= FULL_STEP_COUNT {
        return Ok(plain);
    }
    // The nonlinear form starts from the last iterate. If the result is far from the operator, it starts again from the
    // best system of the iteration and then from the start of the iteration.
    let mut spent = plain.termination.iterations;
    let starts = [
        plain.system.clone(),
        whitest.system.unwrap_or_default(),
        problem.stabilise(&initial_system(problem)?)?.0,
    ];
    let (mut best, mut rank) = (plain, (f64::INFINITY, f64::INFINITY));
    for from in starts.iter().filter(|from| !from.is_empty()) {
        let found = solve_nonlinear_form(limits, problem, from, &mut noise_of)?;
        spent += found.termination.iterations;
        let variance = found.variance();
        // The estimating equation has several zeros; the zero that belongs to the operator has about the smallest
        // residual.
        let far = variance > MAX_VARIANCE_RATIO * whitest.variance;
        let class = match found.termination.reason {
            Reason::Settled | Reason::InstrumentsHeld if !far => 0.0,
            _ if far => 2.0,
            _ => 1.0,
        };
        if (class, variance) < rank {
            (best, rank) = (found, (class, variance));
        }
        if class == 0.0 {
            break;
        }
    }
    if rank.0 == 2.0 {
        // The best result is another zero of the equation, which does not fit the data.
        best.termination.reason = Reason::IterationLimit;
    }
    best.termination.iterations = spent;
    Ok(best)
}

/// The system with the smallest filtered residual during an iteration.
struct SmallestResidual {
    variance: f64,
    system: Option<Vec<f64>>,
}

impl Default for SmallestResidual {
    fn default() -> Self {
        Self {
            variance: f64::INFINITY,
            system: None,
        }
    }
}

/// Runs the iteration without the nonlinear form; `noise_of` returns the noise model of a system.
fn iterate(
    limits: IterationLimits,
    problem: &IvProblem<'_>,
    mut noise_of: impl FnMut(&[f64]) -> NoiseModel,
    whitest: &mut SmallestResidual,
) -> Result<LastIterate, IdentError> {
    let (mut system, _) = problem.stabilise(&initial_system(problem)?)?;
    let mut iterations = 0;
    loop {
        let noise = noise_of(&system);
        let equation = problem.equation(noise.prefilter(&system[..problem.poles]), &system);
        let next = problem.solve(&equation)?;
        iterations += 1;
        // |Z delta|/sigma is the length in standard errors, since the covariance is about sigma^2 (Z'Z)^-1.
        let mut step = vec![0.0; equation.y.len()];
        for (column, (a, b)) in equation.z.iter().zip(next.iter().zip(&system)) {
            add_scaled(&mut step, a - b, column);
        }
        let residual = equation.residual(&next);
        let variance = dot(&residual, &residual) / residual.len() as f64;
        let moved = dot(&step, &step);
        let settled = moved <= limits.tolerance * limits.tolerance * variance
            || moved <= ROUNDING_SHARE * ROUNDING_SHARE * dot(&equation.y, &equation.y);
        let own = equation.residual(&system);
        let of_system = dot(&own, &own) / own.len() as f64;
        if of_system < whitest.variance {
            *whitest = SmallestResidual {
                variance: of_system,
                system: Some(system.clone()),
            };
        }
        // The next iteration simulates with F and filters with 1/F, which requires stable poles.
        let (next, reflected) = problem.stabilise(&next)?;
        let reason = match (settled || iterations >= limits.max_iterations, reflected, settled) {
            (true, true, _) => Some(Reason::UnstableEstimate),
            (true, false, true) => Some(Reason::Settled),
            (true, false, false) => Some(Reason::IterationLimit),
            (false, ..) => None,
        };
        if let Some(reason) = reason {
            return Ok(LastIterate {
                noise: noise_of(&next),
                system: next,
                equation,
                termination: Termination { reason, iterations },
            });
        }
        // A fixed-point iteration can alternate between two systems; half steps damp this and do not change the fixed
        // point.
        let share = if iterations > FULL_STEP_COUNT { 0.5 } else { 1.0 };
        for (s, n) in system.iter_mut().zip(&next) {
            *s += share * (n - *s);
        }
        (system, _) = problem.stabilise(&system)?;
    }
}

fn initial_system(problem: &IvProblem<'_>) -> Result<Vec<f64>, IdentError> {
    match system_from_noise_free_parts(problem) {
        Ok(system) => Ok(system),
        Err(_) => problem.least_squares(Prefilter::default()),
    }
}

fn system_from_noise_free_parts(problem: &IvProblem<'_>) -> Result<Vec<f64>, IdentError> {
    let Some(source) = problem.sources.first() else {
        return problem.least_squares(Prefilter::default());
    };
    let late = |x: &[f64]| [&vec![0.0; problem.nk], &x[..x.len() - problem.nk]].concat();
    let delayed: Vec<Vec<f64>> = source.inputs.iter().map(|x| late(x)).collect();
    let driving: Vec<&[f64]> = delayed.iter().map(Vec::as_slice).collect();
    let outputs: Vec<&[f64]> = problem.data.iter().map(|d| d.u).collect();
    // In a closed loop e contains noise. The parts of e and u that follow the noise-free input contain no noise, so
    // least squares on these parts is consistent, apart from the error of the expansion.
    let clean = driven_parts(&driving, &outputs);
    let data = clean.iter().zip(&source.inputs).map(|(u, e)| Data::new(e, u)).collect();
    let parts = problem.with_data(data, Vec::new());
    let mut system = parts.least_squares(Prefilter::default())?;
    for _ in 0..START_ITERATIONS {
        (system, _) = parts.stabilise(&system)?;
        let filter = Prefilter {
            f: &system[..parts.poles],
            ..Prefilter::default()
        };
        // Steiglitz and McBride: filtering with 1/F of the previous iteration turns the equation error into the output
        // error.
        system = parts.least_squares(filter)?;
    }
    Ok(system)
}

/// Runs the iteration without the nonlinear form, for use as a start.
pub(super) fn plain_iteration(
    limits: IterationLimits,
    problem: &IvProblem<'_>,
    noise_of: impl FnMut(&[f64]) -> NoiseModel,
) -> Result<LastIterate, IdentError> {
    iterate(limits, problem, noise_of, &mut SmallestResidual::default())
}
