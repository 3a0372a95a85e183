//! The interpolation filter: the sinc function under Kaiser's window,
//!
//! ```text
//! x(t) ~ sum_n x_n h(t - n),    h(s) = c sinc(c s) w(s / L),    w(r) = I0(beta sqrt(1 - r^2)) / I0(beta),  |r| <= 1
//! ```
//!
//! with s in samples, `sinc x = sin(pi x) / (pi x)` and the cut-off c as a fraction of the Nyquist frequency. By
//! Kaiser's formulas (J. F. Kaiser, "Nonrecursive digital filter design using the I0-sinh window function", Proc. IEEE
//! Int. Symp. Circuits and Systems, 1974) the ripple is A dB below 1 in both the pass band and the stop band for
//! `beta = 0.1102 (A - 8.7)` and a length `2 L = (A - 7.95) / (2.285 d)`, where d is the width in rad of the transition
//! around c.
//!
//! At integer t this is a linear-phase FIR filter whose delay is compensated; at other t it interpolates, with the same
//! frequency response. The weights for each t are divided by their sum, so a constant is unchanged. A is
//! [`DESIGN_ATTENUATION_DB`], which exceeds the documented attenuation [`STOP_BAND_ATTENUATION_DB`] by a margin.

use std::f64::consts::PI;

/// Attenuation for which the filter is designed, dB.
const DESIGN_ATTENUATION_DB: f64 = 90.0;
/// Documented attenuation of aliases and of the interpolation error, dB.
pub const STOP_BAND_ATTENUATION_DB: f64 = 80.0;
/// Half the width of the transition, relative to its upper edge.
const HALF_TRANSITION_WIDTH: f64 = 0.1;
/// End of the pass band relative to the lower of the two Nyquist frequencies.
pub const PASS_BAND_EDGE: f64 = 0.8;

/// Distance from an integer, in samples, up to which the difference counts as rounding.
const INTEGER_TOLERANCE: f64 = 1e-9;

/// Continuous impulse response of a low-pass filter, in samples of the record.
#[derive(Debug, Clone, Copy)]
pub struct Kernel {
    cutoff: f64,
    /// Number of samples that the filter uses on each side.
    half: usize,
}

impl Kernel {
    /// Returns a kernel with a pass band up to 0.8 and a stop band from 1.2 of the Nyquist frequency of the record: it
    /// shifts a band-limited signal by fractions of a sample.
    pub fn for_interpolation() -> Self {
        Self {
            cutoff: 1.0,
            half: half_length(2.0 * (1.0 - PASS_BAND_EDGE)) as usize,
        }
    }

    /// Returns a kernel with a pass band up to 0.8 `ratio` and a stop band from `ratio`, the new Nyquist frequency
    /// relative to the old one; `None` if the filter would be longer than `longest` on each side.
    pub fn for_resampling(ratio: f64, longest: usize) -> Option<Self> {
        let half = half_length(2.0 * HALF_TRANSITION_WIDTH * ratio);
        // The condition is written so that NaN gives `None`.
        (half <= longest as f64).then_some(Self {
            cutoff: (1.0 - HALF_TRANSITION_WIDTH) * ratio,
            half: half as usize,
        })
    }

    /// Returns a kernel with a pass band up to 0.8 `ratio` and a stop band from 1.2 `ratio`, where `ratio` is the new
    /// Nyquist frequency relative to the old one; the attenuation is 6 dB at `ratio`. Aliases fall between 0.8 and 1 of
    /// the new Nyquist frequency, where they replace the part of the spectrum that the filter has removed, so the
    /// spectrum of noise has no gap. `None` if the filter would be longer than `longest` on each side.
    pub fn for_decimation(ratio: f64, longest: usize) -> Option<Self> {
        let half = half_length(2.0 * (1.0 - PASS_BAND_EDGE) * ratio);
        // The condition is written so that NaN gives `None`.
        (half <= longest as f64).then_some(Self {
            cutoff: ratio,
            half: half as usize,
        })
    }

    /// Returns the number of samples that the filter uses on each side of the requested instant.
    pub fn samples_per_side(self) -> usize {
        self.half
    }

    /// Returns the weights of the samples `floor(t) - half + 1 ..= floor(t) + half` for `t = floor(t) + fraction`; for
    /// an integer t the first sample is `floor(t) - half`, so that the weights are symmetric.
    pub(super) fn weights(self, fraction: f64) -> (isize, Vec<f64>) {
        let half = self.half as isize;
        let first = if fraction == 0.0 { -half } else { 1 - half };
        let mut weights: Vec<f64> = (first..=half).map(|n| self.response(fraction - n as f64)).collect();
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
        (first, weights)
    }

    fn response(self, s: f64) -> f64 {
        let r = s / self.half as f64;
        let root = (1.0 - r * r).max(0.0).sqrt();
        let beta = 0.1102 * (DESIGN_ATTENUATION_DB - 8.7);
        self.cutoff * sinc(self.cutoff * s) * bessel_i0(beta * root) / bessel_i0(beta)
    }

    /// Returns the values at `t_k = first + k step` for k = 0 to n - 1, in samples; every t_k must be at least
    /// [`Kernel::samples_per_side`] samples from both ends.
    pub fn values(self, samples: &[f64], first: f64, step: f64, n: usize) -> Vec<f64> {
        // For an integer step all fractions are equal, and the weights are computed once.
        let (mut known, mut offset, mut weights) = (f64::NAN, 0, Vec::new());
        (0..n)
            .map(|k| {
                let t = first + k as f64 * step;
                // A time that equals a sample up to rounding is treated as that sample.
                let whole = (t - t.round()).abs() < INTEGER_TOLERANCE;
                let at = if whole { t.round() } else { t.floor() };
                let fraction = if whole { 0.0 } else { t - at };
                // The initial value of `known` is NaN, which differs from every fraction.
                let is_known = (fraction - known).abs() < 1e-13;
                if !is_known {
                    (offset, weights) = self.weights(fraction);
                    known = fraction;
                }
                let from = (at as isize + offset).max(0) as usize;
                weights.iter().zip(&samples[from..]).map(|(w, x)| w * x).sum()
            })
            .collect()
    }
}

/// Returns half the length of the filter for a transition of the given width, relative to the Nyquist frequency.
fn half_length(width: f64) -> f64 {
    ((DESIGN_ATTENUATION_DB - 7.95) / (2.0 * 2.285 * PI * width)).ceil()
}

fn sinc(x: f64) -> f64 {
    let angle = PI * x;
    if angle.abs() < 1e-8 { 1.0 } else { angle.sin() / angle }
}

/// Returns the modified Bessel function of the first kind and order 0, computed from its power series; the terms
/// decrease for k > x / 2.
fn bessel_i0(x: f64) -> f64 {
    let square = 0.25 * x * x;
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..200 {
        term *= square / f64::from(k * k);
        sum += term;
        if term < 1e-17 * sum {
            break;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel_function_matches_tables() {
        // Abramowitz and Stegun, Table 9.8, which contains these values multiplied by exp(-x).
        for (x, expected) in [
            (0.0, 1.0),
            (1.0, 1.266_065_877_752_008_4),
            (5.0, 27.239_871_823_604_44),
            (10.0, 2_815.716_628_466_254),
        ] {
            assert!((bessel_i0(x) / expected - 1.0).abs() < 1e-14, "{x}");
        }
    }

    /// Amplitude and delay in samples of an interpolated sinusoid; `frequency` is in cycles per sample, and `fraction`
    /// is the position of the instant between two samples.
    fn response((offset, weights): &(isize, Vec<f64>), frequency: f64, fraction: f64) -> (f64, f64) {
        let omega = 2.0 * PI * frequency;
        let (mut re, mut im) = (0.0, 0.0);
        for (j, w) in weights.iter().enumerate() {
            let angle = omega * (*offset as f64 + j as f64 - fraction);
            re += w * angle.cos();
            im += w * angle.sin();
        }
        (re.hypot(im), im.atan2(re) / omega)
    }

    #[test]
    fn pass_band_and_stop_band_meet_their_specification() {
        let stop = 10_f64.powf(-STOP_BAND_ATTENUATION_DB / 20.0);
        for factor in [2.0, 3.0, 4.0, 10.0, 1.7] {
            let kernel = Kernel::for_resampling(1.0 / factor, 100_000).unwrap();
            let nyquist = 0.5 / factor;
            for fraction in [0.0, 0.25, 0.5, 0.9] {
                let weights = kernel.weights(fraction);
                for i in 1..=400 {
                    let share = f64::from(i) / 400.0;
                    let (gain, delay) = response(&weights, share * PASS_BAND_EDGE * nyquist, fraction);
                    let (leak, _) = response(&weights, nyquist + share * (0.5 - nyquist), fraction);
                    // The filter is designed for 90 dB (3.2e-5), which leaves a margin to the documented 80 dB.
                    assert!((gain - 1.0).abs() < 0.5 * stop, "{factor}, {share}: {gain}");
                    assert!(leak < 0.5 * stop, "{factor}, {share}: {leak:e}");
                    assert!(
                        delay.abs() < 0.02 * factor && (fraction > 0.0 || delay.abs() < 1e-10),
                        "{delay:e}"
                    );
                }
            }
        }
    }

    #[test]
    fn decimation_filter_aliases_only_into_the_last_fifth() {
        for factor in [2.0, 3.0, 10.0, 20.0] {
            let kernel = Kernel::for_decimation(1.0 / factor, 100_000).unwrap();
            let nyquist = 0.5 / factor;
            for fraction in [0.0, 0.5] {
                let weights = kernel.weights(fraction);
                for i in 1..=400 {
                    let share = f64::from(i) / 400.0;
                    let (gain, delay) = response(&weights, share * PASS_BAND_EDGE * nyquist, fraction);
                    let (leak, _) = response(&weights, 1.2 * nyquist + share * (0.5 - 1.2 * nyquist), fraction);
                    assert!(
                        (gain - 1.0).abs() < 5e-5 && leak < 5e-5,
                        "{factor}, {share}: {gain}, {leak:e}"
                    );
                    // The phase is linear, because the weights are symmetric about the requested instant.
                    assert!(delay.abs() < 1e-10, "{delay:e}");
                }
                let (gain, _) = response(&weights, nyquist, fraction);
                assert!((gain - 0.5).abs() < 1e-3, "{gain}");
            }
        }
    }

    #[test]
    fn too_long_filter_is_refused() {
        assert!(Kernel::for_resampling(1e-3, 1000).is_none());
        for bad in [0.0, f64::NAN, -1.0] {
            assert!(
                Kernel::for_resampling(bad, 1000).is_none_or(|kernel| kernel.samples_per_side() <= 1000),
                "{bad}"
            );
        }
    }
}
