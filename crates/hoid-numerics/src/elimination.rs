//! Solution of linear systems in place, by elimination without square roots.
//!
//! **Positive definite matrices**, one right-hand side ([`solve`]). With rows `u_k` and pivots `p_k = u_kk`,
//! `A = sum_k u_k' u_k/p_k` (C. F. Gauss, *Disquisitio de elementis ellipticis Palladis*, 1810). The right-hand side is
//! eliminated together with A. In the back substitution, the term of each unknown is subtracted from all preceding
//! equations as soon as the unknown is known, so no step waits for a complete sum. If the factor itself is needed, use
//! [`crate::cholesky`].
//!
//! **General matrices**, several right-hand sides ([`solve_general`]), with row pivoting (G. H. Golub and C. F. Van
//! Loan, *Matrix Computations*, 2013, section 3.4).

/// Number of columns that are computed at a time.
const COLUMNS_PER_CHUNK: usize = 4;

/// Replaces b by the solution of `A x = b` for the first n of N unknowns. Returns false if A is not positive definite.
/// Only the upper triangle of A is read, and it is overwritten. N must be a multiple of four.
#[inline(always)]
pub fn solve<const N: usize>(a: &mut [[f64; N]; N], n: usize, b: &mut [f64; N]) -> bool {
    const { assert!(N.is_multiple_of(COLUMNS_PER_CHUNK)) };
    let mut inverse = [0.0; N];
    for i in 0..n {
        let (above, below) = a.split_at_mut(i);
        let Some(row) = below.first_mut() else { return false };
        let mut factors = [0.0; N];
        let mut right = b[i];
        for (k, other) in above.iter().enumerate() {
            factors[k] = other[i] * inverse[k];
            right -= factors[k] * b[k];
        }
        b[i] = right;
        for (column, block) in row
            .as_chunks_mut::<COLUMNS_PER_CHUNK>()
            .0
            .iter_mut()
            .enumerate()
            .skip(i / COLUMNS_PER_CHUNK)
        {
            let mut sums = *block;
            for (other, factor) in above.iter().zip(&factors) {
                let other = &other.as_chunks::<COLUMNS_PER_CHUNK>().0[column];
                for (sum, u) in sums.iter_mut().zip(other) {
                    *sum -= factor * u;
                }
            }
            *block = sums;
        }
        if !(row[i] > 0.0 && row[i].is_finite()) {
            return false;
        }
        inverse[i] = 1.0 / row[i];
    }
    for i in (0..n).rev() {
        let x = b[i] * inverse[i];
        b[i] = x;
        for (right, row) in b[..i].iter_mut().zip(a.iter()) {
            *right -= row[i] * x;
        }
    }
    true
}

/// Replaces B by the solution X of `A X = B` and returns `ln |det A|`. If A is singular, the results are not finite.
pub fn solve_general<const N: usize>(a: &mut [[f64; N]; N], b: &mut [[f64; N]; N]) -> f64 {
    let mut log_determinant = 0.0;
    for i in 0..N {
        let mut pivot = i;
        for r in i + 1..N {
            if a[r][i].abs() > a[pivot][i].abs() {
                pivot = r;
            }
        }
        a.swap(i, pivot);
        b.swap(i, pivot);
        let (row, right, size) = (a[i], b[i], a[i][i]);
        log_determinant += libm::log(size.abs());
        for r in i + 1..N {
            let factor = a[r][i] / size;
            for c in i..N {
                a[r][c] -= factor * row[c];
            }
            for c in 0..N {
                b[r][c] -= factor * right[c];
            }
        }
    }
    for i in (0..N).rev() {
        let size = a[i][i];
        b[i].iter_mut().for_each(|x| *x /= size);
        let right = b[i];
        for r in 0..i {
            let factor = a[r][i];
            for c in 0..N {
                b[r][c] -= factor * right[c];
            }
        }
    }
    log_determinant
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cholesky;

    #[test]
    fn solution_matches_cholesky() {
        // A Hilbert matrix plus a ridge, of any size up to N.
        for n in 1..=8 {
            let mut a: [[f64; 8]; 8] = std::array::from_fn(|i| std::array::from_fn(|j| 1.0 / (i + j + 1) as f64));
            (0..8).for_each(|i| a[i][i] += 0.1);
            let b: [f64; 8] = std::array::from_fn(|i| i as f64 - 2.5);
            let (mut l, mut expected, mut x) = (a, b, b);
            assert!(cholesky::factor(&mut l, n));
            cholesky::solve(&l, n, &mut expected);
            assert!(solve(&mut a, n, &mut x));
            for (x, e) in x.iter().zip(expected).take(n) {
                assert!((x - e).abs() < 1e-13 * e.abs().max(1.0), "{n}: {x} {e}");
            }
        }
    }

    #[test]
    fn unsolvable_systems_are_refused() {
        let mut no = [[0.0; 4]; 4];
        (no[0], no[1]) = ([1.0, 2.0, 0.0, 0.0], [2.0, 1.0, 0.0, 0.0]);
        assert!(!solve(&mut no.clone(), 2, &mut [1.0; 4]));
        no[0][0] = f64::NAN;
        assert!(!solve(&mut no, 2, &mut [1.0; 4]) && !solve(&mut [[0.0; 4]; 4], 1, &mut [1.0; 4]));
    }

    #[test]
    fn general_matrix_is_solved_with_its_determinant() {
        // The first pivot is zero; the determinant is 5.
        let a = [[0.0, 2.0, 1.0], [1.0, -1.0, 0.0], [3.0, 0.0, -1.0]];
        let b = [[1.0, 0.0, 2.0], [0.0, 1.0, -1.0], [4.0, 0.5, 0.0]];
        let (mut left, mut x) = (a, b);
        let log_determinant = solve_general(&mut left, &mut x);
        assert!((log_determinant - 5.0_f64.ln()).abs() < 1e-14);
        for (row, right) in a.iter().zip(b) {
            for c in 0..3 {
                let product: f64 = (0..3).map(|k| row[k] * x[k][c]).sum();
                assert!((product - right[c]).abs() < 1e-14);
            }
        }
        assert!(!solve_general(&mut [[0.0; 2]; 2], &mut [[1.0; 2]; 2]).is_finite());
    }
}
