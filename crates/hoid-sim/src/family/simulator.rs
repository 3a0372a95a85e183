//! Prepared scenario of the family, and its runs.
//!
//! Parameters that change follow the sigmoid at each sample, with the exact hold for these values
//! ([`zoh_loop`](super::zoh_loop)). The gains of the remnant are computed for the initial and the final state and
//! follow the same sigmoid. The random numbers of a run are identified by its [`RunSeed`]; each part of the remnant,
//! the stick, and the phases of the target and the disturbance have separate streams.

use std::f64::consts::TAU;

use hoid_model::{
    Channel, Record,
    family_scenario::{Excitation, FamilyScenario, FamilyState, ResolvedFamilyScenario, Stick},
    feedforward::response_parameters,
    forcing::{ForcingFunction, Sinusoid},
};

use super::{
    calibration::Calibration,
    noise::Shaping,
    remnant_run::{RemnantRun, Remnants},
    zoh_loop::{Inputs, LoopState, ZohLoop},
};
use crate::{
    RunSeed, SimError,
    target_response::{TargetResponse, true_parameter_channels},
};

/// Prepared scenario: held models for all samples, and gains of the remnant.
#[derive(Debug, Clone)]
pub struct FamilySimulator {
    pub(super) scenario: ResolvedFamilyScenario,
    /// Held loops, each with the state of the scenario to which it belongs.
    loops: Vec<(FamilyState, ZohLoop)>,
    /// Index in `loops` for each sample; empty if all samples have the same loop.
    loop_indices: Vec<usize>,
    pub(super) remnants: Remnants,
    /// Response to the target; `None` if the person does not see it.
    target_response: Option<TargetResponse>,
}

/// Signals of one run, including the run-in.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FamilySignals {
    /// Error e as recorded.
    pub e: Vec<f64>,
    /// Control u as recorded.
    pub u: Vec<f64>,
    /// Output y of the controlled element.
    pub y: Vec<f64>,
    /// Remnant n, including the bias and the random walk of the stick.
    pub n: Vec<f64>,
    /// Target f.
    pub f: Vec<f64>,
    /// Disturbance d.
    pub d: Vec<f64>,
}

const TARGET_PHASE_TAG: u64 = u64::from_le_bytes(*b"target\0\0");
const DISTURBANCE_PHASE_TAG: u64 = u64::from_le_bytes(*b"disturb\0");

impl FamilySimulator {
    /// Prepares a scenario. All runs share the result.
    ///
    /// # Errors
    /// [`SimError::Model`] if the scenario is invalid or if the loop is unstable in one of its states.
    pub fn new(scenario: &FamilyScenario) -> Result<Self, SimError> {
        let resolved = scenario.resolve()?;
        let ts = scenario.sample_time;
        let held = |state: &FamilyState, delay| -> Result<ZohLoop, SimError> {
            let felt = resolved.motion_in(state)?;
            Ok(ZohLoop::new(state, delay, felt.as_ref(), scenario.realisation, ts)?)
        };
        let samples = resolved.run_in_samples() + resolved.measurement_samples();
        let changes = scenario.schedule.change_s().is_some()
            && (scenario.initial != scenario.last || resolved.feedforward_changes());
        let mut loops: Vec<(FamilyState, ZohLoop)> = Vec::new();
        let mut places = Vec::new();
        for k in 0..if changes { samples } else { 1 } {
            let t_s = resolved.time_s(k);
            let state = resolved.state_at(t_s)?;
            if loops.last().is_none_or(|(last, _)| *last != state) {
                let held = held(&state, resolved.delay_at(t_s))?;
                loops.push((state, held));
            }
            if changes {
                places.push(loops.len() - 1);
            }
        }
        let shapings = (scenario.remnant.iter())
            .map(|part| Shaping::new(&part.shape, ts))
            .collect::<Result<Vec<_>, _>>()?;
        let seen_in = resolved.feedforward_of_states()?;
        let calibrated = |state: &FamilyState, delay, is_last| {
            let seen = seen_in[usize::from(is_last)].as_ref();
            Ok::<_, SimError>(Calibration::of(
                &held(state, delay)?,
                scenario,
                &shapings,
                is_last,
                seen,
            )?)
        };
        let delays = resolved.delays();
        let seen = (scenario.feedforward.as_ref()).map(|seen| {
            let instants = if resolved.feedforward_changes() { samples } else { 1 };
            TargetResponse::new(seen, instants, |k| resolved.feedforward_at(resolved.time_s(k)), ts)
        });
        let seen = seen.transpose()?;
        let initial = calibrated(&scenario.initial, delays[0], false)?;
        let last = if changes {
            calibrated(&scenario.last, delays[1], true)?
        } else {
            initial.clone()
        };
        Ok(Self {
            scenario: resolved,
            loops,
            loop_indices: places,
            target_response: seen,
            remnants: Remnants {
                shapings,
                calibrations: [initial, last],
                changes,
            },
        })
    }

    /// Returns this simulator with another drift and other offsets of the stick.
    ///
    /// # Errors
    /// [`SimError::Model`] if a number of the stick is invalid.
    pub fn with_stick(mut self, stick: Stick) -> Result<Self, SimError> {
        let scenario = FamilyScenario {
            stick,
            ..self.scenario.scenario().clone()
        };
        self.scenario = scenario.resolve()?;
        Ok(self)
    }

    /// Returns the scenario.
    pub fn scenario(&self) -> &ResolvedFamilyScenario {
        &self.scenario
    }

    /// Returns the number of samples of a run, including the run-in.
    pub fn sample_count(&self) -> usize {
        self.scenario.run_in_samples() + self.scenario.measurement_samples()
    }

    /// Returns the loop at sample `k`. After the end of the scenario it is the loop at the last sample.
    #[inline]
    pub(super) fn loop_at(&self, k: usize) -> &ZohLoop {
        let index = self
            .loop_indices
            .get(k)
            .or(self.loop_indices.last())
            .copied()
            .unwrap_or(0);
        &self.loops[index].1
    }

    /// Returns the longest delay in whole samples.
    pub(super) fn longest_delay(&self) -> usize {
        self.loops
            .iter()
            .map(|(_, held)| held.longest_delay())
            .max()
            .unwrap_or(0)
    }

    /// Returns the gains K of the parts of the remnant, before and after the change.
    pub fn remnant_gains(&self) -> [&[f64]; 2] {
        let [initial, last] = &self.remnants.calibrations;
        [&initial.gains, &last.gains]
    }

    /// Returns the variance of u in a long run, without the bias and the random walk of the stick, before and after the
    /// change.
    pub fn control_variance(&self) -> [f64; 2] {
        [0, 1].map(|i| self.remnants.calibrations[i].mean_squares[0])
    }

    /// Returns the variance of e in a long run, without the bias and the random walk of the stick, before and after the
    /// change.
    pub fn error_variance(&self) -> [f64; 2] {
        [0, 1].map(|i| self.remnants.calibrations[i].mean_squares[2])
    }

    /// Returns the signals of a run.
    ///
    /// # Errors
    /// [`SimError::Diverged`] if a signal is not finite.
    pub fn signals(&self, run: RunSeed) -> Result<FamilySignals, SimError> {
        let scenario = self.scenario.scenario();
        let (ts, samples) = (scenario.sample_time, self.sample_count());
        let start_s = self.scenario.time_s(0);
        let mut signals = FamilySignals {
            f: forcing_with_phases(&scenario.target, run, TARGET_PHASE_TAG)?.samples(start_s, ts, samples),
            d: forcing_with_phases(&scenario.disturbance, run, DISTURBANCE_PHASE_TAG)?.samples(start_s, ts, samples),
            ..FamilySignals::default()
        };
        let seen = self.response_to_target(run)?;
        let mut remnant = RemnantRun::new(&self.scenario, &self.remnants, run);
        let mut state = LoopState::at_rest(self.loop_at(0), self.longest_delay());
        for k in 0..samples {
            let n = remnant.next(&self.scenario, &self.remnants, k);
            let inputs = Inputs {
                target: signals.f[k],
                disturbance: signals.d[k],
                // The response of the person to the target does not depend on the signals of the loop.
                remnant: n + seen.get(k).copied().unwrap_or(0.0),
            };
            let now = self.loop_at(k).step(&mut state, inputs);
            remnant.update_control(&self.scenario, &self.remnants, k, now.u);
            signals.e.push(now.e + scenario.stick.offset_e);
            signals.u.push(now.u + scenario.stick.offset_u);
            signals.y.push(now.y);
            signals.n.push(n);
        }
        for (signal, values) in [("e", &signals.e), ("u", &signals.u)] {
            if let Some(k) = values.iter().position(|v| !v.is_finite()) {
                return Err(SimError::Diverged {
                    signal,
                    time_s: self.scenario.time_s(k),
                    scenario: scenario.name.clone(),
                });
            }
        }
        Ok(signals)
    }

    /// Returns the response of the person to a visible target, from rest; empty if the target is not visible.
    fn response_to_target(&self, run: RunSeed) -> Result<Vec<f64>, SimError> {
        let scenario = self.scenario.scenario();
        let Some(seen) = &self.target_response else {
            return Ok(Vec::new());
        };
        let shown_s = self.scenario.time_s(0) + seen.preview_s();
        let target = forcing_with_phases(&scenario.target, run, TARGET_PHASE_TAG)?;
        Ok(seen.respond(&target.samples(shown_s, scenario.sample_time, self.sample_count()))?)
    }

    /// Returns one run as a record, from the start of the measurement or, with `keep_run_in`, of the run-in: e, u, d,
    /// y, n, and f_t if there is a target.
    ///
    /// # Errors
    /// [`SimError::Diverged`] if a signal is not finite.
    pub fn run(&self, run: RunSeed, keep_run_in: bool) -> Result<Record, SimError> {
        let signals = self.signals(run)?;
        let scenario = self.scenario.scenario();
        let first = if keep_run_in { 0 } else { self.scenario.run_in_samples() };
        let channel = |name: &str, mut values: Vec<f64>| {
            values.drain(..first);
            Channel::new(name, "deg", values)
        };
        let mut record = Record::new(scenario.sample_time, channel("e", signals.e), channel("u", signals.u))?
            .labelled(scenario.name.clone())
            .starting_at(self.scenario.time_s(first));
        let mut others = vec![("d", signals.d), ("y", signals.y), ("n", signals.n)];
        if !scenario.target.function.sinusoids().is_empty() {
            others.insert(0, ("f_t", signals.f));
        }
        for (name, values) in others {
            let channel = channel(name, values);
            record = record.with_channel(match &self.target_response {
                Some(seen) if name == "f_t" => seen.target(channel),
                _ if name == "y" && scenario.motion.is_some() => channel.with_role("motion"),
                _ => channel,
            })?;
        }
        Ok(record)
    }

    /// As [`FamilySimulator::run`], with the true parameters of the operator at each sample as additional channels.
    /// Only parameters that are finite throughout are included.
    ///
    /// # Errors
    /// Same as [`FamilySimulator::run`].
    pub fn run_with_truth(&self, run: RunSeed, keep_run_in: bool) -> Result<Record, SimError> {
        let mut record = self.run(run, keep_run_in)?;
        let first = self.sample_count() - record.len();
        let named: Vec<_> = self
            .loops
            .iter()
            .map(|(state, _)| state.operator.named_parameters())
            .collect();
        for (i, parameter) in named[0].iter().enumerate() {
            let value = |k: usize| named[self.loop_indices.get(k).copied().unwrap_or(0)][i].value;
            let values: Vec<f64> = (first..self.sample_count()).map(value).collect();
            if values.iter().all(|v| v.is_finite()) {
                record = record.with_channel(Channel::new(parameter.name, parameter.unit, values))?;
            }
        }
        let felt = self.scenario.scenario().motion.as_ref();
        let felt = felt.map(|felt| response_parameters(felt, 0.0));
        let felt = felt.map(|named| true_parameter_channels("y", (first, self.sample_count()), |_| &named));
        let seen = self
            .target_response
            .iter()
            .flat_map(|seen| seen.true_parameters(first, self.sample_count()));
        for channel in seen.chain(felt.into_iter().flatten()) {
            record = record.with_channel(channel)?;
        }
        Ok(record)
    }
}

/// Returns the forcing function with the phases of a run, which are random or fixed.
fn forcing_with_phases(excitation: &Excitation, run: RunSeed, tag: u64) -> Result<ForcingFunction, SimError> {
    if !excitation.random_phases {
        return Ok(excitation.function.clone());
    }
    let lines = excitation.function.sinusoids();
    let phases = run.uniform_with_tag(tag, lines.len());
    let with = |(line, phase): (&Sinusoid, f64)| Sinusoid {
        phase_rad: TAU * phase,
        ..*line
    };
    Ok(ForcingFunction::new(lines.iter().zip(phases).map(with).collect())?)
}
