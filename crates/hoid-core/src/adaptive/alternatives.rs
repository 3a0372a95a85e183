//! Alternative operators that predict u about as well as the estimate.
//!
//! The covariance of an estimate describes one mode of the likelihood. For poles and delay the likelihood has several
//! modes, and the response of people below 10 rad/s carries little information about which mode is right. The operators
//! rejected in trials from other starting points therefore widen the reported errors, each with the weight
//! `w = exp(-deficit/TEMPERATURE_NATS) f^2`. Here `deficit` is the evidence of the estimate minus that of the rejected
//! operator, and f is the fraction of the currently replayed samples that had been read at the time of the trial. The
//! scatter about the estimate is `sum w d d'/(1 + sum w)`, where d is the difference between the operator and the
//! estimate. The evidence is tempered, since it assumes that the model is right (P. Grunwald and T. van Ommen,
//! *Bayesian Analysis* 12 (2017) 1069-1103). The factor f^2 gradually removes results that later samples have
//! superseded.

use super::sizes::{PARAMETER_COUNT, START_COUNT};

/// Deficit of evidence, in nats, at which the weight of an alternative has fallen to 1/e.
const TEMPERATURE_NATS: f64 = 3.0;

/// Operator rejected in a trial from another starting point.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Alternative<const I: usize> {
    operators: [[f64; PARAMETER_COUNT]; I],
    deficit: f64,
    samples: u64,
    known: bool,
}

crate::state!([const I: usize] Alternative<I> { operators, deficit, samples, known });

/// Operators rejected in the last trial from each starting point.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Alternatives<const I: usize> {
    all: [Alternative<I>; START_COUNT],
}

crate::state!([const I: usize] Alternatives<I> { all });

impl<const I: usize> Alternatives<I> {
    pub const EMPTY: Self = Self {
        all: [Alternative {
            operators: [[0.0; PARAMETER_COUNT]; I],
            deficit: 0.0,
            samples: 0,
            known: false,
        }; START_COUNT],
    };

    /// Stores the responses to all inputs rejected in the trial from a starting point, with their deficit of evidence
    /// and the number of samples read by then.
    pub fn store(&mut self, start: usize, operators: [[f64; PARAMETER_COUNT]; I], deficit: f64, samples: u64) {
        if let Some(place) = self.all.get_mut(start) {
            *place = Alternative {
                operators,
                deficit: deficit.max(0.0),
                samples,
                known: true,
            };
        }
    }

    /// Returns the weighted scatter of the alternatives about the operator of an input. `samples` is the current number
    /// of samples; the last `window` of them are replayed.
    pub fn scatter(
        &self,
        input: usize,
        about: &[f64; PARAMETER_COUNT],
        samples: u64,
        window: u64,
    ) -> [[f64; PARAMETER_COUNT]; PARAMETER_COUNT] {
        let mut scatter = [[0.0; PARAMETER_COUNT]; PARAMETER_COUNT];
        let mut weights = 1.0;
        for other in self.all.iter().filter(|other| other.known) {
            let since = samples.saturating_sub(other.samples) as f64;
            let share = (1.0 - since / samples.min(window).max(1) as f64).max(0.0);
            let weight = libm::exp(-other.deficit / TEMPERATURE_NATS) * share * share;
            weights += weight;
            let own = &other.operators[input];
            for i in 0..PARAMETER_COUNT {
                for j in 0..PARAMETER_COUNT {
                    scatter[i][j] += weight * (own[i] - about[i]) * (own[j] - about[j]);
                }
            }
        }
        scatter.map(|row| row.map(|s| s / weights))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alternatives_are_weighted_by_prediction_and_age() {
        let about = [0.1, 0.04, 11.0, 0.3, 0.28];
        let mut all = Alternatives::EMPTY;
        assert_eq!(
            all.scatter(0, &about, 100, 150),
            [[0.0; PARAMETER_COUNT]; PARAMETER_COUNT]
        );
        let mut other = about;
        other[2] = 13.0;
        all.store(0, [other], 0.0, 100);
        assert!((all.scatter(0, &about, 100, 150)[2][2] - 2.0).abs() < 1e-12);
        // If half of the replayed samples are new, its weight is 1/4; if all are, it is zero.
        assert!((all.scatter(0, &about, 175, 150)[2][2] - 0.8).abs() < 1e-12);
        assert_eq!(all.scatter(0, &about, 250, 150)[2][2], 0.0);
        // With a much larger deficit, the same operator has almost no weight.
        all.store(0, [other], 300.0, 200);
        assert!(all.scatter(0, &about, 200, 150)[2][2] < 1e-9);
        all.store(START_COUNT, [other], 0.0, 200);
    }
}
