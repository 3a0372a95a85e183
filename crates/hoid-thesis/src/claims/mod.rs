//! Statements of the thesis, tested with the data of studies.
//!
//! A claim contains a statement of the thesis and its place, the plans that provide the data, and the measurement. The
//! verdict on a claim follows from the data by the rules of the module [`rules`], which are the same for all claims. If
//! a plan was not run, or if the results lack the required data, the claim cannot be tested and the verdict gives the
//! reason. Claims on experiments with people cannot be tested here, because there are no data.
//!
//! | module | theme |
//! |---|---|
//! | `batch_arx` | batch fits of ARX models |
//! | `batch_bj`, `bj_against_arx` | batch fits of Box-Jenkins models |
//! | `variance_and_zero` | innovation variance, b at a wrong delay, the zero in C2 |
//! | `remnant_order` | the order of the noise model |
//! | `initial_conditions` | starting points of searches |
//! | `recursive_arx`, `recursive_bj` | RLS, and RPEM compared with RLS |
//! | `expectations` | expectations of the recursive estimator in Part II |
//! | `noise` | noise level, remnant time constant, sample time |
//! | `untestable` | claims that are not tested here |
//!
//! ```no_run
//! use hoid_study::Results;
//! use hoid_thesis::claims::{Evidence, findings};
//!
//! let bias = Results::read("results/bias".as_ref())?;
//! let mut evidence = Evidence::new();
//! evidence.add(&bias);
//! for (claim, finding) in findings(&evidence) {
//!     println!("{}: {}", claim.id, finding.verdict);
//! }
//! # Ok::<(), hoid_study::StudyError>(())
//! ```

mod batch_arx;
mod batch_bj;
mod bj_against_arx;
mod claim;
mod evidence;
mod expectations;
mod finding;
mod initial_conditions;
mod noise;
mod recursive_arx;
mod recursive_bj;
mod remnant_order;
pub mod rules;
mod settings;
mod statistics;
mod table;
mod untestable;
mod value;
mod variance_and_zero;

pub use claim::{Claim, Theme};
pub use evidence::Evidence;
pub use finding::{Finding, MeasuredNumber};
pub use rules::{Bound, CellOutcome, CellTest, Part, Verdict};
pub use table::claims_table;
pub use value::Value;

/// All claims, grouped by theme.
pub fn claims() -> Vec<Claim> {
    [
        batch_arx::CLAIMS,
        batch_bj::CLAIMS,
        bj_against_arx::CLAIMS,
        variance_and_zero::CLAIMS,
        remnant_order::CLAIMS,
        initial_conditions::CLAIMS,
        recursive_arx::CLAIMS,
        recursive_bj::CLAIMS,
        expectations::CLAIMS,
        noise::CLAIMS,
        untestable::CLAIMS,
    ]
    .concat()
}

/// All claims with the evidence from the data.
pub fn findings(evidence: &Evidence<'_>) -> Vec<(Claim, Finding)> {
    let with_finding = |claim: Claim| {
        let finding = claim.evaluate(evidence);
        (claim, finding)
    };
    claims().into_iter().map(with_finding).collect()
}

#[cfg(test)]
mod tests;
