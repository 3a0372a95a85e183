//! One virtual person, and the runs of this person.
//!
//! Numbers in `[0, 1)` from the random stream (seed, person) give the parameters in a fixed order. If [`Population`]
//! rejects a draw, the next numbers are used. In each run the gain, the lead, `1/T_I`, omega_nm, zeta_nm and the delay
//! are multiplied by `exp(b z)`, where z are normal deviates of the run and b is the spread between runs. A run whose
//! loop is unstable is drawn again.

use hoid_model::{
    Complex64, FamilyOperator, FamilyScenario, FamilyState, Feedforward, Form, ModelError, Record, SampleTime,
    family_scenario::{Display, PREVIEW_S, RemnantPart, Stick, typical_feedforward},
    margins::{MANUAL_CONTROL_RANGE_RAD_S, closed_loop_is_stable, margins},
    operator_family::Coordinate,
};

use super::{
    population::{Plant, Population},
    remnants::RemnantKind,
};
use crate::{RunSeed, SimError, family::FamilySimulator};

/// Task of every person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Task {
    /// Sample time. Default: 1/60 s.
    pub sample_time: SampleTime,
    /// Duration of the measurement in s. Default: 40 s, two periods of the disturbance.
    pub measurement_s: f64,
    /// Duration of the run-in in s. Default: 5 s.
    pub run_in_s: f64,
    /// Spread of the parameters between runs, such as 0.03 for 3 %. Default: 0.
    pub spread_between_runs: f64,
    /// Display of the task. Unless only the error is displayed, a target with lines between those of the disturbance is
    /// displayed, and the person responds to it. Default: only the error.
    pub display: Display,
    /// Time by which [`Display::Preview`] shows the target ahead, in s. Default: 1 s.
    pub preview_s: f64,
}

impl Default for Task {
    fn default() -> Self {
        Self {
            sample_time: SampleTime::AT_60_HZ,
            measurement_s: 40.0,
            run_in_s: 5.0,
            spread_between_runs: 0.0,
            display: Display::Compensatory,
            preview_s: PREVIEW_S,
        }
    }
}

/// Virtual person with all true values.
#[derive(Debug, Clone)]
pub struct Person {
    /// Controlled element of the task.
    pub plant: Plant,
    /// Operator and controlled element, without the spread between runs.
    pub state: FamilyState,
    /// Response to the displayed target, without the spread between runs; `None` if only the error is displayed.
    pub feedforward: Option<Feedforward>,
    /// Kind of remnant.
    pub kind: RemnantKind,
    /// Share of the variance of u that is due to the remnant.
    pub remnant_share: f64,
    /// Parts of the remnant.
    pub remnant: Vec<RemnantPart>,
    /// Drift and offsets of the stick.
    pub stick: Stick,
    /// Crossover frequency of the open loop `Y P` in rad/s.
    pub crossover_rad_s: f64,
    /// Phase margin of the open loop `Y P` in deg.
    pub phase_margin_deg: f64,
    task: Task,
    streams: RunSeed,
    simulator: FamilySimulator,
}

/// Run of a virtual person.
#[derive(Debug, Clone)]
pub struct PersonRun {
    /// Operator and controlled element of this run; they are those of the person if there is no spread between runs.
    pub state: FamilyState,
    /// Response to the displayed target in this run.
    pub feedforward: Option<Feedforward>,
    /// Record of e, u, d, y and n, and of f_t if it is displayed, from the start of the measurement.
    pub record: Record,
}

/// Number of rejected draws after which the ranges of a population count as empty.
const MAX_DRAWS: usize = 2000;
/// Maximum number of draws for a run.
const MAX_RUN_DRAWS: usize = 50;
/// Number of random values per draw.
const VALUES_PER_DRAW: usize = 16;
const PERSON_TAG: u64 = u64::from_le_bytes(*b"person\0\0");
const DISPLAY_TAG: u64 = u64::from_le_bytes(*b"display\0");
const TARGET_SPREAD_TAG: u64 = u64::from_le_bytes(*b"tspread\0");
const SPREAD_TAG: u64 = u64::from_le_bytes(*b"spread\0\0");

impl Person {
    /// Draws the person identified by a seed and a number. If `form` is `None`, one of the forms that people use with
    /// this element is drawn.
    ///
    /// # Errors
    /// [`SimError::Model`] for invalid ranges or an invalid task, and [`SimError::NoAcceptablePerson`] if the ranges
    /// contain no acceptable loop.
    pub fn draw(
        population: &Population,
        task: &Task,
        plant: Plant,
        form: Option<Form>,
        kind: RemnantKind,
        seed: u64,
        person: u64,
    ) -> Result<Self, SimError> {
        population.check()?;
        if !(0.0..=1.0).contains(&task.spread_between_runs) {
            return Err(SimError::Model(ModelError::OutOfRange {
                quantity: "spread of the parameters between runs",
                found: task.spread_between_runs,
                expected: "0 to 1",
            }));
        }
        let streams = RunSeed {
            seed,
            cell: person,
            replication: 0,
        };
        let numbers = streams.uniform_with_tag(PERSON_TAG, VALUES_PER_DRAW * MAX_DRAWS);
        for draw in numbers.chunks_exact(VALUES_PER_DRAW) {
            let form = form.unwrap_or_else(|| {
                let forms = plant.forms();
                forms[(draw[0] * forms.len() as f64) as usize % forms.len()]
            });
            let Some(taken) = loop_of(population, plant, form, &draw[1..])? else {
                continue;
            };
            let AcceptedLoop {
                state,
                crossover_rad_s,
                phase_margin_deg,
            } = taken;
            let remnant_share = population.remnant_share.at(draw[9]);
            let omega = state
                .operator
                .neuromuscular_parameters()
                .map_or(11.0, |(omega, _)| omega);
            let remnant = kind.remnant_parts(remnant_share, omega, [draw[10], draw[11], draw[12]]);
            let mut scenario = FamilyScenario::new(state.clone(), task.sample_time);
            scenario.name = format!("person {person}");
            scenario.disturbance = plant.disturbance().excitation()?;
            if task.display != Display::Compensatory {
                let followed = population.followed.at(streams.uniform_with_tag(DISPLAY_TAG, 1)[0]);
                let [target, disturbance] = plant.interleaved_excitations();
                scenario.target = target.excitation()?;
                scenario.disturbance = disturbance.excitation()?;
                scenario.feedforward = typical_feedforward(&state, task.display, followed, task.preview_s)?;
            }
            scenario.remnant.clone_from(&remnant);
            scenario.measurement_s = task.measurement_s;
            scenario.run_in_s = task.run_in_s;
            // A loop that is stable in continuous time can be unstable in the simulation with sampled signals.
            let simulator = match FamilySimulator::new(&scenario) {
                Err(SimError::Model(ModelError::UnstableLoop { .. })) => continue,
                other => other?,
            };
            let rms = |variance: [f64; 2]| variance[0].sqrt();
            let (of_u, of_e) = (rms(simulator.control_variance()), rms(simulator.error_variance()));
            let stick = Stick {
                bias: 0.0,
                walk_per_root_s: population.walk_per_root_s * of_u,
                offset_e: population.offset * (2.0 * draw[13] - 1.0) * of_e,
                offset_u: population.offset * (2.0 * draw[14] - 1.0) * of_u,
            };
            return Ok(Self {
                feedforward: scenario.feedforward,
                plant,
                kind,
                remnant_share,
                remnant,
                stick,
                crossover_rad_s,
                phase_margin_deg,
                task: *task,
                streams,
                simulator: simulator.with_stick(stick)?,
                state,
            });
        }
        Err(SimError::NoAcceptablePerson {
            form: form.map_or_else(|| "any".to_owned(), |form| form.to_string()),
            plant: plant.to_string(),
            draws: MAX_DRAWS,
        })
    }

    /// Returns the scenario of a run without spread between runs.
    pub fn scenario(&self) -> &FamilyScenario {
        self.simulator.scenario().scenario()
    }

    /// Returns the seed of the random streams of a run.
    pub fn run_seed(&self, run: u64) -> RunSeed {
        RunSeed {
            replication: run,
            ..self.streams
        }
    }

    /// Returns the run with a given number.
    ///
    /// # Errors
    /// [`SimError::NoAcceptablePerson`] if no draw of the parameters gives a stable loop.
    pub fn run(&self, run: u64) -> Result<PersonRun, SimError> {
        let seed = self.run_seed(run);
        if self.task.spread_between_runs == 0.0 {
            return Ok(PersonRun {
                state: self.state.clone(),
                feedforward: self.feedforward.clone(),
                record: self.simulator.run(seed, false)?,
            });
        }
        let number = |operator: &FamilyOperator| operator.coordinates().len();
        let deviates = seed.white_noise_with_tag(SPREAD_TAG, number(&self.state.operator) * MAX_RUN_DRAWS);
        let of_target = self.feedforward.as_ref().map_or(0, |seen| number(&seen.operator));
        // Without a displayed target, there are no deviates for its response in any draw.
        let of_target = seed.white_noise_with_tag(TARGET_SPREAD_TAG, of_target * MAX_RUN_DRAWS);
        for (draw, z) in deviates.chunks_exact(number(&self.state.operator)).enumerate() {
            let state = FamilyState {
                operator: self.task.spread(&self.state.operator, z)?,
                ..self.state.clone()
            };
            let feedforward = match &self.feedforward {
                Some(seen) => Some(self.task.spread_feedforward(seen, &state.operator, &of_target, draw)?),
                None => None,
            };
            let mut scenario = self.scenario().clone();
            scenario.initial = state.clone();
            scenario.last = state.clone();
            scenario.feedforward.clone_from(&feedforward);
            match FamilySimulator::new(&scenario).and_then(|simulator| simulator.run(seed, false)) {
                Ok(record) => {
                    return Ok(PersonRun {
                        state,
                        feedforward,
                        record,
                    });
                }
                Err(SimError::Model(ModelError::UnstableLoop { .. }) | SimError::Diverged { .. }) => {}
                Err(other) => return Err(other),
            }
        }
        Err(SimError::NoAcceptablePerson {
            form: self.state.operator.form().to_string(),
            plant: self.plant.to_string(),
            draws: MAX_RUN_DRAWS,
        })
    }
}

impl Task {
    /// Returns an operator whose parameters are multiplied by `exp(b z)`, where b is the spread between runs.
    fn spread(&self, operator: &FamilyOperator, z: &[f64]) -> Result<FamilyOperator, ModelError> {
        let kinds = operator.form().coordinates(operator.has_neuromuscular());
        let spread = |((x, kind), z): ((&f64, &Coordinate), &f64)| {
            let by = self.spread_between_runs * z;
            match kind {
                Coordinate::LogOmega | Coordinate::LogZeta => x + by,
                _ => x * by.exp(),
            }
        };
        let own = operator.coordinates();
        let coordinates: Vec<f64> = own.iter().zip(&kinds).zip(z).map(spread).collect();
        FamilyOperator::new(operator.form(), operator.has_neuromuscular(), &coordinates)
    }

    /// Returns a response to the target with the spread of a run and the neuromuscular system of the run.
    fn spread_feedforward(
        &self,
        seen: &Feedforward,
        of_run: &FamilyOperator,
        deviates: &[f64],
        draw: usize,
    ) -> Result<Feedforward, ModelError> {
        let number = seen.operator.coordinates().len();
        let own = self.spread(&seen.operator, &deviates[draw * number..(draw + 1) * number])?;
        let shared = match of_run.neuromuscular_parameters() {
            Some((omega, zeta)) => own.with_neuromuscular(omega, zeta)?,
            None => own,
        };
        Ok(Feedforward::new(shared, seen.preview_s))
    }
}

/// Loop that meets the conditions of a population.
struct AcceptedLoop {
    state: FamilyState,
    crossover_rad_s: f64,
    phase_margin_deg: f64,
}

/// Returns the loop of one draw with its crossover frequency and phase margin; `None` if the population rejects it.
fn loop_of(population: &Population, plant: Plant, form: Form, draw: &[f64]) -> Result<Option<AcceptedLoop>, SimError> {
    let kinds = form.coordinates(true);
    let value = |kind: &Coordinate| match kind {
        Coordinate::Gain => 1.0,
        Coordinate::Lead | Coordinate::Linear => population.lead_s.log_interpolated(draw[0]),
        Coordinate::LagRate if draw[1] < population.integrates => 0.0,
        Coordinate::LagRate => 1.0 / population.lag_s.log_interpolated(draw[2]),
        // If the numerator is a double lead with real roots, c_2 is at most (c_1/2)^2.
        Coordinate::Quadratic => (population.lead_s.log_interpolated(draw[0]) / 2.0).powi(2) * draw[3],
        // A lag causes a phase droop with alpha of the order of 1/T_I.
        Coordinate::Droop => 1.0 / population.lag_s.log_interpolated(draw[2]),
        Coordinate::LogOmega => population.omega_nm_rad_s.at(draw[4]).ln(),
        Coordinate::LogZeta => population.zeta_nm.log_interpolated(draw[5]).ln(),
        Coordinate::Delay => population.tau_e_s.at(draw[6]),
    };
    let mut coordinates: Vec<f64> = kinds.iter().map(value).collect();
    let element = plant.transfer_function()?;
    let crossover = population.crossover_rad_s.log_interpolated(draw[7]);
    let unit = FamilyOperator::new(form, true, &coordinates)?;
    let at = unit.response(crossover) * element.response(crossover);
    let margin = (-at).arg().to_degrees();
    if !population.phase_margin_deg.contains(margin) {
        return Ok(None);
    }
    coordinates[0] = 1.0 / at.norm();
    let state = FamilyState {
        operator: FamilyOperator::new(form, true, &coordinates)?,
        controlled_element: element,
    };
    let open_loop = state.open_loop()?;
    // The test frequencies range from a tenth of the crossover frequency to ten times this frequency.
    let is_resonant = (-40..=40).any(|i| {
        let l = open_loop.response(crossover * 10f64.powf(f64::from(i) / 40.0));
        (Complex64::from(1.0) + l).norm() * population.largest_sensitivity < 1.0
    });
    if is_resonant || !closed_loop_is_stable(&open_loop) {
        return Ok(None);
    }
    // The gain may also equal one at frequencies other than the drawn crossover, so the crossover is determined by its
    // definition.
    let found = margins(|omega| open_loop.response(omega), MANUAL_CONTROL_RANGE_RAD_S);
    let (Some(crossover_rad_s), Some(phase_margin_deg)) = (found.crossover_rad_s, found.phase_margin_deg) else {
        return Ok(None);
    };
    let taken = population.phase_margin_deg.contains(phase_margin_deg);
    Ok(taken.then_some(AcceptedLoop {
        state,
        crossover_rad_s,
        phase_margin_deg,
    }))
}
