//! Solution of positive definite systems in place: `A = L L'`, then two triangular systems.

/// L in the place of the lower triangle of A, n by n with rows of N; false where A is not positive
/// definite.
pub(super) fn factor<const N: usize>(a: &mut [[f64; N]; N], n: usize) -> bool {
    for i in 0..n {
        for j in 0..=i {
            let mut sum = a[i][j];
            for k in 0..j {
                sum -= a[i][k] * a[j][k];
            }
            if i > j {
                a[i][j] = sum / a[j][j];
            } else if sum > 0.0 && sum.is_finite() {
                a[i][i] = libm::sqrt(sum);
            } else {
                return false;
            }
        }
    }
    true
}

/// The solution in the place of b, with L of [`factor`].
pub(super) fn solve<const N: usize>(l: &[[f64; N]; N], n: usize, b: &mut [f64; N]) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_and_refuses() {
        let a: [[f64; 3]; 3] = [[4.0, 2.0, 0.5], [2.0, 5.0, 1.0], [0.5, 1.0, 3.0]];
        let (mut l, mut x) = (a, [1.0, -2.0, 0.5]);
        assert!(factor(&mut l, 3));
        solve(&l, 3, &mut x);
        for (row, b) in a.iter().zip([1.0, -2.0, 0.5]) {
            let product: f64 = row.iter().zip(x).map(|(a, x)| a * x).sum();
            assert!((product - b).abs() < 1e-12);
        }
        assert!(!factor(&mut [[1.0, 2.0], [2.0, 1.0]], 2));
        assert!(!factor(&mut [[f64::NAN; 2]; 2], 2));
    }
}
