//! Test of which of two channels responds to the other, and with which sign.
//!
//! Both are averaged over blocks of [`BLOCK_S`], and each is regressed on its own past and on that of
//! the other,
//!
//! `u(k) = sum_{i=1..P} a_i u(k-i) + sum_{j=1..L} b_j e(k-j) + c + v(k)`
//!
//! and e on u likewise; P = [`OWN`], L = [`OTHER`] blocks. In a closed loop such a prediction is consistent whatever
//! the loop is (L. Ljung, *System Identification*, 1999, section 13.4).
//!
//! **Exchanged.** A person responds only after a delay of a tenth of a second or more; a controlled element responds
//! immediately. The significance of a lag j is the growth of the loss without it: for b_1, `R = (V_without - V)/V`. If
//! e responds to u late and u responds to e at once, with `R` of u above [`AT_ONCE`] and [`TIMES`] times that of e,
//! input and output are exchanged. If neither responds at once, nothing is reported.
//!
//! **Sign.** The response of a person to an error starts in its direction: `sum_j b_j` is positive. The sign is wrong
//! if the sum is [`WRONG`] standard errors below zero.

use hoid_model::{FaultKind, Record};
use hoid_numerics::statistics::mean;

use crate::linalg::least_squares::solve_symmetric;

/// Length of a block, s.
const BLOCK_S: f64 = 0.05;
/// Length of the own past and of that of the other channel, in blocks.
const OWN: usize = 8;
const OTHER: usize = 12;
/// Growth of the loss without the first lag that counts as an immediate response.
const AT_ONCE: f64 = 0.1;
/// Least ratio to that of the other direction.
const TIMES: f64 = 20.0;
/// Standard errors below zero from which on the sum of a response counts as negative.
const WRONG: f64 = 4.0;
/// Number of blocks below which nothing is reported.
const FEWEST: usize = 200;

/// A wrong direction, with its statistic: the ratio of the growths, or the number of standard errors.
pub(super) fn wrong_direction(record: &Record) -> Option<(FaultKind, f64)> {
    let block = ((BLOCK_S / record.sample_time().s()).round() as usize).max(1);
    if record.input().is_empty() || record.sample_time().s() > 0.1 {
        return None;
    }
    let average = |x: &[f64]| -> Vec<f64> { x.chunks_exact(block).map(mean).collect() };
    let (e, u) = (average(record.input()), average(record.output()));
    if e.len() < FEWEST {
        return None;
    }
    let of_output = CrossResponse::of(&u, &e)?;
    let of_input = CrossResponse::of(&e, &u)?;
    if of_output.at_once > AT_ONCE && of_output.at_once > TIMES * of_input.at_once {
        return Some((FaultKind::Exchanged, of_output.at_once / of_input.at_once));
    }
    (of_output.sum < -WRONG).then_some((FaultKind::Sign, -of_output.sum))
}

/// Response of a channel to another.
struct CrossResponse {
    /// Growth of the loss without the first lag.
    at_once: f64,
    /// Sum of the coefficients in standard errors.
    sum: f64,
}

impl CrossResponse {
    /// Response of y to x; `None` if the regression is singular.
    fn of(y: &[f64], x: &[f64]) -> Option<Self> {
        let first = OWN.max(OTHER);
        let size = OWN + OTHER + 1;
        let n = y.len() - first;
        let mut gram = vec![0.0; size * size];
        let mut product = vec![0.0; size];
        let mut power = 0.0;
        let mut row = vec![1.0; size];
        for k in first..y.len() {
            for i in 0..OWN {
                row[i] = y[k - 1 - i];
            }
            for j in 0..OTHER {
                row[OWN + j] = x[k - 1 - j];
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
            // Rounding, for a smooth channel.
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
        let (other, _) = without(Some(OWN))?;
        let of_sum: Vec<f64> = (0..size).map(|i| f64::from((OWN..OWN + OTHER).contains(&i))).collect();
        let sum: f64 = solution[OWN..OWN + OTHER].iter().sum();
        let along = solve_symmetric(&gram, &of_sum)?;
        let variance = loss / (n - size) as f64 * along.iter().zip(&of_sum).map(|(a, b)| a * b).sum::<f64>();
        let answer = Self {
            at_once: (other - loss).max(0.0) / loss,
            sum: sum / variance.sqrt(),
        };
        (loss > 1e-12 * power && answer.at_once.is_finite() && answer.sum.is_finite()).then_some(answer)
    }
}
