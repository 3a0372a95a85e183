//! Learning: trend of a quantity over the runs of a person in a condition.
//!
//! The model is `y_r = a + b (r - r0) + u_r + e_r`, where r is the number of a run and r0 the mean number of all runs
//! of the group: a regression on the run number with the standard errors of the runs and an additional variance between
//! runs ([`meta_regression`]). The comparison uses a, so that conditions are compared at the same amount of practice; b
//! is the change per run, whose mean over people is reported.

use hoid_numerics::statistics::mean;

use super::{
    Coefficient, CompareError, GroupEstimates, Observation, Quantity, Weights, group_estimates::Cell, meta_regression,
};

/// Numbering of the runs: by their names if all names are numbers, otherwise by position.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RunNumbering {
    uses_names: bool,
    /// Mean number of all runs.
    pub middle: f64,
}

impl RunNumbering {
    pub fn of(group: &GroupEstimates, quantity: &Quantity) -> Self {
        let runs: Vec<Vec<&str>> = group
            .cells
            .iter()
            .map(|cell| {
                group
                    .run_estimates(cell, quantity)
                    .into_iter()
                    .map(|(run, _)| run)
                    .collect()
            })
            .collect();
        let by_name = runs.iter().flatten().all(|run| run_number(run).is_some());
        let mut practice = Self {
            uses_names: by_name,
            middle: 0.0,
        };
        let numbers: Vec<f64> = runs
            .iter()
            .flat_map(|of_cell| {
                of_cell
                    .iter()
                    .enumerate()
                    .map(|(index, run)| practice.number(run, index))
            })
            .collect();
        practice.middle = if numbers.is_empty() { 0.0 } else { mean(&numbers) };
        practice
    }

    fn number(&self, run: &str, index: usize) -> f64 {
        match run_number(run) {
            Some(number) if self.uses_names => number,
            _ => index as f64 + 1.0,
        }
    }

    /// Returns the quantity of a cell at the mean run number and its change per run, both with errors, or the reason
    /// why they cannot be computed.
    pub fn quantity_of_cell(
        &self,
        group: &GroupEstimates,
        cell: &Cell,
        quantity: &Quantity,
    ) -> Result<[Coefficient; 2], String> {
        let runs = group.run_estimates(cell, quantity);
        let x: Vec<Vec<f64>> = runs
            .iter()
            .enumerate()
            .map(|(index, (run, _))| vec![1.0, self.number(run, index) - self.middle])
            .collect();
        // If one run lacks a standard error, the standard errors of all runs are ignored.
        let all_known = runs.iter().all(|(_, o)| o.variance > 0.0);
        let observations: Vec<Observation> = runs
            .iter()
            .map(|(_, o)| Observation {
                variance: if all_known { o.variance } else { 0.0 },
                ..*o
            })
            .collect();
        match meta_regression(&observations, &x, Weights::default()) {
            Ok(found) => Ok([found.coefficients[0], found.coefficients[1]]),
            Err(CompareError::TooFew { found, .. }) => Err(format!(
                "{found} runs have an estimate, expected at least 3 for learning"
            )),
            Err(error) => Err(format!("its runs: {error}")),
        }
    }
}

fn run_number(run: &str) -> Option<f64> {
    run.trim().parse().ok().filter(|n: &f64| n.is_finite())
}
