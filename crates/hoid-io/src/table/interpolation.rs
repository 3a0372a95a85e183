//! Linear interpolation between two values.

/// Returns the value at a share of the way from a to b.
pub(crate) fn interpolate(a: f64, b: f64, share: f64) -> f64 {
    // This form gives exactly a and b at the ends and does not overflow between them.
    a * (1.0 - share) + b * share
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_are_exact_and_large_values_do_not_overflow() {
        for (a, b) in [(0.1, 0.7), (-3.0, 1e-9), (f64::MAX, f64::MIN)] {
            assert_eq!((interpolate(a, b, 0.0), interpolate(a, b, 1.0)), (a, b));
        }
        assert_eq!(interpolate(f64::MAX, f64::MIN, 0.5), 0.0);
    }
}
