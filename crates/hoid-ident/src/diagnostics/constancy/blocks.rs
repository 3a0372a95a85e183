//! Scores `g_c = sum psi eps` and information `G_c = sum psi psi'` of blocks of records.
//!
//! Blocks have the length [`BLOCK_S`], or a greater length if this would give more than [`MAX_BLOCKS`] blocks in all
//! records. A long record is processed in pieces of whole blocks, each with its own initial states, so the memory for
//! the columns of psi does not grow with the length of the record.

use std::ops::Range;

use crate::{
    criterion::{Data, Workspace},
    grey_box::{objective::PhysicalCriterion, parametrisation::Parametrisation},
    linalg::vectors::{add_scaled, dot},
};

/// Length of a block, s: longer than the correlation time of the residuals.
pub(super) const BLOCK_S: f64 = 2.0;
/// Largest total number of blocks in all records.
const MAX_BLOCKS: usize = 96;
/// Number of residuals in a piece of a long record.
const RESIDUALS_PER_PIECE: usize = 1 << 15;

/// Score and information of one block of a record.
#[derive(Debug, Clone)]
pub(crate) struct ScoreBlock {
    pub record: usize,
    /// First sample of the block in the record; 0 for the first block.
    pub from: usize,
    pub score: Vec<f64>,
    /// Information matrix of the block by rows.
    pub information: Vec<f64>,
}

/// Residuals of a piece of a record, and the columns of psi, each with the index of its parameter.
pub(crate) type Scores = (Vec<f64>, Vec<(usize, Vec<f64>)>);

/// Computes the blocks of all records for p parameters; the residuals start at sample `first`. `None` if the scores of
/// a record are missing, too short or not finite.
pub(crate) fn score_blocks(
    data: &[Data<'_>],
    first: usize,
    p: usize,
    sample_time_s: f64,
    scores: &mut dyn FnMut(usize, Data<'_>) -> Option<Scores>,
) -> Option<Vec<ScoreBlock>> {
    let count = |d: &Data<'_>| d.u.len().saturating_sub(first);
    let total: usize = data.iter().map(count).sum();
    let length = ((BLOCK_S / sample_time_s).ceil() as usize)
        .max(total.div_ceil(MAX_BLOCKS))
        .max(1);
    let mut blocks = Vec::new();
    for (record, whole) in data.iter().enumerate() {
        let n = count(whole);
        let number = (n / length).max(1);
        let span = |k: usize| k * n / number..(k + 1) * n / number;
        for several in pieces(number, n) {
            let (from, to) = (span(several.start).start, span(several.end - 1).end);
            let piece = Data {
                e: &whole.e[from..first + to],
                u: &whole.u[from..first + to],
                ..*whole
            };
            let (eps, columns) = scores(record, piece)?;
            for k in several {
                let Range { start, end } = span(k);
                let part = start - from..end - from;
                if eps.len() < part.end || columns.iter().any(|(_, column)| column.len() < part.end) {
                    return None;
                }
                let mut block = ScoreBlock {
                    record,
                    from: if k == 0 { 0 } else { first + start },
                    score: vec![0.0; p],
                    information: vec![0.0; p * p],
                };
                for (i, (index, column)) in columns.iter().enumerate() {
                    let column = &column[part.clone()];
                    block.score[*index] += dot(column, &eps[part.clone()]);
                    for (other, against) in &columns[..=i] {
                        let product = dot(column, &against[part.clone()]);
                        block.information[index * p + other] = product;
                        block.information[other * p + index] = product;
                    }
                }
                blocks.push(block);
            }
        }
    }
    let finite = |block: &ScoreBlock| block.score.iter().chain(&block.information).all(|x| x.is_finite());
    blocks.iter().all(finite).then_some(blocks)
}

/// Splits the blocks of a record into groups that are processed together.
fn pieces(number: usize, residuals: usize) -> Vec<Range<usize>> {
    let together = (RESIDUALS_PER_PIECE * number / residuals.max(1)).max(1);
    let starts = (0..number).step_by(together);
    starts.map(|from| from..(from + together).min(number)).collect()
}

/// Computes the blocks of a fit in physical parameters, for the free elements of eta.
pub(crate) fn physical_score_blocks<P: Parametrisation>(
    criterion: &PhysicalCriterion<'_, P>,
    eta: &[f64],
    free: &[usize],
    workspace: &mut Workspace,
) -> Option<Vec<ScoreBlock>> {
    let ts = criterion.layout.sample_time().s();
    let mut scores = |record: usize, data: Data<'_>| -> Option<Scores> {
        // Only e and u are cut into pieces, not the other inputs; a long record with other inputs has no scores.
        if !criterion.further.is_empty() && data.u.len() != criterion.data[record].u.len() {
            return None;
        }
        let mapped = criterion.model_of(eta, record).ok()?;
        let of_theta = criterion.with_data((mapped.orders, &mapped.further), record, data);
        let eps = of_theta.residuals_of(&mapped.theta, 0, workspace);
        let psi = of_theta.jacobian(&mapped.theta, 0, workspace);
        let places = criterion.layout.positions(record).iter();
        let columns = places
            .zip(&mapped.columns)
            .filter(|(index, _)| free.contains(index))
            .map(|(index, slopes)| {
                let mut column = vec![0.0; eps.len()];
                for (slope, psi) in slopes.iter().zip(&psi).filter(|(slope, _)| **slope != 0.0) {
                    add_scaled(&mut column, *slope, psi);
                }
                (*index, column)
            })
            .collect();
        Some((eps, columns))
    };
    score_blocks(&criterion.data, criterion.first, eta.len(), ts, &mut scores)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn block_scores_add_up_for_any_record_length() {
        // With one column, psi = 1, g is the sum of the residuals and G is their number.
        for n in [1000_usize, 100_000] {
            let u: Vec<f64> = (0..n).map(|t| (0.1 * t as f64).sin()).collect();
            let data = [Data::new(&u, &u)];
            let mut scores = |_: usize, piece: Data<'_>| {
                let eps = piece.u[30..].to_vec();
                let ones = vec![1.0; eps.len()];
                Some((eps, vec![(0, ones)]))
            };
            let blocks = score_blocks(&data, 30, 1, 0.01, &mut scores).unwrap();
            let count: f64 = blocks.iter().map(|b| b.information[0]).sum();
            let sum: f64 = blocks.iter().map(|b| b.score[0]).sum();
            assert_eq!(count, (n - 30) as f64);
            assert!((sum - u[30..].iter().sum::<f64>()).abs() < 1e-9);
            assert!(blocks.len() <= MAX_BLOCKS && blocks.len() >= 4, "{}", blocks.len());
        }
        let nothing = &mut |_: usize, _: Data<'_>| None;
        let u = [0.0; 50];
        assert!(score_blocks(&[Data::new(&u, &u)], 10, 1, 0.01, nothing).is_none());
    }
}
