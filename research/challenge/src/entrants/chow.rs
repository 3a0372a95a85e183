//! Test of the difference in the complex response at 2.5 rad/s between the last 5 s and up to 40 s before them, each
//! with its own variance (G. C. Chow, Econometrica 28 (1960) 591-605; without a common variance it is Wald's test).
//!
//! The statistic is `T = d' (C_now + C_before)^-1 d` with `d = H_now - H_before`; whitened residuals are limited to 3.5
//! standard deviations of the fit to the earlier data. Without a change T would be chi-square distributed with two
//! degrees of freedom if the remnant were white after the filter from the start span and the basis contained the
//! operator. Since neither condition holds, T is divided by its average level, computed from the mean of its logarithm
//! (for a chi-square variable `ln 2 - gamma`), and compared with [`THRESHOLD`]. After an alarm all data except the last
//! 3 s are discarded. The reported response is estimated from the remaining data, at most 40 s.

use std::collections::VecDeque;

use hoid_model::Complex64;

use super::{
    super::entrant::{Alarm, Entrant, EntrantResult, Task, complex_covariance},
    basis::{Solution, Square, Sums, product, regressor_responses, reported_response, whiten_run},
};

/// Length of a block, s. `PRESENT_BLOCKS` and `PAST_BLOCKS` are the numbers of blocks in the present and the past, and
/// `MIN_PAST_BLOCKS` is the smallest number in the past.
const BLOCK_S: f64 = 0.25;
const PRESENT_BLOCKS: usize = 20;
const PAST_BLOCKS: usize = 160;
const MIN_PAST_BLOCKS: usize = 24;
/// Number of blocks before an alarm that are kept.
const KEPT_BLOCKS: usize = 12;
const TEST_OMEGA_RAD_S: f64 = 2.5;
const RESIDUAL_LIMIT: f64 = 3.5;
/// Ratio of T to its level above which a change is declared, if it is exceeded in `PERSISTENCE_BLOCKS` consecutive
/// blocks. In runs 2 to 5 of the cases without a change (open seeds; 1.8 h), which are not in any table, ratios of 6,
/// 8, 12 and 25 are exceeded 32, 15, 9 and 5 times; without the cases with a missing and a silent span, 21, 5, 0 and 0
/// times.
const THRESHOLD: f64 = 10.0;
const PERSISTENCE_BLOCKS: usize = 4;
/// Expectation of the logarithm of a chi-square variable with two degrees of freedom. The following constants are the
/// prior of the level above it, the weight of this prior in blocks, the memory length of the mean in blocks, and the
/// largest excess of a logarithm over the level.
const MEAN_LOG_CHI_SQUARE: f64 = 0.115_931_515_658_412_45;
const DEFAULT_LEVEL: f64 = 0.5;
const PRIOR_WEIGHT: f64 = 10.0;
const MAX_MEMORY_BLOCKS: f64 = 480.0;
const MAX_LOG_EXCESS: f64 = 3.0;

pub(super) struct Chow;

impl Entrant for Chow {
    fn name(&self) -> String {
        "chow".to_owned()
    }

    fn follow(&self, task: &Task) -> Result<EntrantResult, String> {
        let run = whiten_run(task)?;
        let start = Solution {
            theta: run.theta,
            covariance: run.covariance,
            variance: run.variance,
        };
        let gradient = regressor_responses(task, TEST_OMEGA_RAD_S);
        let per_block = (BLOCK_S / run.every_s).round() as usize;
        let (mut blocks, mut open) = (VecDeque::<Sums>::new(), Sums::default());
        let (mut before, mut whole, mut alarms) = (start, start, Vec::new());
        let (mut level, mut levels, mut above) = (MEAN_LOG_CHI_SQUARE + DEFAULT_LEVEL, PRIOR_WEIGHT, 0);
        let mut answer = EntrantResult::default();
        for (i, sample) in run.samples.iter().enumerate() {
            while (task.asked_s.get(answer.estimates.len())).is_some_and(|t| *t < sample.t_s) {
                answer
                    .estimates
                    .push(reported_response(task, &whole.theta, &whole.covariance));
            }
            if !sample.is_void {
                let bound = RESIDUAL_LIMIT * before.variance.sqrt();
                let expected = product(&sample.x, &before.theta);
                open.add(&sample.x, expected + (sample.y - expected).clamp(-bound, bound));
            }
            if (i + 1) % per_block != 0 {
                continue;
            }
            blocks.push_back(std::mem::take(&mut open));
            if blocks.len() > PRESENT_BLOCKS + PAST_BLOCKS {
                blocks.pop_front();
            }
            let sum = |from: usize, to: usize| {
                let mut sums = Sums::default();
                blocks.range(from..to).for_each(|block| sums.join(block));
                sums.solve().ok()
            };
            let n = blocks.len();
            if let Some(solved) = sum(n.saturating_sub(PAST_BLOCKS), n) {
                whole = solved;
            }
            if n < PRESENT_BLOCKS + MIN_PAST_BLOCKS {
                continue;
            }
            let (Some(past), Some(now)) = (sum(0, n - PRESENT_BLOCKS), sum(n - PRESENT_BLOCKS, n)) else {
                continue;
            };
            before = past;
            let t = distance(&gradient, &past, &now);
            let relative = t / (level - MEAN_LOG_CHI_SQUARE).exp().max(1.0);
            levels = (levels + 1.0).min(MAX_MEMORY_BLOCKS);
            level += (t.max(0.05).ln().min(level + MAX_LOG_EXCESS) - level) / levels;
            above = if relative > THRESHOLD { above + 1 } else { 0 };
            if above >= PERSISTENCE_BLOCKS && sample.t_s >= task.start_s.1 {
                above = 0;
                alarms.push(Alarm {
                    t_s: sample.t_s,
                    of_remnant: false,
                });
                blocks.drain(..n - KEPT_BLOCKS);
                if let Some(solved) = present_solution(&blocks) {
                    (before, whole) = (solved, solved);
                }
            }
        }
        answer.estimates.resize_with(task.asked_s.len(), || {
            reported_response(task, &whole.theta, &whole.covariance)
        });
        answer.alarms = Some(alarms);
        Ok(answer)
    }
}

fn present_solution(blocks: &VecDeque<Sums>) -> Option<Solution> {
    let mut sums = Sums::default();
    blocks.iter().for_each(|block| sums.join(block));
    sums.solve().ok()
}

/// Returns Wald's statistic for the difference between the responses.
fn distance(gradient: &[Complex64], before: &Solution, now: &Solution) -> f64 {
    let flat = |c: &Square| c.iter().flatten().copied().collect::<Vec<f64>>();
    let [a, b] = [before, now].map(|solved| complex_covariance(gradient, &flat(&solved.covariance)));
    let [rr, ii, ri] = [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
    let d: Complex64 = (gradient.iter().zip(now.theta.iter().zip(&before.theta)))
        .map(|(g, (now, before))| g * (now - before))
        .sum();
    (d.re * d.re * ii - 2.0 * d.re * d.im * ri + d.im * d.im * rr) / (rr * ii - ri * ri)
}
