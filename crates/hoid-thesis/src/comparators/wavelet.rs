//! Ratio of wavelet transforms at the lines (P. M. Thompson, D. H. Klyde, E. N. Bachelder and T. J. Rosenthal,
//! *Development of wavelet-based techniques for detecting loss of control*, AIAA 2004-5064).
//!
//! With Morlet's wavelet of c radians, whose envelope at the frequency omega has the width `s = c/omega`, the transform
//! is
//!
//! `X(omega, t) = sum_k x(k) exp(-(t_k - t)^2/(2 s^2)) e^(-j omega t_k)`,
//!
//! and `H(j omega, t) = U/E`. The transform shows how much of each frequency a signal contains near time t. The width
//! of the envelope decreases with frequency: a slow line is averaged over tens of seconds, a fast line over seconds. In
//! the frequency domain the envelope has the width omega/c, and lines that are closer than about this width interfere
//! with each other. The response at t uses as much data after t as before it.

use hoid_ident::{settings, settings::Bounds};
use num_complex::Complex64;

use super::comparator::{Comparator, ComparatorDescription, Task, TrackingResult};
use crate::ThesisError;

const NAME: &str = "wavelet";
/// Distance, in widths of the envelope, beyond which the envelope is neglected: it is 3e-4 there.
const ENVELOPE_WIDTHS: f64 = 4.0;

settings! {
    /// Options of the wavelet transforms.
    pub struct WaveletRatio {
        /// Radians c of the wave within the width of its envelope
        #[setting(bounds(Bounds::PositiveFinite))]
        pub radians: f64 = 8.0,
    }
}

impl WaveletRatio {
    /// Returns the transforms of e and u at one frequency and time.
    fn transforms(&self, signals: [&[f64]; 2], omega: f64, at: usize, ts: f64) -> [Complex64; 2] {
        let width = self.radians / (omega * ts);
        let reach = (ENVELOPE_WIDTHS * width).ceil() as usize;
        let (first, last) = (at.saturating_sub(reach), (at + reach).min(signals[0].len() - 1));
        let mut sums = [Complex64::default(); 2];
        for k in first..=last {
            let from = k as f64 - at as f64;
            let wave = Complex64::from_polar((-0.5 * (from / width).powi(2)).exp(), -omega * ts * from);
            for (sum, signal) in sums.iter_mut().zip(signals) {
                *sum += wave * signal[k];
            }
        }
        sums
    }
}

impl Comparator for WaveletRatio {
    fn description(&self) -> ComparatorDescription {
        ComparatorDescription {
            name: NAME,
            help: "ratio of the wavelet transforms of u and e at the lines",
            source: "Thompson et al. 2004",
            extra_information: "the lines of the forcing function, and as much data after each time as before it",
        }
    }

    fn track(&self, task: &Task<'_>) -> Result<TrackingResult, ThesisError> {
        let (e, u) = task.signals(NAME, 1)?;
        let ts = task.record.sample_time().s();
        let of = |at: &usize| {
            let ratio = |omega: &f64| {
                let [e, u] = self.transforms([e, u], *omega, *at, ts);
                u / e
            };
            task.omega_rad_s.iter().map(ratio).collect()
        };
        let response: Vec<Vec<Complex64>> = task.requested_samples.iter().map(of).collect();
        Ok(TrackingResult::without_operator(response))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::{super::tests::*, *};

    #[test]
    fn short_wavelets_follow_a_change_of_gain() {
        let omega = 8.0;
        let wave = |k: usize| (omega * 0.01 * k as f64).sin();
        let e: Vec<f64> = (0..6000).map(wave).collect();
        let gain = |k: usize| if k < 3000 { 1.0 } else { 3.0 };
        let u: Vec<f64> = (0..6000)
            .map(|k| gain(k) * if k >= 10 { wave(k - 10) } else { 0.0 })
            .collect();
        let record = test_record(&e, &u);
        let found = WaveletRatio::default()
            .track(&test_task(&record, &[1500, 4500], &[omega]))
            .unwrap();
        for (row, gain) in found.response.iter().zip([1.0, 3.0]) {
            let expected = Complex64::from_polar(gain, -omega * 0.1);
            // The mirror line at -omega is 12 widths away, and the ends of the record are 4 widths away.
            assert!((row[0] - expected).norm() < 1e-3, "{row:?} {expected}");
        }
    }

    /// The transform of a sinusoid is compared with the known continuous transform, `sqrt(2 pi) s e^(j phase)/2` in
    /// samples.
    #[test]
    fn transform_of_a_sinusoid_is_half_its_envelope() {
        let omega = 5.0;
        let cosine: Vec<f64> = (0..4000)
            .map(|k| (omega * 0.01 * (f64::from(k) - 2000.0) + 0.7).cos())
            .collect();
        let method = WaveletRatio::default();
        let [found, _] = method.transforms([&cosine, &cosine], omega, 2000, 0.01);
        let width = 8.0 / (omega * 0.01);
        let expected = Complex64::from_polar(0.5 * (std::f64::consts::TAU).sqrt() * width, 0.7);
        // Truncation of the envelope at 4 widths omits 6e-5 of its area.
        assert!((found / expected - 1.0).norm() < 2e-4, "{found} {expected}");
    }

    #[test]
    fn zero_input_is_refused_and_zero_output_has_no_response() {
        let silent = test_record(&[0.0; 50], &[1.0; 50]);
        assert!(
            WaveletRatio::default()
                .track(&test_task(&silent, &[9], &[1.0]))
                .is_err()
        );
        let e: Vec<f64> = (0..500).map(|k| (0.1 * f64::from(k)).sin()).collect();
        let record = test_record(&e, &[0.0; 500]);
        let found = WaveletRatio::default()
            .track(&test_task(&record, &[250], &[10.0]))
            .unwrap();
        assert!(found.response[0][0].norm() < 1e-12);
    }
}
