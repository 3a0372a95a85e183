//! The remnant filter, its discrete transfer function and its monic noise model.

use super::discretisation::{MIN_TIME_CONSTANT_RATIO, RemnantDiscretisation, backward_gain, denominator};
use super::zoh_numerator::{FactoredNumerator, HIGHEST_ORDER, zoh_numerator};
use crate::{DiscreteTransferFunction, ModelError, SampleTime};

/// `K_n / (T_n s + 1)^m`, driven by white noise of unit variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RemnantFilter {
    /// Gain K_n of the filter.
    pub gain: f64,
    /// Time constant T_n in s.
    pub time_constant_s: f64,
    /// Order m, 1 to 4.
    pub order: usize,
}

/// Noise model `C(q^-1)/D(q^-1) eps'`, where C and D are monic with all roots inside the unit circle.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseModel {
    /// Coefficients `[1, c1, ...]` of C in ascending powers of `q^-1`.
    pub c: Vec<f64>,
    /// Coefficients `[1, d1, ..., dm]` of D in ascending powers of `q^-1`.
    pub d: Vec<f64>,
    /// Standard deviation sigma' of eps'.
    pub innovation_sd: f64,
}

impl RemnantFilter {
    /// Creates a remnant filter and checks its parameters.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] unless the gain is zero or more, the time constant is positive, both are finite, and
    /// the order is 1 to 4.
    pub fn new(gain: f64, time_constant_s: f64, order: usize) -> Result<Self, ModelError> {
        let filter = Self {
            gain,
            time_constant_s,
            order,
        };
        filter.check()?;
        Ok(filter)
    }

    fn check(&self) -> Result<(), ModelError> {
        let refuse = |quantity, found, expected| {
            Err(ModelError::OutOfRange {
                quantity,
                found,
                expected,
            })
        };
        if !(self.gain.is_finite() && self.gain >= 0.0) {
            return refuse("remnant gain K_n", self.gain, "a finite number, zero or more");
        }
        if !(self.time_constant_s.is_finite() && self.time_constant_s > 0.0) {
            let found = self.time_constant_s;
            return refuse("remnant time constant T_n in s", found, "a positive finite number");
        }
        if !(1..=HIGHEST_ORDER).contains(&self.order) {
            return refuse("remnant order m", self.order as f64, "1, 2, 3 or 4");
        }
        Ok(())
    }

    /// Checks the filter and returns `a = Ts/T_n`.
    pub(crate) fn time_constant_ratio(&self, sample_time: SampleTime) -> Result<f64, ModelError> {
        self.check()?;
        let a = sample_time.s() / self.time_constant_s;
        if !(MIN_TIME_CONSTANT_RATIO..=1.0 / MIN_TIME_CONSTANT_RATIO).contains(&a) {
            return Err(ModelError::OutOfRange {
                quantity: "remnant time constant T_n in s",
                found: self.time_constant_s,
                expected: "a time between 1e-9 and 1e9 samples; check its unit against that of the sample time",
            });
        }
        Ok(a)
    }

    /// Returns the discrete transfer function from the white noise, of which one value is drawn per sample, to the
    /// remnant n.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] as for [`RemnantFilter::new`], and if T_n is not between 1e-9 and 1e9 samples.
    pub fn discretise(
        &self,
        sample_time: SampleTime,
        how: RemnantDiscretisation,
    ) -> Result<DiscreteTransferFunction, ModelError> {
        let a = self.time_constant_ratio(sample_time)?;
        let num: Vec<f64> = match how {
            RemnantDiscretisation::ZeroOrderHold => {
                let numerator = zoh_numerator(self.order, a);
                std::iter::once(0.0)
                    .chain(numerator.iter().map(|n| self.gain * n))
                    .collect()
            }
            RemnantDiscretisation::BackwardEuler => vec![self.gain * backward_gain(self.order, a)],
        };
        DiscreteTransferFunction::new(&num, &denominator(self.order, how.pole(a)), sample_time)
    }

    /// Returns the monic noise model with the same spectrum as the remnant.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] as for [`RemnantFilter::new`], and if T_n is not between 1e-9 and 1e9 samples.
    pub fn noise_model(&self, sample_time: SampleTime, how: RemnantDiscretisation) -> Result<NoiseModel, ModelError> {
        let a = self.time_constant_ratio(sample_time)?;
        let (c, unit) = match how {
            RemnantDiscretisation::ZeroOrderHold => {
                let held = FactoredNumerator::new(self.order, a);
                (held.c, held.innovation_sd)
            }
            RemnantDiscretisation::BackwardEuler => (vec![1.0], backward_gain(self.order, a)),
        };
        Ok(NoiseModel {
            c,
            d: denominator(self.order, how.pole(a)),
            innovation_sd: self.gain * unit,
        })
    }
}
