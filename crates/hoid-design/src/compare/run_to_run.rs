//! Variation of one person from run to run.
//!
//! A cell, a person in a condition, has the crossover frequencies x_i of n runs. Its variance from run to run is the
//! sample variance, relative to the square of the mean. The cells are pooled with their degrees of freedom n - 1:
//!
//! `w^2 = sum (n - 1) var(x)/mean(x)^2 / sum (n - 1)`
//!
//! The errors of the estimates are not subtracted, so w is an upper bound. The standard errors of the fits contain the
//! variation of the person within a run, which the Cramer-Rao bound of a design does not contain: in recordings of
//! three people they explain most of the scatter between runs.

use hoid_numerics::statistics::{mean, sample_variance};

use super::{
    GroupEstimates, Quantity,
    group_estimates::{Cell, distinct},
};

/// Smallest number of runs from which the variation of a cell from run to run is computed.
const MIN_RUNS: usize = 3;

impl GroupEstimates {
    /// Returns the standard deviation of the crossover frequency of one person from run to run, relative to its mean,
    /// and the number of people; `None` if no person has the crossover of three runs in one condition.
    pub(crate) fn run_to_run_variation(&self) -> Option<(f64, usize)> {
        let of_cell = |cell: &Cell| {
            let runs = self.run_estimates(cell, &Quantity::Crossover);
            runs.into_iter().map(|(_, o)| o.value).collect::<Vec<f64>>()
        };
        let enough = |cell: &&Cell| of_cell(cell).len() >= MIN_RUNS;
        let people = distinct(self.cells.iter().filter(enough).map(|cell| &cell.subject));
        let cells: Vec<Vec<f64>> = self.cells.iter().filter(enough).map(of_cell).collect();
        Some((variation(&cells)?, people.len()))
    }
}

/// Returns the relative standard deviation within cells; `None` without cells.
fn variation(cells: &[Vec<f64>]) -> Option<f64> {
    let (mut sum, mut degrees) = (0.0, 0.0);
    for values in cells {
        let of_cell = values.len() as f64 - 1.0;
        sum += of_cell * sample_variance(values) / mean(values).powi(2);
        degrees += of_cell;
    }
    (degrees > 0.0).then(|| (sum / degrees).sqrt())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
    use rand_distr::{Distribution, StandardNormal};

    use super::{super::group_estimates::tests::group, *};

    /// There are 40 cells of five runs with a variation of 15 %. The relative standard error of the estimated variation
    /// is `1/sqrt(2 160)`, 5.6 %.
    #[test]
    fn run_to_run_variation_is_found() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut cell = |k: usize| -> Vec<f64> {
            let crossover = 2.0 + 0.1 * k as f64;
            let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
            (0..5).map(|_| crossover * (1.0 + 0.15 * normal())).collect()
        };
        let varied: Vec<Vec<f64>> = (0..40).map(&mut cell).collect();
        let found = variation(&varied).unwrap();
        assert!((found / 0.15 - 1.0).abs() < 0.15, "{found}");
        assert_eq!(variation(&[vec![2.0; 3]]), Some(0.0));
        assert_eq!(variation(&[]), None);
        assert_eq!(
            group(&[("A", "x", 2.0, 0.1), ("B", "x", 2.2, 0.1)]).run_to_run_variation(),
            None
        );
    }
}
