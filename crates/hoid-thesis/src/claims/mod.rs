//! Statements of the thesis, tested by the data of studies.
//!
//! A claim contains the statement of the text and its place, the plans that measure it and the
//! method. Its verdict comes from the data by the rules of the module [`rules`], the same for all
//! claims. A claim whose plan was not run, or which needs data that the results do not have, cannot
//! be tested and gives the reason; so does one on experiments with people, for which there are no
//! data here.
//!
//! | module | theme |
//! |---|---|
//! | `batch_arx` | batch fits of ARX models |
//! | `batch_bj`, `bj_against_arx` | batch fits of Box-Jenkins models |
//! | `variance_and_zero` | innovation variance, b at a wrong delay, the zero in C2 |
//! | `remnant_order` | the order of the noise model |
//! | `initial_conditions` | where searches start |
//! | `recursive_arx`, `recursive_bj` | RLS, and RPEM against RLS |
//! | `expectations` | expectations of Part II for the recursion |
//! | `noise` | noise level, remnant time constant, sample time |
//! | `elsewhere` | claims that are not tested here |
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
mod elsewhere;
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
mod value;
mod variance_and_zero;

pub use claim::{Claim, Theme};
pub use evidence::Evidence;
pub use finding::{Finding, Measured};
pub use rules::{Bound, CellOutcome, CellTest, Part, Verdict};
pub use table::claims_table;
pub use value::Value;

/// All claims, by theme.
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
        elsewhere::CLAIMS,
    ]
    .concat()
}

/// All claims with the evidence of the data on them.
pub fn findings(evidence: &Evidence<'_>) -> Vec<(Claim, Finding)> {
    let with_finding = |claim: Claim| {
        let finding = claim.evaluate(evidence);
        (claim, finding)
    };
    claims().into_iter().map(with_finding).collect()
}

#[cfg(test)]
mod tests;
