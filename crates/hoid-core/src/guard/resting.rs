//! Distinction between a resting stick and a frozen channel: in both cases the signal stays constant, but only a frozen
//! channel is a fault.
//!
//! A stick with a dead zone rests at its centre, and a stick that is pushed to its end rests there. Such values are
//! atoms of the distribution of u: u often returns to them and stays there. The last [`MAX_ATOMS`] values at which u
//! stayed for `MIN_REST_S` or longer are stored, each with the number n of its rests, their total duration S and the
//! duration l of the longest rest. A constant span of length T is a **rest**, and no fault, if
//!
//! `n >= 3`, `S >= .05 t`, `T < max(8 s, 2 l)`,
//!
//! where t is the time before the span. A frozen channel has an arbitrary value, at which u has never or hardly ever
//! been before, since a distribution without an atom at this value gives it probability zero. A channel that freezes
//! during a rest stays constant for longer than the person ever rested. The next rest is longer than the longest of n
//! independent, identically distributed rests with probability 1/(n+1) for any continuous distribution (order
//! statistics; H. A. David and H. N. Nagaraja, *Order Statistics*, 2003, §2.1). For exponentially distributed rests, it
//! is more than twice as long with probability `2/((n+1)(n+2))`. The minimum of 8 s applies while only a few rests have
//! been observed.
//!
//! The caller checks the other conditions of a rest: e must move during the rest, and the innovations must not be
//! larger than is typical.

/// Number of stored values.
pub const MAX_ATOMS: usize = 4;
/// Minimum duration of a rest in s.
const MIN_REST_S: f64 = 0.1;
/// Minimum number of rests at a value for it to count as an atom; `MIN_TIME_SHARE` is the minimum fraction of the time
/// spent there.
const MIN_RESTS: u32 = 3;
const MIN_TIME_SHARE: f64 = 0.05;
/// A rest at an atom is accepted if it is shorter than `ACCEPTED_REST_S` seconds or than `LONGEST_REST_FACTOR` times
/// the longest rest so far.
const ACCEPTED_REST_S: f64 = 8.0;
const LONGEST_REST_FACTOR: f64 = 2.0;

/// Value at which u has rested.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Atom {
    value: f64,
    rests: u32,
    /// Number of samples in all rests at this value, and in the longest of them.
    samples: u64,
    longest: u64,
}

crate::state!([] Atom { value, rests, samples, longest });

/// Values at which u has rested, and the current constant span.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestDetector {
    sample_time: f64,
    /// Largest difference between two values that count as equal.
    tolerance: f64,
    atoms: [Atom; MAX_ATOMS],
    samples: u64,
    /// Current value of u, and number of samples for which it has been constant.
    value: f64,
    constant_samples: u64,
    /// True if the current constant span must not be learnt.
    rejected: bool,
}

crate::state!([] RestDetector { tolerance, atoms, samples, value, constant_samples, rejected });

impl RestDetector {
    /// Returns an empty list of rests, with the sample time in s.
    pub fn new(sample_time: f64) -> Self {
        Self {
            sample_time,
            tolerance: 0.0,
            atoms: [Atom::default(); MAX_ATOMS],
            samples: 0,
            value: 0.0,
            constant_samples: 0,
            rejected: false,
        }
    }

    /// Sets the largest difference between two values that count as equal.
    pub fn set_tolerance(&mut self, tolerance: f64) {
        self.tolerance = tolerance;
    }

    /// Takes a sample of u. A NaN ends a constant span.
    #[inline]
    pub fn update(&mut self, u: f64) {
        self.samples += 1;
        if self.constant_samples > 0 && (u - self.value).abs() <= self.tolerance {
            self.constant_samples += 1;
        } else {
            if self.constant_samples as f64 * self.sample_time >= MIN_REST_S && !self.rejected {
                self.record_rest();
            }
            (self.value, self.constant_samples) = if u.is_finite() { (u, 1) } else { (0.0, 0) };
            self.rejected = false;
        }
    }

    /// Marks the current constant span as not being a rest, so it is not learnt.
    pub fn reject(&mut self) {
        self.rejected = true;
    }

    /// Learns the constant span that has just ended. If the list of atoms is full and does not contain the value of the
    /// span, this value replaces the atom with the shortest total duration.
    fn record_rest(&mut self) {
        let index = self.atom_index().unwrap_or_else(|| {
            let least = (0..MAX_ATOMS).min_by_key(|i| self.atoms[*i].samples).unwrap_or(0);
            self.atoms[least] = Atom {
                value: self.value,
                ..Atom::default()
            };
            least
        });
        let (atom, constant_samples) = (&mut self.atoms[index], self.constant_samples);
        atom.rests = atom.rests.saturating_add(1);
        atom.samples += constant_samples;
        atom.longest = atom.longest.max(constant_samples);
    }

    /// Index of the current value in the list of atoms; `None` if the list does not contain it.
    fn atom_index(&self) -> Option<usize> {
        let known = |atom: &Atom| atom.rests > 0 && (atom.value - self.value).abs() <= self.tolerance;
        self.atoms.iter().position(known)
    }

    /// True while u is constant because the person is resting at an atom.
    pub fn is_rest(&self) -> bool {
        let Some(index) = self.atom_index() else {
            return false;
        };
        let Atom {
            rests,
            samples,
            longest,
            ..
        } = self.atoms[index];
        let duration_s = self.constant_samples as f64 * self.sample_time;
        let believed = (LONGEST_REST_FACTOR * longest as f64 * self.sample_time).max(ACCEPTED_REST_S);
        // Number of samples before this constant span.
        let time = self.samples.saturating_sub(self.constant_samples) as f64;
        self.constant_samples > 0
            && rests >= MIN_RESTS
            && samples as f64 >= MIN_TIME_SHARE * time
            && duration_s < believed
            && !self.rejected
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the rests of a person who moves for 2 s before each rest at zero; the lengths of the rests are in
    /// samples of 10 ms.
    fn person(rests: &[u64]) -> RestDetector {
        let mut resting = RestDetector::new(0.01);
        for rest in rests {
            (0..200).for_each(|k| resting.update(libm::sin(f64::from(k) * 0.1 + 0.05)));
            (0..*rest).for_each(|_| resting.update(0.0));
        }
        (0..200).for_each(|k| resting.update(libm::sin(f64::from(k) * 0.1 + 0.05)));
        resting
    }

    /// Returns the time in s after which a constant span at a value is no longer a rest.
    fn rest_duration_s(mut resting: RestDetector, value: f64) -> f64 {
        let last = (1..10_000).take_while(|_| {
            resting.update(value);
            resting.is_rest()
        });
        last.count() as f64 * 0.01
    }

    #[test]
    fn rest_is_accepted_at_known_values_for_a_limited_time() {
        let resting = person(&[60, 150, 80, 120]);
        assert!((rest_duration_s(resting, 0.0) - 8.0).abs() < 0.02);
        assert!((rest_duration_s(person(&[60, 600, 80, 120]), 0.0) - 12.0).abs() < 0.02);
        // Neither a new value nor a value with a single rest counts as a rest.
        assert!(rest_duration_s(resting, 0.37) == 0.0);
        assert!(rest_duration_s(person(&[150]), 0.0) == 0.0);
    }

    /// A signal that briefly takes each of many values, as from a coarse converter, does not rest.
    #[test]
    fn quantised_values_are_not_rest_values() {
        let mut resting = RestDetector::new(0.01);
        for k in 0_u32..400 {
            let value = f64::from(k.wrapping_mul(2_654_435_761) >> 26);
            (0..12).for_each(|_| resting.update(value));
        }
        for value in [0.0, 7.0, 33.0, 63.0] {
            assert!(rest_duration_s(resting, value) == 0.0, "{value}");
        }
    }

    #[test]
    fn rejected_rests_and_nan_are_ignored() {
        let mut resting = person(&[60, 150, 80]);
        (0..3000).for_each(|_| resting.update(0.0));
        resting.reject();
        resting.update(1.0);
        assert!((rest_duration_s(resting, 0.0) - 8.0).abs() < 0.02);
        resting.update(f64::NAN);
        assert!(!resting.is_rest());
        assert!(!RestDetector::new(0.01).is_rest());
    }
}
