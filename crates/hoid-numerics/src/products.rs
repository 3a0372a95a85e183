//! Products of vectors and of small matrices.

/// Returns `sum_i a_i b_i` over the length of the shorter slice, summed from the first term to the last; zero for empty
/// slices.
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    // The sum starts with the first product instead of zero, since every addition adds to the latency of a recursion.
    let mut pairs = a.iter().zip(b);
    let Some((a, b)) = pairs.next() else {
        return 0.0;
    };
    let mut sum = a * b;
    for (a, b) in pairs {
        sum += a * b;
    }
    sum
}

/// Returns `M C M'`, where M has the given rows.
pub fn congruence<const K: usize, const S: usize>(rows: &[[f64; S]; K], c: &[[f64; S]; S]) -> [[f64; K]; K] {
    let of = |a: &[f64; S], b: &[f64; S]| -> f64 {
        let each = (0..S).map(|i| a[i] * (0..S).map(|j| c[i][j] * b[j]).sum::<f64>());
        each.sum()
    };
    core::array::from_fn(|i| core::array::from_fn(|j| of(&rows[i], &rows[j])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dot_is_bit_identical_to_the_ordered_sum() {
        let a = [0.1, -7.3, 1e17, 3.3, -1e17];
        let b = [1.7, 0.3, 1.0, 0.9, 1.0];
        let sum: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        assert_eq!(dot(&a, &b).to_bits(), sum.to_bits());
        assert_eq!(dot(&a[..2], &b), 0.1 * 1.7 - 7.3 * 0.3);
        assert_eq!(dot(&[], &b), 0.0);
    }

    #[test]
    fn congruence_is_the_covariance_of_linear_combinations() {
        let rows = [[1.0, 2.0, 0.0], [0.0, -1.0, 3.0]];
        let c = [[4.0, 1.0, 0.0], [1.0, 2.0, 0.5], [0.0, 0.5, 1.0]];
        assert_eq!(congruence(&rows, &c), [[16.0, -2.0], [-2.0, 8.0]]);
    }
}
