//! A stick that rests, and a channel that is frozen: both stay constant, and only one of them is a fault.
//!
//! A stick with a dead zone rests at its centre, and one that is pushed to its end rests there. Such values are atoms
//! of the distribution of u: u comes back to them often, and stays. The last [`ATOMS`] values at which u represented
//! `LEAST_S` or more are kept, each with the number of its rests n, their sum s and the longest of them, l. A stand of
//! length T is a **rest**, and no fault, where
//!
//! `n >= 3`, `s >= .05 t`, `T < max(8 s, 2 l)`
//!
//! after t seconds. A frozen channel is at whatever the value was, to which u never came back before or hardly ever,
//! for a distribution without an atom there gives it probability zero; and one that froze within a rest is stationary
//! longer than the person ever rested. For a longest of n equally distributed rests the next one is larger with
//! probability 1/(n+1), whatever their distribution (order statistics; H. A. David and H. N. Nagaraja, *Order
//! Statistics*, 2003, §2.1); twice as long it is, with exponential rests, with a probability of about `2/((n+1)(n+2))`.
//! The least of 8 s is for the time in which only a few rests have been seen.
//!
//! A rest is judged by who calls: e has to move on meanwhile, and the innovations must be no larger than typical.

/// Values that are kept.
pub const ATOMS: usize = 4;
/// Least length of a rest, s.
const LEAST_S: f64 = 0.1;
/// Rests at a value, and their share of the time, that make it an atom.
const RESTS: u32 = 3;
const SHARE: f64 = 0.05;
/// Longest rest that is always believed at an atom, s, and in units of the longest so far.
const BELIEVED_S: f64 = 8.0;
const LONGER: f64 = 2.0;

/// A value at which u has rested.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Atom {
    value: f64,
    rests: u32,
    /// Samples of its rests, and of the longest.
    samples: u64,
    longest: u64,
}

crate::state!([] Atom { value, rests, samples, longest });

/// The rests of u.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resting {
    sample_time: f64,
    /// Distance within which two values are one.
    tolerance: f64,
    atoms: [Atom; ATOMS],
    samples: u64,
    /// The value at which u is stationary, and for how long.
    value: f64,
    stands: u64,
    /// True if the stand is not to be learnt.
    doubted: bool,
}

crate::state!([] Resting { tolerance, atoms, samples, value, stands, doubted });

impl Resting {
    /// Nothing is known.
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

    /// Values that are so near to each other are one.
    pub fn set_tolerance(&mut self, tolerance: f64) {
        self.tolerance = tolerance;
    }

    /// Takes a sample of u; one that is not a number ends a stand.
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

    /// The current stand is not a rest: it is not learnt.
    pub fn doubt(&mut self) {
        self.doubted = true;
    }

    /// The stand that is over enters the values; where there is no room, in place of the one with the least time.
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

    /// Where the current value is kept.
    fn place(&self) -> Option<usize> {
        let known = |atom: &Atom| atom.rests > 0 && (atom.value - self.value).abs() <= self.tolerance;
        self.atoms.iter().position(known)
    }

    /// True while u is stationary as the person rests.
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
        // The time before this stand.
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

    /// The time after which a are at a value is not a rest, s.
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
        // Never there, and there once.
        assert!(told_after(resting, 0.37) == 0.0);
        assert!(told_after(person(&[150]), 0.0) == 0.0);
    }

    /// A signal that was seen to be at many values for a moment, as one of a coarse converter does.
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
