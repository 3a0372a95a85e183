//! The task of a condition: the controlled element as a function of time, and the excitation of the loop.

use hoid_ident::family::ChannelRole;
use hoid_model::{
    ContinuousTransferFunction, FamilyOperator, FamilyScenario, FamilyState, Form, ModelError, SampleTime,
    family_scenario::{Display, Excitation, MultiSine},
    forcing::ForcingFunction,
    schedule::Schedule,
};

use crate::{
    LabError,
    config::{Condition, Signal},
};

/// The task of a condition: a scenario without its operator.
#[derive(Debug, Clone)]
pub enum TaskDefinition {
    /// One of the conditions C1 to C6, or a similar condition.
    Reference(Box<hoid_model::scenario::ResolvedScenario>),
    /// A task with any controlled element.
    Family(Box<hoid_model::family_scenario::ResolvedFamilyScenario>),
}

impl Signal {
    fn excitation(&self) -> Result<Excitation, ModelError> {
        MultiSine {
            period_s: self.period_s,
            largest: self.largest,
            rms: self.rms,
            interleaved: self.interleaved,
        }
        .excitation()
    }
}

impl Condition {
    /// Returns the task of the condition.
    ///
    /// # Errors
    /// [`LabError::Scenario`], [`LabError::Model`].
    pub fn task_definition(&self) -> Result<TaskDefinition, LabError> {
        if let Some(text) = &self.scenario_text {
            let name = self.scenario.as_deref().unwrap_or(&self.name);
            return Ok(match hoid_io::parse_any_scenario(text, name, &self.name)? {
                hoid_io::AnyScenario::Reference(scenario) => TaskDefinition::Reference(Box::new(scenario.resolve()?)),
                hoid_io::AnyScenario::Family(scenario) => TaskDefinition::Family(Box::new(scenario.resolve()?)),
            });
        }
        let element: ContinuousTransferFunction = self.controlled_element.parse()?;
        let state = |controlled_element| -> Result<FamilyState, ModelError> {
            Ok(FamilyState {
                // The scenario requires an operator, which is not used: the person is at the screen.
                operator: FamilyOperator::new(Form::Gain, false, &[1.0, 0.2])?,
                controlled_element,
            })
        };
        let mut scenario = FamilyScenario::new(state(element)?, SampleTime::AT_100_HZ);
        scenario.name.clone_from(&self.name);
        (scenario.measurement_s, scenario.run_in_s) = (self.measurement_s, self.run_in_s);
        if let Some(last) = &self.last_element {
            scenario.last = state(last.parse()?)?;
            let (rate_per_s, midpoint_s) = (self.rate_per_s, self.change_s.unwrap_or(self.measurement_s / 2.0));
            scenario.schedule = match self.interval_s {
                Some(interval_s) => Schedule::Alternating {
                    rate_per_s,
                    midpoint_s,
                    interval_s,
                },
                None => Schedule::Sigmoid { rate_per_s, midpoint_s },
            };
        }
        let excitation =
            |signal: &Option<Signal>| signal.as_ref().map_or(Ok(Excitation::default()), Signal::excitation);
        scenario.target = excitation(&self.target)?;
        scenario.disturbance = excitation(&self.disturbance)?;
        Ok(TaskDefinition::Family(Box::new(scenario.resolve()?)))
    }

    /// Returns the role of the target for the person, as a role of `hoid identify`; `None` if there is no target or the
    /// display shows the error only.
    ///
    /// # Errors
    /// As [`Condition::task_definition`].
    pub(crate) fn target_role(&self) -> Result<Option<String>, LabError> {
        Ok(self.target_role_in(&self.task_definition()?))
    }

    /// Returns [`Self::target_role`] for the course of this condition.
    pub(crate) fn target_role_in(&self, course: &TaskDefinition) -> Option<String> {
        let [has_target, _] = course.has_lines();
        let feedforward = ChannelRole::Feedforward;
        let role = match self.display {
            Display::Compensatory => None,
            Display::Pursuit => Some(feedforward.to_string()),
            Display::Preview => Some(format!("{feedforward}:{}", self.preview_s)),
        };
        role.filter(|_| has_target)
    }
}

impl TaskDefinition {
    /// Returns the lengths of the run-in and the measurement, in s.
    pub fn durations_s(&self) -> (f64, f64) {
        match self {
            Self::Reference(course) => (course.scenario().run_in_s, course.scenario().measurement_s),
            Self::Family(course) => (course.scenario().run_in_s, course.scenario().measurement_s),
        }
    }

    /// Returns the controlled element at a time from the start of the measurement.
    pub fn element_at(&self, t_s: f64) -> Result<ContinuousTransferFunction, ModelError> {
        match self {
            Self::Reference(course) => course.parameters_at(t_s).controlled_element.transfer_function(),
            Self::Family(course) => Ok(course.state_at(t_s)?.controlled_element),
        }
    }

    /// Returns the controlled element if it is constant.
    ///
    /// # Errors
    /// As [`TaskDefinition::element_at`].
    pub fn constant_element(&self) -> Result<Option<ContinuousTransferFunction>, ModelError> {
        match self.change_s() {
            None => self.element_at(0.0).map(Some),
            Some(_) => Ok(None),
        }
    }

    /// Returns the target and the disturbance.
    pub fn excitations(&self) -> [Excitation; 2] {
        let fixed = |function: &ForcingFunction| Excitation {
            function: function.clone(),
            random_phases: false,
        };
        match self {
            Self::Reference(course) => [fixed(&course.scenario().forcing), Excitation::default()],
            Self::Family(course) => [course.scenario().target.clone(), course.scenario().disturbance.clone()],
        }
    }

    /// Returns whether the target and the disturbance, in this order, have lines.
    pub fn has_lines(&self) -> [bool; 2] {
        self.excitations()
            .map(|excitation| !excitation.function.sinusoids().is_empty())
    }

    /// Returns the position of the leading gain in the realisation of the controlled element.
    pub fn realisation(&self) -> hoid_model::scenario::Realisation {
        match self {
            Self::Reference(course) => course.scenario().realisation,
            Self::Family(course) => course.scenario().realisation,
        }
    }

    /// Returns the time of the change (s); `None` if the element does not change.
    pub fn change_s(&self) -> Option<f64> {
        match self {
            Self::Reference(course) => course.scenario().schedule.change_s(),
            Self::Family(course) => course.scenario().schedule.change_s(),
        }
    }
}
