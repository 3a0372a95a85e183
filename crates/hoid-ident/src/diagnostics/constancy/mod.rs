//! Tests whether the parameters of a fit are constant, based on the scores over time.
//!
//! At the minimum the scores `s(t) = psi(t) eps(t)` sum to zero. If a parameter changes within a record or from one run
//! to the next, the scores tend to have one sign before the change and the other sign after it (J. Nyblom, *JASA* 84
//! (1989) 223-230; B. E. Hansen, *J. Policy Modeling* 14 (1992) 517-533). For a direction v in the space of the
//! parameters and a set A of samples (the samples of a record after an instant, or one of several runs), the regressor
//! of a change is `z = psi'v` in A and 0 elsewhere. The part of z that the constant parameters do not explain is
//!
//! `r(t) = psi(t)' w(t)`, `w = v - a` in A and `-a` elsewhere, `a = G^-1 G_A v`
//!
//! and the Lagrange multiplier statistic (D. W. K. Andrews, *Econometrica* 61 (1993) 821-856) is `T = U / sqrt V`,
//! `U = sum r eps`. Its supremum over all A is tested. With blocks c, `g_c = sum psi eps`, `G_c = sum psi psi'`,
//! `h_c = w_c' g_c` and `R_c = w_c' G_c w_c`, the sums are `U = sum h_c` and `R = sum R_c`, and the estimated change is
//! `delta = U/R`. The exact information in A is used instead of a share of time, since the excitation is not uniform in
//! time.
//!
//! **V is the largest** of three variances. The first is the variance of the model, `sigma^2 R`. The second is the
//! scatter of blocks of 2 s about the tested change, `sum (h_c - delta R_c)^2 n/(n-2)`, which is valid for any
//! correlation within a block: the part of a person's remnant that the model does not explain is correlated over a few
//! tenths of a second (K.-Y. Liang and S. L. Zeger, *Biometrika* 73 (1986) 13-22; the scatter is taken about the
//! change, since a change must not mask itself). The third is the median of this scatter over all A, since the scatter
//! of a few blocks may be small by chance. Since people vary from run to run, `share^2 size^2 sum_runs (r'psi'v)^2` is
//! added, where `share` is the relative variation of the parameters and `size` the value of the parameter.
//!
//! **Level.** T is compared with Student's distribution with n - 2 degrees of freedom. The p-value of the supremum is
//! the smaller of Bonferroni's bound and the value for continuous time ([`critical`]), corrected for the number of
//! directions. The delay and the other parameters are tested separately, each at the level [`SIGNIFICANCE_LEVEL`]. For
//! drifts and periodic changes within a record, z is weighted by a line or a sine instead of 0 and 1; these count only
//! if they exceed the variation of people from run to run. The directions are the parameters of the operator or, if the
//! coefficients do not correspond to an operator, the coefficients.
//!
//! | file | contents |
//! |---|---|
//! | `blocks` | scores and information of blocks of records |
//! | `critical` | p-values of a supremum |
//! | `polynomials` | scores of a polynomial fit, including the score of the delay |
//! | `search` | search for the most significant change |
//! | `response_changes` | test of a known response for jumps, drifts and periodic changes |
//! | `influential_block` | search for the block with the most influence on the fit |

mod blocks;
mod critical;
mod influential_block;
mod polynomials;
mod response_changes;
mod search;
#[cfg(test)]
mod tests;

use hoid_model::{Finding, Record};

pub(crate) use blocks::{physical_score_blocks, score_blocks};
use influential_block::most_influential_block;
pub use response_changes::{ResponseBasis, ResponseChange, response_changes};
pub use search::TimeCourse;
use search::{Change, strongest_course, strongest_step};
pub(crate) use search::{Constancy, Direction};

/// Largest p-value at which a parameter counts as changed, both in the test of the delay and in the test of the other
/// parameters.
const SIGNIFICANCE_LEVEL: f64 = 5e-4;
/// Default relative standard deviation of a person's gain, crossover and delay from run to run. In six sets of ten runs
/// by three people, with each run identified alone and the variance of the estimates subtracted, the crossover varied
/// by 7 to 21 % (median 13 %), and the gain by 11 to 32 %.
pub const RUN_TO_RUN_DEVIATION: f64 = 0.13;

impl Constancy<'_> {
    /// Returns a warning if a parameter changes, and a warning if a stretch of the records dominates the fit. The test
    /// for a stretch assumes that the standard errors were computed from the model, not from the scatter of blocks.
    pub fn findings(&self, records: &[Record]) -> Vec<Finding> {
        self.change_finding(records)
            .into_iter()
            .chain(self.stretch_finding(records))
            .collect()
    }

    fn stretch_finding(&self, records: &[Record]) -> Option<Finding> {
        let found = most_influential_block(self)?;
        let record = records.get(found.record)?;
        let (from_s, to_s) = (
            record.time_s(found.first_sample),
            record.time_s(found.next_sample.unwrap_or(record.len())),
        );
        let to = found
            .next_sample
            .map_or("the end".to_owned(), |_| format!("{to_s:.0} s"));
        let record = if records.len() > 1 {
            format!(" of record {}", found.record + 1)
        } else {
            String::new()
        };
        let moves: Vec<String> = found
            .parameter_changes
            .iter()
            .map(|(name, by)| format!("{name} by {by:.1}"))
            .collect();
        let finding = Finding::warning(
            "stretch",
            format!(
                "the fit depends on the interval from {from_s:.0} s to {to}{record}: omitting it changes {} standard \
                 errors; inspect the recording there",
                moves.join(", ")
            ),
        );
        Some(finding.over(from_s, to_s))
    }

    /// Returns a warning if a parameter changes, with the name of the parameter and the approximate time.
    pub fn change_finding(&self, records: &[Record]) -> Option<Finding> {
        let of = |delay: bool| {
            let found = [strongest_step(self, delay), strongest_course(self, delay)]
                .into_iter()
                .flatten();
            let found = found.filter(|change| change.p_value < SIGNIFICANCE_LEVEL);
            found.min_by(|a, b| a.p_value.total_cmp(&b.p_value))
        };
        let mut found: Vec<Change> = [of(true), of(false)].into_iter().flatten().collect();
        found.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
        let words: Vec<String> = found
            .iter()
            .map(|change| self.change_description(change, records.len()))
            .collect();
        // A change between records has no time.
        let at_s = |change: &Change| {
            let record = records.get(change.record).filter(|_| change.first_sample > 0)?;
            Some((record.time_s(change.first_sample), record.time_s(change.first_sample)))
        };
        (!words.is_empty()).then(|| {
            Finding::warning(
                "not-constant",
                format!(
                    "the person's response is not constant: {}; fit the parts separately, or use --change sigmoid or a \
                     tracker",
                    words.join(", and ")
                ),
            )
            .over_spans(found.iter().filter_map(at_s))
        })
    }

    fn change_description(&self, change: &Change, records: usize) -> String {
        let at_s = change.first_sample as f64 * self.sample_time_s;
        let of_record = match records {
            0 | 1 => String::new(),
            _ => format!(" in record {}", change.record + 1),
        };
        let (name, size, error, unit) = (&change.name, change.size, change.error, change.unit);
        match change.time_course {
            TimeCourse::Step => {}
            TimeCourse::Drift => {
                return format!(
                    "{name} drifts by about {size:+.2} ± {error:.2}{unit}{of_record} (p = {:.0e})",
                    change.p_value
                );
            }
            TimeCourse::Oscillation(period_s) => {
                return format!(
                    "{name} oscillates by about {:.2} ± {error:.2}{unit} with a period of about {period_s:.0} \
                     s{of_record} (p = {:.0e})",
                    size.abs(),
                    change.p_value
                );
            }
        }
        let place = match (records, change.first_sample) {
            (0 | 1, _) => format!("about {at_s:.0} s after the start"),
            (_, 0) => format!("in record {} compared with the others", change.record + 1),
            _ => format!("about {at_s:.0} s after the start of record {}", change.record + 1),
        };
        format!(
            "{name} changes by about {size:+.2} ± {error:.2}{unit} {place} (p = {:.0e})",
            change.p_value
        )
    }
}
