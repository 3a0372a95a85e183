//! The difference of the complex response at 2.5 rad/s, the last 5 s against up to 40 s before
//! them, each with a variance of its own (G. C. Chow, Econometrica 28 (1960) 591-605; without the
//! common variance it is Wald's test).
//!
//! `d = H_now - H_before`, `d' (C_now + C_before)^-1 d` against [`THRESHOLD`]; whitened residuals
//! are limited at 3.5 standard deviations of the fit before. After an alarm what came before it is
//! forgotten. The response that is said is that of all seconds since, 40 at most.

use std::collections::VecDeque;

use hoid_model::Complex64;

use super::{
    super::contestant::{Alarm, Answer, Contestant, Task, of_complex},
    basis::{Solved, Square, Sums, product, said, whitened, worth},
};

/// Seconds of a block, and blocks of now and before; the least of before.
const BLOCK_S: f64 = 0.25;
const NOW: usize = 20;
const BEFORE: usize = 160;
const LEAST_BEFORE: usize = 24;
/// Seconds before an alarm that are kept.
const KEPT: usize = 12;
const AT_RAD_S: f64 = 2.5;
const LIMIT: f64 = 3.5;
/// Wald's statistic from which a change is declared; 2 degrees of freedom. A remnant whose spectrum
/// and a person whose poles were known would pass 15 once an hour; those of the open seeds pass 25
/// some ten times an hour where nobody changes, for the basis is not theirs.
const THRESHOLD: f64 = 40.0;

pub(super) struct Chow;

impl Contestant for Chow {
    fn name(&self) -> String {
        "chow".to_owned()
    }

    fn follow(&self, task: &Task) -> Result<Answer, String> {
        let run = whitened(task)?;
        let start = Solved {
            theta: run.theta,
            covariance: run.covariance,
            variance: run.variance,
        };
        let gradient = worth(task, AT_RAD_S);
        let per_block = (BLOCK_S / run.every_s).round() as usize;
        let (mut blocks, mut open) = (VecDeque::<Sums>::new(), Sums::default());
        let (mut before, mut whole, mut alarms) = (start, start, Vec::new());
        let mut answer = Answer::default();
        for (i, sample) in run.samples.iter().enumerate() {
            while (task.asked_s.get(answer.said.len())).is_some_and(|t| *t < sample.t_s) {
                answer.said.push(said(task, &whole.theta, &whole.covariance));
            }
            if !sample.is_void {
                let bound = LIMIT * before.variance.sqrt();
                let expected = product(&sample.x, &before.theta);
                open.add(&sample.x, expected + (sample.y - expected).clamp(-bound, bound));
            }
            if (i + 1) % per_block != 0 {
                continue;
            }
            blocks.push_back(std::mem::take(&mut open));
            if blocks.len() > NOW + BEFORE {
                blocks.pop_front();
            }
            let sum = |from: usize, to: usize| {
                let mut sums = Sums::default();
                blocks.range(from..to).for_each(|block| sums.join(block));
                sums.solve().ok()
            };
            let n = blocks.len();
            if let Some(solved) = sum(n.saturating_sub(BEFORE), n) {
                whole = solved;
            }
            if n < NOW + LEAST_BEFORE {
                continue;
            }
            let (Some(past), Some(now)) = (sum(0, n - NOW), sum(n - NOW, n)) else {
                continue;
            };
            before = past;
            if sample.t_s < task.start_s.1 {
                continue;
            }
            if distance(&gradient, &past, &now) > THRESHOLD {
                alarms.push(Alarm {
                    t_s: sample.t_s,
                    of_remnant: false,
                });
                blocks.drain(..n - KEPT);
                if let Some(solved) = now_of(&blocks) {
                    (before, whole) = (solved, solved);
                }
            }
        }
        answer
            .said
            .resize_with(task.asked_s.len(), || said(task, &whole.theta, &whole.covariance));
        answer.alarms = Some(alarms);
        Ok(answer)
    }
}

fn now_of(blocks: &VecDeque<Sums>) -> Option<Solved> {
    let mut sums = Sums::default();
    blocks.iter().for_each(|block| sums.join(block));
    sums.solve().ok()
}

/// Wald's statistic of the difference of the responses.
fn distance(gradient: &[Complex64], before: &Solved, now: &Solved) -> f64 {
    let flat = |c: &Square| c.iter().flatten().copied().collect::<Vec<f64>>();
    let [a, b] = [before, now].map(|solved| of_complex(gradient, &flat(&solved.covariance)));
    let [rr, ii, ri] = [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
    let d: Complex64 = (gradient.iter().zip(now.theta.iter().zip(&before.theta)))
        .map(|(g, (now, before))| g * (now - before))
        .sum();
    (d.re * d.re * ii - 2.0 * d.re * d.im * ri + d.im * d.im * rr) / (rr * ii - ri * ri)
}
