//! Names the input whose response changed, for a model with two inputs.
//!
//! Rows at distances of at least [`MIN_ROW_DISTANCE_S`] are compared in pairs. With the difference d of a response at a
//! frequency and the sum C of the covariances of its real and imaginary parts, `T = d' C^-1 d` (A. Wald, 1943) exceeds
//! x with probability `exp(-x/2)` if nothing changes and the errors of the rows are independent. Rows within the memory
//! of the recursion have similar errors, so the test then has less power. The probability that the largest T of an
//! input, over all pairs and frequencies, exceeds a limit is at most that of one comparison times the number of
//! comparisons (Bonferroni). While the recursion follows a change in one response, the other may deviate for a few
//! seconds. The T of a pair is therefore the smallest T of the pair and of the pairs with neighbouring rows: a change
//! must last.

use hoid_model::Finding;

use crate::{
    change::{Change, FurtherChange},
    further_input::FURTHER_RESPONSES_RAD_S,
    response::Response,
    trace::Trace,
};

/// Least time between compared rows, s.
const MIN_ROW_DISTANCE_S: f64 = 10.0;
/// Largest number of rows that are compared.
const MAX_ROWS: usize = 16;
/// p-value, over all comparisons of an input, below which a change is reported.
const SIGNIFICANCE_LEVEL: f64 = 0.01;

/// The largest change in a response.
#[derive(Debug, Clone, Copy)]
struct LargestChange {
    /// Times of the two rows, s.
    between_s: [f64; 2],
    omega_rad_s: f64,
    responses: [Response; 2],
    /// Upper bound on the probability that a statistic at least as large occurs in any comparison if nothing changes.
    p_value: f64,
}

impl Trace {
    /// Returns a note that names the input whose response changed; `None` for a model with one input and if neither
    /// changed. `rows` are the examined rows.
    pub(super) fn changed_input_finding(&self, rows: &[usize]) -> Option<Finding> {
        let further = self.options().further.as_ref()?;
        let channel = further.channel.as_str();
        let changes = match self.options().method.is_self_starting() {
            true => self.declared_input_changes(),
            false => {
                let own = self.largest_change(rows, |row, omega| Some(self.response_at(row, omega)));
                let of_further = self.largest_change(rows, |row, omega| self.further_response(row, omega));
                [own, of_further].map(|found| found.filter(|f| f.p_value < SIGNIFICANCE_LEVEL).map(|f| f.as_text()))
            }
        };
        let [own, of_further] = changes;
        let message = match (own, of_further) {
            (Some(own), Some(further)) => {
                format!("the response to e changed {own}; the response to {channel} also changed, {further}")
            }
            (Some(own), None) => {
                format!("the response to e changed {own}; no change in the response to {channel} was found")
            }
            (None, Some(further)) => {
                format!("the response to {channel} changed {further}; no change in the response to e was found")
            }
            (None, None) => return None,
        };
        Some(Finding::note("changed-input", message))
    }

    /// Returns the declared changes in the response to e, and those of the response to the further input, as text.
    fn declared_input_changes(&self) -> [Option<String>; 2] {
        let text = |of: &dyn Fn(&Change) -> Vec<&'static str>| {
            let each = self.changes().iter().filter_map(|(t, change)| {
                let named = of(change);
                let at_s = t - change.seconds_ago;
                (!named.is_empty()).then(|| format!("at {at_s:.1} s ({})", named.join(", ")))
            });
            Some(each.collect::<Vec<_>>().join(" and ")).filter(|text| !text.is_empty())
        };
        [
            text(&Change::changed_quantities_of_e),
            text(&|change| {
                change
                    .further
                    .iter()
                    .flat_map(FurtherChange::changed_quantities)
                    .collect()
            }),
        ]
    }

    /// Returns the largest change in a response between two of the rows; `None` if no two rows can be compared.
    fn largest_change(
        &self,
        rows: &[usize],
        response: impl Fn(usize, f64) -> Option<Response>,
    ) -> Option<LargestChange> {
        let step = rows.len().div_ceil(MAX_ROWS).max(1);
        let rows: Vec<usize> = rows.iter().rev().step_by(step).rev().copied().collect();
        let at = |row: usize| self.times_s()[row];
        let last = rows.len().checked_sub(1)?;
        let pairs: Vec<[usize; 2]> = (0..=last)
            .flat_map(|from| (from + 1..=last).map(move |to| [from, to]))
            .filter(|[from, to]| at(rows[*to]) - at(rows[*from]) >= MIN_ROW_DISTANCE_S)
            .collect();
        let comparisons = (FURTHER_RESPONSES_RAD_S.len() * pairs.len()) as f64;
        let mut largest: Option<LargestChange> = None;
        for omega_rad_s in FURTHER_RESPONSES_RAD_S {
            let all: Vec<Response> = rows.iter().filter_map(|row| response(*row, omega_rad_s)).collect();
            if all.len() <= last {
                continue;
            }
            for &[from, to] in &pairs {
                // The neighbouring rows outside the pair or, at the ends of the record, within it.
                let before = from.checked_sub(1).unwrap_or(from + 1);
                let after = if to < last { to + 1 } else { to - 1 };
                let lasting = [[from, to], [before, to], [from, after]]
                    .map(|[from, to]| wald_statistic(&[all[from], all[to]]))
                    .into_iter()
                    .fold(f64::INFINITY, f64::min);
                let p_value = (comparisons * (-0.5 * lasting).exp()).min(1.0);
                if largest.is_none_or(|known| p_value < known.p_value) {
                    largest = Some(LargestChange {
                        between_s: [at(rows[from]), at(rows[to])],
                        omega_rad_s,
                        responses: [all[from], all[to]],
                        p_value,
                    });
                }
            }
        }
        largest
    }
}

impl LargestChange {
    fn as_text(&self) -> String {
        let [before, after] = &self.responses;
        let turned = (after.phase_deg().value - before.phase_deg().value + 180.0).rem_euclid(360.0) - 180.0;
        format!(
            "between {:.0} and {:.0} s, at {} rad/s from {:.1} to {:.1} dB and by {turned:+.0} deg (p = {:.1e})",
            self.between_s[0],
            self.between_s[1],
            self.omega_rad_s,
            before.gain_db().value,
            after.gain_db().value,
            self.p_value
        )
    }
}

/// Returns `d' C^-1 d` for the difference d of two responses; zero without a positive covariance.
fn wald_statistic([before, after]: &[Response; 2]) -> f64 {
    let d = [0, 1].map(|part| after.value[part] - before.value[part]);
    let c = |i: usize, j: usize| before.covariance[i][j] + after.covariance[i][j];
    let determinant = c(0, 0) * c(1, 1) - c(0, 1) * c(1, 0);
    let squares = d[0] * d[0] * c(1, 1) - 2.0 * d[0] * d[1] * c(0, 1) + d[1] * d[1] * c(0, 0);
    let found = squares / determinant;
    if determinant > 0.0 && found.is_finite() {
        found
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wald_statistic_is_the_squared_distance_in_errors() {
        let response = |re: f64, c: [[f64; 2]; 2]| Response {
            value: [re, 1.0],
            covariance: c,
        };
        let unit = [[0.5, 0.0], [0.0, 0.5]];
        assert!((wald_statistic(&[response(0.0, unit), response(3.0, unit)]) - 9.0).abs() < 1e-12);
        // d = [1, 0], C = [[2, 1], [1, 2]]: d' C^-1 d = 2/3.
        let oblique = [[1.0, 0.5], [0.5, 1.0]];
        assert!((wald_statistic(&[response(0.0, oblique), response(1.0, oblique)]) - 2.0 / 3.0).abs() < 1e-12);
        for useless in [[[0.0; 2]; 2], [[f64::NAN; 2]; 2]] {
            assert_eq!(wald_statistic(&[response(0.0, useless), response(1.0, useless)]), 0.0);
        }
    }
}
