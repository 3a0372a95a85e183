//! Fourier coefficients of a record over whole periods.
//!
//! For N samples, `X_k = (2/N) sum_i x_i e^{-j 2 pi k i/N}`, k = 0 .. N/2. A sinusoid `A sin(omega_k t + phi)` with
//! `omega_k = 2 pi k/(N Ts)` has `|X_k| = A` and no contribution to any other bin. With the bins 0 and N/2 counted
//! once, `var(x) = sum_{k = 1}^{N/2} |X_k|^2/2` (Parseval; J. S. Bendat and A. G. Piersol, *Random Data*, 2010, section
//! 11.2; R. Pintelon and J. Schoukens, *System Identification: A Frequency Domain Approach*, 2012, section 2.2).

use hoid_model::Complex64;
use realfft::RealFftPlanner;

/// Returns the Fourier coefficients `X_k`, k = 0 .. N/2.
pub(crate) fn coefficients(values: &[f64]) -> Vec<Complex64> {
    let n = values.len();
    if n == 0 {
        return Vec::new();
    }
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(n);
    let mut input = values.to_vec();
    let mut output = vec![Complex64::new(0.0, 0.0); n / 2 + 1];
    // Both buffers have the lengths that the transform expects, so there is no error.
    let _ = transform.process(&mut input, &mut output);
    let scale = 2.0 / n as f64;
    for x in &mut output {
        *x *= scale;
    }
    output
}

/// Returns the contribution of bin k to the variance of N samples.
pub(super) fn power(coefficients: &[Complex64], k: usize, samples: usize) -> f64 {
    let once = k == 0 || 2 * k == samples;
    coefficients[k].norm_sqr() / if once { 4.0 } else { 2.0 }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn sinusoid_appears_only_in_its_bin() {
        for n in [96, 97, 2400] {
            let x: Vec<f64> = (0..n)
                .map(|i| 0.3 + 1.7 * (TAU * 7.0 * f64::from(i) / f64::from(n) + 0.4).sin())
                .collect();
            let found = coefficients(&x);
            assert_eq!(found.len(), n as usize / 2 + 1);
            // A sine is a cosine a quarter of a turn later.
            let expected = Complex64::from_polar(1.7, 0.4 - TAU / 4.0);
            for (k, c) in found.iter().enumerate() {
                let expected = match k {
                    0 => Complex64::new(0.6, 0.0),
                    7 => expected,
                    _ => Complex64::new(0.0, 0.0),
                };
                // The tolerance allows for the rounding error of about ten successive additions.
                assert!((c - expected).norm() < 1e-13, "{n} {k}: {c}");
            }
        }
    }

    #[test]
    fn power_adds_up_to_the_variance() {
        for n in [2_usize, 3, 64, 81] {
            let x: Vec<f64> = (0..n).map(|i| ((i * i + 3 * i) % 11) as f64).collect();
            let mean = x.iter().sum::<f64>() / n as f64;
            let variance = x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64;
            let c = coefficients(&x);
            let sum: f64 = (1..c.len()).map(|k| power(&c, k, n)).sum();
            assert!((sum - variance).abs() < 1e-12, "{n}: {sum} {variance}");
            assert!((power(&c, 0, n) - mean * mean).abs() < 1e-12);
        }
        assert!(coefficients(&[]).is_empty());
    }
}
