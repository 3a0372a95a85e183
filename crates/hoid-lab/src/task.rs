//! The tables of a run, which the page uses and from which Rust recomputes the run.
//!
//! The controlled element is discretised exactly over a tick of 1 ms (zero-order hold, [`hoid_model::zoh_system`]). If
//! it varies, the matrices of each block of ten ticks are computed from the continuous model at the middle of the
//! block. The target and the disturbance are sampled at every tick; they are faded in linearly over the first seconds
//! of the run-in, so that a run does not start with a jump.

use std::{collections::BTreeMap, f64::consts::TAU};

use hoid_model::{
    SampleTime,
    family_scenario::Excitation,
    forcing::{ForcingFunction, Sinusoid},
    scenario::Realisation,
    zoh_system::ZohSystem,
};
use hoid_sim::RunSeed;
use serde::{Deserialize, Serialize};

use crate::{LabError, config::Condition, plant::Plant};

/// Length of a tick, s.
pub const TICK_S: f64 = 1e-3;
/// Number of ticks per sample of a record.
pub const TICKS_PER_SAMPLE: usize = 10;
/// Time (in s) over which the target and the disturbance are faded in.
const FADE_S: f64 = 3.0;

/// A controlled element, and the tick from which it applies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Phase {
    /// First tick at which the element applies.
    pub from: usize,
    /// Matrices of the element.
    #[serde(flatten)]
    pub plant: Plant,
}

/// The tables of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Number of ticks before the measurement.
    pub run_in: usize,
    /// Total number of ticks, including the run-in.
    pub ticks: usize,
    /// Controlled elements; the first applies from tick 0.
    pub phases: Vec<Phase>,
    /// Target at each tick, continued beyond the end of the run by the preview time.
    pub target: Vec<f64>,
    /// Disturbance at each tick.
    pub disturbance: Vec<f64>,
}

/// Signals of the loop.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Signals {
    /// Input u from the device at each tick.
    pub u: Vec<f64>,
    /// Error e at each tick.
    pub e: Vec<f64>,
}

impl Task {
    /// Creates the tables of a run. `cell` is the index of the condition and `replication` the number of the run; with
    /// the seed of the condition they determine the phases.
    ///
    /// # Errors
    /// [`LabError::Message`] if the condition, which may come from a file, is invalid; [`LabError::Model`] for an
    /// element that cannot be discretised.
    pub fn new(condition: &Condition, cell: u64, replication: u64) -> Result<Self, LabError> {
        condition.check()?;
        let course = condition.task_definition()?;
        let tick = SampleTime::new(TICK_S)?;
        let (run_in_s, measured_s) = course.durations_s();
        let whole = |s: f64| (s / TICK_S).round() as usize;
        let (run_in, ticks) = (whole(run_in_s), whole(run_in_s).saturating_add(whole(measured_s)));
        let start_s = -(run_in as f64) * TICK_S;
        let mut phases: Vec<Phase> = Vec::new();
        let mut last = None;
        for from in (0..ticks).step_by(TICKS_PER_SAMPLE) {
            let element = course.element_at(start_s + from.saturating_add(TICKS_PER_SAMPLE / 2) as f64 * TICK_S)?;
            if last.as_ref() == Some(&element) {
                continue;
            }
            let plant = discretise_with_hold(element.num(), element.den(), course.realisation(), tick)?;
            phases.push(Phase { from, plant });
            last = Some(element);
            if course.change_s().is_none() {
                break;
            }
        }
        let seed = RunSeed {
            seed: condition.seed,
            cell,
            replication,
        };
        let [target, disturbance] = course.excitations();
        let lines = [&target, &disturbance].map(|excitation| excitation.function.sinusoids().len());
        let mut turns = seed.uniform_numbers(lines.iter().sum()).into_iter();
        let fade = FADE_S.min(run_in_s);
        let mut table = |excitation: &Excitation, n: usize| -> Result<Vec<f64>, LabError> {
            let mut values = draw_phases(excitation, &mut turns)?.samples(start_s, tick, n);
            for (k, value) in values.iter_mut().enumerate().take(whole(fade)) {
                *value *= k as f64 * TICK_S / fade;
            }
            Ok(values)
        };
        Ok(Self {
            run_in,
            ticks,
            phases,
            target: table(&target, ticks.saturating_add(whole(condition.preview_s)))?,
            disturbance: table(&disturbance, ticks)?,
        })
    }

    /// Simulates the loop with the given u.
    pub fn run(&self, u: &[f64]) -> Signals {
        let mut signals = Signals {
            u: u.to_vec(),
            e: Vec::with_capacity(u.len()),
        };
        let mut phases = self.phases.iter().peekable();
        let Some(mut phase) = phases.next() else {
            return signals;
        };
        let mut state = vec![0.0; phase.plant.order()];
        let forcing = self.target.iter().zip(&self.disturbance);
        for (k, (u, (target, disturbance))) in u.iter().zip(forcing).enumerate().take(self.ticks) {
            phase = phases.next_if(|next| next.from <= k).unwrap_or(phase);
            let v = u + disturbance;
            signals.e.push(target - phase.plant.output(&state, v));
            phase.plant.step(&mut state, v);
        }
        signals
    }
}

/// Returns the excitation as a function of time, with random phases if requested.
fn draw_phases(excitation: &Excitation, turns: &mut impl Iterator<Item = f64>) -> Result<ForcingFunction, LabError> {
    if !excitation.random_phases {
        return Ok(excitation.function.clone());
    }
    let sinusoids = excitation.function.sinusoids().iter().zip(turns);
    let drawn = sinusoids.map(|(s, turn)| Sinusoid {
        phase_rad: TAU * turn,
        ..*s
    });
    Ok(ForcingFunction::new(drawn.collect())?)
}

/// Discretises a controlled element over one tick; `realisation` gives the position of its leading gain.
fn discretise_with_hold(
    num: &[f64],
    den: &[f64],
    realisation: Realisation,
    tick: SampleTime,
) -> Result<Plant, LabError> {
    let gain = num.first().copied().unwrap_or(0.0);
    let shape: Vec<f64> = num.iter().map(|c| if gain == 0.0 { *c } else { c / gain }).collect();
    let system = ZohSystem::new(&shape, den, 0.0, tick)?;
    let scaled = |values: &[f64], by: f64| values.iter().map(|v| v * by).collect::<Vec<_>>();
    let (at_input, at_output) = match realisation {
        Realisation::Input => (gain, 1.0),
        Realisation::Output => (1.0, gain),
    };
    Ok(Plant {
        a: system.transition_matrix().to_vec(),
        b: scaled(system.input_vector(), at_input),
        c: scaled(system.output_row(), at_output),
        d: system.direct_feedthrough() * gain,
    })
}

/// Returns u at each tick from the events `(tick, u)` in chronological order: u of the last event that has taken
/// effect.
pub fn held_inputs(events: &[(usize, f64)], ticks: usize) -> Vec<f64> {
    let by_tick: BTreeMap<usize, f64> = events.iter().copied().collect();
    let mut u = 0.0;
    (0..ticks)
        .map(|k| {
            u = by_tick.get(&k).copied().unwrap_or(u);
            u
        })
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::config::{Condition, Signal};

    fn condition(element: &str) -> Condition {
        Condition {
            controlled_element: element.to_owned(),
            measurement_s: 20.0,
            run_in_s: 5.0,
            target: Some(Signal::default()),
            ..Condition::default()
        }
    }

    #[test]
    fn held_double_integrator_is_exact() {
        let task = Task::new(
            &Condition {
                target: None,
                disturbance: Some(Signal {
                    rms: 0.0,
                    ..Signal::default()
                }),
                ..condition("2/s^2")
            },
            0,
            1,
        )
        .unwrap();
        let signals = task.run(&vec![3.0; task.ticks]);
        for k in (0..task.ticks).step_by(997) {
            let t = k as f64 * TICK_S;
            // y = 2 * 3 * t^2/2.
            assert!((signals.e[k] + 3.0 * t * t).abs() < 1e-7 * (1.0 + t * t), "{k}");
        }
    }

    #[test]
    fn loop_matches_the_simulator() {
        // The simulator of C4 at 100 Hz, with u held over ten ticks, agrees with the task at 1 kHz: both holds are
        // exact, and the element changes in the same blocks. The only difference is that the task evaluates the element
        // at the middle of each block.
        use hoid_model::scenario::{Condition as Reference, Scenario};
        use hoid_sim::Simulator;
        let own = Condition {
            scenario: Some("C1".to_owned()),
            scenario_text: Some("condition = \"C1\"\n".to_owned()),
            ..Condition::default()
        };
        let task = Task::new(&own, 0, 0).unwrap();
        let simulator = Simulator::new(&Scenario::condition(Reference::C1)).unwrap();
        let signals = simulator
            .signals(&RunSeed::default().white_noise(simulator.sample_count()))
            .unwrap();
        // Only ticks after the fade-in are compared, because the simulator has no fade-in.
        let faded = (FADE_S / TICK_S) as usize;
        let forcing = hoid_model::forcing::ForcingFunction::reference();
        let whole = forcing.samples(-10.0, SampleTime::new(TICK_S).unwrap(), faded);
        let mut task = task;
        task.target[..faded].copy_from_slice(&whole);
        let u: Vec<f64> = signals.u.iter().flat_map(|u| [*u; TICKS_PER_SAMPLE]).collect();
        let found = task.run(&u);
        assert_eq!(found.e.len(), task.ticks);
        for (k, e) in signals.e.iter().enumerate() {
            let ours = found.e[k * TICKS_PER_SAMPLE];
            assert!((ours - e).abs() < 1e-9 * (1.0 + e.abs()), "{k}: {ours} {e}");
        }
    }

    #[test]
    fn elements_change_on_schedule() {
        let changing = Condition {
            last_element: Some("8/s".to_owned()),
            change_s: Some(10.0),
            rate_per_s: 2.0,
            ..condition("4/s")
        };
        let task = Task::new(&changing, 0, 1).unwrap();
        let gain = |k: usize| {
            let phase = task.phases.iter().rfind(|phase| phase.from <= k).unwrap();
            phase.plant.b[0] * phase.plant.c[0] / TICK_S
        };
        assert!((gain(0) - 4.0).abs() < 1e-6 && (gain(task.ticks - 1) - 8.0).abs() < 1e-6);
        // The gain at the middle of the change is correct to within one block; its slope there is 4 * 2/4 per second.
        assert!((gain(15_000) - 6.0).abs() < 0.02);
        assert!(task.phases.windows(2).all(|pair| pair[0].from < pair[1].from));
        assert_eq!(Task::new(&condition("4/s"), 0, 1).unwrap().phases.len(), 1);
    }

    #[test]
    fn phases_differ_between_runs_and_are_reproducible() {
        let own = condition("4/s");
        let [a, again, b] = [1, 1, 2].map(|run| Task::new(&own, 0, run).unwrap().target);
        assert_eq!(a, again);
        assert_ne!(a, b);
        assert_eq!(a[0], 0.0);
        let rms = |x: &[f64]| (x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64).sqrt();
        // The sum is over one whole period.
        assert!((rms(&a[5_000..25_000]) - 1.5).abs() < 1e-3);
    }

    #[test]
    fn inputs_are_held_until_the_next() {
        assert_eq!(
            held_inputs(&[(2, 1.0), (2, 3.0), (4, 5.0)], 6),
            [0.0, 0.0, 3.0, 3.0, 5.0, 5.0]
        );
        assert_eq!(held_inputs(&[], 2), [0.0; 2]);
    }
}
