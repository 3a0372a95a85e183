//! The remnant in u: its power at non-excited frequencies.
//!
//! Over whole periods the response to the excitation has no power between its lines, so all power there is remnant. Bin
//! k of a window of N samples gives the one-sided density `|U_k|^2/2 / (2 pi/(N Ts))` per rad/s, with a relative
//! standard error of 1 (chi-square with two degrees of freedom). The mean of m values, from n runs and neighbouring
//! bins, has a relative standard error of `1/sqrt(m)` (J. S. Bendat and A. G. Piersol, *Random Data*, 2010, section
//! 8.5.4).
//!
//! The lines also contain remnant. The remnant at the lines is estimated from the density at neighbouring frequencies:
//! `noise ratio = power of the remnant / var(u)` estimates P_n of eq. 43, whereas the share at non-excited frequencies
//! does not include the remnant at the lines.

use std::f64::consts::TAU;

use hoid_model::Complex64;

use super::{spectrum::power, window::Window};

/// Mean density of the remnant in u over a band of frequencies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RemnantBand {
    /// Mean frequency of the averaged bins, rad/s.
    pub omega_rad_s: f64,
    /// One-sided power density of u at non-excited frequencies, square of the unit of u per rad/s. The integral of the
    /// density is a variance.
    pub density: f64,
    /// Number of averaged values, i.e. of non-excited bins of all runs in the band.
    pub values: usize,
}

impl RemnantBand {
    /// Returns the standard error of the density for a stationary normal remnant.
    pub fn standard_error(&self) -> f64 {
        self.density / (self.values as f64).sqrt()
    }
}

/// Fourier coefficients of u in one run, and its excited bins in ascending order.
pub(super) struct ControlSpectrum<'a> {
    pub coefficients: &'a [Complex64],
    pub window: Window,
    pub excited: &'a [usize],
}

impl ControlSpectrum<'_> {
    fn bin_width_rad_s(&self, ts_s: f64) -> f64 {
        TAU / (self.window.samples as f64 * ts_s)
    }

    fn is_line(&self, k: usize) -> bool {
        self.excited.binary_search(&k).is_ok()
    }

    fn power(&self, k: usize) -> f64 {
        power(self.coefficients, k, self.window.samples)
    }

    /// Returns the variance of u, and the part of it at non-excited frequencies.
    fn total_and_remnant_power(&self) -> (f64, f64) {
        let bins = 1..self.coefficients.len();
        let all: f64 = bins.clone().map(|k| self.power(k)).sum();
        let off: f64 = bins.filter(|k| !self.is_line(*k)).map(|k| self.power(k)).sum();
        (all, off)
    }
}

/// Returns the mean density in bands with the width of `neighbours` bins of the shortest window, over the non-excited
/// bins of all runs.
pub(super) fn spectrum(runs: &[ControlSpectrum<'_>], ts_s: f64, neighbours: usize) -> Vec<RemnantBand> {
    let widest = runs.iter().map(|r| r.bin_width_rad_s(ts_s)).fold(0.0, f64::max);
    let band_rad_s = widest * neighbours.max(1) as f64;
    // For each band: sum of frequencies, sum of densities, and number of bins.
    let mut bands: Vec<(f64, f64, usize)> = Vec::new();
    for run in runs {
        let width = run.bin_width_rad_s(ts_s);
        for k in (1..run.coefficients.len()).filter(|k| !run.is_line(*k)) {
            let omega = k as f64 * width;
            // The shift by half a bin assigns a frequency at the edge of two bands to the lower band, regardless of
            // rounding.
            let band = ((omega - 0.5 * width) / band_rad_s).max(0.0) as usize;
            if bands.len() <= band {
                bands.resize(band + 1, (0.0, 0.0, 0));
            }
            let b = &mut bands[band];
            *b = (b.0 + omega, b.1 + run.power(k) / width, b.2 + 1);
        }
    }
    let mean = |&(omega, density, values): &(f64, f64, usize)| RemnantBand {
        omega_rad_s: omega / values as f64,
        density: density / values as f64,
        values,
    };
    bands.iter().filter(|b| b.2 > 0).map(mean).collect()
}

/// Returns, for one run, the share of the power of u at non-excited frequencies and the noise ratio.
pub(super) fn remnant_share_and_noise_ratio(
    run: &ControlSpectrum<'_>,
    ts_s: f64,
    spectrum: &[RemnantBand],
) -> (f64, f64) {
    let (all, off) = run.total_and_remnant_power();
    let width = run.bin_width_rad_s(ts_s);
    let at_lines: f64 = (run.excited.iter())
        .map(|&k| width * density_at(spectrum, k as f64 * width))
        .sum();
    (off / all, (off + at_lines) / all)
}

/// Interpolates the density linearly between the centres of two bands; outside the bands, returns the density of the
/// first or the last band.
fn density_at(spectrum: &[RemnantBand], omega: f64) -> f64 {
    let above = spectrum.partition_point(|b| b.omega_rad_s <= omega);
    match (above.checked_sub(1).map(|i| &spectrum[i]), spectrum.get(above)) {
        (Some(low), Some(high)) => {
            let part = (omega - low.omega_rad_s) / (high.omega_rad_s - low.omega_rad_s);
            low.density + part * (high.density - low.density)
        }
        (Some(end), None) | (None, Some(end)) => end.density,
        (None, None) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::{super::spectrum::coefficients, *};

    #[test]
    fn bands_contain_the_power_between_the_lines() {
        let n = 512;
        let x: Vec<f64> = (0..n).map(|k| (k as f64 * k as f64 * 0.37).sin()).collect();
        let c = coefficients(&x);
        let window = Window {
            first: 0,
            samples: n,
            periods: 2,
        };
        // Harmonics 3, 5 and 40 of two periods.
        let excited = [6, 10, 80];
        let run = ControlSpectrum {
            coefficients: &c,
            window,
            excited: &excited,
        };
        let (all, off) = run.total_and_remnant_power();
        let on: f64 = [6, 10, 80].iter().map(|k| power(&c, *k, n)).sum();
        assert!((all - on - off).abs() < 1e-14);
        let ts = 0.1;
        let width = TAU / (n as f64 * ts);
        for neighbours in [1, 7, 1000] {
            let bands = spectrum(
                &[ControlSpectrum {
                    coefficients: &c,
                    window,
                    excited: &excited,
                }],
                ts,
                neighbours,
            );
            let sum: f64 = bands.iter().map(|b| b.density * b.values as f64 * width).sum();
            assert!((sum - off).abs() < 1e-14 * n as f64, "{neighbours}");
            assert_eq!(bands.iter().map(|b| b.values).sum::<usize>(), 256 - 3);
            assert!(bands.windows(2).all(|b| b[0].omega_rad_s < b[1].omega_rad_s));
            let (share, ratio) = remnant_share_and_noise_ratio(&run, ts, &bands);
            assert!((share - off / all).abs() < 1e-15 && ratio > share);
        }
        assert_eq!(density_at(&[], 1.0), 0.0);
    }
}
