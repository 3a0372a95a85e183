//! Search for the most significant change over all directions, records and instants.

use std::{
    f64::consts::{FRAC_PI_4, TAU},
    ops::Range,
};

use hoid_numerics::statistics::upper_median;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::{
    blocks::ScoreBlock,
    critical::{student_p_value, supremum_p_value},
};

/// Minimum number of blocks on each side of a change.
const MIN_BLOCKS_PER_SIDE: usize = 2;
/// Minimum number of blocks of a record that is tested for a drift or a periodic change.
const MIN_BLOCKS_OF_COURSE: usize = 8;
/// Shortest period of a periodic change, in blocks.
const MIN_PERIOD_BLOCKS: f64 = 5.0;
/// A change is tested only if at least this share of its information remains after estimating the constant parameters.
const MIN_REMAINING_INFORMATION_SHARE: f64 = 1e-3;
/// Smallest eigenvalue of the information, scaled to a unit diagonal, for which a combination of parameters is
/// determined.
const MIN_EIGENVALUE: f64 = 1e-9;

/// Input data of the test.
pub(crate) struct Constancy<'a> {
    pub blocks: &'a [ScoreBlock],
    pub directions: &'a [Direction],
    /// Innovation variance sigma^2.
    pub variance: f64,
    /// Relative variation of the parameters between runs.
    pub run_to_run: f64,
    pub sample_time_s: f64,
}

impl Constancy<'_> {
    /// Returns the duration of a block, s; `None` if no record has three blocks.
    fn block_s(&self) -> Option<f64> {
        // The first block of a record starts at sample zero, before its first residual.
        let pair = self
            .blocks
            .windows(2)
            .find(|pair| pair[0].record == pair[1].record && pair[0].from > 0)?;
        Some((pair[1].from - pair[0].from) as f64 * self.sample_time_s)
    }
}

/// A direction in the space of the parameters.
#[derive(Debug, Clone)]
pub(crate) struct Direction {
    pub name: String,
    /// Unit of the change, with a leading space if there is one.
    pub unit: &'static str,
    pub vector: Vec<f64>,
    pub delay: bool,
    /// Value of the parameter, to which its variation between runs is proportional; 1 for a logarithm, 0 if the
    /// variation between runs does not count, as for a parameter that is estimated for each run.
    pub size: f64,
}

/// Time course of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeCourse {
    /// A jump.
    Step,
    /// A linear drift over the whole record.
    Drift,
    /// A periodic change with this period in s.
    Oscillation(f64),
}

/// A significant change in a parameter.
#[derive(Debug, Clone)]
pub(super) struct Change {
    pub time_course: TimeCourse,
    pub name: String,
    pub unit: &'static str,
    pub record: usize,
    /// First sample after a step; 0 if a whole record differs from the others, and for a drift or a periodic change.
    pub first_sample: usize,
    pub size: f64,
    pub error: f64,
    pub p_value: f64,
}

/// A candidate change: record, first sample, course, and the size of the change in each block.
pub(super) struct Candidate {
    record: usize,
    first_sample: usize,
    time_course: TimeCourse,
    weights: Vec<f64>,
}

impl Candidate {
    /// Returns a step: a change of size one in a range of blocks, and zero in all other blocks.
    fn step(record: usize, at: usize, blocks: Range<usize>, all: usize) -> Self {
        let weights = (0..all).map(|c| f64::from(u8::from(blocks.contains(&c)))).collect();
        Self {
            record,
            first_sample: at,
            time_course: TimeCourse::Step,
            weights,
        }
    }

    /// Returns a change that follows `weight` over the blocks of a record, counted from zero, and is zero elsewhere.
    fn course(
        record: usize,
        time_course: TimeCourse,
        own: &Range<usize>,
        all: usize,
        weight: impl Fn(f64) -> f64,
    ) -> Self {
        let weights = (0..all).map(|c| {
            if own.contains(&c) {
                weight((c - own.start) as f64)
            } else {
                0.0
            }
        });
        Self {
            record,
            first_sample: 0,
            time_course,
            weights: weights.collect(),
        }
    }
}

/// Test statistics of one candidate change.
struct CandidateTest {
    set: usize,
    share: f64,
    u: f64,
    r: f64,
    model_variance_test: f64,
    by_blocks: f64,
    between_runs: f64,
}

/// Returns the step with the smallest p-value: of the delay if `delay` is true, otherwise of the other parameters.
pub(super) fn strongest_step(of: &Constancy<'_>, delay: bool) -> Option<Change> {
    let directions: Vec<_> = of.directions.iter().filter(|d| d.delay == delay).collect();
    strongest_change(of, &directions, &candidate_steps(of.blocks))
}

/// Returns the drift or the periodic change with the smallest p-value within a record: of the delay if `delay` is true,
/// otherwise of the other parameters. `None` if the change, reduced by two standard errors and multiplied by the share
/// of the record in all data, is smaller than the variation of the parameter between runs.
pub(super) fn strongest_course(of: &Constancy<'_>, delay: bool) -> Option<Change> {
    let block_count = |record: usize| of.blocks.iter().filter(|b| b.record == record).count();
    let mut sets = drifts(of.blocks);
    sets.extend(periodic_changes(of.blocks, of.block_s()?));
    sets.retain(|set| block_count(set.record) >= MIN_BLOCKS_OF_COURSE);
    let courses = (of.directions.iter()).filter(|direction| direction.delay == delay);
    let directions: Vec<_> = courses.collect();
    let found = strongest_change(of, &directions, &sets)?;
    let usual = directions.iter().find(|direction| direction.name == found.name)?.size * of.run_to_run;
    let share = block_count(found.record) as f64 / of.blocks.len() as f64;
    (share * (found.size.abs() - 2.0 * found.error) > usual).then_some(found)
}

/// Returns the change with the smallest p-value among these directions and candidates, whether or not it is
/// significant.
pub(super) fn strongest_change(of: &Constancy<'_>, directions: &[&Direction], sets: &[Candidate]) -> Option<Change> {
    let (blocks, n) = (of.blocks, of.blocks.len());
    let p = blocks.first()?.score.len();
    if n < 2 * MIN_BLOCKS_PER_SIDE || of.variance <= 0.0 || sets.is_empty() {
        return None;
    }
    let matrices: Vec<DMatrix<f64>> = blocks
        .iter()
        .map(|b| DMatrix::from_row_slice(p, p, &b.information))
        .collect();
    let whole = matrices.iter().fold(DMatrix::zeros(p, p), |sum, m| sum + m);
    let inverse = pseudo_inverse(&whole)?;
    // With a prior or a bound the scores do not sum to zero; a step to the minimum without prior and bound removes
    // their sum.
    let sum = blocks
        .iter()
        .fold(DVector::zeros(p), |sum, b| sum + DVector::from_column_slice(&b.score));
    let step = &inverse * sum;
    let scores: Vec<DVector<f64>> = blocks
        .iter()
        .zip(&matrices)
        .map(|(b, m)| DVector::from_column_slice(&b.score) - m * &step)
        .collect();
    let mut best: Option<Change> = None;
    for direction in directions {
        let v = DVector::from_column_slice(&direction.vector);
        let along: Vec<DVector<f64>> = matrices.iter().map(|m| m * &v).collect();
        let all: Vec<CandidateTest> = (0..sets.len())
            .filter_map(|k| {
                test_candidate(
                    of,
                    (&matrices, &scores),
                    &inverse,
                    (&v, &along, direction.size),
                    &sets[k],
                    k,
                )
            })
            .collect();
        let mut ratios: Vec<f64> = all.iter().map(|t| t.by_blocks / t.model_variance_test).collect();
        let typical = upper_median(&mut ratios).unwrap_or(1.0);
        let smallest = all.iter().map(|t| t.share.min(1.0 - t.share)).fold(0.5, f64::min);
        for t in &all {
            // A periodic change affects all blocks alike; the variance for such a change uses the median scatter over
            // all candidates.
            let (scatter, freedom) = match sets[t.set].time_course {
                TimeCourse::Step | TimeCourse::Drift => (t.by_blocks, n - 2),
                TimeCourse::Oscillation(_) => (0.0, 4 * (n - 2)),
            };
            let variance = scatter.max(t.model_variance_test * typical.max(1.0)) + t.between_runs;
            let p_one = student_p_value(t.u / variance.sqrt(), freedom as f64);
            let of_all = match sets[t.set].time_course {
                TimeCourse::Step => supremum_p_value(p_one, all.len(), smallest.max(1e-3)),
                _ => p_one * all.len() as f64,
            };
            let p_value = (of_all * directions.len() as f64).min(1.0);
            if best.as_ref().is_none_or(|known| p_value < known.p_value) {
                best = Some(Change {
                    time_course: sets[t.set].time_course,
                    name: direction.name.clone(),
                    unit: direction.unit,
                    record: sets[t.set].record,
                    first_sample: sets[t.set].first_sample,
                    size: t.u / t.r,
                    error: variance.sqrt() / t.r,
                    p_value,
                });
            }
        }
    }
    best
}

/// Returns the candidate steps: each whole record if there are several records, and the part of a record after each
/// block boundary.
pub(super) fn candidate_steps(blocks: &[ScoreBlock]) -> Vec<Candidate> {
    let several = blocks.last().is_some_and(|b| b.record > 0);
    let mut all = Vec::new();
    for (record, Range { start: from, end: to }) in records(blocks) {
        if several && to - from >= MIN_BLOCKS_PER_SIDE {
            all.push(Candidate::step(record, 0, from..to, blocks.len()));
        }
        for k in from + MIN_BLOCKS_PER_SIDE..(to + 1).saturating_sub(MIN_BLOCKS_PER_SIDE) {
            all.push(Candidate::step(record, blocks[k].from, k..to, blocks.len()));
        }
    }
    all
}

/// Returns the candidate drifts: a linear change over the blocks of each record.
pub(super) fn drifts(blocks: &[ScoreBlock]) -> Vec<Candidate> {
    records(blocks)
        .map(|(record, own)| {
            let n = own.len().max(1) as f64;
            Candidate::course(record, TimeCourse::Drift, &own, blocks.len(), |c| (c + 0.5) / n - 0.5)
        })
        .collect()
}

/// Returns sinusoidal changes over the blocks of each record, where `block_s` is the duration of a block: periods from
/// [`MIN_PERIOD_BLOCKS`] blocks to two thirds of the record, with frequencies spaced by half the frequency resolution,
/// each in four phases.
pub(super) fn periodic_changes(blocks: &[ScoreBlock], block_s: f64) -> Vec<Candidate> {
    let of_record = |(record, own): (usize, Range<usize>)| {
        let n = own.len() as f64;
        let frequencies = (3..)
            .map(move |k| f64::from(k) / (2.0 * n))
            .take_while(|f| *f <= 1.0 / MIN_PERIOD_BLOCKS);
        let of = move |frequency: f64, phase: u32| {
            let course = TimeCourse::Oscillation(block_s / frequency);
            Candidate::course(record, course, &own, blocks.len(), |c| {
                (TAU * (c + 0.5) * frequency + FRAC_PI_4 * f64::from(phase)).sin()
            })
        };
        let all: Vec<Candidate> = frequencies
            .flat_map(|frequency| (0..4).map(move |phase| (frequency, phase)))
            .map(|(frequency, phase)| of(frequency, phase))
            .collect();
        all
    };
    records(blocks).flat_map(of_record).collect()
}

/// Returns the records, each with the range of its blocks.
fn records(blocks: &[ScoreBlock]) -> impl Iterator<Item = (usize, Range<usize>)> {
    let count = blocks.last().map_or(0, |b| b.record + 1);
    (0..count).map(|record| {
        let from = blocks.partition_point(|b| b.record < record);
        let to = blocks.partition_point(|b| b.record <= record);
        (record, from..to)
    })
}

fn test_candidate(
    of: &Constancy<'_>,
    (matrices, scores): (&[DMatrix<f64>], &[DVector<f64>]),
    inverse: &DMatrix<f64>,
    (v, along, size): (&DVector<f64>, &[DVector<f64>], f64),
    set: &Candidate,
    index: usize,
) -> Option<CandidateTest> {
    let p = v.len();
    let mut inside = DVector::zeros(p);
    let (mut information, mut of_set) = (0.0, 0.0);
    for (moved, weight) in along.iter().zip(&set.weights) {
        inside += moved * *weight;
        information += v.dot(moved);
        of_set += weight * weight * v.dot(moved);
    }
    let a = inverse * inside;
    let mut parts = Vec::with_capacity(matrices.len());
    let mut of_runs = vec![0.0; of.blocks.last()?.record + 1];
    for (c, (matrix, score)) in matrices.iter().zip(scores).enumerate() {
        let w = v * set.weights[c] - &a;
        let moved = matrix * &w;
        parts.push((w.dot(score), w.dot(&moved)));
        of_runs[of.blocks[c].record] += v.dot(&moved);
    }
    let (u, r) = parts.iter().fold((0.0, 0.0), |(u, r), (h, rc)| (u + h, r + rc));
    if r <= MIN_REMAINING_INFORMATION_SHARE * of_set || of_set <= 0.0 {
        return None;
    }
    let (delta, n) = (u / r, parts.len() as f64);
    let scatter: f64 = parts.iter().map(|(h, rc)| (h - delta * rc).powi(2)).sum();
    let runs: f64 = if of_runs.len() > 1 {
        of_runs.iter().map(|x| x * x).sum()
    } else {
        0.0
    };
    Some(CandidateTest {
        set: index,
        share: of_set / information,
        u,
        r,
        model_variance_test: of.variance * r,
        by_blocks: scatter * n / (n - 2.0),
        between_runs: (of.run_to_run * size).powi(2) * runs,
    })
}

/// Returns the pseudo-inverse over the determined combinations of parameters, after scaling to a unit diagonal.
pub(super) fn pseudo_inverse(whole: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let p = whole.nrows();
    let scale = DVector::from_fn(p, |i, _| {
        if whole[(i, i)] > 0.0 {
            whole[(i, i)].sqrt().recip()
        } else {
            0.0
        }
    });
    let scaled = DMatrix::from_fn(p, p, |i, j| whole[(i, j)] * scale[i] * scale[j]);
    if scaled.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::new(scaled);
    let mut inverse = DMatrix::zeros(p, p);
    for (k, value) in eigen
        .eigenvalues
        .iter()
        .enumerate()
        .filter(|(_, value)| **value > MIN_EIGENVALUE)
    {
        let column = eigen.eigenvectors.column(k).component_mul(&scale);
        inverse += &column * column.transpose() / *value;
    }
    Some(inverse)
}
