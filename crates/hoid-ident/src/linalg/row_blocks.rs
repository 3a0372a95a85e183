//! Reduction of a tall least-squares problem to a triangular one, block of rows by block of rows.
//!
//! If `[X_1 y_1] = Q_1 R_1` for the first rows, the factor of all rows so far follows from `[R_1; X_2 y_2] = Q_2 R_2` for
//! the next block (G. H. Golub, R. J. Plemmons and A. Sameh, in *High-Speed Computing*, 1988, 171-179). The reflections
//! are orthogonal, so the triangular problem has the same solution, residual sum of squares and rank as the tall one.
//! A block fits into the second-level cache, whereas a reflection of the whole problem reads all of it from memory.
//!
//! The reflection for column k has only the element `R_kk` and the column of the block in its vector, since R is zero
//! below the diagonal.

use super::vectors::{add_scaled, dot};

/// Number of rows in a block.
const BLOCK_ROWS: usize = 256;

/// Returns the columns of the triangular problem with p + 1 rows, one after the other, and its right-hand side.
pub(super) fn reduce_rows(columns: &[f64], y: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let rows = y.len();
    let signals: Vec<&[f64]> = columns.chunks_exact(rows).chain([y]).collect();
    let q = signals.len();
    let mut r = vec![0.0; q * q];
    let mut block = Vec::with_capacity(q * BLOCK_ROWS);
    for from in (0..rows).step_by(BLOCK_ROWS) {
        let to = rows.min(from + BLOCK_ROWS);
        block.clear();
        signals
            .iter()
            .for_each(|signal| block.extend_from_slice(&signal[from..to]));
        absorb(&mut r, &mut block, to - from);
    }
    let y = r.split_off((q - 1) * q);
    (r, y)
}

/// Replaces R by the factor of R above a block of rows; the block becomes zero up to rounding.
fn absorb(r: &mut [f64], block: &mut [f64], rows: usize) {
    let q = block.len() / rows;
    for k in 0..q {
        let (head, tail) = block.split_at_mut((k + 1) * rows);
        let v = &head[k * rows..];
        let squares = dot(v, v);
        if squares == 0.0 {
            continue;
        }
        let diagonal = r[k * q + k];
        let sigma = -(diagonal * diagonal + squares).sqrt().copysign(diagonal);
        let first = diagonal - sigma;
        let half_square = 0.5 * (first * first + squares);
        r[k * q + k] = sigma;
        for (column, j) in tail.chunks_exact_mut(rows).zip(k + 1..) {
            let factor = (first * r[j * q + k] + dot(v, column)) / half_square;
            r[j * q + k] -= factor * first;
            add_scaled(column, -factor, v);
        }
    }
}
