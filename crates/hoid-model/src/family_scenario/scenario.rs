//! The task of an operator of the family.

use super::{
    multi_sine::Excitation,
    remnant::{RemnantPart, Stick},
    state::FamilyState,
};
use crate::{
    FamilyOperator, ModelError, SampleTime, delayed_operator::whole_samples, operator_family::Coordinate,
    scenario::Realisation, schedule::Schedule,
};

/// Longest preview, s.
const LONGEST_PREVIEW_S: f64 = 60.0;
/// Longest run, in samples.
const MOST_SAMPLES: usize = 100_000_000;

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

/// Response of a person to the displayed target.
#[derive(Debug, Clone, PartialEq)]
pub struct Feedforward {
    /// Operator from the target to u; its delay is relative to the end of the preview.
    pub operator: FamilyOperator,
    /// Preview time, s.
    pub preview_s: f64,
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
        if measurement_samples == 0 || all > MOST_SAMPLES {
            let expected = "one to 1e8 samples including the run-in";
            return Err(wrong("measurement time T_m in s", self.measurement_s, expected));
        }
        if !self.initial.is_like(&self.last) {
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
                let expected = "no delay: the delay of a task belongs to the operator";
                return Err(wrong("delay of the controlled element in s", delay, expected));
            }
        }
        let changes = self.initial.operator.tau_e_s() != self.last.operator.tau_e_s();
        let mut delays = [(0, 0.0); 2];
        for (delay, state) in delays.iter_mut().zip([&self.initial, &self.last]) {
            let tau = state.operator.tau_e_s() / self.sample_time.s();
            let whole = whole_samples(state.operator.tau_e_s(), self.sample_time)?;
            *delay = if changes {
                (tau.round() as usize, 0.0)
            } else {
                // If tau is an integer number of samples, this remainder is only a rounding error.
                let late = tau - whole as f64;
                (whole, if late < 1e-9 { 0.0 } else { late })
            };
        }
        if let Some(seen) = &self.feedforward {
            whole("displayed future of the target in s", seen.preview_s)?;
            if seen.preview_s > LONGEST_PREVIEW_S {
                let quantity = "displayed future of the target in s";
                return Err(wrong(quantity, seen.preview_s, "at most 60 s"));
            }
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
        let [initial, last] = self.delays;
        if initial == last {
            return initial;
        }
        let delay = self.scenario.schedule.value(initial.0 as f64, last.0 as f64, t_s);
        (delay.round() as usize, 0.0)
    }

    /// Returns operator and controlled element at time `t_s`.
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
        let mut coordinates = state.operator.coordinates().to_vec();
        let kinds = state.operator.form().coordinates(state.operator.has_neuromuscular());
        for (x, kind) in coordinates.iter_mut().zip(kinds) {
            if kind == Coordinate::Delay {
                *x = self.delay_at(t_s).0 as f64 * sample_time.s();
            }
        }
        let operator = &state.operator;
        Ok(FamilyState {
            operator: FamilyOperator::new(operator.form(), operator.has_neuromuscular(), &coordinates)?,
            ..state
        })
    }
}
