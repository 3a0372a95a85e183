//! The validated sample time.

use crate::ModelError;

/// Time between two samples, Ts in s: positive and finite.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct SampleTime(f64);

impl TryFrom<f64> for SampleTime {
    type Error = ModelError;

    fn try_from(ts_s: f64) -> Result<Self, ModelError> {
        Self::new(ts_s)
    }
}

impl From<SampleTime> for f64 {
    fn from(ts: SampleTime) -> Self {
        ts.0
    }
}

impl SampleTime {
    /// 0.01 s, the sample time of the reference task.
    pub const AT_100_HZ: Self = Self(0.01);

    /// 1/60 s, the sample time of a typical screen and of recorded experiments.
    pub const AT_60_HZ: Self = Self(1.0 / 60.0);

    /// Creates a sample time in s.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] unless the sample time is positive and finite.
    pub fn new(ts_s: f64) -> Result<Self, ModelError> {
        if ts_s.is_finite() && ts_s > 0.0 {
            Ok(Self(ts_s))
        } else {
            Err(ModelError::OutOfRange {
                quantity: "sample time Ts in s",
                found: ts_s,
                expected: "a positive finite number",
            })
        }
    }

    /// Returns the nearest delay of b0 in samples, `nk = tau_e/Ts + 1`, for a delay tau_e in s; `usize::MAX` if the
    /// delay is too long.
    pub fn nk(self, tau_e_s: f64) -> usize {
        ((tau_e_s / self.0).round() as usize).saturating_add(1)
    }

    /// Returns the sample time Ts in s.
    pub fn s(self) -> f64 {
        self.0
    }

    /// Returns half the sampling frequency in rad/s: `pi / Ts`.
    pub fn nyquist_rad_s(self) -> f64 {
        std::f64::consts::PI / self.0
    }

    /// Returns a time in s as a number of samples, or `None` if it is not within `1e-6` samples of an integer.
    ///
    /// The quotient is rounded, never truncated: `0.29 / 0.01` is `28.999999999999996` in floating point and means 29.
    pub fn whole_samples(self, time_s: f64) -> Option<usize> {
        let samples = time_s / self.0;
        let rounded = samples.round();
        ((samples - rounded).abs() <= 1e-6 && (0.0..1e15).contains(&rounded)).then_some(rounded as usize)
    }

    /// True if two sample times are equal up to rounding (1e-6 relative); their records can then be fitted together.
    pub fn matches(self, other: Self) -> bool {
        (self.0 - other.0).abs() <= 1e-6 * self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_times_are_refused() {
        for bad in [0.0, -0.01, f64::NAN, f64::INFINITY] {
            assert!(SampleTime::new(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn delay_is_rounded_to_whole_samples() {
        let ts = SampleTime::new(0.01).unwrap();
        assert_eq!(ts.whole_samples(0.29), Some(29));
        assert_eq!(ts.whole_samples(0.28), Some(28));
        assert_eq!(ts.whole_samples(0.285), None);
        assert_eq!(ts.whole_samples(-0.01), None);
        assert_eq!(ts.whole_samples(f64::NAN), None);
        assert_eq!((ts.nk(0.28), ts.nk(0.284), ts.nk(-1.0)), (29, 29, 1));
        assert_eq!(SampleTime::new(1e-300).unwrap().nk(0.2), usize::MAX);
    }
}
