//! The change that stands out among all directions, records and instants.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::{
    blocks::ScoreBlock,
    critical::{of_student, of_supremum},
};

/// Blocks on each side of a change.
const FEWEST: usize = 2;
/// Share of the information of a change that the constant parameters must leave.
const LEFT: f64 = 1e-3;
/// Eigenvalue of the information, scaled to a unit diagonal, below which a combination of parameters
/// is not determined.
const SINGULAR: f64 = 1e-9;

/// What is looked at.
pub(crate) struct Constancy<'a> {
    pub blocks: &'a [ScoreBlock],
    pub directions: &'a [Direction],
    /// Innovation variance sigma^2.
    pub variance: f64,
    /// What parameters vary by between runs, as a part of them.
    pub run_to_run: f64,
    pub sample_time_s: f64,
}

/// A direction in the space of the parameters.
#[derive(Debug, Clone)]
pub(crate) struct Direction {
    pub name: String,
    /// Unit of the change, with a space in front where there is one.
    pub unit: &'static str,
    pub vector: Vec<f64>,
    pub delay: bool,
    /// The parameter's value, of which people vary by a part between runs; 1 for a logarithm, 0 for
    /// what each run has for itself.
    pub size: f64,
}

/// A change of a parameter.
#[derive(Debug, Clone)]
pub(super) struct Change {
    pub name: String,
    pub unit: &'static str,
    pub record: usize,
    /// First sample behind it; 0 where a whole record differs from the others.
    pub at: usize,
    pub by: f64,
    pub error: f64,
    pub p_value: f64,
}

/// A set of samples that differs: record, first sample and the blocks.
struct Set {
    record: usize,
    at: usize,
    blocks: std::ops::Range<usize>,
}

/// A change that is tested.
struct Tested {
    set: usize,
    share: f64,
    u: f64,
    r: f64,
    by_model: f64,
    by_blocks: f64,
    between_runs: f64,
}

/// The change with the smallest p-value among the delays, or among the others.
pub(super) fn strongest(of: &Constancy<'_>, delay: bool) -> Option<Change> {
    let (blocks, n) = (of.blocks, of.blocks.len());
    let p = blocks.first()?.g.len();
    let sets = sets(blocks);
    if n < 2 * FEWEST || of.variance <= 0.0 || sets.is_empty() {
        return None;
    }
    let matrices: Vec<DMatrix<f64>> = blocks.iter().map(|b| DMatrix::from_row_slice(p, p, &b.big)).collect();
    let whole = matrices.iter().fold(DMatrix::zeros(p, p), |sum, m| sum + m);
    let inverse = pseudo_inverse(&whole)?;
    // A prior or a bound leaves a sum of scores: one step to the minimum without it.
    let sum = blocks
        .iter()
        .fold(DVector::zeros(p), |sum, b| sum + DVector::from_column_slice(&b.g));
    let step = &inverse * sum;
    let scores: Vec<DVector<f64>> = blocks
        .iter()
        .zip(&matrices)
        .map(|(b, m)| DVector::from_column_slice(&b.g) - m * &step)
        .collect();
    let directions: Vec<_> = of.directions.iter().filter(|d| d.delay == delay).collect();
    let mut best: Option<Change> = None;
    for direction in &directions {
        let v = DVector::from_column_slice(&direction.vector);
        let all: Vec<Tested> = (0..sets.len())
            .filter_map(|k| tested(of, (&matrices, &scores), &inverse, (&v, direction.size), &sets[k], k))
            .collect();
        let mut ratios: Vec<f64> = all.iter().map(|t| t.by_blocks / t.by_model).collect();
        ratios.sort_by(f64::total_cmp);
        let usual = ratios.get(ratios.len() / 2).copied().unwrap_or(1.0);
        let smallest = all.iter().map(|t| t.share.min(1.0 - t.share)).fold(0.5, f64::min);
        for t in &all {
            let variance = t.by_blocks.max(t.by_model * usual.max(1.0)) + t.between_runs;
            let p_one = of_student(t.u / variance.sqrt(), (n - 2) as f64);
            let p_value = (of_supremum(p_one, all.len(), smallest.max(1e-3)) * directions.len() as f64).min(1.0);
            if best.as_ref().is_none_or(|known| p_value < known.p_value) {
                best = Some(Change {
                    name: direction.name.clone(),
                    unit: direction.unit,
                    record: sets[t.set].record,
                    at: sets[t.set].at,
                    by: t.u / t.r,
                    error: variance.sqrt() / t.r,
                    p_value,
                });
            }
        }
    }
    best
}

/// Whole records among others, and the part of a record behind each boundary of blocks.
fn sets(blocks: &[ScoreBlock]) -> Vec<Set> {
    let records = blocks.last().map_or(0, |b| b.record + 1);
    let mut all = Vec::new();
    for record in 0..records {
        let from = blocks.partition_point(|b| b.record < record);
        let to = blocks.partition_point(|b| b.record <= record);
        if records > 1 && to - from >= FEWEST {
            let (at, blocks) = (0, from..to);
            all.push(Set { record, at, blocks });
        }
        for k in from + FEWEST..(to + 1).saturating_sub(FEWEST) {
            let (at, blocks) = (blocks[k].from, k..to);
            all.push(Set { record, at, blocks });
        }
    }
    all
}

fn tested(
    of: &Constancy<'_>,
    (matrices, scores): (&[DMatrix<f64>], &[DVector<f64>]),
    inverse: &DMatrix<f64>,
    (v, size): (&DVector<f64>, f64),
    set: &Set,
    index: usize,
) -> Option<Tested> {
    let p = v.len();
    let inside = matrices[set.blocks.clone()]
        .iter()
        .fold(DVector::zeros(p), |sum, m| sum + m * v);
    let information: f64 = matrices.iter().map(|m| v.dot(&(m * v))).sum();
    let of_set = v.dot(&inside);
    let a = inverse * inside;
    let (within, beside) = (v - &a, -&a);
    let mut parts = Vec::with_capacity(matrices.len());
    let mut of_runs = vec![0.0; of.blocks.last()?.record + 1];
    for (c, (matrix, score)) in matrices.iter().zip(scores).enumerate() {
        let w = if set.blocks.contains(&c) { &within } else { &beside };
        let moved = matrix * w;
        parts.push((w.dot(score), w.dot(&moved)));
        of_runs[of.blocks[c].record] += v.dot(&moved);
    }
    let (u, r) = parts.iter().fold((0.0, 0.0), |(u, r), (h, rc)| (u + h, r + rc));
    if r <= LEFT * of_set || of_set <= 0.0 {
        return None;
    }
    let (delta, n) = (u / r, parts.len() as f64);
    let scatter: f64 = parts.iter().map(|(h, rc)| (h - delta * rc).powi(2)).sum();
    let runs: f64 = if of_runs.len() > 1 {
        of_runs.iter().map(|x| x * x).sum()
    } else {
        0.0
    };
    Some(Tested {
        set: index,
        share: of_set / information,
        u,
        r,
        by_model: of.variance * r,
        by_blocks: scatter * n / (n - 2.0),
        between_runs: (of.run_to_run * size).powi(2) * runs,
    })
}

/// The inverse over what the data determine, in units of a unit diagonal.
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
        .filter(|(_, value)| **value > SINGULAR)
    {
        let column = eigen.eigenvectors.column(k).component_mul(&scale);
        inverse += &column * column.transpose() / *value;
    }
    Some(inverse)
}
