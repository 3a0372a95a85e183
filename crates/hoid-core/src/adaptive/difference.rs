//! Selection of the parameters that changed, in groups, from the difference between present and past.
//!
//! Between past and present, gains, level and dynamics differ by d, with the covariance C (`contrast`) and `W = C^-1`.
//! The data do not distinguish all components of d: a longer delay has nearly the same effect as a combined change of
//! the gains, and a few seconds of data hardly separate the two. Each group (the gains; natural frequency and damping;
//! the delay) is therefore treated as either changed or unchanged; the level always counts as changed. For the set S of
//! the components that changed,
//!
//! `d_S = (W_SS)^-1 (W d)_S`, with the covariance `(W_SS)^-1`,
//!
//! and `chi_S^2 = d' W d - d_S' (W d)_S` is the statistic of the hypothesis that the other components did not change.
//! The set with the smallest `chi_S^2 + 4 |S|` is reported. The penalty of 4 per parameter is between Akaike's penalty,
//! 2, and Schwarz's penalty, the logarithm of the number of samples (*Annals of Statistics* 6 (1978) 461-464).

use hoid_numerics::{cholesky, products::dot};

use super::{
    contrast::Contrast,
    sizes::{GAIN_COUNT, LINEAR_COUNT, STATE_COUNT},
};

/// Penalty per changed parameter.
const PARAMETER_PENALTY: f64 = 4.0;
/// Number of possible sets of changed groups (gains, neuromuscular system, delay); each group is one bit of the index
/// of the set.
const SET_COUNT: usize = 8;
const GAINS_BIT: usize = 1;
const SYSTEM_BIT: usize = 2;
const DELAY_BIT: usize = 4;

/// Parameters that changed, with the sizes of their changes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Difference {
    /// Changes of gains, level, natural frequency, damping and delay; zero for parameters that did not change.
    pub value: [f64; STATE_COUNT],
    /// Covariance of `value`.
    pub covariance: [[f64; STATE_COUNT]; STATE_COUNT],
    /// Whether the gains, the neuromuscular system (natural frequency and damping) and the delay changed.
    pub changed: [bool; 3],
}

crate::state!([] Difference { value, covariance, changed });

impl Difference {
    /// Selects the parameters that changed. Returns `None` if the covariance of the contrast is not positive definite.
    pub(super) fn of(contrast: &Contrast) -> Option<Self> {
        let (d, mut factor) = (contrast.difference, contrast.covariance);
        if !cholesky::factor(&mut factor, STATE_COUNT) {
            return None;
        }
        let w = cholesky::scaled_inverse(&factor, STATE_COUNT, 1.0);
        let mut best = None;
        let mut least = f64::MAX;
        // The loop covers all sets of groups except the empty set.
        for set in 1..SET_COUNT {
            let is_in = |i: usize| match i {
                0..GAIN_COUNT => set & GAINS_BIT > 0,
                GAIN_COUNT => true,
                LINEAR_COUNT | 5 => set & SYSTEM_BIT > 0,
                _ => set & DELAY_BIT > 0,
            };
            let (mut places, mut n) = ([0; STATE_COUNT], 0);
            for i in (0..STATE_COUNT).filter(|i| is_in(*i)) {
                places[n] = i;
                n += 1;
            }
            let mut own = [[0.0; STATE_COUNT]; STATE_COUNT];
            let mut of_d = [0.0; STATE_COUNT];
            for (a, i) in places[..n].iter().enumerate() {
                for (b, j) in places[..n].iter().enumerate() {
                    own[a][b] = w[*i][*j];
                }
                of_d[a] = (0..STATE_COUNT).map(|j| w[*i][j] * d[j]).sum();
            }
            if !cholesky::factor(&mut own, n) {
                continue;
            }
            let mut of_set = of_d;
            cholesky::solve(&own, n, &mut of_set);
            let cost = PARAMETER_PENALTY * n as f64 - dot(&of_set[..n], &of_d);
            if cost < least {
                least = cost;
                let mut difference = Self {
                    changed: [GAINS_BIT, SYSTEM_BIT, DELAY_BIT].map(|bit| set & bit > 0),
                    ..Self::default()
                };
                let inverse = cholesky::scaled_inverse(&own, n, 1.0);
                for (a, i) in places[..n].iter().enumerate() {
                    difference.value[*i] = of_set[a];
                    for (b, j) in places[..n].iter().enumerate() {
                        difference.covariance[*i][*j] = inverse[a][b];
                    }
                }
                best = Some(difference);
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Returns a contrast in which the delay is poorly distinguished from the gains.
    fn contrast(difference: [f64; STATE_COUNT]) -> Contrast {
        let mut covariance = [[0.0; STATE_COUNT]; STATE_COUNT];
        for (i, row) in covariance.iter_mut().enumerate() {
            row[i] = 0.02;
        }
        for i in [0, 6] {
            for j in [0, 6] {
                covariance[i][j] += if i == j { 1.8 } else { 1.798 };
            }
        }
        Contrast {
            difference,
            covariance,
            ..Contrast::default()
        }
    }

    #[test]
    fn smallest_explaining_set_of_changes_is_reported() {
        // Only the delay changed; compared with their own errors, neither the gains nor the delay differ by much.
        let reported = Difference::of(&contrast([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.5])).unwrap();
        assert_eq!(reported.changed, [false, false, true]);
        assert!((reported.value[6] - 1.5).abs() < 1e-9 && reported.value[0] == 0.0);
        // The variance of the delay for known gains is far less than its marginal variance, 1.82.
        assert!(reported.covariance[6][6] < 0.1, "{}", reported.covariance[6][6]);
        let reported = Difference::of(&contrast([0.0, 1.5, 0.0, 0.0, 2.0, 0.0, 0.0])).unwrap();
        assert_eq!(reported.changed, [true, true, false]);
        // If all groups changed, the difference itself is reported.
        let difference = [2.0, 2.0, 2.0, 2.0, 2.0, 2.0, -12.0];
        let reported = Difference::of(&contrast(difference)).unwrap();
        assert_eq!(reported.changed, [true; 3]);
        for (i, value) in reported.value.iter().enumerate() {
            assert!((value - difference[i]).abs() < 1e-9);
        }
    }

    #[test]
    fn empty_contrast_has_no_difference() {
        assert!(Difference::of(&Contrast::default()).is_none());
    }
}
