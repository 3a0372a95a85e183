//! Columns with the rows of all records, one record after the other.

use crate::linalg::vectors::{add_scaled, dot};

/// Columns with the rows of all records, one record after the other.
pub(crate) type Columns = Vec<Vec<f64>>;

/// A column counts as a linear combination of previous columns if its independent part has less than this share of its
/// amplitude. Columns that are orthogonalised twice are accurate to 1e-15.
const MIN_INDEPENDENT_SHARE: f64 = 1e-10;
/// Largest length of an artificial past, in samples.
const MAX_PAST_SAMPLES: usize = 256;

/// Returns the signal with an artificial past, and the length of this past. The past is the signal reflected at its
/// first sample and faded in, so simulations start without a jump.
pub(super) fn with_past(x: &[f64]) -> (Vec<f64>, usize) {
    let length = MAX_PAST_SAMPLES.min(x.len().saturating_sub(1));
    let fade = |k: usize| 0.5 + 0.5 * (std::f64::consts::PI * k as f64 / (length + 1) as f64).cos();
    let mut extended: Vec<f64> = (1..=length).rev().map(|k| fade(k) * (2.0 * x[0] - x[k])).collect();
    extended.extend_from_slice(x);
    (extended, length)
}

/// Returns an orthonormal basis of the columns (two passes of Gram-Schmidt), and the indices of the linearly
/// independent columns.
pub(super) fn orthonormal_basis(columns: &[Vec<f64>]) -> (Columns, Vec<usize>) {
    let mut q: Columns = Vec::new();
    let mut kept = Vec::new();
    for (index, column) in columns.iter().enumerate() {
        let size = dot(column, column).sqrt();
        let mut own = column.clone();
        for _ in 0..2 {
            for q in &q {
                let component = dot(q, &own);
                add_scaled(&mut own, -component, q);
            }
        }
        let rest = dot(&own, &own).sqrt();
        // The comparison also rejects `NaN`.
        if rest > MIN_INDEPENDENT_SHARE * size {
            own.iter_mut().for_each(|v| *v /= rest);
            q.push(own);
            kept.push(index);
        }
    }
    (q, kept)
}

/// Splits a residual over all records into the parts of the single records, which have these numbers of rows.
pub(super) fn split_by_record(residual: &[f64], rows: &[usize]) -> Columns {
    let mut at = 0;
    rows.iter()
        .map(|n| {
            at += n;
            residual[at - n..at].to_vec()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: u32, w: f64) -> Vec<f64> {
        (0..n)
            .map(|t| (w * f64::from(t)).sin() + 0.3 * (2.3 * w * f64::from(t)).cos())
            .collect()
    }

    #[test]
    fn artificial_past_joins_the_record_smoothly() {
        let x = wave(2000, 0.01);
        let (extended, past) = with_past(&x);
        assert_eq!(past, MAX_PAST_SAMPLES);
        assert_eq!(extended[past..], x);
        let steepest = extended.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
        assert!(steepest < 0.03, "{steepest}");
        assert_eq!(with_past(&[5.0]), (vec![5.0], 0));
        assert_eq!(with_past(&[]), (vec![], 0));
    }

    #[test]
    fn dependent_columns_are_excluded_from_the_basis() {
        let (a, b) = (wave(100, 0.2), wave(100, 0.9));
        let sum: Vec<f64> = a.iter().zip(&b).map(|(x, y)| x - 3.0 * y).collect();
        let (basis, kept) = orthonormal_basis(&[a, vec![0.0; 100], b, sum, vec![f64::NAN; 100]]);
        assert_eq!(kept, [0, 2]);
        assert!(dot(&basis[0], &basis[1]).abs() < 1e-14);
    }
}
