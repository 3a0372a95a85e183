//! Components of u other than the response to e, sample by sample: the parts of the remnant, and the random walk of the
//! stick.
//!
//! `n(k) = walk(k) + sum of K_i(k) G_i(q) w_i(k)`, with K_i from [`calibration`](super::calibration) and w_i from
//! [`noise`](super::noise). In a signal-dependent part, a fraction of the variance of w_i is proportional to the
//! running mean square of the signal on which it depends. The remnant is known before the control of the same sample.

use hoid_model::family_scenario::{DependenceSignal, ResolvedFamilyScenario};

use super::{
    calibration::Calibration,
    noise::{Shaping, ShapingState, driving_noise},
};
use crate::RunSeed;

const STICK_STREAM_TAG: u64 = u64::from_le_bytes(*b"stick\0\0\0");

/// Prepared remnant of a scenario: the filter of each part, and its strength before and after the change.
#[derive(Debug, Clone)]
pub(super) struct Remnants {
    pub shapings: Vec<Shaping>,
    pub calibrations: [Calibration; 2],
    /// True if the scenario changes over time.
    pub changes: bool,
}

impl Remnants {
    /// Returns a value of the calibration at sample `k`, between its values in the initial and final states. After the
    /// end of the scenario it is the value at the last sample.
    #[inline]
    fn calibrated_value(&self, scenario: &ResolvedFamilyScenario, k: usize, of: impl Fn(&Calibration) -> f64) -> f64 {
        let [initial, last] = &self.calibrations;
        if !self.changes {
            return of(initial);
        }
        let t_s = scenario.time_s(k.min(sample_count_of(scenario) - 1));
        scenario.scenario().schedule.value(of(initial), of(last), t_s)
    }
}

fn sample_count_of(scenario: &ResolvedFamilyScenario) -> usize {
    scenario.run_in_samples() + scenario.measurement_samples()
}

/// Remnant of one run, with the state of its filters.
#[derive(Debug, Clone)]
pub(super) struct RemnantRun {
    run: RunSeed,
    /// Input of each part, from the first sample of the run-in to the last sample drawn.
    inputs: Vec<Vec<f64>>,
    /// Steps of the random walk of the stick, for the same samples.
    stick_steps: Vec<f64>,
    shaping_states: Vec<ShapingState>,
    /// Running mean square of the signal on which each part depends, relative to the mean square of this signal over
    /// the run.
    mean_squares: Vec<f64>,
    forgetting_factors: Vec<f64>,
    walk: f64,
    /// Control at the previous sample.
    before: f64,
}

impl RemnantRun {
    pub fn new(resolved: &ResolvedFamilyScenario, of: &Remnants, run: RunSeed) -> Self {
        let scenario = resolved.scenario();
        let ts_s = scenario.sample_time.s();
        let forgets = (scenario.remnant.iter()).map(|part| {
            part.signal_dependence
                .map_or(1.0, |own| 1.0 - (-ts_s / own.memory_s).exp())
        });
        let mut new = Self {
            run,
            inputs: Vec::new(),
            stick_steps: Vec::new(),
            shaping_states: of.shapings.iter().map(ShapingState::at_rest).collect(),
            mean_squares: vec![1.0; of.shapings.len()],
            forgetting_factors: forgets.collect(),
            walk: scenario.stick.bias,
            before: 0.0,
        };
        new.draw(resolved, sample_count_of(resolved));
        new
    }

    /// Draws the random numbers for at least the given number of samples. The random numbers of a sample do not depend
    /// on how many samples are drawn.
    fn draw(&mut self, scenario: &ResolvedFamilyScenario, samples: usize) {
        if samples <= self.stick_steps.len() {
            return;
        }
        let scenario = scenario.scenario();
        let ts_s = scenario.sample_time.s();
        self.inputs = (0..)
            .zip(&scenario.remnant)
            .map(|(i, part)| driving_noise(part, self.run, i, ts_s, samples))
            .collect();
        self.stick_steps = if scenario.stick.walk_per_root_s == 0.0 {
            vec![0.0; samples]
        } else {
            self.run.white_noise_with_tag(STICK_STREAM_TAG, samples)
        };
    }

    /// Returns the remnant at sample `k`. Must be called for the samples in order, without gaps.
    #[inline]
    pub fn next(&mut self, scenario: &ResolvedFamilyScenario, of: &Remnants, k: usize) -> f64 {
        // The remnant continues after the end of the scenario.
        if k >= self.stick_steps.len() {
            self.draw(scenario, 2 * k + 1);
        }
        let mut n = self.walk;
        for (i, part) in scenario.scenario().remnant.iter().enumerate() {
            let mut w = self.inputs[i][k];
            if let Some(own) = part.signal_dependence {
                w *= (1.0 - own.share + own.share * self.mean_squares[i]).sqrt();
            }
            n += of.calibrated_value(scenario, k, |c| c.gains[i]) * self.shaping_states[i].step(&of.shapings[i], w);
        }
        n
    }

    /// Takes the control at sample `k`, for which [`RemnantRun::next`] has already been called.
    #[inline]
    pub fn update_control(&mut self, scenario: &ResolvedFamilyScenario, of: &Remnants, k: usize, u: f64) {
        // A restored run may not have drawn any numbers yet.
        self.draw(scenario, k + 1);
        for (i, part) in scenario.scenario().remnant.iter().enumerate() {
            if let Some(own) = part.signal_dependence {
                let (square, mean) = match own.signal {
                    DependenceSignal::Control => (u * u, of.calibrated_value(scenario, k, |c| c.mean_squares[0])),
                    DependenceSignal::Rate => (
                        (u - self.before).powi(2),
                        of.calibrated_value(scenario, k, |c| c.mean_squares[1]),
                    ),
                };
                self.mean_squares[i] += self.forgetting_factors[i] * (square / mean - self.mean_squares[i]);
            }
        }
        self.before = u;
        let scenario = scenario.scenario();
        self.walk += scenario.stick.walk_per_root_s * scenario.sample_time.s().sqrt() * self.stick_steps[k];
    }

    /// Returns the state as numbers.
    pub fn state_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        let shaped = self.shaping_states.iter_mut().flat_map(ShapingState::state_mut);
        [&mut self.walk, &mut self.before]
            .into_iter()
            .chain(&mut self.mean_squares)
            .chain(shaped)
    }
}
