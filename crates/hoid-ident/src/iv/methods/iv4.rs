//! The four-step instrumental variable method (L. Ljung, *System Identification*, 1999, section
//! 15.3, eq. 15.21-15.26).
//!
//! 1. The equation `A u = B q^-nk e + v` is fitted by least squares.
//! 2. Instruments are simulated with the A and B of step 1, for a first IV estimate.
//! 3. An autoregression `L v = eps` is fitted to the residual.
//! 4. Instruments are simulated with the A and B of step 2, for an IV estimate of the equation filtered with L.
//!
//! The estimate is consistent for any v, and has the smallest variance if L whitens v. For a closed loop the
//! simulations use the noise-free input. Ljung uses the order na + nb for L as an example; here the order is four times
//! as high. If a process is sampled at a high rate, v (`A = F`, `v = F n` with noise n) has zeros near the unit circle,
//! for which an autoregression needs many terms.

use hoid_model::Structure;

use crate::iv::{
    algorithm::{Algorithm, IterationLimits, IvSolution},
    columns::split_by_record,
    covariance::covariance,
    equation::{IvProblem, Prefilter},
};
use crate::{IdentError, Reason, Termination, criterion::Criterion, noise_model::noise_model};

pub(super) const ALGORITHM: Algorithm = Algorithm {
    name: "iv4",
    help: "four-step instrumental variables",
    source: "Ljung 1999, section 15.3",
    structures: &[Structure::Arx],
    solve,
};

/// Order of the autoregression L, as a multiple of na + nb.
const ORDER_FACTOR: usize = 4;
/// Minimum number of rows for each coefficient of the autoregression.
const MIN_ROWS_PER_COEFFICIENT: usize = 10;

fn solve(problem: &IvProblem<'_>, _: &Criterion<'_>, _: IterationLimits) -> Result<IvSolution, IdentError> {
    // Step 1: the estimate is biased by the coloured v, but the output simulated with it is correlated with the true
    // output, which is sufficient for instruments.
    let (start, _) = problem.stabilise(&problem.least_squares(Prefilter::default())?)?;
    // Step 2: IV estimate with simulated instruments.
    let second = problem.equation(Prefilter::default(), &start);
    let system = problem.solve(&second)?;
    // Step 3: L whitens v, which minimises the variance (Ljung 1999, eq. 15.24).
    let rows = problem.row_counts(0);
    let shortest = rows.iter().min().copied().unwrap_or(0);
    let order = (ORDER_FACTOR * (problem.poles + problem.nb)).min(shortest / MIN_ROWS_PER_COEFFICIENT);
    let (_, whitening) = noise_model(&split_by_record(&second.residual(&system), &rows), 0, order);
    let filter = Prefilter {
        d: &whitening,
        ..Prefilter::default()
    };
    // Step 4: IV estimate of the filtered equation.
    let (stable, _) = problem.stabilise(&system)?;
    let last = problem.equation(filter, &stable);
    let theta = problem.solve(&last)?;
    let residual = split_by_record(&last.residual(&theta), &problem.row_counts(order));
    Ok(IvSolution {
        covariance: covariance(&last.z, &last.phi, |_| true, &residual),
        theta,
        termination: Termination {
            reason: Reason::Direct,
            iterations: 0,
        },
    })
}
