//! Products of vectors.

/// `sum_i a_i b_i` over the shorter of the two, from the first to the last; zero of none.
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Not from zero: every addition is one more that a recursion waits for.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_sum_in_order_to_the_last_bit() {
        let a = [0.1, -7.3, 1e17, 3.3, -1e17];
        let b = [1.7, 0.3, 1.0, 0.9, 1.0];
        let sum: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        assert_eq!(dot(&a, &b).to_bits(), sum.to_bits());
        assert_eq!(dot(&a[..2], &b), 0.1 * 1.7 - 7.3 * 0.3);
        assert_eq!(dot(&[], &b), 0.0);
    }
}
