//! Rules that convert numbers with Monte Carlo errors to a verdict.
//!
//! 1. **A cell.** A claim is tested in each cell (a scenario, an estimator, a parameter) to which it applies. The
//!    measured value is x, its Monte Carlo error s, and the margin 2 s.
//!    - *Comparison* (larger, smaller, no larger than): the cell passes if x is on the claimed side of the limit by
//!      more than the margin, fails if it is on the other side by more than the margin, and is undecided otherwise.
//!    - *Number* (around 50 %, 10 times): the cell passes if x lies within the range that the wording allows, widened
//!      by the margin, and fails otherwise. A cell that would pass is undecided if the margin exceeds half the range,
//!      because such an x carries no information about the number. If the number is the size of an effect (slower by a
//!      factor, less error by a percentage), an x beyond the range on the side of the larger effect *exceeds* the
//!      claim: the statement is true, and the effect is larger.
//!    - If fewer than half of the replications give a value (because models cannot be converted), the cell is
//!      undecided.
//! 2. **A part** of a claim (same figure of merit, same test) *holds* if 90 % of its decided cells pass. A part *holds
//!    and more so* if fewer cells pass, but 90 % pass or exceed the claim. A part *holds in part* if 50 % of its
//!    decided cells pass or exceed the claim, and *does not hold* otherwise. If fewer than half of the cells of a part
//!    are decided, the part is undecided.
//! 3. **A claim** *holds* if all its parts hold. A claim *holds and more so* if all parts hold and at least one of them
//!    holds and more so. A claim *does not hold* if no part holds even in part, and *holds in part* otherwise. If no
//!    part is decided, the claim *cannot be tested*.
//!
//! Meaning of the wording, the same for all claims:
//!
//! | wording | test |
//! |---|---|
//! | around x, x %, x times | from x / 2 to 3 x / 2 |
//! | x % more, x % less, reduced by x % | relative to the value with which it is compared, even if both values are in % of a true value |
//! | large, important, considerable, huge, wrong bias | beyond 25 % of the true value |
//! | acceptable, accurate, always accurate | within 10 % |
//! | close to zero, null on average, the same, not affected | within 5 percentage points of the true value |
//! | null without remnant | within 0.001 % |
//! | heavily, highly reduced | less than a quarter of the quantity remains |
//! | much higher | at least one and a half times |
//! | the same VAF | within 1 percentage point |
//! | slight, small, matters more | at least 0.1 percentage points of the true value |
//! | a linear trend | R^2 of the fitted straight line at least 0.9 |

use super::value::Value;

/// Limit for a large bias, % of the true value.
pub(super) const LARGE_BIAS: f64 = 25.0;
/// Limit for an acceptable bias, % of the true value.
pub(super) const ACCEPTABLE_BIAS: f64 = 10.0;
/// Limit for a bias close to zero or to another bias, percentage points of the true value.
pub(super) const CLOSE_BIAS: f64 = 5.0;
/// Smallest relevant difference, percentage points of the true value.
pub(super) const RELEVANT_DIFFERENCE: f64 = 0.1;
/// Largest remaining fraction of a quantity that is heavily reduced.
pub(super) const HEAVY_REDUCTION: f64 = 0.25;
/// Smallest ratio for a quantity that is much higher.
pub(super) const MUCH_HIGHER_RATIO: f64 = 1.5;
/// Smallest R^2 of a linear trend.
pub(super) const MIN_LINEAR_R2: f64 = 0.9;

const MARGIN_STANDARD_ERRORS: f64 = 2.0;
const MIN_SHARE_TO_HOLD: f64 = 0.9;
const MIN_SHARE_TO_HOLD_IN_PART: f64 = 0.5;

/// Verdict on a claim from the data.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// The claim holds.
    Holds,
    /// The claim is true, and the effect is larger than the claimed number.
    HoldsWithLargerEffect,
    /// The claim holds in part.
    HoldsInPart,
    /// The claim does not hold.
    DoesNotHold,
    /// The claim cannot be tested, for this reason.
    CannotBeTested(String),
}

impl Verdict {
    /// The verdict as text, without the reason.
    pub fn text(&self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::HoldsWithLargerEffect => "holds, and more so",
            Self::HoldsInPart => "holds in part",
            Self::DoesNotHold => "does not hold",
            Self::CannotBeTested(_) => "cannot be tested",
        }
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::CannotBeTested(reason) => write!(f, "cannot be tested: {reason}"),
            other => f.write_str(other.text()),
        }
    }
}

/// Outcome of the test in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellOutcome {
    /// The value is as claimed.
    Passes,
    /// The value is beyond the claimed number, on the side of the larger effect.
    Exceeds,
    /// The value is not as claimed.
    Fails,
    /// The margin is too large to decide, or there is no value.
    Undecided,
}

/// Claimed bound on the value of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// The value is larger than this limit.
    Above(f64),
    /// The value is smaller than this limit.
    Below(f64),
    /// The value lies in the range of a claimed number.
    Between(f64, f64),
    /// The value lies in the range of a claimed effect size; a larger value is a larger effect.
    Effect(f64, f64),
}

/// Test of a claim in one cell.
#[derive(Debug, Clone, PartialEq)]
pub struct CellTest {
    /// Name of the cell.
    pub label: String,
    /// The measured value.
    pub measured: Value,
    /// The claimed bound.
    pub bound: Bound,
}

impl CellTest {
    /// Compares the measured value with the claimed bound.
    pub fn outcome(&self) -> CellOutcome {
        let Value { value, error } = self.measured;
        if !value.is_finite() || !error.is_finite() {
            return CellOutcome::Undecided;
        }
        let margin = MARGIN_STANDARD_ERRORS * error;
        let beyond = match self.bound {
            Bound::Above(limit) => value - limit,
            Bound::Below(limit) => limit - value,
            Bound::Between(low, high) | Bound::Effect(low, high) => {
                let effect = matches!(self.bound, Bound::Effect(..));
                return if effect && value > high + margin {
                    CellOutcome::Exceeds
                } else if !(low - margin..=high + margin).contains(&value) {
                    CellOutcome::Fails
                } else if margin > 0.5 * (high - low) {
                    CellOutcome::Undecided
                } else {
                    CellOutcome::Passes
                };
            }
        };
        if beyond > margin {
            CellOutcome::Passes
        } else if beyond < -margin || margin == 0.0 {
            CellOutcome::Fails
        } else {
            CellOutcome::Undecided
        }
    }
}

/// The cells of a claim with the same figure of merit and the same test.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// The figure of merit and the claim.
    pub label: String,
    /// Tests in the cells of the part.
    pub tests: Vec<CellTest>,
    /// Additional numbers that are shown but not tested.
    pub shown: Vec<(String, Value)>,
}

impl Part {
    pub(super) fn new(label: &str) -> Self {
        Self {
            label: label.to_owned(),
            tests: Vec::new(),
            shown: Vec::new(),
        }
    }

    /// Adds a number that is shown but not tested.
    pub(super) fn add_shown(&mut self, label: String, value: Value) {
        self.shown.push((label, value));
    }

    fn add(&mut self, label: String, measured: Value, bound: Bound) {
        self.tests.push(CellTest { label, measured, bound });
    }

    /// Adds a cell in which the value is claimed to be larger than a limit.
    pub(super) fn add_above(&mut self, label: String, measured: Value, limit: f64) {
        self.add(label, measured, Bound::Above(limit));
    }

    /// Adds a cell in which the value is claimed to be smaller than a limit.
    pub(super) fn add_below(&mut self, label: String, measured: Value, limit: f64) {
        self.add(label, measured, Bound::Below(limit));
    }

    /// Adds a cell in which the value is claimed to be around a number.
    pub(super) fn add_around(&mut self, label: String, measured: Value, number: f64) {
        self.add_between(label, measured, 0.5 * number, 1.5 * number);
    }

    /// Adds a cell in which an effect is claimed to have this size; a larger value is a larger effect.
    pub(super) fn add_effect(&mut self, label: String, measured: Value, size: f64) {
        self.add(label, measured, Bound::Effect(0.5 * size, 1.5 * size));
    }

    /// Adds a cell in which the size of an effect is claimed to lie in a range.
    pub(super) fn add_effect_between(&mut self, label: String, measured: Value, low: f64, high: f64) {
        self.add(label, measured, Bound::Effect(low, high));
    }

    /// Adds a cell in which the value is claimed to lie in a range.
    pub(super) fn add_between(&mut self, label: String, measured: Value, low: f64, high: f64) {
        self.add(label, measured, Bound::Between(low, high));
    }

    /// Number of cells with this outcome.
    pub fn count(&self, outcome: CellOutcome) -> usize {
        self.tests.iter().filter(|test| test.outcome() == outcome).count()
    }

    /// Numbers of failed cells whose value is above and below the range of a claimed number.
    pub fn outcome_counts_beyond_bounds(&self) -> (usize, usize) {
        let fails = self.tests.iter().filter(|test| test.outcome() == CellOutcome::Fails);
        fails.fold((0, 0), |(above, below), test| match test.bound {
            Bound::Between(low, _) | Bound::Effect(low, _) => {
                if test.measured.value < low {
                    (above, below + 1)
                } else {
                    (above + 1, below)
                }
            }
            _ => (above, below),
        })
    }

    /// Verdict on the part by rule 2; `None` if the part is undecided.
    pub fn verdict(&self) -> Option<Verdict> {
        let [passes, exceeds, fails] =
            [CellOutcome::Passes, CellOutcome::Exceeds, CellOutcome::Fails].map(|outcome| self.count(outcome));
        let decided = passes + exceeds + fails;
        if decided == 0 || 2 * decided < self.tests.len() {
            return None;
        }
        let share = |cells: usize| cells as f64 / decided as f64;
        Some(if share(passes) >= MIN_SHARE_TO_HOLD {
            Verdict::Holds
        } else if share(passes + exceeds) >= MIN_SHARE_TO_HOLD {
            Verdict::HoldsWithLargerEffect
        } else if share(passes + exceeds) >= MIN_SHARE_TO_HOLD_IN_PART {
            Verdict::HoldsInPart
        } else {
            Verdict::DoesNotHold
        })
    }
}

/// Verdict on a claim from its parts by rule 3.
pub fn verdict(parts: &[Part]) -> Verdict {
    let each: Vec<Option<Verdict>> = parts.iter().map(Part::verdict).collect();
    let is = |asked: &Verdict| each.iter().filter(|found| found.as_ref() == Some(asked)).count();
    if each.iter().all(Option::is_none) {
        let cells: usize = parts.iter().map(|part| part.tests.len()).sum();
        let open: usize = parts.iter().map(|part| part.count(CellOutcome::Undecided)).sum();
        return Verdict::CannotBeTested(format!("the replications leave {open} of {cells} cells undecided"));
    }
    let [holds, more_so, in_part] =
        [Verdict::Holds, Verdict::HoldsWithLargerEffect, Verdict::HoldsInPart].map(|asked| is(&asked));
    if holds == each.len() {
        Verdict::Holds
    } else if holds + more_so == each.len() {
        Verdict::HoldsWithLargerEffect
    } else if holds + more_so + in_part == 0 {
        Verdict::DoesNotHold
    } else {
        Verdict::HoldsInPart
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(value: f64, error: f64, bound: Bound) -> CellOutcome {
        CellTest {
            label: String::new(),
            measured: Value { value, error },
            bound,
        }
        .outcome()
    }

    fn part(passes: usize, fails: usize, open: usize) -> Part {
        let mut part = Part::new("by hand");
        for (count, value) in [(passes, 3.0), (fails, -3.0), (open, 1.0)] {
            for _ in 0..count {
                part.add_above(String::new(), Value { value, error: 1.0 }, 0.0);
            }
        }
        part
    }

    #[test]
    fn cell_passes_beyond_two_standard_errors() {
        use CellOutcome::{Fails, Passes, Undecided};
        for (value, outcome) in [(12.1, Passes), (11.9, Undecided), (8.1, Undecided), (7.9, Fails)] {
            assert_eq!(cell(value, 1.0, Bound::Above(10.0)), outcome);
            assert_eq!(cell(-value, 1.0, Bound::Below(-10.0)), outcome);
        }
        // Without a Monte Carlo error no cell is undecided, and a value that is not larger fails.
        assert_eq!(cell(10.0, 0.0, Bound::Above(10.0)), Fails);
        assert_eq!(cell(10.0 + 1e-9, 0.0, Bound::Above(10.0)), Passes);
        let around = Bound::Between(25.0, 75.0);
        for (value, outcome) in [
            (50.0, Passes),
            (76.9, Passes),
            (77.1, Fails),
            (23.1, Passes),
            (22.9, Fails),
        ] {
            assert_eq!(cell(value, 1.0, around), outcome);
        }
        // The margin 2 s = 26 is more than half the range, 75 - 25.
        for (value, outcome) in [(50.0, Undecided), (100.9, Undecided), (101.1, Fails)] {
            assert_eq!(cell(value, 13.0, around), outcome);
        }
        for (value, error) in [(f64::NAN, 1.0), (1.0, f64::NAN), (f64::INFINITY, 1.0)] {
            assert_eq!(cell(value, error, around), Undecided);
            assert_eq!(cell(value, error, Bound::Above(0.0)), Undecided);
        }
    }

    #[test]
    fn larger_effect_exceeds_the_claim() {
        use CellOutcome::{Exceeds, Fails, Passes, Undecided};
        let times = Bound::Effect(25.0, 75.0);
        for (value, outcome) in [(284.0, Exceeds), (77.1, Exceeds), (76.9, Passes), (22.9, Fails)] {
            assert_eq!(cell(value, 1.0, times), outcome);
        }
        assert_eq!(cell(100.9, 13.0, times), Undecided);
        let part = |values: &[f64]| {
            let mut part = Part::new("by hand");
            values.iter().for_each(|value| {
                part.add_effect(
                    String::new(),
                    Value {
                        value: *value,
                        error: 1.0,
                    },
                    50.0,
                )
            });
            part
        };
        assert_eq!(part(&[50.0, 50.0]).verdict(), Some(Verdict::Holds));
        assert_eq!(part(&[50.0, 284.0]).verdict(), Some(Verdict::HoldsWithLargerEffect));
        assert_eq!(part(&[1.0, 284.0]).verdict(), Some(Verdict::HoldsInPart));
        assert_eq!(part(&[1.0, 2.0, 284.0]).verdict(), Some(Verdict::DoesNotHold));
        let (plain, more, not) = (part(&[50.0]), part(&[284.0]), part(&[1.0]));
        assert_eq!(verdict(&[plain.clone(), more.clone()]), Verdict::HoldsWithLargerEffect);
        assert_eq!(verdict(&[more.clone(), not]), Verdict::HoldsInPart);
        assert_eq!(more.outcome_counts_beyond_bounds(), (0, 0));
    }

    #[test]
    fn part_verdict_follows_the_share_of_decided_cells() {
        assert_eq!(part(9, 1, 0).verdict(), Some(Verdict::Holds));
        assert_eq!(part(8, 1, 0).verdict(), Some(Verdict::HoldsInPart));
        assert_eq!(part(1, 1, 0).verdict(), Some(Verdict::HoldsInPart));
        assert_eq!(part(4, 5, 0).verdict(), Some(Verdict::DoesNotHold));
        assert_eq!(part(5, 0, 5).verdict(), Some(Verdict::Holds));
        assert_eq!(part(5, 0, 6).verdict(), None);
        assert_eq!(part(0, 0, 0).verdict(), None);
    }

    #[test]
    fn claim_verdict_combines_its_parts() {
        let (yes, half, no, open) = (part(9, 0, 0), part(5, 4, 0), part(0, 9, 0), part(1, 0, 9));
        let of = |parts: &[&Part]| verdict(&parts.iter().map(|part| (*part).clone()).collect::<Vec<_>>());
        assert_eq!(of(&[&yes, &yes]), Verdict::Holds);
        assert_eq!(of(&[&yes, &no]), Verdict::HoldsInPart);
        assert_eq!(of(&[&yes, &open]), Verdict::HoldsInPart);
        assert_eq!(of(&[&half]), Verdict::HoldsInPart);
        assert_eq!(of(&[&no, &no]), Verdict::DoesNotHold);
        assert_eq!(of(&[&no, &open]), Verdict::DoesNotHold);
        assert!(matches!(of(&[&open, &open]), Verdict::CannotBeTested(reason) if reason.contains("18 of 20")));
        assert!(matches!(of(&[]), Verdict::CannotBeTested(_)));
    }
}
