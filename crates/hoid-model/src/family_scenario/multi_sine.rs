//! Sums of sines at prime multiples of one frequency, as used in experiments with people.
//!
//! `d(t) = sum over primes p of A_p sin(2 pi p t/T + phi_p)` with `A_p` proportional to `1/p`. No line is a harmonic of
//! another, so the harmonics of a nonlinear response to one line do not fall on another line. Most of the power is at
//! low frequencies, which people can follow (D. T. McRuer and H. R. Jex, IEEE Trans. Human Factors in Electronics 8
//! (1967) 231-249; M. M. van Paassen and M. Mulder, *Identification of Human Control Behaviour*, 2006; M. Yamagami et
//! al., IEEE Trans. Cybernetics 53 (2023) 2039-2050 with primes times 0.05 Hz). The phases are random in each run, so
//! the signal cannot be memorised.

use std::f64::consts::TAU;

use crate::{
    ModelError,
    forcing::{ForcingFunction, Sinusoid},
};

/// A target or a disturbance.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Excitation {
    /// Sinusoids of the signal; empty if there is no signal.
    pub function: ForcingFunction,
    /// True if new phases, uniform over the circle, are drawn for each run.
    pub random_phases: bool,
}

/// A sum of sines at prime multiples of `1/period_s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MultiSine {
    /// Period T, s. Default 20 s.
    pub period_s: f64,
    /// Largest multiple of 1/T. Default 31, which is 1.55 Hz for the default period.
    pub largest: u32,
    /// Root mean square of the signal. Default 1.
    pub rms: f64,
    /// Primes that are used as multiples. Default: all primes.
    pub interleaved: Interleaved,
}

/// Selection of primes, by which a target and a disturbance can have different lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Interleaved {
    /// All primes.
    #[default]
    All,
    /// The second, fourth, ... prime number: 3, 7, 13 ...
    Even,
    /// The first, third, ... prime number: 2, 5, 11 ...
    Odd,
}

crate::named_choice!(Interleaved, "lines of a multi-sine", 3, { All => "all", Even => "even", Odd => "odd" });

impl Default for MultiSine {
    fn default() -> Self {
        Self {
            period_s: 20.0,
            largest: 31,
            rms: 1.0,
            interleaved: Interleaved::All,
        }
    }
}

impl MultiSine {
    /// Returns the primes in use, up to the largest multiple.
    pub fn multiples(&self) -> Vec<u32> {
        let is_prime = |n: &u32| (2..).take_while(|d| d * d <= *n).all(|d| !n.is_multiple_of(d));
        let (from, step) = match self.interleaved {
            Interleaved::All => (0, 1),
            Interleaved::Even => (1, 2),
            Interleaved::Odd => (0, 2),
        };
        (2..=self.largest).filter(is_prime).skip(from).step_by(step).collect()
    }

    /// Returns the excitation; its phases are random in each run.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] for a period that is not positive or not finite, an rms that is negative or not
    /// finite, or a largest multiple outside 2 to 10000 or below the first selected prime.
    pub fn excitation(&self) -> Result<Excitation, ModelError> {
        let refuse = |quantity, found, expected| {
            Err(ModelError::OutOfRange {
                quantity,
                found,
                expected,
            })
        };
        if !(self.period_s.is_finite() && self.period_s > 0.0) {
            return refuse("period of a multi-sine in s", self.period_s, "a positive finite number");
        }
        if !(self.rms.is_finite() && self.rms >= 0.0) {
            return refuse("rms of a multi-sine", self.rms, "a finite number, zero or more");
        }
        if !(2..=10_000).contains(&self.largest) || self.multiples().is_empty() {
            let found = f64::from(self.largest);
            return refuse(
                "largest multiple of a multi-sine",
                found,
                "2 to 10000, with at least one prime among the multiples",
            );
        }
        let multiples = self.multiples();
        let power: f64 = multiples.iter().map(|p| f64::from(*p).powi(-2) / 2.0).sum();
        let line = |p: &u32| Sinusoid {
            amplitude_deg: self.rms / power.sqrt() / f64::from(*p),
            omega_rad_s: f64::from(*p) * TAU / self.period_s,
            phase_rad: 0.0,
        };
        Ok(Excitation {
            function: ForcingFunction::new(multiples.iter().map(line).collect())?,
            random_phases: true,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multiples_are_primes_and_amplitudes_decrease() {
        let sum = MultiSine::default();
        assert_eq!(sum.multiples(), [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31]);
        let excitation = sum.excitation().unwrap();
        assert!(excitation.random_phases);
        assert!((excitation.function.rms_deg() - 1.0).abs() < 1e-14);
        let lines = excitation.function.sinusoids();
        assert!((lines[0].omega_rad_s - 0.2 * std::f64::consts::PI).abs() < 1e-14);
        assert!((lines[10].amplitude_deg * 31.0 - lines[0].amplitude_deg * 2.0).abs() < 1e-14);
    }

    #[test]
    fn interleaved_lines_are_disjoint() {
        let of = |interleaved| MultiSine {
            interleaved,
            ..MultiSine::default()
        };
        let (even, odd) = (of(Interleaved::Even), of(Interleaved::Odd));
        assert_eq!(even.multiples(), [3, 7, 13, 19, 29]);
        assert_eq!(odd.multiples(), [2, 5, 11, 17, 23, 31]);
        assert!((even.excitation().unwrap().function.rms_deg() - 1.0).abs() < 1e-14);
        let none = MultiSine { largest: 2, ..even };
        assert!(none.excitation().is_err());
    }

    #[test]
    fn invalid_multisines_are_refused() {
        let default = MultiSine::default();
        for bad in [
            MultiSine {
                period_s: 0.0,
                ..default
            },
            MultiSine {
                rms: f64::NAN,
                ..default
            },
            MultiSine { largest: 1, ..default },
        ] {
            assert!(bad.excitation().is_err(), "{bad:?}");
        }
    }
}
