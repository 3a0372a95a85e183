//! Solution of positive definite systems in place: `A = U' U`, then two triangular systems.

/// U in the place of the upper triangle of A, n by n with rows of N; false where A is not positive
/// definite. A row is taken out of all below it as soon as it is there: its numbers stand one after another.
pub(super) fn factor<const N: usize>(a: &mut [[f64; N]; N], n: usize) -> bool {
    for k in 0..n {
        let Some((row, below)) = a[k..n].split_first_mut() else { break };
        let square = row[k];
        if !(square > 0.0 && square.is_finite()) {
            return false;
        }
        row[k] = libm::sqrt(square);
        let share = row[k];
        row[k + 1..n].iter_mut().for_each(|u| *u /= share);
        for (j, other) in (k + 1..n).zip(below) {
            let factor = row[j];
            for (a, u) in other[j..n].iter_mut().zip(&row[j..n]) {
                *a -= factor * u;
            }
        }
    }
    true
}

/// The solution in the place of b, with U of [`factor`].
pub(super) fn solve<const N: usize>(u: &[[f64; N]; N], n: usize, b: &mut [f64; N]) {
    for i in 0..n {
        let mut sum = b[i];
        for k in 0..i {
            sum -= u[k][i] * b[k];
        }
        b[i] = sum / u[i][i];
    }
    for i in (0..n).rev() {
        let mut sum = b[i];
        for k in i + 1..n {
            sum -= u[i][k] * b[k];
        }
        b[i] = sum / u[i][i];
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
