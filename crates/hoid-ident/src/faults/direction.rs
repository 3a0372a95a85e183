//! Tests which of two channels responds to the other, and with which sign.
//!
//! Both channels are averaged over blocks of [`BLOCK_S`]. Each channel is regressed on its own past and on the past of
//! the other channel,
//!
//! `u(k) = sum_{i=1..P} a_i u(k-i) + sum_{j=1..L} b_j e(k-j) + c + v(k)`
//!
//! and likewise e on u, with P = [`OWN_LAG_COUNT`] and L = [`OTHER_LAG_COUNT`] blocks. In a closed loop a prediction
//! from past samples is consistent for any feedback (L. Ljung, *System Identification*, 1999, section 13.4).
//!
//! **Exchanged.** A person responds only after a delay of a tenth of a second or more; a controlled element responds
//! immediately. The significance of lag j is the relative increase in the loss without it: for b_1,
//! `R = (V_without - V)/V`. If e responds to u with a delay and u responds to e immediately, i.e. if `R` of u exceeds
//! both [`MIN_IMMEDIATE_INCREASE`] and [`MIN_INCREASE_RATIO`] times `R` of e, input and output are exchanged. If
//! neither responds immediately, nothing is reported.
//!
//! **Sign.** A person's response to an error initially has the sign of the error: `sum_j b_j` is positive. The sign is
//! wrong if the sum is more than [`MIN_NEGATIVE_STANDARD_ERRORS`] standard errors below zero.

use hoid_model::{FaultKind, Record};
use hoid_numerics::statistics::mean;

use crate::linalg::least_squares::solve_symmetric;

/// Length of a block, s.
const BLOCK_S: f64 = 0.05;
/// Numbers of past blocks in the regression: of the channel itself, and of the other channel.
const OWN_LAG_COUNT: usize = 8;
const OTHER_LAG_COUNT: usize = 12;
/// Relative increase in the loss without the first lag above which a response is immediate.
const MIN_IMMEDIATE_INCREASE: f64 = 0.1;
/// For exchanged channels, minimum ratio of the increase in the loss for u to the increase for e.
const MIN_INCREASE_RATIO: f64 = 20.0;
/// The sum of the coefficients `b_j` counts as negative if it is more than this number of standard errors below zero.
const MIN_NEGATIVE_STANDARD_ERRORS: f64 = 4.0;
/// Minimum number of blocks for a test.
const MIN_BLOCKS: usize = 200;

/// Returns a wrong direction and its statistic: for exchanged channels the ratio of the increases in the loss, for a
/// wrong sign the number of standard errors. `None` if no fault is found, or if the record is too short or its sample
/// time is too long for the test.
pub(super) fn find_wrong_direction(record: &Record) -> Option<(FaultKind, f64)> {
    let block = ((BLOCK_S / record.sample_time().s()).round() as usize).max(1);
    if record.input().is_empty() || record.sample_time().s() > 0.1 {
        return None;
    }
    let average = |x: &[f64]| -> Vec<f64> { x.chunks_exact(block).map(mean).collect() };
    let (e, u) = (average(record.input()), average(record.output()));
    if e.len() < MIN_BLOCKS {
        return None;
    }
    let of_output = CrossResponse::of(&u, &e)?;
    let of_input = CrossResponse::of(&e, &u)?;
    if of_output.immediate_effect > MIN_IMMEDIATE_INCREASE
        && of_output.immediate_effect > MIN_INCREASE_RATIO * of_input.immediate_effect
    {
        return Some((
            FaultKind::Exchanged,
            of_output.immediate_effect / of_input.immediate_effect,
        ));
    }
    (of_output.sum < -MIN_NEGATIVE_STANDARD_ERRORS).then_some((FaultKind::Sign, -of_output.sum))
}

/// Response of one channel to another.
struct CrossResponse {
    /// Relative increase in the loss if the first lag of the other channel is omitted.
    immediate_effect: f64,
    /// Sum of the coefficients of the other channel, in standard errors.
    sum: f64,
}

impl CrossResponse {
    /// Estimates the response of y to x; `None` if the regression is singular.
    fn of(y: &[f64], x: &[f64]) -> Option<Self> {
        let first = OWN_LAG_COUNT.max(OTHER_LAG_COUNT);
        let size = OWN_LAG_COUNT + OTHER_LAG_COUNT + 1;
        let n = y.len() - first;
        let mut gram = vec![0.0; size * size];
        let mut product = vec![0.0; size];
        let mut power = 0.0;
        let mut row = vec![1.0; size];
        for k in first..y.len() {
            for i in 0..OWN_LAG_COUNT {
                row[i] = y[k - 1 - i];
            }
            for j in 0..OTHER_LAG_COUNT {
                row[OWN_LAG_COUNT + j] = x[k - 1 - j];
            }
            for i in 0..size {
                product[i] += row[i] * y[k];
                for j in 0..=i {
                    gram[i * size + j] += row[i] * row[j];
                }
            }
            power += y[k] * y[k];
        }
        for i in 0..size {
            for j in i + 1..size {
                gram[i * size + j] = gram[j * size + i];
            }
            // This keeps the matrix of a smooth channel regular in spite of rounding.
            gram[i * size + i] *= 1.0 + 1e-9;
        }
        let without = |left_out: Option<usize>| -> Option<(f64, Vec<f64>)> {
            let kept: Vec<usize> = (0..size).filter(|i| Some(*i) != left_out).collect();
            let part: Vec<f64> = kept
                .iter()
                .flat_map(|i| kept.iter().map(move |j| i * size + j))
                .map(|at| gram[at])
                .collect();
            let right: Vec<f64> = kept.iter().map(|i| product[*i]).collect();
            let solution = solve_symmetric(&part, &right)?;
            let explained: f64 = solution.iter().zip(&right).map(|(a, b)| a * b).sum();
            Some((power - explained, solution))
        };
        let (loss, solution) = without(None)?;
        let (other, _) = without(Some(OWN_LAG_COUNT))?;
        let of_sum: Vec<f64> = (0..size)
            .map(|i| f64::from((OWN_LAG_COUNT..OWN_LAG_COUNT + OTHER_LAG_COUNT).contains(&i)))
            .collect();
        let sum: f64 = solution[OWN_LAG_COUNT..OWN_LAG_COUNT + OTHER_LAG_COUNT].iter().sum();
        let along = solve_symmetric(&gram, &of_sum)?;
        let variance = loss / (n - size) as f64 * along.iter().zip(&of_sum).map(|(a, b)| a * b).sum::<f64>();
        let answer = Self {
            immediate_effect: (other - loss).max(0.0) / loss,
            sum: sum / variance.sqrt(),
        };
        (loss > 1e-12 * power && answer.immediate_effect.is_finite() && answer.sum.is_finite()).then_some(answer)
    }
}
