//! The forcing function: the target signal as a sum of sinusoids.
//!
//! `f_t(t) = sum A_k sin(omega_k t + phi_k)` (eq. 42), with t = 0 at the start of the measurement.
//!
//! The sinusoids also run before t = 0, so that the loop has settled by the end of the run-in. The reference
//! frequencies are integer multiples of `2 pi / 81.92 s`: the measurement contains an integer number of periods of each
//! sinusoid, and there is no leakage.
//!
//! [`ForcingFunction::samples`] uses `sin(a + b) = sin a cos b + cos a sin b` with b from a table over one block. This
//! takes two products per sinusoid and sample instead of a sine. Unlike with a recurrence, the error does not grow
//! along the record.

use std::f64::consts::TAU;

use crate::{ModelError, SampleTime, remnant_gain::SpectralLine};

/// One sinusoid of the forcing function.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Sinusoid {
    /// Amplitude A_k, deg.
    pub amplitude_deg: f64,
    /// Frequency omega_k, rad/s.
    pub omega_rad_s: f64,
    /// Phase phi_k at t = 0, rad.
    pub phase_rad: f64,
}

/// A sum of sinusoids.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ForcingFunction {
    sinusoids: Vec<Sinusoid>,
}

/// Duration in s that contains an integer number of periods of each reference frequency.
pub const REFERENCE_PERIOD_S: f64 = 81.92;

/// Rows of Table 1: n_t, A_k in deg, phi_k in rad.
const REFERENCE_LINES: [(f64, f64, f64); 10] = [
    (3.0, 1.186, -0.753),
    (5.0, 1.121, 1.564),
    (8.0, 0.991, 0.588),
    (13.0, 0.756, -0.546),
    (22.0, 0.447, 0.674),
    (34.0, 0.245, -1.724),
    (53.0, 0.123, -1.963),
    (86.0, 0.061, -2.189),
    (139.0, 0.036, 0.875),
    (229.0, 0.025, 0.604),
];

/// Multiples and phases in rad of the disturbance: one line below each line of the target of Table 1, so the lines of
/// the target and the disturbance alternate. With these phases, the largest value is 2.0 times the rms.
const DISTURBANCE_LINES: [(f64, f64); 10] = [
    (2.0, 0.7),
    (4.0, -0.3),
    (7.0, -2.9),
    (11.0, -1.7),
    (17.0, -2.0),
    (29.0, 0.5),
    (43.0, 2.2),
    (67.0, 1.9),
    (109.0, 1.8),
    (181.0, 2.0),
];

/// Number of samples in one block of the table of angles. A block length near the square root of the record length
/// requires the fewest sines.
const BLOCK_SAMPLES: usize = 96;

impl ForcingFunction {
    /// Returns the forcing function with the given sinusoids. Without sinusoids, the target is at rest.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if a number is not finite, a frequency is not positive, or two frequencies are equal.
    pub fn new(sinusoids: Vec<Sinusoid>) -> Result<Self, ModelError> {
        let refuse = |quantity, found, expected| {
            Err(ModelError::OutOfRange {
                quantity,
                found,
                expected,
            })
        };
        for (k, s) in sinusoids.iter().enumerate() {
            if !s.amplitude_deg.is_finite() {
                return refuse("amplitude of a sinusoid in deg", s.amplitude_deg, "a finite number");
            }
            if !s.phase_rad.is_finite() {
                return refuse("phase of a sinusoid in rad", s.phase_rad, "a finite number");
            }
            let quantity = "frequency of a sinusoid in rad/s";
            if !(s.omega_rad_s.is_finite() && s.omega_rad_s > 0.0) {
                return refuse(quantity, s.omega_rad_s, "a positive finite number");
            }
            if sinusoids[..k].iter().any(|other| other.omega_rad_s == s.omega_rad_s) {
                return refuse(
                    quantity,
                    s.omega_rad_s,
                    "a different frequency for each sinusoid; merge sinusoids of equal frequency",
                );
            }
        }
        Ok(Self { sinusoids })
    }

    /// Returns the forcing function of Table 1 with ten sinusoids, whose frequencies are exactly
    /// `omega_k = n_t 2 pi / 81.92`.
    pub fn reference() -> Self {
        let term = |(multiple, amplitude_deg, phase_rad)| Sinusoid {
            amplitude_deg,
            omega_rad_s: multiple * TAU / REFERENCE_PERIOD_S,
            phase_rad,
        };
        Self {
            sinusoids: REFERENCE_LINES.into_iter().map(term).collect(),
        }
    }

    /// Returns a disturbance for the target of Table 1, with the given root mean square in deg. It has ten lines, one
    /// below each line of the target, so that the responses to the target and to the error can be separated. Each
    /// amplitude is proportional to the geometric mean of the amplitudes of the neighbouring lines of the target.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if the root mean square is negative or not finite.
    pub fn reference_disturbance(rms_deg: f64) -> Result<Self, ModelError> {
        if !(rms_deg.is_finite() && rms_deg >= 0.0) {
            return Err(ModelError::OutOfRange {
                quantity: "rms of the disturbance in deg",
                found: rms_deg,
                expected: "a finite number, zero or more",
            });
        }
        if rms_deg == 0.0 {
            return Ok(Self::default());
        }
        let term = |(k, (multiple, phase_rad)): (usize, (f64, f64))| Sinusoid {
            amplitude_deg: (REFERENCE_LINES[k.saturating_sub(1)].1 * REFERENCE_LINES[k].1).sqrt(),
            omega_rad_s: multiple * TAU / REFERENCE_PERIOD_S,
            phase_rad,
        };
        let mut all = Self {
            sinusoids: DISTURBANCE_LINES.into_iter().enumerate().map(term).collect(),
        };
        let scale = rms_deg / all.rms_deg();
        all.sinusoids.iter_mut().for_each(|s| s.amplitude_deg *= scale);
        Ok(all)
    }

    /// Returns the sinusoids.
    pub fn sinusoids(&self) -> &[Sinusoid] {
        &self.sinusoids
    }

    /// Returns the amplitude and the frequency of each sinusoid, for the computation of the remnant gain.
    pub fn lines(&self) -> Vec<SpectralLine> {
        let line = |s: &Sinusoid| SpectralLine {
            amplitude: s.amplitude_deg,
            omega_rad_s: s.omega_rad_s,
        };
        self.sinusoids.iter().map(line).collect()
    }

    /// Returns f_t(t) in deg.
    pub fn value(&self, t_s: f64) -> f64 {
        let term = |s: &Sinusoid| s.amplitude_deg * (s.omega_rad_s * t_s + s.phase_rad).sin();
        self.sinusoids.iter().map(term).sum()
    }

    /// Returns f_t in deg at `start_s + k Ts`, k from 0 to `n - 1`: equal to [`ForcingFunction::value`] up to rounding,
    /// but faster.
    pub fn samples(&self, start_s: f64, sample_time: SampleTime, n: usize) -> Vec<f64> {
        let mut values = vec![0.0; n];
        for s in &self.sinusoids {
            let mut table = [(0.0, 0.0); BLOCK_SAMPLES];
            for (j, angle) in table.iter_mut().enumerate().take(n) {
                *angle = (s.omega_rad_s * (j as f64 * sample_time.s())).sin_cos();
            }
            for (i, block) in values.chunks_mut(BLOCK_SAMPLES).enumerate() {
                let t_s = start_s + (i * BLOCK_SAMPLES) as f64 * sample_time.s();
                let (sin, cos) = (s.omega_rad_s * t_s + s.phase_rad).sin_cos();
                let (sin, cos) = (s.amplitude_deg * sin, s.amplitude_deg * cos);
                for (value, (sin_on, cos_on)) in block.iter_mut().zip(&table) {
                    *value += sin * cos_on + cos * sin_on;
                }
            }
        }
        values
    }

    /// Root mean square of the forcing function over a long time, deg.
    pub fn rms_deg(&self) -> f64 {
        let power: f64 = self.sinusoids.iter().map(|s| s.amplitude_deg.powi(2) / 2.0).sum();
        power.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ts() -> SampleTime {
        SampleTime::new(0.01).unwrap()
    }

    #[test]
    fn reference_frequencies_and_rms_match_table_1() {
        let f = ForcingFunction::reference();
        // Table 1 prints omega_k to 1e-3; the expected rms is known to 1e-4.
        let printed = [0.230, 0.384, 0.614, 0.997, 1.687, 2.608, 4.065, 6.596, 10.661, 17.564];
        for (s, omega) in f.sinusoids().iter().zip(printed) {
            assert!((s.omega_rad_s - omega).abs() < 5.1e-4);
        }
        assert!((f.rms_deg() - 1.4996).abs() < 5e-5);
    }

    #[test]
    fn disturbance_and_target_lines_alternate() {
        let (f, d) = (
            ForcingFunction::reference(),
            ForcingFunction::reference_disturbance(0.2).unwrap(),
        );
        assert!((d.rms_deg() - 0.2).abs() < 1e-15);
        let (of_f, of_d) = (f.sinusoids(), d.sinusoids());
        for k in 0..10 {
            assert!(of_d[k].omega_rad_s < of_f[k].omega_rad_s);
            assert!(k == 9 || of_d[k + 1].omega_rad_s > of_f[k].omega_rad_s);
        }
        let values = d.samples(0.0, ts(), 8192);
        let largest = values.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
        assert!((1.93..2.04).contains(&(largest / 0.2)), "{}", largest / 0.2);
        assert_eq!(
            ForcingFunction::reference_disturbance(0.0).unwrap(),
            ForcingFunction::default()
        );
        for bad in [-0.1, f64::NAN, f64::INFINITY] {
            assert!(ForcingFunction::reference_disturbance(bad).is_err());
        }
    }

    #[test]
    fn one_measurement_is_a_whole_number_of_periods() {
        let f = ForcingFunction::reference();
        let values = f.samples(0.0, ts(), 8192);
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let rms = (values.iter().map(|v| v * v).sum::<f64>() / n).sqrt();
        // The sinusoids are orthogonal over a whole number of periods, so only rounding errors remain.
        assert!(mean.abs() < 1e-13);
        assert!((rms - f.rms_deg()).abs() < 1e-13);
        assert!((f.value(0.0) - f.value(REFERENCE_PERIOD_S)).abs() < 1e-12);
    }

    #[test]
    fn samples_match_pointwise_values() {
        let f = ForcingFunction::reference();
        for (start, n) in [(-10.0, 9192), (0.0, 1), (3.217, 97), (0.0, 0)] {
            let samples = f.samples(start, ts(), n);
            assert_eq!(samples.len(), n);
            for (k, value) in samples.into_iter().enumerate() {
                let t = start + k as f64 * 0.01;
                // The angle reaches 1500 rad, where it is rounded to 1e-13; the amplitude at this frequency is 0.025
                // deg.
                assert!((value - f.value(t)).abs() < 1e-13, "t = {t}");
            }
        }
    }

    #[test]
    fn samples_of_many_blocks_keep_their_precision() {
        let slow = Sinusoid {
            amplitude_deg: 1.0,
            omega_rad_s: 0.5,
            phase_rad: 0.2,
        };
        let f = ForcingFunction::new(vec![slow]).unwrap();
        let samples = f.samples(0.0, ts(), 1_000_000);
        // The angle reaches 5000 rad, where it is rounded to 5e-13.
        let worst = (0..1_000_000).map(|k| (samples[k] - f.value(k as f64 * 0.01)).abs());
        assert!(worst.fold(0.0, f64::max) < 2e-12);
    }

    #[test]
    fn bad_sinusoids_are_refused() {
        let with = |amplitude_deg, omega_rad_s, phase_rad| Sinusoid {
            amplitude_deg,
            omega_rad_s,
            phase_rad,
        };
        for bad in [
            with(f64::NAN, 1.0, 0.0),
            with(1.0, 0.0, 0.0),
            with(1.0, -1.0, 0.0),
            with(1.0, f64::INFINITY, 0.0),
            with(1.0, 1.0, f64::NAN),
        ] {
            assert!(ForcingFunction::new(vec![bad]).is_err(), "{bad:?}");
        }
        assert!(ForcingFunction::new(vec![with(1.0, 2.0, 0.0), with(3.0, 2.0, 1.0)]).is_err());
        assert_eq!(
            ForcingFunction::new(Vec::new()).unwrap().samples(0.0, ts(), 3),
            [0.0; 3]
        );
    }
}
