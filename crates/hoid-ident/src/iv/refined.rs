//! The common iteration of the refined methods.
//!
//! Given a system, its noise-free output is simulated, the filter `D/(C F)` is built, and the
//! filtered equation gives the next system, until an iteration moves it by less than the tolerance:
//! with `delta` the step and sigma the standard deviation of the filtered residual,
//! `|Z delta| <= tolerance sigma`, which is a distance in standard errors.
//!
//! **Start.** Input and output are replaced by the parts of them that follow the noise-free input (Laguerre expansion),
//! and a few iterations of K. Steiglitz and L. E. McBride (*IEEE Trans. Automatic Control* 10 (1965) 461-464) on these
//! signals give a system close to the true one, in open and in closed loop. If this fails, least squares on the data
//! themselves is used.

use crate::{
    IdentError, Reason, Termination,
    criterion::Data,
    linalg::least_squares::{add_scaled, dot},
};

use super::{
    algorithm::IterationLimits,
    equation::{IvProblem, Prefilter},
    external_signal::following,
    last_iterate::{LastIterate, NoiseModel},
    own_poles::solve_for_own_poles,
};

/// Number of iterations of the start.
const START_ROUNDS: usize = 5;
/// Number of iterations after which only half of each step is taken, against oscillations.
const FULL_STEPS: usize = 20;
/// Ratio of the residual of a zero to the smallest one above which it is not the zero of the operator.
const FAR: f64 = 1.15;
/// Steps below this share of the output are rounding.
const ROUNDING: f64 = 1e-12;

/// Iterates, and continues in the nonlinear form if this does not converge ([`super::own_poles`]); `noise_of` returns
/// the noise model for a system.
pub(super) fn settle(
    limits: IterationLimits,
    problem: &IvProblem<'_>,
    mut noise_of: impl FnMut(&[f64]) -> NoiseModel,
) -> Result<LastIterate, IdentError> {
    let mut whitest = Whitest::default();
    let plain = iterate(limits, problem, &mut noise_of, &mut whitest)?;
    if plain.termination.converged() || limits.max_iterations <= FULL_STEPS {
        return Ok(plain);
    }
    // From the last iterate; if that leads far away, from its best system and from its start.
    let mut spent = plain.termination.iterations;
    let starts = [
        plain.system.clone(),
        whitest.system.unwrap_or_default(),
        problem.stabilised(&start(problem)?)?.0,
    ];
    let (mut best, mut rank) = (plain, (f64::INFINITY, f64::INFINITY));
    for from in starts.iter().filter(|from| !from.is_empty()) {
        let found = solve_for_own_poles(limits, problem, from, &mut noise_of)?;
        spent += found.termination.iterations;
        let variance = found.variance();
        // The estimating equation has several zeros; that of the operator has about the smallest residual found.
        let far = variance > FAR * whitest.variance;
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
        // Another zero of the equation, which does not fit the data.
        best.termination.reason = Reason::IterationLimit;
    }
    best.termination.iterations = spent;
    Ok(best)
}

/// The system with the smallest filtered residual of an iteration.
struct Whitest {
    variance: f64,
    system: Option<Vec<f64>>,
}

impl Default for Whitest {
    fn default() -> Self {
        Self {
            variance: f64::INFINITY,
            system: None,
        }
    }
}

/// The iteration only; `noise_of` returns the noise model for a system.
fn iterate(
    limits: IterationLimits,
    problem: &IvProblem<'_>,
    mut noise_of: impl FnMut(&[f64]) -> NoiseModel,
    whitest: &mut Whitest,
) -> Result<LastIterate, IdentError> {
    let (mut system, _) = problem.stabilised(&start(problem)?)?;
    let mut iterations = 0;
    loop {
        let noise = noise_of(&system);
        let equation = problem.equation(noise.prefilter(&system[..problem.poles]), &system);
        let next = problem.solve(&equation)?;
        iterations += 1;
        // |Z delta|/sigma: a distance in standard errors, since the covariance is about sigma^2 (Z'Z)^-1.
        let mut step = vec![0.0; equation.y.len()];
        for (column, (a, b)) in equation.z.iter().zip(next.iter().zip(&system)) {
            add_scaled(&mut step, a - b, column);
        }
        let residual = equation.residual(&next);
        let variance = dot(&residual, &residual) / residual.len() as f64;
        let moved = dot(&step, &step);
        let settled = moved <= limits.tolerance * limits.tolerance * variance
            || moved <= ROUNDING * ROUNDING * dot(&equation.y, &equation.y);
        let own = equation.residual(&system);
        let of_system = dot(&own, &own) / own.len() as f64;
        if of_system < whitest.variance {
            *whitest = Whitest {
                variance: of_system,
                system: Some(system.clone()),
            };
        }
        // The next iteration simulates with F and filters with 1/F: both need stable poles.
        let (next, reflected) = problem.stabilised(&next)?;
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
        // A fixed point iteration can alternate between two systems; half steps damp that and keep the fixed point.
        let share = if iterations > FULL_STEPS { 0.5 } else { 1.0 };
        for (s, n) in system.iter_mut().zip(&next) {
            *s += share * (n - *s);
        }
        (system, _) = problem.stabilised(&system)?;
    }
}

fn start(problem: &IvProblem<'_>) -> Result<Vec<f64>, IdentError> {
    match of_noise_free_parts(problem) {
        Ok(system) => Ok(system),
        Err(_) => problem.least_squares(Prefilter::default()),
    }
}

fn of_noise_free_parts(problem: &IvProblem<'_>) -> Result<Vec<f64>, IdentError> {
    let Some(source) = problem.sources.first() else {
        return problem.least_squares(Prefilter::default());
    };
    let late = |x: &[f64]| [&vec![0.0; problem.nk], &x[..x.len() - problem.nk]].concat();
    let delayed: Vec<Vec<f64>> = source.inputs.iter().map(|x| late(x)).collect();
    let driving: Vec<&[f64]> = delayed.iter().map(Vec::as_slice).collect();
    let outputs: Vec<&[f64]> = problem.data.iter().map(|d| d.u).collect();
    // In a closed loop e contains noise. The projections on the noise-free input do not, so that least squares on them
    // is consistent up to the error of the projection.
    let clean = following(&driving, &outputs);
    let data = clean.iter().zip(&source.inputs).map(|(u, e)| Data::new(e, u)).collect();
    let parts = problem.of(data, Vec::new());
    let mut system = parts.least_squares(Prefilter::default())?;
    for _ in 0..START_ROUNDS {
        (system, _) = parts.stabilised(&system)?;
        let filter = Prefilter {
            f: &system[..parts.poles],
            ..Prefilter::default()
        };
        // Steiglitz and McBride: filtered with 1/F of the iteration before, the equation error becomes the output
        // error.
        system = parts.least_squares(filter)?;
    }
    Ok(system)
}

/// The iteration only, for a start.
pub(super) fn plain_iteration(
    limits: IterationLimits,
    problem: &IvProblem<'_>,
    noise_of: impl FnMut(&[f64]) -> NoiseModel,
) -> Result<LastIterate, IdentError> {
    iterate(limits, problem, noise_of, &mut Whitest::default())
}
