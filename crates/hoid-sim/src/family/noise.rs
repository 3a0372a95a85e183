//! Parts of the remnant, sample by sample.
//!
//! Each part is `n = K G w` with the white sequence w of the remnant in [`hoid_model::family_scenario`], and has its
//! own random streams.

use hoid_model::{
    ModelError, SampleTime,
    family_scenario::{RemnantPart, RemnantShape},
    zoh_system::ZohSystem,
};

use crate::RunSeed;

/// Shaping filter of a part.
#[derive(Debug, Clone)]
pub(super) enum Shaping {
    White,
    Held(ZohSystem),
    Ar(Vec<f64>),
}

impl Shaping {
    pub fn new(shape: &RemnantShape, sample_time: SampleTime) -> Result<Self, ModelError> {
        Ok(match shape {
            RemnantShape::White => Self::White,
            RemnantShape::Ar { coefficients } => Self::Ar(coefficients.clone()),
            RemnantShape::Lag { time_constant_s, order } => {
                let a = 1.0 / time_constant_s;
                let den = (0..*order).fold(vec![1.0], |den, _| hoid_model::polynomial::product(&den, &[1.0, a]));
                Self::Held(ZohSystem::new(&[a.powi(*order as i32)], &den, 0.0, sample_time)?)
            }
            RemnantShape::Resonance { omega_rad_s, zeta } => {
                let square = omega_rad_s * omega_rad_s;
                let den = [1.0, 2.0 * zeta * omega_rad_s, square];
                Self::Held(ZohSystem::new(&[square], &den, 0.0, sample_time)?)
            }
        })
    }
}

/// State of a shaping filter.
#[derive(Debug, Clone)]
pub(super) struct ShapingState {
    state: Vec<f64>,
    next: Vec<f64>,
}

impl ShapingState {
    pub fn at_rest(shaping: &Shaping) -> Self {
        let order = match shaping {
            Shaping::White => 0,
            Shaping::Held(system) => system.order(),
            Shaping::Ar(coefficients) => coefficients.len(),
        };
        Self {
            state: vec![0.0; order],
            next: vec![0.0; order],
        }
    }

    /// Returns the output of the filter at this sample. The input `w` affects the output of a held filter only from the
    /// next sample.
    #[inline]
    pub fn step(&mut self, shaping: &Shaping, w: f64) -> f64 {
        match shaping {
            Shaping::White => w,
            Shaping::Held(system) => {
                let output = system.output(&self.state);
                system.step(&self.state, w, 0.0, &mut self.next);
                std::mem::swap(&mut self.state, &mut self.next);
                output
            }
            Shaping::Ar(coefficients) => {
                let past: f64 = coefficients.iter().zip(&self.state).map(|(d, v)| d * v).sum();
                let output = w - past;
                self.state.rotate_right(1);
                if let Some(newest) = self.state.first_mut() {
                    *newest = output;
                }
                output
            }
        }
    }

    /// Returns the state as numbers.
    pub fn state_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        self.state.iter_mut()
    }
}

/// Returns the white sequence w of a part, with its pulses and intermittence but without its dependence on u.
pub(super) fn driving_noise(part: &RemnantPart, run: RunSeed, index: u64, ts_s: f64, samples: usize) -> Vec<f64> {
    let mut w = if index == 0 {
        // The first part uses the same deviates as `Simulator`, so a remnant of one part is the same as in `Simulator`.
        run.white_noise(samples)
    } else {
        run.white_noise_with_tag(PART_STREAM_TAG + 4 * index, samples)
    };
    if let Some(pulses) = part.pulses {
        // There is at most one pulse per sample.
        let chance = (pulses.rate_per_s * ts_s).min(1.0);
        let heights = run.white_noise_with_tag(PART_STREAM_TAG + 4 * index + 1, samples);
        let places = run.uniform_with_tag(PART_STREAM_TAG + 4 * index + 2, samples);
        let (steady, size) = ((1.0 - pulses.share).sqrt(), (pulses.share / chance).sqrt());
        for ((w, height), place) in w.iter_mut().zip(heights).zip(places) {
            *w = steady * *w + if place < chance { size * height } else { 0.0 };
        }
    }
    if let Some(times) = part.intermittence.filter(|times| times.off_s > 0.0) {
        let draws = run.uniform_with_tag(PART_STREAM_TAG + 4 * index + 3, samples);
        let duty = times.on_s / (times.on_s + times.off_s);
        // The switching is a two-state Markov chain with the mean times `on_s` and `off_s`, observed at the samples.
        let settled = 1.0 - (-ts_s * (1.0 / times.on_s + 1.0 / times.off_s)).exp();
        let mut on = draws.first().is_some_and(|draw| *draw < duty);
        for (w, draw) in w.iter_mut().zip(draws) {
            *w = if on { *w / duty.sqrt() } else { 0.0 };
            let chance = settled * if on { 1.0 - duty } else { duty };
            if draw < chance {
                on = !on;
            }
        }
    }
    w
}

/// Tag of the random streams of part 0; the tags of the other parts follow. The deviates of part 0 come from
/// [`RunSeed::white_noise`].
pub(super) const PART_STREAM_TAG: u64 = u64::from_le_bytes(*b"\0people\0");
