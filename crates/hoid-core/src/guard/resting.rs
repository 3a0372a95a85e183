//! A resting stick and a frozen channel: both signals stay constant, but only a frozen channel is a fault.
//!
//! A stick with a dead zone rests at its centre, and one that is pushed to its end rests there. Such values are atoms
//! of the distribution of u: u returns to them often, and stays. The last [`ATOMS`] values at which u stayed for
//! `LEAST_S` or more are kept, each with the number of its rests n, their sum s and the longest of them, l. A constant
//! span of length T is a **rest**, and no fault, if
//!
//! `n >= 3`, `s >= .05 t`, `T < max(8 s, 2 l)`
//!
//! after t seconds. A frozen channel has an arbitrary value, which u has never or hardly ever had before, since a
//! distribution without an atom there gives that value probability zero; and a channel that freezes within a rest is
//! constant for longer than the person ever rested. The next rest is longer than the longest of n identically
//! distributed rests with probability 1/(n+1), whatever their distribution (order statistics; H. A. David and H. N.
//! Nagaraja, *Order Statistics*, 2003, §2.1); for exponential rests, it is twice as long with a probability of about
//! `2/((n+1)(n+2))`. The minimum of 8 s is for the time in which only a few rests have been observed.
//!
//! The caller checks the other conditions of a rest: e has to move meanwhile, and the innovations must be no larger
//! than typical.

/// Number of values that are kept.
pub const ATOMS: usize = 4;
/// Least length of a rest, s.
const LEAST_S: f64 = 0.1;
/// Number of rests at a value, and their share of the time, that make it an atom.
const RESTS: u32 = 3;
const SHARE: f64 = 0.05;
/// Longest rest at an atom that is always accepted, s, and the same in units of the longest so far.
const BELIEVED_S: f64 = 8.0;
const LONGER: f64 = 2.0;

/// A value at which u has rested.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Atom {
    value: f64,
    rests: u32,
    /// Number of samples of its rests, and of the longest.
    samples: u64,
    longest: u64,
}

crate::state!([] Atom { value, rests, samples, longest });

/// The rests of u.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resting {
    sample_time: f64,
    /// Distance up to which two values are equal.
    tolerance: f64,
    atoms: [Atom; ATOMS],
    samples: u64,
    /// The current value of u, and how long it has been constant.
    value: f64,
    stands: u64,
    /// True if the constant span is not to be learnt.
    doubted: bool,
}

crate::state!([] Resting { tolerance, atoms, samples, value, stands, doubted });

impl Resting {
    /// An empty list of rests.
    pub fn new(sample_time: f64) -> Self {
        Self {
            sample_time,
            tolerance: 0.0,
            atoms: [Atom::default(); ATOMS],
            samples: 0,
            value: 0.0,
            stands: 0,
            doubted: false,
        }
    }

    /// Sets the distance up to which two values are equal.
    pub fn set_tolerance(&mut self, tolerance: f64) {
        self.tolerance = tolerance;
    }

    /// Takes a sample of u; NaN ends a constant span.
    #[inline]
    pub fn take(&mut self, u: f64) {
        self.samples += 1;
        if self.stands > 0 && (u - self.value).abs() <= self.tolerance {
            self.stands += 1;
        } else {
            if self.stands as f64 * self.sample_time >= LEAST_S && !self.doubted {
                self.learn();
            }
            (self.value, self.stands) = if u.is_finite() { (u, 1) } else { (0.0, 0) };
            self.doubted = false;
        }
    }

    /// Marks the current constant span as no rest: it is not learnt.
    pub fn doubt(&mut self) {
        self.doubted = true;
    }

    /// Learns the constant span that has ended; if the list is full, it replaces the value with the least time.
    fn learn(&mut self) {
        let place = self.place().unwrap_or_else(|| {
            let least = (0..ATOMS).min_by_key(|i| self.atoms[*i].samples).unwrap_or(0);
            self.atoms[least] = Atom {
                value: self.value,
                ..Atom::default()
            };
            least
        });
        let (atom, stands) = (&mut self.atoms[place], self.stands);
        atom.rests = atom.rests.saturating_add(1);
        atom.samples += stands;
        atom.longest = atom.longest.max(stands);
    }

    /// Index of the current value.
    fn place(&self) -> Option<usize> {
        let known = |atom: &Atom| atom.rests > 0 && (atom.value - self.value).abs() <= self.tolerance;
        self.atoms.iter().position(known)
    }

    /// True while u is constant because the person rests.
    pub fn is_rest(&self) -> bool {
        let Some(place) = self.place() else {
            return false;
        };
        let Atom {
            rests,
            samples,
            longest,
            ..
        } = self.atoms[place];
        let stands = self.stands as f64 * self.sample_time;
        let believed = (LONGER * longest as f64 * self.sample_time).max(BELIEVED_S);
        // The time before this constant span.
        let time = self.samples.saturating_sub(self.stands) as f64;
        self.stands > 0 && rests >= RESTS && samples as f64 >= SHARE * time && stands < believed && !self.doubted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2 s of movement and a rest at zero of the given lengths, in samples of 10 ms.
    fn person(rests: &[u64]) -> Resting {
        let mut resting = Resting::new(0.01);
        for rest in rests {
            (0..200).for_each(|k| resting.take(libm::sin(f64::from(k) * 0.1 + 0.05)));
            (0..*rest).for_each(|_| resting.take(0.0));
        }
        (0..200).for_each(|k| resting.take(libm::sin(f64::from(k) * 0.1 + 0.05)));
        resting
    }

    /// The time after which a constant span at a value is no longer a rest, s.
    fn told_after(mut resting: Resting, value: f64) -> f64 {
        let last = (1..10_000).take_while(|_| {
            resting.take(value);
            resting.is_rest()
        });
        last.count() as f64 * 0.01
    }

    #[test]
    fn a_stick_rests_where_it_often_did_and_not_for_ever() {
        let resting = person(&[60, 150, 80, 120]);
        assert!((told_after(resting, 0.0) - 8.0).abs() < 0.02);
        assert!((told_after(person(&[60, 600, 80, 120]), 0.0) - 12.0).abs() < 0.02);
        // A new value, and one with a single rest.
        assert!(told_after(resting, 0.37) == 0.0);
        assert!(told_after(person(&[150]), 0.0) == 0.0);
    }

    /// A signal with many values for a moment each, as from a coarse converter.
    #[test]
    fn values_of_a_coarse_signal_are_no_atoms() {
        let mut resting = Resting::new(0.01);
        for k in 0_u32..400 {
            let value = f64::from(k.wrapping_mul(2_654_435_761) >> 26);
            (0..12).for_each(|_| resting.take(value));
        }
        for value in [0.0, 7.0, 33.0, 63.0] {
            assert!(told_after(resting, value) == 0.0, "{value}");
        }
    }

    #[test]
    fn a_doubted_stand_is_not_learnt_and_no_number_is_no_rest() {
        let mut resting = person(&[60, 150, 80]);
        (0..3000).for_each(|_| resting.take(0.0));
        resting.doubt();
        resting.take(1.0);
        assert!((told_after(resting, 0.0) - 8.0).abs() < 0.02);
        resting.take(f64::NAN);
        assert!(!resting.is_rest());
        assert!(!Resting::new(0.01).is_rest());
    }
}
