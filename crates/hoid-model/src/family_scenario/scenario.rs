//! The task of an operator of the family.

use super::{
    multi_sine::Excitation,
    remnant::{RemnantPart, Stick},
    state::FamilyState,
};
use crate::{
    FamilyOperator, Feedforward, ModelError, SampleTime,
    delayed_operator::whole_samples,
    feedforward::{OperatorWithDelay, delay_at, delays},
    scenario::Realisation,
    schedule::Schedule,
};

/// Longest run, in samples.
const MAX_SAMPLES: usize = 100_000_000;

/// One task: operator, controlled element, excitation, remnant, stick and change over time.
#[derive(Debug, Clone, PartialEq)]
pub struct FamilyScenario {
    /// Name of the task in tables and file names.
    pub name: String,
    /// State before the change.
    pub initial: FamilyState,
    /// State after the change. It has the same form as the state before the change.
    pub last: FamilyState,
    /// Course of the change over time.
    pub schedule: Schedule,
    /// Target f.
    pub target: Excitation,
    /// Response of u to the displayed target; `None` if the display shows only the error.
    pub feedforward: Option<Feedforward>,
    /// Response of u to the motion y of the controlled element, which the person feels; `None` without motion. It
    /// shares the neuromuscular system of the response to the error.
    pub motion: Option<FamilyOperator>,
    /// Disturbance d at the input of the controlled element, held over each sample.
    pub disturbance: Excitation,
    /// Independent parts of the remnant.
    pub remnant: Vec<RemnantPart>,
    /// Drift of the stick and offsets of the recording.
    pub stick: Stick,
    /// Time between two samples.
    pub sample_time: SampleTime,
    /// Measurement time, s.
    pub measurement_s: f64,
    /// Run-in before the measurement, s.
    pub run_in_s: f64,
    /// Position of the leading gain of the controlled element.
    pub realisation: Realisation,
}

/// A scenario that has been checked.
#[derive(Debug, Clone, PartialEq)]
pub struct ResolvedFamilyScenario {
    scenario: FamilyScenario,
    /// Delay before and after the change, each as a number of whole samples and a fraction of a sample.
    delays: [(usize, f64); 2],
    run_in_samples: usize,
    measurement_samples: usize,
}

impl FamilyScenario {
    /// Returns a task of 40 s after a run-in of 5 s, with an operator and a controlled element but no excitation,
    /// remnant or change.
    pub fn new(state: FamilyState, sample_time: SampleTime) -> Self {
        Self {
            name: "people".to_owned(),
            last: state.clone(),
            initial: state,
            schedule: Schedule::Constant,
            target: Excitation::default(),
            feedforward: None,
            motion: None,
            disturbance: Excitation::default(),
            remnant: Vec::new(),
            stick: Stick::default(),
            sample_time,
            measurement_s: 40.0,
            run_in_s: 5.0,
            realisation: Realisation::default(),
        }
    }

    /// Checks the scenario and computes the quantities that a simulation needs.
    ///
    /// # Errors
    /// [`ModelError`], which names the quantity.
    pub fn resolve(&self) -> Result<ResolvedFamilyScenario, ModelError> {
        self.schedule.check()?;
        let wrong = |quantity, found, expected| ModelError::OutOfRange {
            quantity,
            found,
            expected,
        };
        let whole = |quantity, time_s: f64| {
            let samples = self.sample_time.whole_samples(time_s);
            samples.ok_or_else(|| wrong(quantity, time_s, "zero or more, and a whole number of samples"))
        };
        let measurement_samples = whole("measurement time T_m in s", self.measurement_s)?;
        let run_in_samples = whole("run-in time t_0 in s", self.run_in_s)?;
        let all = run_in_samples + measurement_samples;
        if measurement_samples == 0 || all > MAX_SAMPLES {
            let expected = "one to 1e8 samples including the run-in";
            return Err(wrong("measurement time T_m in s", self.measurement_s, expected));
        }
        if !self.initial.has_same_form(&self.last) {
            return Err(ModelError::Operator {
                reason: format!(
                    "the form of the operator and the number of poles of the controlled element change from {} and {} \
                     to {} and {}; expected the same before and after",
                    self.initial.operator.form(),
                    self.initial.controlled_element.den().len() - 1,
                    self.last.operator.form(),
                    self.last.controlled_element.den().len() - 1,
                ),
            });
        }
        for state in [&self.initial, &self.last] {
            let delay = state.controlled_element.delay_s();
            if delay != 0.0 {
                let expected = "zero; add this delay to that of the operator";
                return Err(wrong("delay of the controlled element in s", delay, expected));
            }
        }
        let delays = delays(
            [self.initial.operator.tau_e_s(), self.last.operator.tau_e_s()],
            self.sample_time,
        )?;
        if let Some(seen) = &self.feedforward {
            seen.check(&self.schedule, self.sample_time)?;
            if seen.operator.has_neuromuscular() != self.initial.operator.has_neuromuscular() {
                return Err(ModelError::Operator {
                    reason:
                        "only one of the responses to error and target has neuromuscular dynamics; expected both or \
                             neither, since they share one neuromuscular system"
                            .to_owned(),
                });
            }
        }
        if let Some(felt) = &self.motion {
            if felt.has_neuromuscular() != self.initial.operator.has_neuromuscular() {
                return Err(ModelError::Operator {
                    reason:
                        "only one of the responses to error and motion has neuromuscular dynamics; expected both or \
                             neither, since they share one neuromuscular system"
                            .to_owned(),
                });
            }
            whole_samples(felt.tau_e_s(), self.sample_time)?;
        }
        self.remnant.iter().try_for_each(RemnantPart::check)?;
        self.stick.check()?;
        let share: f64 = self.remnant.iter().filter_map(RemnantPart::share).sum();
        if share >= 1.0 {
            let quantity = "share of the variance of u due to all parts of the remnant";
            return Err(wrong(quantity, share, "below one"));
        }
        Ok(ResolvedFamilyScenario {
            scenario: self.clone(),
            delays,
            run_in_samples,
            measurement_samples,
        })
    }
}

impl ResolvedFamilyScenario {
    /// Returns the scenario from which the quantities were computed.
    pub fn scenario(&self) -> &FamilyScenario {
        &self.scenario
    }

    /// Number of samples of the run-in, before t = 0.
    pub fn run_in_samples(&self) -> usize {
        self.run_in_samples
    }

    /// Number of samples of the measurement.
    pub fn measurement_samples(&self) -> usize {
        self.measurement_samples
    }

    /// Time of sample `k` of the run, s; t = 0 is the start of the measurement.
    pub fn time_s(&self, k: usize) -> f64 {
        -(self.run_in_samples as f64) * self.scenario.sample_time.s() + k as f64 * self.scenario.sample_time.s()
    }

    /// Returns the delays before and after the change, each as a number of whole samples and a fraction of a sample. If
    /// the delay changes, both are rounded to whole samples.
    pub fn delays(&self) -> [(usize, f64); 2] {
        self.delays
    }

    /// Returns the delay at time `t_s` as a number of whole samples and a fraction of a sample; it is rounded to the
    /// nearest whole sample if the delay changes.
    pub fn delay_at(&self, t_s: f64) -> (usize, f64) {
        delay_at(self.delays, &self.scenario.schedule, t_s)
    }

    /// True if the response to the target or its neuromuscular system changes over time.
    pub fn feedforward_changes(&self) -> bool {
        let FamilyScenario { initial, last, .. } = &self.scenario;
        let changes = self.scenario.schedule.change_s().is_some();
        let seen = self.scenario.feedforward.as_ref();
        let muscles = initial.operator.neuromuscular_parameters() != last.operator.neuromuscular_parameters();
        changes && seen.is_some_and(|seen| seen.last.is_some() || muscles)
    }

    /// Returns the response to motion with the neuromuscular system of the given state, and its delay as a number of
    /// whole samples and a fraction of a sample; `None` without motion.
    ///
    /// # Errors
    /// As [`FamilyOperator::new`].
    pub fn motion_in(&self, state: &FamilyState) -> Result<Option<OperatorWithDelay>, ModelError> {
        let FamilyScenario { initial, last, .. } = &self.scenario;
        let Some(felt) = &self.scenario.motion else {
            return Ok(None);
        };
        let changes = initial.operator.neuromuscular_parameters() != last.operator.neuromuscular_parameters();
        let felt = match state.operator.neuromuscular_parameters().filter(|_| changes) {
            Some((omega, zeta)) => felt.with_neuromuscular(omega, zeta)?,
            None => felt.clone(),
        };
        let tau_s = felt.tau_e_s();
        let [delay, _] = delays([tau_s; 2], self.scenario.sample_time)?;
        Ok(Some((felt, delay)))
    }

    /// Returns the responses to the target before and after the change.
    ///
    /// # Errors
    /// As [`FamilyOperator::new`].
    pub fn feedforward_of_states(&self) -> Result<[Option<FamilyOperator>; 2], ModelError> {
        let Some(seen) = &self.scenario.feedforward else {
            return Ok([None, None]);
        };
        let FamilyScenario { initial, last, .. } = &self.scenario;
        let mut after = seen.last.as_ref().unwrap_or(&seen.operator).clone();
        let muscles = last.operator.neuromuscular_parameters();
        if let Some((omega, zeta)) = muscles.filter(|_| muscles != initial.operator.neuromuscular_parameters()) {
            after = after.with_neuromuscular(omega, zeta)?;
        }
        Ok([Some(seen.operator.clone()), Some(after)])
    }

    /// Returns the response to the target at time `t_s`, with its delay as a number of whole samples and a fraction of
    /// a sample; `None` if the person does not see the target.
    ///
    /// # Errors
    /// As [`ResolvedFamilyScenario::state_at`].
    pub fn feedforward_at(&self, t_s: f64) -> Result<Option<OperatorWithDelay>, ModelError> {
        let FamilyScenario {
            initial,
            last,
            schedule,
            sample_time,
            feedforward,
            ..
        } = &self.scenario;
        let Some(seen) = feedforward else { return Ok(None) };
        let (before, after) = (
            initial.operator.neuromuscular_parameters(),
            last.operator.neuromuscular_parameters(),
        );
        let between = |a: f64, b: f64| schedule.value(a, b, t_s);
        let muscles = before.zip(after).filter(|(before, after)| before != after);
        let muscles = muscles.map(|(a, b)| (between(a.0, b.0), between(a.1, b.1)));
        Ok(Some(seen.at(t_s, schedule, *sample_time, muscles)?))
    }

    /// Returns the operator and the controlled element at time `t_s`.
    ///
    /// # Errors
    /// [`ModelError`] if the transition between the two valid states passes through an invalid state.
    pub fn state_at(&self, t_s: f64) -> Result<FamilyState, ModelError> {
        let FamilyScenario {
            initial,
            last,
            schedule,
            sample_time,
            ..
        } = &self.scenario;
        let state = initial.interpolated(last, |a, b| schedule.value(a, b, t_s))?;
        if initial.operator.tau_e_s() == last.operator.tau_e_s() {
            return Ok(state);
        }
        let delay_s = self.delay_at(t_s).0 as f64 * sample_time.s();
        Ok(FamilyState {
            operator: state.operator.with_delay(delay_s)?,
            ..state
        })
    }
}
