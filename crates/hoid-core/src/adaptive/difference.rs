//! Selection of the parameters that changed, in groups, from the difference between present and past.
//!
//! Between past and present, gains, level and dynamics differ by d, with the covariance C (`contrast`) and `W = C^-1`.
//! The data do not distinguish all components of d: a longer delay has nearly the same effect as a combined change in
//! the gains, and a few seconds of data hardly separate the two. Each group (natural frequency and damping; the gains
//! of each input; the delay of each input) is therefore treated as either changed or unchanged; the level always counts
//! as changed. For the set S of the components that changed,
//!
//! `d_S = (W_SS)^-1 (W d)_S`, with the covariance `(W_SS)^-1`,
//!
//! and `chi_S^2 = d' W d - d_S' (W d)_S` is the statistic of the hypothesis that the other components did not change.
//! The set with the smallest `chi_S^2 + 4 |S|` is reported. The penalty of 4 per parameter is between Akaike's penalty,
//! 2, and Schwarz's penalty, the logarithm of the number of samples (*Annals of Statistics* 6 (1978) 461-464).

use hoid_numerics::{cholesky, products::dot};

use super::{
    contrast::Contrast,
    sizes::{GAIN_COUNT, LINEAR_COUNT, STATE_COUNT, delay_place, input_count, input_of},
};

/// Penalty per changed parameter.
const PARAMETER_PENALTY: f64 = 4.0;

/// Group of parameters that change together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterGroup {
    /// Gains of the response to an input.
    Gains(usize),
    /// Natural frequency and damping of the neuromuscular system, which all responses share.
    System,
    /// Delay of the response to an input.
    Delay(usize),
}

impl ParameterGroup {
    /// Returns the group of a place in the state; `None` for the level.
    fn of(place: usize) -> Option<Self> {
        match place {
            GAIN_COUNT => None,
            LINEAR_COUNT..STATE_COUNT if place != delay_place(0) => Some(Self::System),
            _ => {
                let input = input_of(place);
                Some(match place == delay_place(input) {
                    true => Self::Delay(input),
                    false => Self::Gains(input),
                })
            }
        }
    }

    /// Bit of the group in the index of a set of groups.
    fn bit(self) -> u64 {
        1 << match self {
            Self::Gains(0) => 0,
            Self::System => 1,
            Self::Gains(input) => 1 + 2 * input,
            Self::Delay(input) => 2 + 2 * input,
        }
    }
}

/// Parameters that changed, with the sizes of their changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference<const S: usize> {
    /// Changes in all states; zero for parameters that did not change.
    pub value: [f64; S],
    /// Covariance of `value`.
    pub covariance: [[f64; S]; S],
    /// Bits of the groups that changed.
    changed: u64,
}

crate::state!([const S: usize] Difference<S> { value, covariance, changed });

impl<const S: usize> Default for Difference<S> {
    fn default() -> Self {
        Self {
            value: [0.0; S],
            covariance: [[0.0; S]; S],
            changed: 0,
        }
    }
}

impl<const S: usize> Difference<S> {
    /// True if a group of parameters changed.
    pub fn has_changed(&self, group: ParameterGroup) -> bool {
        self.changed & group.bit() > 0
    }

    /// Selects the parameters that changed. Returns `None` if the covariance of the contrast is not positive definite.
    pub(super) fn of(contrast: &Contrast<S>) -> Option<Self> {
        let (d, mut factor) = (contrast.difference, contrast.covariance);
        if !cholesky::factor(&mut factor, S) {
            return None;
        }
        let w = cholesky::scaled_inverse(&factor, S, 1.0);
        let mut best = None;
        let mut least = f64::MAX;
        // The loop covers all sets of groups except the empty set.
        for set in 1..ParameterGroup::Gains(input_count(S)).bit() {
            let is_in = |i: usize| ParameterGroup::of(i).is_none_or(|group| set & group.bit() > 0);
            let (mut places, mut n) = ([0; S], 0);
            for i in (0..S).filter(|i| is_in(*i)) {
                places[n] = i;
                n += 1;
            }
            let mut own = [[0.0; S]; S];
            let mut of_d = [0.0; S];
            for (a, i) in places[..n].iter().enumerate() {
                for (b, j) in places[..n].iter().enumerate() {
                    own[a][b] = w[*i][*j];
                }
                of_d[a] = (0..S).map(|j| w[*i][j] * d[j]).sum();
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
                    changed: set,
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
    fn contrast(difference: [f64; STATE_COUNT]) -> Contrast<STATE_COUNT> {
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

    fn changed<const S: usize>(difference: &Difference<S>) -> std::vec::Vec<ParameterGroup> {
        let inputs = (0..input_count(S)).flat_map(|input| [ParameterGroup::Gains(input), ParameterGroup::Delay(input)]);
        let all = inputs.chain([ParameterGroup::System]);
        all.filter(|group| difference.has_changed(*group)).collect()
    }

    #[test]
    fn input_that_changed_is_named() {
        use crate::adaptive::sizes::state_count;
        const S: usize = state_count(2);
        let of = |place: usize| {
            let mut contrast = Contrast::<S>::default();
            (0..S).for_each(|i| contrast.covariance[i][i] = 0.02);
            contrast.difference[place] = 1.5;
            changed(&Difference::of(&contrast).unwrap())
        };
        assert_eq!(of(1), [ParameterGroup::Gains(0)]);
        assert_eq!(of(4), [ParameterGroup::System]);
        assert_eq!(of(6), [ParameterGroup::Delay(0)]);
        assert_eq!(of(8), [ParameterGroup::Gains(1)]);
        assert_eq!(of(10), [ParameterGroup::Delay(1)]);
    }

    #[test]
    fn smallest_explaining_set_of_changes_is_reported() {
        // Only the delay changed; compared with their own errors, neither the gains nor the delay differs by much.
        let reported = Difference::of(&contrast([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.5])).unwrap();
        assert_eq!(changed(&reported), [ParameterGroup::Delay(0)]);
        assert!((reported.value[6] - 1.5).abs() < 1e-9 && reported.value[0] == 0.0);
        // The variance of the delay for known gains is far less than its marginal variance, 1.82.
        assert!(reported.covariance[6][6] < 0.1, "{}", reported.covariance[6][6]);
        let reported = Difference::of(&contrast([0.0, 1.5, 0.0, 0.0, 2.0, 0.0, 0.0])).unwrap();
        assert_eq!(changed(&reported), [ParameterGroup::Gains(0), ParameterGroup::System]);
        // If all groups changed, the difference itself is reported.
        let difference = [2.0, 2.0, 2.0, 2.0, 2.0, 2.0, -12.0];
        let reported = Difference::of(&contrast(difference)).unwrap();
        assert_eq!(changed(&reported).len(), 3);
        for (i, value) in reported.value.iter().enumerate() {
            assert!((value - difference[i]).abs() < 1e-9);
        }
    }

    #[test]
    fn empty_contrast_has_no_difference() {
        assert!(Difference::of(&Contrast::<STATE_COUNT>::default()).is_none());
    }
}
