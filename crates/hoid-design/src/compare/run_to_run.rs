//! Variation of one person from run to run.
//!
//! A cell, a person in a condition, has the crossover frequencies x_i of n runs with the standard errors s_i. Its variance
//! from run to run is the sample variance minus the mean of `s_i^2`, relative to the square of the mean. The cells are
//! pooled with their degrees of freedom n - 1:
//!
//! `w^2 = sum (n - 1) (var(x) - mean(s^2))/mean(x)^2 / sum (n - 1)`

use hoid_numerics::statistics::{mean, sample_variance};

use super::{
    GroupEstimates, Observation, Quantity,
    group_estimates::{Cell, distinct},
};

/// Smallest number of runs of a cell for its variation from run to run.
const MIN_RUNS: usize = 3;

impl GroupEstimates {
    /// Returns the standard deviation of the crossover frequency of one person from run to run, relative to its mean, and
    /// the number of people; `None` if no person has the crossover of three runs in one condition.
    pub(crate) fn run_to_run(&self) -> Option<(f64, usize)> {
        let of_cell = |cell: &Cell| {
            let runs = self.of_runs(cell, &Quantity::Crossover);
            runs.into_iter().map(|(_, o)| o).collect::<Vec<Observation>>()
        };
        let enough = |cell: &&Cell| of_cell(cell).len() >= MIN_RUNS;
        let people = distinct(self.cells.iter().filter(enough).map(|cell| &cell.subject));
        let cells: Vec<Vec<Observation>> = self.cells.iter().filter(enough).map(of_cell).collect();
        Some((variation(&cells)?, people.len()))
    }
}

/// Returns the relative standard deviation within cells that the standard errors do not explain; `None` without cells.
fn variation(cells: &[Vec<Observation>]) -> Option<f64> {
    let (mut sum, mut degrees) = (0.0, 0.0);
    for cell in cells {
        let values: Vec<f64> = cell.iter().map(|o| o.value).collect();
        let of_errors = mean(&cell.iter().map(|o| o.variance).collect::<Vec<_>>());
        let of_cell = values.len() as f64 - 1.0;
        sum += of_cell * (sample_variance(&values) - of_errors) / mean(&values).powi(2);
        degrees += of_cell;
    }
    (degrees > 0.0).then(|| (sum / degrees).max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
    use rand_distr::{Distribution, StandardNormal};

    use super::{super::group_estimates::tests::group, *};

    /// 40 cells of five runs with a variation of 15 % and errors of 10 %. The variance of the estimated variance is
    /// `2 (.15^2 + .1^2)^2/160`, so the standard error of the standard deviation is 8 %.
    #[test]
    fn variation_from_run_to_run_excludes_the_errors_of_the_estimates() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut cell = |k: usize, of_person: f64| -> Vec<Observation> {
            let crossover = 2.0 + 0.1 * k as f64;
            let one = |_| Observation {
                value: crossover * (1.0 + of_person * normal() + 0.1 * normal()),
                variance: (0.1 * crossover).powi(2),
            };
            (0..5).map(one).collect()
        };
        let varied: Vec<Vec<Observation>> = (0..40).map(|k| cell(k, 0.15)).collect();
        let steady: Vec<Vec<Observation>> = (0..40).map(|k| cell(k, 0.0)).collect();
        let found = variation(&varied).unwrap();
        assert!((found / 0.15 - 1.0).abs() < 0.2, "{found}");
        assert!(variation(&steady).unwrap() < 0.05);
        assert_eq!(variation(&[]), None);
        assert_eq!(group(&[("A", "x", 2.0, 0.1), ("B", "x", 2.2, 0.1)]).run_to_run(), None);
    }
}
