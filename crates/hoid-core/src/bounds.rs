//! A number within its bounds.

/// Limits a value to two bounds. A bound that is not a number has no effect, and the upper one wins if they are
/// reversed, as in the numbers of a damaged save: [`f64::clamp`] panics there.
#[inline]
pub fn within(value: f64, [low, high]: [f64; 2]) -> f64 {
    value.max(low).min(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_of_any_kind_do_no_harm() {
        assert_eq!([-1.0, 0.5, 3.0].map(|x| within(x, [0.0, 2.0])), [0.0, 0.5, 2.0]);
        assert_eq!(within(5.0, [f64::NAN, 2.0]), 2.0);
        assert_eq!(within(5.0, [0.0, f64::NAN]), 5.0);
        assert_eq!(within(5.0, [3.0, 1.0]), 1.0);
    }
}
