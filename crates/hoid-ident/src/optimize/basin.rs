//! Tests whether a start leads to a known minimum.

use super::objective::Minimum;
use crate::linalg::vectors::dot;

/// True if a start with this loss is in the basin of a known minimum: its loss agrees with the quadratic model about
/// the minimum, so a search from the start would end in this minimum.
pub(crate) fn lies_in_basin(minimum: &Minimum, start: &[f64], sum_of_squares: f64) -> bool {
    let p = start.len();
    let delta: Vec<f64> = start.iter().zip(&minimum.theta).map(|(a, b)| a - b).collect();
    let rise: f64 = (0..p)
        .map(|i| delta[i] * dot(&minimum.linearisation.gram[i * p..(i + 1) * p], &delta))
        .sum();
    let found = sum_of_squares - minimum.linearisation.sum_of_squares;
    rise <= MAX_LOSS_INCREASE * minimum.linearisation.sum_of_squares && (found - rise).abs() <= 0.1 * rise
}

/// Largest relative increase in the loss at which a start is compared with the quadratic model.
const MAX_LOSS_INCREASE: f64 = 0.05;
