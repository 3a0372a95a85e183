//! Distribution from which virtual people are drawn, and the controlled element.
//!
//! Each parameter is drawn uniformly over a range; time constants and damping are drawn uniformly in the logarithm. The
//! gain follows from a crossover frequency, which is also drawn uniformly in the logarithm. All parameters are drawn
//! again if the phase margin of the loop is outside its range or if the loop is resonant or unstable.
//!
//! | parameter | range | source |
//! |---|---|---|
//! | T_L | 0.3 to 2 s | D. T. McRuer and H. R. Jex, IEEE Trans. Human Factors in Electronics 8 (1967) 231-249 |
//! | T_I | 2 to 20 s, or infinite | McRuer and Jex: low-frequency lag of people on `K/s` |
//! | omega_nm | 8 to 16 rad/s | R. E. Magdaleno and D. T. McRuer, NASA CR-1757 (1971); M. M. van Paassen, *Biophysics in Aircraft Control* (1994) |
//! | zeta_nm | 0.1 to 0.6 | Magdaleno and McRuer; van Paassen |
//! | tau | 0.12 to 0.4 s | McRuer and Jex: 0.12 to 0.2 s for practised people on `K/s`, longer for elements of higher order |
//! | followed fraction of a displayed target | 0.4 to 1 | R. J. Wasicko, D. T. McRuer and R. E. Magdaleno, AFFDL-TR-66-137 (1966) |
//! | phase margin | 20 to 65 deg | McRuer and Jex |

use hoid_model::{
    ContinuousTransferFunction, Form, ModelError,
    family_scenario::{Interleaved, MultiSine},
};

/// Range of values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Lower limit.
    pub low: f64,
    /// Upper limit.
    pub high: f64,
}

impl Range {
    /// Builds the range from its limits.
    pub const fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    /// Returns the value at a fraction (0 to 1) of the range.
    pub(super) fn at(&self, part: f64) -> f64 {
        self.low + (self.high - self.low) * part
    }

    /// Returns the value at a fraction (0 to 1) of the range on a logarithmic scale.
    pub(super) fn log_interpolated(&self, part: f64) -> f64 {
        self.low * (self.high / self.low).powf(part)
    }

    /// True if the range contains the value.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    pub(super) fn check(&self, quantity: &'static str, least: f64) -> Result<(), ModelError> {
        let ordered = self.low.is_finite() && self.high.is_finite() && self.low <= self.high && self.low >= least;
        if ordered {
            return Ok(());
        }
        Err(ModelError::OutOfRange {
            quantity,
            found: if self.low >= least { self.high } else { self.low },
            expected: "two positive numbers (zero or more for shares), the smaller number first",
        })
    }
}

/// Ranges of the parameters of virtual people.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Population {
    /// Lead time constant T_L in s.
    pub lead_s: Range,
    /// Lag time constant T_I in s, if it is finite.
    pub lag_s: Range,
    /// Probability that the lag of a person is an integration, that is, T_I is infinite. Default: 0.25.
    pub integrates: f64,
    /// Neuromuscular natural frequency omega_nm in rad/s.
    pub omega_nm_rad_s: Range,
    /// Neuromuscular damping ratio zeta_nm.
    pub zeta_nm: Range,
    /// Effective delay tau_e in s.
    pub tau_e_s: Range,
    /// Crossover frequency in rad/s. Default: 1 to 5.
    pub crossover_rad_s: Range,
    /// Phase margin in deg.
    pub phase_margin_deg: Range,
    /// Largest `|1/(1 + Y P)|` of an accepted loop; above this limit a loop counts as resonant. Default: 4, the value
    /// at the crossover for a phase margin of 14.4 deg.
    pub largest_sensitivity: f64,
    /// Share of the variance of u that is due to the remnant. Default: 0.05 to 0.5.
    pub remnant_share: Range,
    /// Fraction of a displayed target that the machine follows by the response to the target alone, near 3 rad/s
    /// ([`typical_feedforward`](hoid_model::family_scenario::typical_feedforward)). Default: 0.4 to 1.
    pub followed: Range,
    /// Largest offset of the recorded e and u, in either direction, relative to the rms of the signal. Default: 0.3.
    pub offset: f64,
    /// Random walk of the stick, in rms of u per square root of a second. Default: 0.03.
    pub walk_per_root_s: f64,
}

impl Default for Population {
    fn default() -> Self {
        Self {
            lead_s: Range::new(0.3, 2.0),
            lag_s: Range::new(2.0, 20.0),
            integrates: 0.25,
            omega_nm_rad_s: Range::new(8.0, 16.0),
            zeta_nm: Range::new(0.1, 0.6),
            tau_e_s: Range::new(0.12, 0.4),
            crossover_rad_s: Range::new(1.0, 5.0),
            phase_margin_deg: Range::new(20.0, 65.0),
            largest_sensitivity: 4.0,
            remnant_share: Range::new(0.05, 0.5),
            followed: Range::new(0.4, 1.0),
            offset: 0.3,
            walk_per_root_s: 0.03,
        }
    }
}

impl Population {
    pub(super) fn check(&self) -> Result<(), ModelError> {
        let tiny = f64::MIN_POSITIVE;
        self.lead_s.check("lead T_L of the population in s", tiny)?;
        self.lag_s.check("lag T_I of the population in s", tiny)?;
        self.omega_nm_rad_s.check("omega_nm of the population in rad/s", tiny)?;
        self.zeta_nm.check("zeta_nm of the population", tiny)?;
        self.tau_e_s.check("delay tau_e of the population in s", 0.0)?;
        self.crossover_rad_s
            .check("crossover of the population in rad/s", tiny)?;
        self.phase_margin_deg
            .check("phase margin of the population in deg", 0.0)?;
        self.remnant_share.check("remnant share of the population", 0.0)?;
        self.followed.check("followed fraction of the target", 0.0)?;
        for (quantity, found, most) in [
            ("probability of an infinite T_I", self.integrates, 1.0),
            ("remnant share of the population", self.remnant_share.high, 0.9),
            ("offset of the population in rms", self.offset, 1e3),
            ("walk of the stick in rms per root second", self.walk_per_root_s, 1e3),
        ] {
            if !(0.0..=most).contains(&found) {
                return Err(ModelError::OutOfRange {
                    quantity,
                    found,
                    expected: "zero or more; a probability up to 1, a share up to 0.9",
                });
            }
        }
        if self.largest_sensitivity.is_nan() || self.largest_sensitivity <= 1.0 {
            return Err(ModelError::OutOfRange {
                quantity: "largest sensitivity |1/(1 + Y P)| of the population",
                found: self.largest_sensitivity,
                expected: "more than one",
            });
        }
        Ok(())
    }
}

/// Controlled element of a virtual person.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Plant {
    /// `1/s`.
    Integrator,
    /// `1/(s(s+1))`.
    LaggedIntegrator,
    /// `1/s^2`.
    DoubleIntegrator,
}

hoid_model::named_choice!(Plant, "controlled element", 3, {
    Integrator => "integrator",
    LaggedIntegrator => "lagged-integrator",
    DoubleIntegrator => "double-integrator",
});

impl Plant {
    /// Returns the denominator of the transfer function in descending powers of s; the numerator is one.
    pub fn denominator(self) -> &'static [f64] {
        match self {
            Self::Integrator => &[1.0, 0.0],
            Self::LaggedIntegrator => &[1.0, 1.0, 0.0],
            Self::DoubleIntegrator => &[1.0, 0.0, 0.0],
        }
    }

    /// Returns the controlled element in the notation of a manifest, `NUM/DEN`.
    pub fn text(self) -> &'static str {
        match self {
            Self::Integrator => "1/1,0",
            Self::LaggedIntegrator => "1/1,1,0",
            Self::DoubleIntegrator => "1/1,0,0",
        }
    }

    /// Returns the transfer function of the controlled element.
    ///
    /// # Errors
    /// As [`ContinuousTransferFunction::new`]; no error is expected in practice.
    pub fn transfer_function(self) -> Result<ContinuousTransferFunction, ModelError> {
        ContinuousTransferFunction::new(&[1.0], self.denominator())
    }

    /// Returns the forms that people use with this element, which are drawn with equal probabilities: gain, lead and
    /// lag with `1/s`; a lead, or two leads with a lag, with elements of second order.
    pub fn forms(self) -> &'static [Form] {
        match self {
            Self::Integrator => &[Form::LeadLag],
            Self::LaggedIntegrator | Self::DoubleIntegrator => &[Form::Lead2Lag, Form::Lead],
        }
    }

    /// Returns the target and the disturbance of a task with a displayed target: the multi-sine of
    /// [`Plant::disturbance`], whose primes are used alternately by the target and the disturbance.
    pub fn interleaved_excitations(self) -> [MultiSine; 2] {
        [Interleaved::Even, Interleaved::Odd].map(|interleaved| MultiSine {
            interleaved,
            ..self.disturbance()
        })
    }

    /// Returns the disturbance: a multi-sine at the prime multiples of 0.05 Hz, up to 31 times with `1/s` and up to 17
    /// times with elements of second order, whose loops are slower.
    pub fn disturbance(self) -> MultiSine {
        MultiSine {
            largest: if self == Self::Integrator { 31 } else { 17 },
            ..MultiSine::default()
        }
    }
}
