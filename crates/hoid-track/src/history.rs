//! The latest values of a signal, the newest first.

use hoid_core::state::{State, visit_all};

/// Largest magnitude of a value in a recursion. The fourth power of such a value is finite, and therefore so are the
/// covariances of filtered signals.
const MAX_MAGNITUDE: f64 = 1e60;

/// Limits the magnitude of a value to 1e60; NaN, which products of large numbers may give, becomes zero.
pub fn limit_magnitude(x: f64) -> f64 {
    if x.is_nan() {
        0.0
    } else {
        x.clamp(-MAX_MAGNITUDE, MAX_MAGNITUDE)
    }
}

/// The last n values in one slice. Each value is stored twice, n elements apart, so no values have to be moved.
#[derive(Debug, Clone)]
pub struct History {
    values: Vec<f64>,
    n: usize,
    at: usize,
}

impl State for History {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(&mut [&mut self.values.as_mut_slice(), &mut self.at], each);
        self.at = self.at.min(self.n);
    }
}

impl History {
    /// A history of n zeros.
    pub fn new(n: usize) -> Self {
        Self {
            values: vec![0.0; n.saturating_mul(2)],
            n,
            at: 0,
        }
    }

    /// Adds the next value and drops the oldest one.
    pub fn push(&mut self, x: f64) {
        let Some(last) = self.n.checked_sub(1) else { return };
        self.at = self.at.checked_sub(1).unwrap_or(last);
        for at in [self.at, self.at.saturating_add(self.n)] {
            if let Some(place) = self.values.get_mut(at) {
                *place = limit_magnitude(x);
            }
        }
    }

    /// Returns `[x(t), x(t-1), ..., x(t-n+1)]`, where x(t) is the latest value.
    pub fn newest_first(&self) -> &[f64] {
        let from = self.values.get(self.at..).unwrap_or_default();
        from.get(..self.n).unwrap_or_default()
    }
}

/// Returns `sum c_i x(t-i)` over as many terms as there are coefficients.
pub fn weighted_sum(coefficients: &[f64], past: &[f64]) -> f64 {
    coefficients.iter().zip(past).map(|(c, x)| c * x).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn history_holds_the_last_values_newest_first() {
        for n in 0..4 {
            let mut past = History::new(n);
            for t in 1..=9 {
                past.push(f64::from(t));
                let expected: Vec<f64> = (0..n).map(|i| f64::from((t - i as i32).max(0))).collect();
                assert_eq!(past.newest_first(), expected);
            }
        }
    }

    /// The newest values remain within the buffer after invalid numbers were restored.
    #[test]
    fn newest_values_stay_within_the_buffer() {
        let mut past = History::new(3);
        past.visit(&mut |number| *number = 1e18);
        assert_eq!(past.newest_first().len(), 3);
        past.push(1.0);
        assert_eq!(past.newest_first()[0], 1.0);
    }

    #[test]
    fn stored_values_are_finite_and_limited() {
        let mut past = History::new(3);
        [f64::NAN, f64::INFINITY, -1e300].into_iter().for_each(|x| past.push(x));
        assert_eq!(past.newest_first(), [-MAX_MAGNITUDE, MAX_MAGNITUDE, 0.0]);
        assert_eq!(weighted_sum(&[1.0, 1.0], past.newest_first()), 0.0);
    }
}
