//! The order of the runs of a session.
//!
//! In the balanced Latin squares of E. J. Williams (*Australian Journal of Scientific Research* A 2 (1949) 149-168),
//! row r for n conditions is `r, r+1, r-1, r+2, r-2, ...` modulo n: each condition occurs once in each position and
//! follows every other condition equally often. For an odd n a second square is required, which consists of the
//! reversed rows of the first; there are then 2n rows.

use serde::{Deserialize, Serialize};

use crate::config::{Config, Order};

/// A planned run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlannedRun {
    /// Index of the condition in the configuration.
    pub condition: usize,
    /// True for a training run, which is excluded from the analysis.
    pub training: bool,
    /// Number of the run within its condition, counted from 1.
    pub run: usize,
}

/// Returns the conditions in row `row` of a balanced square for `n` conditions.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "2 n of a list fits into usize; without conditions the loop is empty, so there is no remainder by zero"
)]
pub fn latin_row(n: usize, row: usize) -> Vec<usize> {
    let rows = if n.is_multiple_of(2) { n } else { 2 * n };
    let row = row % rows.max(1);
    let mut order: Vec<usize> = (0..n)
        .map(|index| {
            let step = index.div_ceil(2);
            let shift = if index.is_multiple_of(2) { n - step } else { step };
            (row + shift) % n
        })
        .collect();
    if row >= n {
        order.reverse();
    }
    order
}

/// Returns all runs of a session, one condition after the other; in each condition the training runs are first.
pub fn plan(config: &Config, row: usize) -> Vec<PlannedRun> {
    let n = config.condition.len();
    let order = match config.order {
        Order::Given => (0..n).collect(),
        Order::Latin => latin_row(n, row),
    };
    let runs = |condition: usize| {
        let own = config.condition.get(condition)?;
        let all = 1..=own.training.saturating_add(own.runs);
        Some(all.map(move |run| PlannedRun {
            condition,
            training: run <= own.training,
            run,
        }))
    };
    order.into_iter().filter_map(runs).flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_are_balanced() {
        for n in 1..8 {
            let rows = if n % 2 == 0 { n } else { 2 * n };
            let (mut places, mut pairs) = (vec![0; n * n], vec![0; n * n]);
            for row in 0..rows {
                let order = latin_row(n, row);
                for (index, condition) in order.iter().enumerate() {
                    places[index * n + condition] += 1;
                }
                for pair in order.windows(2) {
                    pairs[pair[0] * n + pair[1]] += 1;
                }
            }
            assert!(places.iter().all(|count| *count == rows / n), "{n} {places:?}");
            for a in 0..n {
                for b in (0..n).filter(|b| *b != a) {
                    assert_eq!(pairs[a * n + b], rows / n, "{n}: {a} then {b}");
                }
            }
        }
    }

    #[test]
    fn training_runs_come_first_and_are_not_counted() {
        let mut config = Config::default();
        config.condition[0].training = 2;
        let plan = plan(&config, 5);
        assert_eq!(plan.iter().map(|p| p.training).collect::<Vec<_>>(), [true, true, false]);
        assert_eq!(plan.iter().map(|p| p.run).collect::<Vec<_>>(), [1, 2, 3]);
    }
}
