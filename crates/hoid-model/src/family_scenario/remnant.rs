//! Components of u other than the responses to e, f and y: the remnant, and the drift and the offsets of the stick.
//!
//! The remnant is a sum of independent parts. Each part is a white sequence w of unit variance, passed through a
//! shaping filter and a gain,
//!
//! `n(k) = K G(q) w(k)`, `w = m(k) [sqrt(1 - p) g(k) + sqrt(p) b(k) h(k)/sqrt(lambda Ts)] s(k)/sqrt(D)`,
//!
//! where g and h are normal, b = 1 with probability `lambda Ts` and 0 otherwise (Poisson pulses), and s is 1 or 0 (on
//! or off) for exponentially distributed times with means `T_on` and `T_off`, `D = T_on/(T_on + T_off)`. The factor m
//! is given by `m^2 = 1 - c + c r^2/E r^2`, where r^2 is the running mean square of u or of its rate and `E r^2` is its
//! mean over the whole run. The factors of g(k) and h(k) are independent of g(k) and h(k). Therefore w is white with
//! unit variance, and the filter alone determines the spectrum and the strength of the remnant.
//!
//! | part | source |
//! |---|---|
//! | broad band, `1/(T_n s + 1)^m` | eq. 3 of the thesis; W. H. Levison, S. Baron and D. L. Kleinman, IEEE Trans. Man-Machine Systems 10 (1969) 101-108 |
//! | peak near omega_nm | tremor in the pass band of the neuromuscular loop: R. E. Magdaleno and D. T. McRuer, NASA CR-1757 (1971) |
//! | slow drift | `1/(T_n s + 1)` with T_n of many seconds |
//! | signal-dependent | C. M. Harris and D. M. Wolpert, Nature 394 (1998) 780-784; Levison et al. for the scaling with the signals |
//! | pulses | L. R. Young and J. L. Meiry, IEEE Trans. Automatic Control 10 (1965) 336-341; R. A. Hess, J. Guidance and Control 2 (1979) 221-227 |
//! | on and off | P. Gawthrop, I. Loram, M. Lakie and H. Gollee, Biological Cybernetics 104 (2011) 31-51 |

use crate::{ModelError, polynomial, remnant::HIGHEST_ORDER};

/// Shaping filter of a part of the remnant.
#[derive(Debug, Clone, PartialEq)]
pub enum RemnantShape {
    /// `1`: the part is white.
    White,
    /// `1/(T_n s + 1)^m`, discretised by an exact hold. With a T_n of many seconds, the part is a slow drift.
    Lag {
        /// Time constant T_n, s.
        time_constant_s: f64,
        /// Order m, 1 to 4.
        order: usize,
    },
    /// `omega^2/(s^2 + 2 zeta omega s + omega^2)`, discretised by an exact hold.
    Resonance {
        /// Natural frequency omega, rad/s.
        omega_rad_s: f64,
        /// Damping ratio zeta.
        zeta: f64,
    },
    /// `1/(1 + d_1 q^-1 + d_2 q^-2 + ...)`.
    Ar {
        /// Coefficients d_1, d_2, ...
        coefficients: Vec<f64>,
    },
}

/// Strength of a part of the remnant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PartStrength {
    /// Share of the variance of u that this part causes through the closed loop.
    Share(f64),
    /// The gain K itself, before and after the change.
    Gain {
        /// Gain K before the change.
        initial: f64,
        /// Gain K after the change.
        last: f64,
    },
}

/// Signal on which a signal-dependent part of the remnant depends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DependenceSignal {
    /// The part depends on the running rms of u.
    Control,
    /// The part depends on the running rms of the rate of u.
    Rate,
}

crate::named_choice!(DependenceSignal, "signal that a remnant follows", 2, { Control => "control", Rate => "rate" });

/// Dependence of the standard deviation of a part on u.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignalDependence {
    /// Signal that determines the standard deviation.
    pub signal: DependenceSignal,
    /// c: share of the variance of the part that depends on the signal, 0 to 1.
    pub share: f64,
    /// Memory length of the running mean square, s.
    pub memory_s: f64,
}

/// Poisson pulses in a part of the remnant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulses {
    /// p: share of the variance of the part that is due to pulses, 0 to 1.
    pub share: f64,
    /// lambda: mean number of pulses per second.
    pub rate_per_s: f64,
}

/// Switching of a part of the remnant on and off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intermittence {
    /// Mean duration T_on for which the part is on, s.
    pub on_s: f64,
    /// Mean duration T_off for which the part is off, s.
    pub off_s: f64,
}

/// A part of the remnant.
#[derive(Debug, Clone, PartialEq)]
pub struct RemnantPart {
    /// Shaping filter of the part.
    pub shape: RemnantShape,
    /// Strength of the part.
    pub strength: PartStrength,
    /// Dependence of the part on u; `None` if there is no dependence.
    pub signal_dependence: Option<SignalDependence>,
    /// Pulses of the part; `None` if there are no pulses.
    pub pulses: Option<Pulses>,
    /// Switching of the part on and off; `None` if it is always on.
    pub intermittence: Option<Intermittence>,
}

/// Drift of the stick, and offsets of the recording. Bias and random walk act in the loop: the controlled element
/// receives them, and the person responds to their effect. The offsets of e and u are only added to the recorded
/// signals.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stick {
    /// Bias of the stick: the constant part of u.
    pub bias: f64,
    /// Standard deviation of the random walk of u after 1 s; it grows with the square root of time.
    pub walk_per_root_s: f64,
    /// Offset of the recorded e.
    pub offset_e: f64,
    /// Offset of the recorded u.
    pub offset_u: f64,
}

impl RemnantPart {
    /// Returns a Gaussian, stationary part that causes the given share of the variance of u.
    pub fn new(shape: RemnantShape, share: f64) -> Self {
        Self {
            shape,
            strength: PartStrength::Share(share),
            signal_dependence: None,
            pulses: None,
            intermittence: None,
        }
    }

    /// Returns the share of the variance of u; `None` if the strength is given as a gain.
    pub fn share(&self) -> Option<f64> {
        match self.strength {
            PartStrength::Share(share) => Some(share),
            PartStrength::Gain { .. } => None,
        }
    }

    /// Checks the parameters of the part.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] or [`ModelError::Operator`], which name the quantity.
    pub(super) fn check(&self) -> Result<(), ModelError> {
        let positive = "a positive finite number";
        let part = "a number from 0 to 1";
        let demand = |quantity, found: f64, holds: bool, expected| {
            if found.is_finite() && holds {
                Ok(())
            } else {
                Err(ModelError::OutOfRange {
                    quantity,
                    found,
                    expected,
                })
            }
        };
        match &self.shape {
            RemnantShape::White => {}
            RemnantShape::Lag { time_constant_s, order } => {
                let t_n = *time_constant_s;
                demand("time constant T_n of the remnant in s", t_n, t_n > 0.0, positive)?;
                let m = *order as f64;
                demand(
                    "order m of the remnant",
                    m,
                    (1..=HIGHEST_ORDER).contains(order),
                    "1 to 4",
                )?;
            }
            RemnantShape::Resonance { omega_rad_s, zeta } => {
                let quantity = "frequency of the peak of the remnant in rad/s";
                demand(quantity, *omega_rad_s, *omega_rad_s > 0.0, positive)?;
                demand("damping of the peak of the remnant", *zeta, *zeta > 0.0, positive)?;
            }
            RemnantShape::Ar { coefficients } => {
                let inverse = [&[1.0][..], coefficients].concat();
                let inside = polynomial::roots(&inverse).is_some_and(|all| all.iter().all(|z| z.norm() < 1.0));
                if !inside {
                    return Err(ModelError::Operator {
                        reason: format!(
                            "the remnant with the coefficients {coefficients:?} is not stable; expected all roots of \
                             z^n + d_1 z^(n-1) + ... within the unit circle"
                        ),
                    });
                }
            }
        }
        match self.strength {
            PartStrength::Share(share) => demand(
                "share of the variance of u due to the remnant",
                share,
                (0.0..1.0).contains(&share),
                "zero or more, below one",
            )?,
            PartStrength::Gain { initial, last } => {
                for gain in [initial, last] {
                    demand(
                        "gain of the remnant",
                        gain,
                        gain >= 0.0,
                        "a finite number, zero or more",
                    )?;
                }
            }
        }
        if let Some(SignalDependence { share: c, memory_s, .. }) = self.signal_dependence {
            demand("part of the remnant that follows u", c, (0.0..=1.0).contains(&c), part)?;
            let quantity = "memory length in s of the rms that the remnant follows";
            demand(quantity, memory_s, memory_s > 0.0, positive)?;
        }
        if let Some(Pulses { share: p, rate_per_s }) = self.pulses {
            demand(
                "part of the remnant that consists of pulses",
                p,
                (0.0..=1.0).contains(&p),
                part,
            )?;
            demand("rate of pulses in 1/s", rate_per_s, rate_per_s > 0.0, positive)?;
        }
        if let Some(Intermittence { on_s, off_s }) = self.intermittence {
            demand("mean time with remnant in s", on_s, on_s > 0.0, positive)?;
            let expected = "a finite number, zero or more";
            demand("mean time without remnant in s", off_s, off_s >= 0.0, expected)?;
        }
        if self.signal_dependence.is_some() && self.intermittence.is_some() {
            return Err(ModelError::Operator {
                reason:
                    "a part of the remnant follows u and is intermittent: u is larger while this part is present, so \
                     the strength would differ from the requested value; split this part into two"
                        .to_owned(),
            });
        }
        Ok(())
    }
}

impl Stick {
    pub(super) fn check(&self) -> Result<(), ModelError> {
        for (quantity, found, holds) in [
            ("bias of the stick", self.bias, true),
            (
                "random walk of the stick per root second",
                self.walk_per_root_s,
                self.walk_per_root_s >= 0.0,
            ),
            ("offset of the recorded e", self.offset_e, true),
            ("offset of the recorded u", self.offset_u, true),
        ] {
            if !(found.is_finite() && holds) {
                return Err(ModelError::OutOfRange {
                    quantity,
                    found,
                    expected: "a finite number, nonnegative for the random walk",
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_parts_are_refused() {
        let good = RemnantPart::new(RemnantShape::White, 0.2);
        assert!(good.check().is_ok());
        let shaped = |shape| RemnantPart { shape, ..good.clone() };
        for bad in [
            RemnantPart::new(RemnantShape::White, 1.0),
            RemnantPart::new(RemnantShape::White, f64::NAN),
            shaped(RemnantShape::Lag {
                time_constant_s: 0.0,
                order: 1,
            }),
            shaped(RemnantShape::Lag {
                time_constant_s: 0.1,
                order: 5,
            }),
            shaped(RemnantShape::Resonance {
                omega_rad_s: 10.0,
                zeta: 0.0,
            }),
            shaped(RemnantShape::Ar {
                coefficients: vec![-1.01],
            }),
            RemnantPart {
                strength: PartStrength::Gain {
                    initial: 0.1,
                    last: -0.1,
                },
                ..good.clone()
            },
            RemnantPart {
                pulses: Some(Pulses {
                    share: 1.2,
                    rate_per_s: 1.0,
                }),
                ..good.clone()
            },
            RemnantPart {
                intermittence: Some(Intermittence { on_s: 0.0, off_s: 1.0 }),
                ..good.clone()
            },
            RemnantPart {
                signal_dependence: Some(SignalDependence {
                    signal: DependenceSignal::Rate,
                    share: 0.5,
                    memory_s: 0.0,
                }),
                ..good.clone()
            },
        ] {
            assert!(bad.check().is_err(), "{bad:?}");
        }
        let stick = Stick {
            walk_per_root_s: -1.0,
            ..Stick::default()
        };
        assert!(stick.check().is_err() && Stick::default().check().is_ok());
    }
}
