//! Nonlinear form of the equation, in which F has its own poles. It is used if the iteration of the refined methods
//! does not converge.
//!
//! The iteration solves `Z' L (F u - B q^-nk e) = 0` for F and B, with 1/F of the previous iteration in L. If F has a
//! pole so slow that the record hardly distinguishes it from a pole on the unit circle, such as the lag of an operator,
//! or if the model is too small, a pole outside the circle may solve this equation; reflected inside, it leads to the
//! same result again. The alternative is a zero of
//!
//! `g(theta) = Z' eps(theta)`,  `eps = (D/C) (u - (B/F) q^-nk e)`,
//!
//! which is the same at a fixed point of the iteration but has a stable F. With Z, C and D of a system fixed, and Q an
//! orthonormal basis of Z, `|Q' eps(theta)|^2` is therefore minimised over B and stable F (damped Gauss-Newton, along
//! the border of stability if necessary: [`crate::optimize`]). Then Z, C and D are computed again, until theta no
//! longer changes; [`Extrapolation`] helps if the convergence is slow or oscillates. If g has no zero in the region of
//! stability, its smallest norm is on the border of this region, and the termination reports this.
//!
//! **Without convergence.** If the model is smaller than the operator, eps is correlated with some of the instruments
//! that other systems give, and each theta may lead to instruments that give another theta. Instruments need not come
//! from the estimate itself: any auxiliary model gives a consistent estimate. In this case the estimate is the zero of
//! `Z' eps(theta)` for the Z, C and D whose zero is closest to the system from which they were computed. It counts as
//! converged if the zero differs from this system by less than half a standard error.
//!
//! psi is the exact derivative with 1/(C F) at rest at the first row. The unknown state at this row has no effect,
//! since its responses are projected out of Z.
//!
//! The zero of g is the nonlinear form of the optimal instrumental variable estimate (T. Söderström and P. Stoica,
//! *Instrumental Variable Methods for System Identification*, 1983, ch. 6; see P. C. Young, *Automatica* 52 (2015)
//! 35-46, on the stationary point of the refined iteration).

use std::ops::Range;

use hoid_core::stability::roots_inside;

use super::{
    algorithm::IterationLimits,
    columns::Columns,
    equation::IvProblem,
    final_iteration::{LastIterate, NoiseModel},
};
use crate::{
    IdentError, Reason, SearchOptions, Termination,
    criterion::Workspace,
    linalg::{
        least_squares::solve_symmetric,
        vectors::{add_scaled, dot},
    },
    optimize::{Linearisation, Objective, minimise},
};

/// Largest number of search steps with given instruments.
const SEARCH_STEPS: usize = 30;
/// Number of iterations used by the extrapolation, and the ridge factor of their combination.
const EXTRAPOLATION_POINT_COUNT: usize = 5;
const RIDGE_FACTOR: f64 = 1e-10;
/// Tolerance of the search with given instruments, as a share of the tolerance of the iteration.
const INNER_TOLERANCE_FACTOR: f64 = 1e-2;
/// A pole with at least this radius counts as being on the unit circle.
const MIN_RADIUS_ON_CIRCLE: f64 = 1.0 - 1e-7;
/// Largest negligible step in standard errors, over all parameters together.
const NEGLIGIBLE_STEP: f64 = 0.5;
/// The iteration counts as divergent after this number of successive steps without a reduction of the step length by
/// the factor `REDUCTION_FACTOR`.
const MAX_STEPS_WITHOUT_REDUCTION: usize = 12;
const REDUCTION_FACTOR: f64 = 0.9;
/// If a step is longer than this multiple of the shortest step, the extrapolation has diverged.
const DIVERGENCE_RATIO: f64 = 10.0;

/// The objective `|Q' eps(theta)|^2` for given instruments and a given noise model.
struct InstrumentObjective<'p, 'a> {
    problem: &'p IvProblem<'a>,
    noise: &'p NoiseModel,
    q: Columns,
    /// Reference power, chosen such that a sum of squares up to 1e-26 of it counts as zero.
    power: f64,
}

impl Objective for InstrumentObjective<'_, '_> {
    fn is_feasible(&self, system: &[f64]) -> bool {
        system.iter().all(|v| v.is_finite()) && roots_inside(&system[..self.problem.poles], 1.0)
    }

    fn linearise(&self, system: &[f64], _: &mut Workspace) -> Linearisation {
        let (eps, psi) = self
            .problem
            .prediction_error(self.noise.prefilter(&system[..self.problem.poles]), system);
        let c: Vec<f64> = self.q.iter().map(|q| dot(q, &eps)).collect();
        let along: Vec<Vec<f64>> = psi
            .iter()
            .map(|psi| self.q.iter().map(|q| dot(q, psi)).collect())
            .collect();
        Linearisation {
            sum_of_squares: dot(&c, &c),
            descent: along.iter().map(|column| dot(column, &c)).collect(),
            gram: (along.iter())
                .flat_map(|a| along.iter().map(move |b| dot(a, b)))
                .collect(),
        }
    }

    fn output_power(&self) -> f64 {
        self.power
    }

    fn stable_blocks(&self) -> Vec<Range<usize>> {
        std::iter::once(0..self.problem.poles).collect()
    }
}

/// Iterates the nonlinear form, starting from a system with stable F, and returns the iterate with the shortest step.
/// `noise_of` returns the noise model of a system.
///
/// # Errors
/// [`IdentError::SingularInstruments`] if the instruments are linearly dependent, [`IdentError::NoFiniteLoss`] if the
/// search fails.
pub(super) fn solve_nonlinear_form(
    limits: IterationLimits,
    problem: &IvProblem<'_>,
    start: &[f64],
    noise_of: &mut impl FnMut(&[f64]) -> NoiseModel,
) -> Result<LastIterate, IdentError> {
    let options = SearchOptions {
        max_iterations: SEARCH_STEPS,
        ..SearchOptions::default()
    };
    let mut system = start.to_vec();
    let mut extrapolation = Extrapolation::default();
    let mut nearest: Option<(f64, LastIterate)> = None;
    let (mut iterations, mut without_gain) = (0, 0);
    loop {
        let noise = noise_of(&system);
        let equation = problem.equation(noise.prefilter(&system[..problem.poles]), &system);
        let residual = equation.residual(&system);
        let variance = dot(&residual, &residual) / residual.len() as f64;
        let objective = InstrumentObjective {
            problem,
            noise: &noise,
            q: problem.basis(&equation.z)?,
            power: 1e26 * (INNER_TOLERANCE_FACTOR * limits.tolerance).powi(2) * variance,
        };
        let end = minimise(&objective, system.clone(), &options, None, &mut Workspace::default())
            .ok_or(IdentError::NoFiniteLoss)?;
        iterations += 1;
        without_gain += 1;
        let step: Vec<f64> = end.theta.iter().zip(&system).map(|(a, b)| a - b).collect();
        let lengths = gram_by_rows(&equation.z);
        let moved = (squared_length(&lengths, &step) / variance).sqrt();
        let least = nearest.as_ref().map_or(f64::INFINITY, |(least, _)| *least);
        let next = extrapolation.next(&system, step, &lengths);
        let inside = objective.is_feasible(&next);
        if moved < least {
            if moved < REDUCTION_FACTOR * least {
                without_gain = 0;
            }
            let there = LastIterate {
                noise: noise.clone(),
                system: end.theta.clone(),
                equation,
                termination: Termination {
                    reason: end_reason(moved, limits.tolerance, &end.theta[..problem.poles]),
                    iterations,
                },
            };
            nearest = Some((moved, there));
        }
        let ended = moved <= limits.tolerance
            || iterations >= limits.max_iterations
            || without_gain >= MAX_STEPS_WITHOUT_REDUCTION;
        if let (true, Some((_, mut last))) = (ended, nearest.take_if(|_| ended)) {
            last.noise = noise_of(&last.system);
            last.termination.iterations = iterations;
            return Ok(last);
        }
        system = match &nearest {
            // The extrapolation has diverged: return to the best system.
            Some((least, near)) if moved > DIVERGENCE_RATIO * least => {
                extrapolation = Extrapolation::default();
                near.system.clone()
            }
            _ if inside => next,
            _ => end.theta,
        };
    }
}

/// Returns the reason for ending an iteration whose next step has the length `moved` in standard errors.
fn end_reason(moved: f64, tolerance: f64, f: &[f64]) -> Reason {
    if moved > NEGLIGIBLE_STEP {
        Reason::IterationLimit
    } else if !roots_inside(f, MIN_RADIUS_ON_CIRCLE) {
        Reason::Border
    } else if moved <= tolerance {
        Reason::Settled
    } else {
        Reason::InstrumentsHeld
    }
}

/// Extrapolation of a fixed-point iteration from the last few points, by the combination of their steps with the
/// smallest norm (D. G. Anderson, *J. ACM* 12 (1965) 547-560). Without the extrapolation the iteration may converge
/// slowly or oscillate if the model is too small and the instruments are noise-free.
#[derive(Default)]
struct Extrapolation {
    /// Point and step of the last iteration; `differences` contains the changes of point and step between successive
    /// iterations.
    last: Option<(Vec<f64>, Vec<f64>)>,
    differences: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Extrapolation {
    fn next(&mut self, point: &[f64], step: Vec<f64>, lengths: &[f64]) -> Vec<f64> {
        let p = point.len();
        if let Some((point_before, step_before)) = self.last.take() {
            self.differences
                .push((difference(point, &point_before), difference(&step, &step_before)));
            if self.differences.len() > EXTRAPOLATION_POINT_COUNT.min(p) {
                self.differences.remove(0);
            }
        }
        let times = |v: &[f64]| -> Vec<f64> { lengths.chunks_exact(p).map(|row| dot(row, v)).collect() };
        let mut next: Vec<f64> = point.iter().zip(&step).map(|(x, f)| x + f).collect();
        let weighed: Vec<Vec<f64>> = self.differences.iter().map(|(_, df)| times(df)).collect();
        let gram: Vec<f64> = weighed
            .iter()
            .enumerate()
            .flat_map(|(i, w)| {
                let row = self.differences.iter().enumerate();
                row.map(move |(j, (_, df))| dot(w, df) * if i == j { 1.0 + RIDGE_FACTOR } else { 1.0 })
            })
            .collect();
        let right: Vec<f64> = weighed.iter().map(|w| dot(w, &step)).collect();
        if let Some(shares) = solve_symmetric(&gram, &right).filter(|_| !right.is_empty()) {
            for ((dx, df), share) in self.differences.iter().zip(shares) {
                add_scaled(&mut next, -share, dx);
                add_scaled(&mut next, -share, df);
            }
        }
        self.last = Some((point.to_vec(), step));
        next
    }
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Returns `Z'Z` by rows.
fn gram_by_rows(z: &Columns) -> Vec<f64> {
    z.iter().flat_map(|a| z.iter().map(move |b| dot(a, b))).collect()
}

/// Returns `v' M v`.
fn squared_length(m: &[f64], v: &[f64]) -> f64 {
    m.chunks_exact(v.len()).zip(v).map(|(row, x)| x * dot(row, v)).sum()
}
