//! Tests whether the error e responds to the output u, as in a closed loop.
//!
//! In a closed loop every change in u affects e. The test asks whether the last [`TESTED_OUTPUTS_S`] of u improve the
//! prediction of e from earlier errors and outputs (C. W. J. Granger, *Econometrica* 37 (1969) 424-438). A component
//! that is common to both signals, such as a forcing function, can be predicted from these earlier samples; the
//! remaining part of u cannot.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::whitened::{NOISE_ORDER, decimation_factor, orthonormal_basis};

/// Duration of the latest outputs that are tested, s.
const TESTED_OUTPUTS_S: f64 = 0.25;

/// Result of the test of whether e responds to u.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopResponse {
    /// Probability of a share at least as large if e does not respond to u.
    pub p_value: f64,
    /// Share explained by the latest outputs, relative to the variance of e that earlier samples do not explain.
    pub share: f64,
}

/// Tests whether e responds to u in the samples from `from` on. `None` if there are too few data, a value is not a
/// number or a signal is constant.
pub fn loop_response(e: &[f64], u: &[f64], from: usize, sample_time_s: f64) -> Option<LoopResponse> {
    let thin = decimation_factor(sample_time_s);
    let latest = (TESTED_OUTPUTS_S / (thin as f64 * sample_time_s)).round().max(1.0) as usize;
    let longest = latest + NOISE_ORDER;
    let rows: Vec<usize> = (from..u.len().min(e.len())).step_by(thin).collect();
    let n = rows.len().checked_sub(longest)?;
    let known = 2 * NOISE_ORDER + 1;
    if n < 10 * (known + latest) {
        return None;
    }
    let past = |of: &[f64], t: usize, lag: usize| of[rows[t + longest - lag]];
    let y = DVector::from_fn(n, |t, _| past(e, t, 0));
    let before = DMatrix::from_fn(n, known, |t, j| match j {
        0 => 1.0,
        j if j <= NOISE_ORDER => past(e, t, j),
        j => past(u, t, latest + j - NOISE_ORDER),
    });
    let latest_columns = DMatrix::from_fn(n, latest, |t, j| past(u, t, j + 1));
    if !before.iter().chain(&latest_columns).chain(&y).all(|v| v.is_finite()) {
        return None;
    }
    let q = orthonormal_basis(&before)?;
    let left = &y - &q * (q.transpose() * &y);
    let latest_columns = &latest_columns - &q * (q.transpose() * &latest_columns);
    let of_latest = orthonormal_basis(&latest_columns)?;
    let explained = (of_latest.transpose() * &left).norm_squared();
    let (whole, rest) = (left.norm_squared(), left.norm_squared() - explained);
    if whole <= 0.0 {
        return None;
    }
    let freedom = (n - known - latest) as f64;
    let ratio = explained / latest as f64 / (rest.max(f64::MIN_POSITIVE) / freedom);
    let p_value = FisherSnedecor::new(latest as f64, freedom).ok()?.sf(ratio);
    Some(LoopResponse {
        p_value,
        share: explained / whole,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::whitened::random_number;

    /// Returns e and u of a loop around an integrator, with separate noise on e and on u.
    fn simulate_loop(seed: u64) -> [Vec<f64>; 2] {
        let mut seed = seed;
        let n = 3000;
        let (mut e, mut u, mut v) = (vec![0.0; n], vec![0.0; n], 0.0);
        for t in 1..n {
            let sine = |p: f64| (0.02 * 0.3 * p * t as f64 + p).sin();
            let forcing: f64 = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0]
                .map(sine)
                .iter()
                .sum();
            e[t] = e[t - 1] + 0.02 * (forcing - u[t - 1]);
            v = 0.8 * v + random_number(&mut seed);
            u[t] = 2.0 * if t >= 10 { e[t - 10] } else { 0.0 } + 0.3 * v;
        }
        // Without separate noise on e, e and its past determine u completely.
        let e = e.iter().map(|e| e + 1e-3 * random_number(&mut seed)).collect();
        [e, u]
    }

    #[test]
    fn e_responds_only_to_u_of_its_own_loop() {
        for seed in 0..10 {
            let ([e, u], [_, other]) = (simulate_loop(seed), simulate_loop(100 + seed));
            let (own, other) = (
                loop_response(&e, &u, 0, 0.02).unwrap(),
                loop_response(&e, &other, 0, 0.02).unwrap(),
            );
            assert!(own.share > 0.2 && own.p_value < 1e-6, "{own:?}");
            assert!(other.share < 0.05, "{other:?}");
        }
    }

    #[test]
    fn short_records_and_zero_output_give_no_result() {
        let [e, u] = simulate_loop(1);
        assert_eq!(loop_response(&e[..300], &u[..300], 0, 0.02), None);
        assert_eq!(loop_response(&e, &vec![0.0; u.len()], 0, 0.02), None);
    }
}
