//! Adjustment of the p-values of several tests.
//!
//! S. Holm, *Scand. J. Stat.* 6 (1979) 65-70: for m p-values in ascending order `p_1 <= .. <= p_m` the adjusted values
//! are `max_{j <= i} min(1, (m - j + 1) p_j)`. The probability of one or more false findings among the tests is then at
//! most the significance level, regardless of how the tests depend on each other.

/// Returns the adjusted p-values, in the order of the given p-values.
pub fn holm(probabilities: &[f64]) -> Vec<f64> {
    let m = probabilities.len();
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by(|a, b| probabilities[*a].total_cmp(&probabilities[*b]));
    let mut adjusted = vec![0.0; m];
    let mut least = 0.0_f64;
    for (index, i) in order.into_iter().enumerate() {
        least = least.max(((m - index) as f64 * probabilities[i]).min(1.0));
        adjusted[i] = least;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holm_adjustment_matches_r() {
        // R: p.adjust(c(.01, .04, .03, .005), "holm") = .03 .06 .06 .02.
        let adjusted = holm(&[0.01, 0.04, 0.03, 0.005]);
        for (found, expected) in adjusted.iter().zip([0.03, 0.06, 0.06, 0.02]) {
            assert!((found - expected).abs() < 1e-15, "{adjusted:?}");
        }
        assert_eq!(holm(&[0.6, 0.7]), [1.0, 1.0]);
        assert_eq!((holm(&[]), holm(&[0.2])), (vec![], vec![0.2]));
    }
}
