//! Solution of positive definite systems in place, by the factorisation `A = L L'` and two triangular systems (A. L.
//! Cholesky, by E. Benoit, *Bulletin géodésique* 2 (1924) 67-77; G. H. Golub and C. F. Van Loan, *Matrix Computations*,
//! 2013, section 4.2).
//!
//! Matrices are N by N; only the first n rows and columns are used. [`solve`] subtracts each known term as soon as it
//! is known, whereas [`substitute_forward`] and [`substitute_backward`] sum the known terms and subtract the sum.
//! Applied one after the other, [`substitute_forward`] and [`substitute_backward`] give the result of [`solve`] except
//! for rounding.

/// Replaces the lower triangle of A by L. Returns false if A is not positive definite.
pub fn factor<const N: usize>(a: &mut [[f64; N]; N], n: usize) -> bool {
    factor_with_min_pivot(a, n, 0.0)
}

/// Replaces the lower triangle of A by L. Returns false if a pivot, the square of a diagonal element of L, is not above
/// `least`.
pub fn factor_with_min_pivot<const N: usize>(a: &mut [[f64; N]; N], n: usize, least: f64) -> bool {
    for i in 0..n {
        for j in 0..=i {
            let mut sum = a[i][j];
            for k in 0..j {
                sum -= a[i][k] * a[j][k];
            }
            if i > j {
                a[i][j] = sum / a[j][j];
            } else if sum > least && sum.is_finite() {
                a[i][i] = libm::sqrt(sum);
            } else {
                return false;
            }
        }
    }
    true
}

/// Replaces b by the solution of `A x = b`, given L from [`factor`].
pub fn solve<const N: usize>(l: &[[f64; N]; N], n: usize, b: &mut [f64; N]) {
    for i in 0..n {
        let mut sum = b[i];
        for k in 0..i {
            sum -= l[i][k] * b[k];
        }
        b[i] = sum / l[i][i];
    }
    for i in (0..n).rev() {
        let mut sum = b[i];
        for k in i + 1..n {
            sum -= l[k][i] * b[k];
        }
        b[i] = sum / l[i][i];
    }
}

/// Returns `scale A^-1`, given L from [`factor`], with zeros beyond the first n rows and columns.
pub fn scaled_inverse<const N: usize>(l: &[[f64; N]; N], n: usize, scale: f64) -> [[f64; N]; N] {
    let mut inverse = [[0.0; N]; N];
    for (i, row) in inverse.iter_mut().enumerate().take(n) {
        row[i] = scale;
        solve(l, n, row);
    }
    inverse
}

/// Replaces b by `L^-1 b`.
pub fn substitute_forward<const N: usize>(l: &[[f64; N]; N], n: usize, b: &mut [f64; N]) {
    for i in 0..n {
        let known: f64 = (0..i).map(|k| l[i][k] * b[k]).sum();
        b[i] = (b[i] - known) / l[i][i];
    }
}

/// Replaces b by `L'^-1 b`.
pub fn substitute_backward<const N: usize>(l: &[[f64; N]; N], n: usize, b: &mut [f64; N]) {
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| l[k][i] * b[k]).sum();
        b[i] = (b[i] - known) / l[i][i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: [[f64; 3]; 3] = [[4.0, 2.0, 0.5], [2.0, 5.0, 1.0], [0.5, 1.0, 3.0]];

    #[test]
    fn solves_definite_and_refuses_indefinite_systems() {
        let (mut l, mut x) = (A, [1.0, -2.0, 0.5]);
        assert!(factor(&mut l, 3));
        solve(&l, 3, &mut x);
        for (row, b) in A.iter().zip([1.0, -2.0, 0.5]) {
            let product: f64 = row.iter().zip(x).map(|(a, x)| a * x).sum();
            assert!((product - b).abs() < 1e-12);
        }
        assert!(!factor(&mut [[1.0, 2.0], [2.0, 1.0]], 2));
        assert!(!factor(&mut [[f64::NAN; 2]; 2], 2));
    }

    #[test]
    fn small_pivot_is_refused() {
        // The second pivot is 1e-6.
        let a = [[1.0, 1.0], [1.0, 1.0 + 1e-6]];
        assert!(factor_with_min_pivot(&mut a.clone(), 2, 1e-7) && !factor_with_min_pivot(&mut a.clone(), 2, 1e-5));
    }

    #[test]
    fn forward_and_backward_substitution_give_the_solution() {
        let (mut l, b) = (A, [1.0, -2.0, 0.5]);
        assert!(factor(&mut l, 3));
        let (mut x, mut expected) = (b, b);
        substitute_forward(&l, 3, &mut x);
        let half = x;
        substitute_backward(&l, 3, &mut x);
        solve(&l, 3, &mut expected);
        for i in 0..3 {
            let of_l: f64 = (0..=i).map(|k| l[i][k] * half[k]).sum();
            assert!((of_l - b[i]).abs() < 1e-14 && (x[i] - expected[i]).abs() < 1e-14);
        }
    }

    #[test]
    fn scaled_inverse_uses_only_the_leading_block() {
        let mut l = A;
        assert!(factor(&mut l, 2));
        let inverse = scaled_inverse(&l, 2, 32.0);
        // 1/16 [5 -2; -2 4].
        let expected = [[10.0, -4.0, 0.0], [-4.0, 8.0, 0.0], [0.0; 3]];
        for (row, expected) in inverse.iter().zip(expected) {
            for (v, e) in row.iter().zip(expected) {
                assert!((v - e).abs() < 1e-13, "{inverse:?}");
            }
        }
    }
}
