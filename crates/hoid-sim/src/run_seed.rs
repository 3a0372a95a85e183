//! Random streams that belong to a run, not to a thread.
//!
//! A run is identified by (seed, cell, replication). These three numbers are the key of a ChaCha8 generator. Any run
//! can therefore be repeated alone, and runs can be computed in any order and on any number of threads; no two runs
//! share a stream.

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

use crate::normal_deviates::normal_deviates;

/// Identifier of the random stream of one run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct RunSeed {
    /// Seed of the study.
    pub seed: u64,
    /// Cell of the study (a scenario of its grid).
    pub cell: u64,
    /// Replication within the cell.
    pub replication: u64,
}

/// Last eight bytes of the key of the generator. Other uses of (seed, cell, replication) have another tag and therefore
/// another stream.
const REMNANT_TAG: u64 = u64::from_le_bytes(*b"remnant\0");
const UNIFORM_TAG: u64 = u64::from_le_bytes(*b"uniform\0");

impl RunSeed {
    /// Returns white Gaussian noise of unit variance.
    pub fn white_noise(&self, n: usize) -> Vec<f64> {
        let mut noise = vec![0.0; n];
        self.white_noise_into(&mut noise);
        noise
    }

    /// Writes the first samples of [`RunSeed::white_noise`] into existing memory.
    pub fn white_noise_into(&self, noise: &mut [f64]) {
        normal_deviates(self.generator(REMNANT_TAG), noise);
    }

    /// Returns uniform random numbers in `[0, 1)`, for drawing people or the phases of a run.
    pub fn uniform_numbers(&self, n: usize) -> Vec<f64> {
        self.uniform_with_tag(UNIFORM_TAG, n)
    }

    /// Returns white Gaussian noise of unit variance from a separate stream of the run.
    pub(crate) fn white_noise_with_tag(&self, tag: u64, n: usize) -> Vec<f64> {
        let mut noise = vec![0.0; n];
        normal_deviates(self.generator(tag), &mut noise);
        noise
    }

    /// Returns uniform random numbers in `[0, 1)` from a separate stream of the run.
    pub(crate) fn uniform_with_tag(&self, tag: u64, n: usize) -> Vec<f64> {
        let mut generator = self.generator(tag);
        // The 53 highest bits of each random number give a number in [0, 1).
        (0..n)
            .map(|_| (generator.next_u64() >> 11) as f64 / (1u64 << 53) as f64)
            .collect()
    }

    fn generator(&self, tag: u64) -> ChaCha8Rng {
        let mut key = [0; 32];
        for (bytes, number) in key
            .chunks_exact_mut(8)
            .zip([self.seed, self.cell, self.replication, tag])
        {
            bytes.copy_from_slice(&number.to_le_bytes());
        }
        ChaCha8Rng::from_seed(key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(seed: u64, cell: u64, replication: u64) -> Vec<f64> {
        RunSeed {
            seed,
            cell,
            replication,
        }
        .white_noise(20_000)
    }

    #[test]
    fn noise_is_repeatable_and_independent_between_runs() {
        assert_eq!(noise(1, 2, 3), noise(1, 2, 3));
        let all = [
            noise(1, 2, 3),
            noise(2, 2, 3),
            noise(1, 3, 3),
            noise(1, 2, 4),
            noise(3, 2, 1),
        ];
        for (i, a) in all.iter().enumerate() {
            for b in &all[..i] {
                let n = a.len() as f64;
                let correlation: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>() / n;
                // The tolerance is four standard errors of 1/sqrt(n).
                assert!(correlation.abs() < 4.0 / n.sqrt(), "{correlation}");
            }
        }
    }

    #[test]
    fn noise_is_standard_normal() {
        let x = noise(7, 0, 0);
        let n = x.len() as f64;
        let moment = |k: i32| x.iter().map(|v| v.powi(k)).sum::<f64>() / n;
        // The standard errors of the moments are 1, sqrt 2, sqrt 15 and sqrt 96, each divided by sqrt n; the tolerance
        // is four of these.
        assert!(moment(1).abs() < 4.0 / n.sqrt());
        assert!((moment(2) - 1.0).abs() < 4.0 * 2f64.sqrt() / n.sqrt());
        assert!(moment(3).abs() < 4.0 * 15f64.sqrt() / n.sqrt());
        assert!((moment(4) - 3.0).abs() < 4.0 * 96f64.sqrt() / n.sqrt());
    }

    #[test]
    fn noise_matches_the_pinned_values() {
        // A change in the generator or the transform would change every published figure, so this test must detect it.
        let first: Vec<String> = RunSeed::default()
            .white_noise(3)
            .iter()
            .map(|v| format!("{v:.12}"))
            .collect();
        assert_eq!(first, PINNED_VALUES);
    }

    const PINNED_VALUES: [&str; 3] = ["0.538334543947", "0.367797666622", "0.599664157656"];
}
