//! Dispersion of the power of the innovations in time.
//!
//! For a remnant of constant power the block energies are chi-square: the logarithm of the energy of n samples has the
//! variance 2/n. People who act in pulses have innovations in bursts, and the variance of the log energies is tens of
//! times larger. A likelihood that treats their samples as independent is too sharp and splits the data of a constant
//! operator into many segments. Each sample therefore counts as `1/c` of a sample, the quasi-likelihood of
//! overdispersed data (R. W. M. Wedderburn, *Biometrika* 61 (1974) 439-447), with `c = v^DISPERSION_EXPONENT`, where v
//! is the variance of the log energies divided by its value for constant power. Differences between successive blocks
//! remove slow drifts of the power:
//!
//! `v = (pi/2) (mean |ln E_k - ln E_{k-1}|)^2/(4/n)`,
//!
//! Absolute values limit the influence of a change, which acts like a single burst.
//!
//! c is smaller than v, because bursts coincide with the response and are not independent of it. The exponent is
//! empirical. Pilots with a dead zone have a typical v of 75 and c of at most 4.5, people with a mouse a typical v of 6
//! and c of at most 1.9, and simulated remnants have c = 1.

/// Exponent of the dispersion `c = v^DISPERSION_EXPONENT`.
const DISPERSION_EXPONENT: f64 = 0.3;
/// Weight of the prior v = 1, as a number of differences of log energies.
const PRIOR_DIFFERENCES: f64 = 4.0;
/// Largest value of v.
const MAX_VOLATILITY: f64 = 1000.0;

/// Running mean of the absolute differences of the log energies, scaled to 1 for a constant power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Volatility {
    /// Number of blocks over which one energy is summed.
    blocks: u64,
    taken: u64,
    energy: f64,
    samples: f64,
    last: f64,
    steps: f64,
    differences: f64,
    started: bool,
}

crate::state!([] Volatility { taken, energy, samples, last, steps, differences, started });

impl Volatility {
    pub fn new(blocks: u64) -> Self {
        Self {
            blocks,
            taken: 0,
            energy: 0.0,
            samples: 0.0,
            last: 0.0,
            steps: 0.0,
            differences: 0.0,
            started: false,
        }
    }

    /// Adds the energy of a block and the number of its samples.
    pub fn add(&mut self, energy: f64, samples: f64) {
        self.energy += energy;
        self.samples += samples;
        self.taken += 1;
        if self.taken < self.blocks {
            return;
        }
        let log = libm::log(self.energy);
        if log.is_finite() {
            if self.started {
                // E|N(0, 2 var)| = sqrt(4 var/pi). With var = 2 v/n and this scale, the mean of the steps is sqrt(v).
                let step = log - self.last;
                self.steps += step.abs() * libm::sqrt(0.125 * core::f64::consts::PI * self.samples);
                self.differences += 1.0;
            }
            (self.last, self.started) = (log, true);
        }
        (self.taken, self.energy, self.samples) = (0, 0.0, 0.0);
    }

    /// Returns the number of samples that count as one independent sample.
    pub fn dispersion(&self) -> f64 {
        let root = (self.steps + PRIOR_DIFFERENCES) / (self.differences + PRIOR_DIFFERENCES);
        libm::pow((root * root).clamp(1.0, MAX_VOLATILITY), DISPERSION_EXPONENT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dispersion_is_one_for_constant_power_and_larger_for_bursts() {
        let mut seed = 3_u64;
        let mut uniform = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        // Sums of 12 uniform numbers are nearly normal.
        let (mut even, mut bursts) = (Volatility::new(4), Volatility::new(4));
        for block in 0..4000 {
            let energy: f64 = (0..32)
                .map(|_| {
                    let x: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                    x * x
                })
                .sum();
            even.add(energy, 32.0);
            bursts.add(if block / 4 % 2 == 0 { energy } else { 10.0 * energy }, 32.0);
        }
        // 1000 differences: v = 1 with a standard error of .05.
        assert!((even.dispersion() - 1.0).abs() < 0.06, "{}", even.dispersion());
        // (pi/2) (ln 10)^2 128/4 = 267.
        assert!((bursts.dispersion() - libm::pow(267.0, DISPERSION_EXPONENT)).abs() < 0.2);
        assert!((Volatility::new(4).dispersion() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn zero_power_is_not_a_burst() {
        let mut v = Volatility::new(1);
        for energy in [0.0, 1.0, 0.0, 0.0, 1.0] {
            v.add(energy, 32.0);
        }
        assert!((v.dispersion() - 1.0).abs() < 1e-12);
    }
}
