//! Search for a stretch of the records that dominates the fit.
//!
//! A short event, such as a pause or one second with the wrong sign of a channel, is not a lasting change. Without
//! block c the parameters would differ by
//!
//! `delta_c = -(A - A_c)^-1 h_c`, `A = J' G J`, `h = J' g`
//!
//! where the columns of J are the tested directions (the jackknife of a group, to first order: B. Efron, *The
//! Jackknife, the Bootstrap and Other Resampling Plans*, 1982, chapter 3). By chance one of n blocks changes a
//! parameter by about `1/sqrt n` of its standard error. A block is reported if it changes a parameter by more than
//! [`MIN_REPORTED_CHANGE`] standard errors and by more than [`MIN_REPORTED_CHANGE`] times the root sum of squares
//! `sqrt(sum delta^2)` of all other blocks. The sum of squares over all blocks estimates the variance of the parameter;
//! a block above these limits alone makes this estimate several times the variance of the model.

use nalgebra::{DMatrix, DVector};

use super::search::{Constancy, pseudo_inverse};

/// A block is reported if it changes a parameter by more than this number of standard errors.
const MIN_REPORTED_CHANGE: f64 = 2.0;
/// Minimum change for records with few blocks, as a multiple of the change that a single block causes by chance.
const MIN_RATIO_TO_CHANCE: f64 = 4.5;
/// Minimum number of blocks for the test.
const MIN_BLOCKS: usize = 5;

/// A block with large influence, and the parameters that change without it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct InfluentialBlock {
    pub record: usize,
    /// First sample of the block, and first sample of the next block (`None` at the end of the record).
    pub first_sample: usize,
    pub next_sample: Option<usize>,
    /// Name of each parameter that changes without the block, and this change in standard errors.
    pub parameter_changes: Vec<(String, f64)>,
}

/// Returns the block with the most influence; `None` if its influence is below the threshold.
pub(super) fn most_influential_block(of: &Constancy<'_>) -> Option<InfluentialBlock> {
    let (n, m) = (of.blocks.len(), of.directions.len());
    if n < MIN_BLOCKS || m == 0 || of.variance <= 0.0 {
        return None;
    }
    let p = of.blocks[0].score.len();
    let j = DMatrix::from_fn(p, m, |row, column| of.directions[column].vector[row]);
    let mut parts: Vec<(DVector<f64>, DMatrix<f64>)> = of
        .blocks
        .iter()
        .map(|block| {
            let (g, big) = (
                DVector::from_column_slice(&block.score),
                DMatrix::from_row_slice(p, p, &block.information),
            );
            (j.transpose() * g, j.transpose() * big * &j)
        })
        .collect();
    let whole = parts.iter().fold(DMatrix::zeros(m, m), |sum, (_, a)| sum + a);
    let inverse = pseudo_inverse(&whole)?;
    // With a prior, a bound or a delay on the grid of samples the scores do not sum to zero; a step to the minimum
    // removes their sum.
    let step = &inverse * parts.iter().fold(DVector::zeros(m), |sum, (h, _)| sum + h);
    parts.iter_mut().for_each(|(h, a)| *h -= &*a * &step);
    let moved: Option<Vec<DVector<f64>>> = parts
        .iter()
        .map(|(h, a)| Some(-(pseudo_inverse(&(&whole - a))? * h)))
        .collect();
    let moved = moved?;
    let ratio = |c: usize, k: usize| {
        let others: f64 = moved.iter().map(|d| d[k] * d[k]).sum::<f64>() - moved[c][k] * moved[c][k];
        let variance = (of.variance * inverse[(k, k)]).max(others);
        if variance > 0.0 {
            moved[c][k].abs() / variance.sqrt()
        } else {
            0.0
        }
    };
    let largest = |c: usize| (0..m).map(|k| ratio(c, k)).fold(0.0, f64::max);
    let (c, most) = (0..n).map(|c| (c, largest(c))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let threshold = MIN_REPORTED_CHANGE.max(MIN_RATIO_TO_CHANCE / ((n - 1) as f64).sqrt());
    (most > threshold).then(|| InfluentialBlock {
        record: of.blocks[c].record,
        first_sample: of.blocks[c].from,
        next_sample: of
            .blocks
            .get(c + 1)
            .filter(|b| b.record == of.blocks[c].record)
            .map(|b| b.from),
        parameter_changes: (0..m)
            .filter(|k| ratio(c, *k) > threshold)
            .map(|k| {
                (
                    of.directions[k].name.clone(),
                    moved[c][k].abs() / (of.variance * inverse[(k, k)]).sqrt(),
                )
            })
            .collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::{
        super::{Direction, blocks::ScoreBlock},
        *,
    };

    /// Regression on a column of ones; each block has ten residuals with the given mean.
    fn influential_stretch(means: &[f64], variance: f64) -> Option<InfluentialBlock> {
        let blocks: Vec<ScoreBlock> = means
            .iter()
            .enumerate()
            .map(|(c, mean)| ScoreBlock {
                record: 0,
                from: 10 * c,
                score: vec![10.0 * mean],
                information: vec![10.0],
            })
            .collect();
        let direction = Direction {
            name: "mean".to_owned(),
            unit: "",
            vector: vec![1.0],
            delay: false,
            size: 1.0,
        };
        most_influential_block(&Constancy {
            blocks: &blocks,
            directions: &[direction],
            variance,
            run_to_run: 0.0,
            sample_time_s: 0.01,
        })
    }

    #[test]
    fn reported_change_equals_a_fit_without_the_block() {
        let mut means = vec![0.1, -0.1, 0.05, -0.05, 0.1, -0.1, 0.0, 0.0];
        assert_eq!(influential_stretch(&means, 1.0), None);
        means[3] = 8.0;
        let found = influential_stretch(&means, 1.0).unwrap();
        assert_eq!((found.first_sample, found.next_sample), (30, Some(40)));
        // The mean of all blocks is 1.00625, the mean of the others is 0.007, and the standard error is 1/sqrt 80.
        let (all, others) = (8.05 / 8.0, 0.05 / 7.0);
        assert!(
            (found.parameter_changes[0].1 - (all - others) * 80.0_f64.sqrt()).abs() < 1e-9,
            "{found:?}"
        );
        means[7] = 8.0;
        means[3] = 0.0;
        assert_eq!(influential_stretch(&means, 1.0).unwrap().next_sample, None);
    }

    #[test]
    fn scatter_of_all_blocks_is_not_a_stretch() {
        let means = [3.0, -2.0, 2.5, -3.0, 3.0, -2.5, 2.0, -3.0];
        assert_eq!(influential_stretch(&means, 1.0), None);
        assert_eq!(influential_stretch(&[5.0, 0.0, 0.0], 1.0), None);
        assert_eq!(influential_stretch(&[0.0; 8], 0.0), None);
    }
}
