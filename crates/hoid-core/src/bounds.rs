//! Limit of a number to an interval, without a panic.

/// Limits a value to an interval. A bound that is NaN has no effect. If the bounds are reversed, as they can be after a
/// damaged file has been loaded, the upper bound applies, whereas [`f64::clamp`] panics.
#[inline]
pub fn clamp(value: f64, [low, high]: [f64; 2]) -> f64 {
    value.max(low).min(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_and_reversed_bounds_are_handled() {
        assert_eq!([-1.0, 0.5, 3.0].map(|x| clamp(x, [0.0, 2.0])), [0.0, 0.5, 2.0]);
        assert_eq!(clamp(5.0, [f64::NAN, 2.0]), 2.0);
        assert_eq!(clamp(5.0, [0.0, f64::NAN]), 5.0);
        assert_eq!(clamp(5.0, [3.0, 1.0]), 1.0);
    }
}
