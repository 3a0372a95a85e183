//! Changes to a scenario that commands and functions accept: the options of `hoid simulate` and `pyhoid.simulate`.

use hoid_model::{
    FamilyScenario, Feedforward, ModelError, SampleTime,
    forcing::ForcingFunction,
    remnant_gain::NoiseDefinition,
    scenario::{Realisation, Scenario},
};
use thiserror::Error;

use super::reading::AnyScenario;

/// Values that replace the values of a scenario; `None` keeps the value of the scenario.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ScenarioChanges {
    /// Order m of the remnant filter.
    pub remnant_order: Option<usize>,
    /// Noise level P_n.
    pub noise_level: Option<f64>,
    /// Definition of the noise level.
    pub noise_definition: Option<NoiseDefinition>,
    /// Time constant T_n of the remnant, s.
    pub remnant_time_constant: Option<f64>,
    /// Sample time, s.
    pub sample_time: Option<f64>,
    /// Position of the leading gain of the controlled element.
    pub realisation: Option<Realisation>,
    /// Response to the displayed target as text ([`Feedforward::from_text`]), or `none`.
    pub feedforward: Option<String>,
    /// Root mean square of the disturbance at the input of the controlled element, deg; zero for none.
    pub disturbance: Option<f64>,
}

/// A change that is not possible for a scenario.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{option} {reason}")]
pub struct ScenarioChangeError {
    /// Name of the option, such as `noise_definition`.
    pub option: &'static str,
    /// The problem and the remedy.
    pub reason: String,
}

impl ScenarioChanges {
    /// Returns the changed scenario.
    ///
    /// # Errors
    /// [`ScenarioChangeError`] with the name of the option.
    pub fn apply(&self, scenario: AnyScenario) -> Result<AnyScenario, ScenarioChangeError> {
        Ok(match scenario {
            AnyScenario::Reference(scenario) => AnyScenario::Reference(Box::new(self.apply_to_reference(*scenario)?)),
            AnyScenario::Family(scenario) => AnyScenario::Family(Box::new(self.apply_to_family(*scenario)?)),
        })
    }

    fn apply_to_reference(&self, mut scenario: Scenario) -> Result<Scenario, ScenarioChangeError> {
        if let Some(order) = self.remnant_order {
            scenario.remnant.order = order;
        }
        if let Some(time_constant) = self.remnant_time_constant {
            scenario.remnant.time_constant_s = time_constant;
        }
        if let Some(ts) = self.sample_time {
            scenario.sample_time = sample_time(ts)?;
        }
        if let Some(realisation) = self.realisation {
            scenario.realisation = realisation;
        }
        let strength = scenario.remnant.strength;
        scenario.remnant.strength =
            (strength.with_level(self.noise_level, self.noise_definition)).ok_or_else(|| ScenarioChangeError {
                option: "noise_definition",
                reason: "needs a noise level, but the scenario gives the gain K_n instead".to_owned(),
            })?;
        if let Some(text) = &self.feedforward {
            let of = scenario.initial.operator;
            scenario.feedforward = feedforward(text, Some((of.omega_nm_rad_s, of.zeta_nm)))?;
        }
        if let Some(rms) = self.disturbance {
            scenario.disturbance =
                rescaled_disturbance(&scenario.disturbance, rms).map_err(|error| ScenarioChangeError {
                    option: "disturbance",
                    reason: format!("is wrong: {error}"),
                })?;
        }
        Ok(scenario)
    }

    /// Rejects the remnant and disturbance options, because the scenario file of an operator of the family defines
    /// both.
    fn apply_to_family(&self, mut scenario: FamilyScenario) -> Result<FamilyScenario, ScenarioChangeError> {
        let remnant = "applies only to the remnant of the thesis; in a scenario with a form, specify the remnant in \
                       [[remnant]] tables";
        let disturbance = "applies only to the conditions of the thesis; in a scenario with a form, specify the \
                           disturbance in the [disturbance] table";
        for (option, is_given, reason) in [
            ("remnant_order", self.remnant_order.is_some(), remnant),
            ("noise_level", self.noise_level.is_some(), remnant),
            ("noise_definition", self.noise_definition.is_some(), remnant),
            ("remnant_time_constant", self.remnant_time_constant.is_some(), remnant),
            ("disturbance", self.disturbance.is_some(), disturbance),
        ] {
            if is_given {
                return Err(ScenarioChangeError {
                    option,
                    reason: reason.to_owned(),
                });
            }
        }
        if let Some(ts) = self.sample_time {
            scenario.sample_time = sample_time(ts)?;
        }
        if let Some(realisation) = self.realisation {
            scenario.realisation = realisation;
        }
        if let Some(text) = &self.feedforward {
            scenario.feedforward = feedforward(text, scenario.initial.operator.neuromuscular_parameters())?;
            if scenario.feedforward.is_some() && scenario.target.function.sinusoids().is_empty() {
                return Err(ScenarioChangeError {
                    option: "feedforward",
                    reason: "needs a target: add [target] to the scenario".to_owned(),
                });
            }
        }
        Ok(scenario)
    }
}

fn sample_time(ts: f64) -> Result<SampleTime, ScenarioChangeError> {
    SampleTime::new(ts).map_err(|error| ScenarioChangeError {
        option: "sample_time",
        reason: format!("is wrong: {error}"),
    })
}

fn feedforward(text: &str, neuromuscular: Option<(f64, f64)>) -> Result<Option<Feedforward>, ScenarioChangeError> {
    if text.trim() == "none" {
        return Ok(None);
    }
    let found = Feedforward::from_text(text, neuromuscular).map_err(|error| ScenarioChangeError {
        option: "feedforward",
        reason: format!("is wrong: {error}"),
    })?;
    Ok(Some(found))
}

/// Returns a disturbance with the lines of `known` and another root mean square. If `known` has no lines, the lines are
/// between the lines of the target of the thesis.
pub(super) fn rescaled_disturbance(known: &ForcingFunction, rms_deg: f64) -> Result<ForcingFunction, ModelError> {
    let reference = ForcingFunction::reference_disturbance(rms_deg)?;
    let own = known.rms_deg();
    if own == 0.0 || rms_deg == 0.0 {
        return Ok(reference);
    }
    let mut lines = known.sinusoids().to_vec();
    lines.iter_mut().for_each(|line| line.amplitude_deg *= rms_deg / own);
    ForcingFunction::new(lines)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::Condition;

    use super::*;

    fn changed(condition: Condition, changes: &ScenarioChanges) -> Result<Scenario, ScenarioChangeError> {
        let base = AnyScenario::Reference(Box::new(Scenario::condition(condition)));
        match changes.apply(base)? {
            AnyScenario::Reference(scenario) => Ok(*scenario),
            AnyScenario::Family(_) => unreachable!(),
        }
    }

    fn family(target: &str, changes: &ScenarioChanges) -> Result<FamilyScenario, ScenarioChangeError> {
        let text = format!(
            "form = \"gain\"\n{target}\n[initial]\nK = 2\nomega_nm_rad_s = 11\nzeta_nm = 0.3\ntau_e_s = 0.2\n\
             controlled_element = \"1/s\""
        );
        let base = super::super::parse_any_scenario(&text, "x.toml", "x").unwrap();
        match changes.apply(base)? {
            AnyScenario::Family(scenario) => Ok(*scenario),
            AnyScenario::Reference(_) => unreachable!(),
        }
    }

    #[test]
    fn empty_changes_leave_the_scenario_unchanged() {
        let same = changed(Condition::C4, &ScenarioChanges::default()).unwrap();
        assert_eq!(same, Scenario::condition(Condition::C4));
    }

    #[test]
    fn display_and_disturbance_are_added_and_removed() {
        let changes = ScenarioChanges {
            feedforward: Some("derivative:0.15,tau_f=0.1,preview=0.25".to_owned()),
            disturbance: Some(0.2),
            noise_level: Some(0.0),
            sample_time: Some(0.005),
            ..ScenarioChanges::default()
        };
        let scenario = changed(Condition::C4, &changes).unwrap();
        let seen = scenario.feedforward.clone().unwrap();
        assert_eq!((seen.operator.coordinates()[0], seen.preview_s), (0.15, 0.25));
        assert!((scenario.disturbance.rms_deg() - 0.2).abs() < 1e-15);
        assert_eq!(scenario.sample_time.s(), 0.005);
        let away = ScenarioChanges {
            feedforward: Some("none".to_owned()),
            disturbance: Some(0.0),
            ..ScenarioChanges::default()
        };
        let AnyScenario::Reference(plain) = away.apply(AnyScenario::Reference(Box::new(scenario.clone()))).unwrap()
        else {
            unreachable!()
        };
        assert_eq!(
            (plain.feedforward.clone(), plain.disturbance.clone()),
            (None, ForcingFunction::default())
        );
        let louder = rescaled_disturbance(&scenario.disturbance, 0.4).unwrap();
        assert!((louder.rms_deg() - 0.4).abs() < 1e-15);
        let of_person = ScenarioChanges {
            feedforward: Some("gain:0.5,tau_f=0.2".to_owned()),
            ..ScenarioChanges::default()
        };
        let scenario = family("target = {}", &of_person).unwrap();
        assert_eq!(scenario.feedforward.unwrap().operator.coordinates()[1], 11.0_f64.ln());
    }

    #[test]
    fn errors_for_invalid_changes_name_the_option() {
        let with = |change: &dyn Fn(&mut ScenarioChanges)| {
            let mut changes = ScenarioChanges::default();
            change(&mut changes);
            changes
        };
        let of_person = |change: &dyn Fn(&mut ScenarioChanges)| family("", &with(change)).unwrap_err();
        assert_eq!(of_person(&|c| c.noise_level = Some(0.1)).option, "noise_level");
        assert_eq!(of_person(&|c| c.disturbance = Some(0.1)).option, "disturbance");
        let error = of_person(&|c| c.feedforward = Some("gain:1".to_owned()));
        assert!(error.to_string().contains("add [target]"), "{error}");
        let of_condition = |change: &dyn Fn(&mut ScenarioChanges)| changed(Condition::C1, &with(change)).unwrap_err();
        assert_eq!(of_condition(&|c| c.sample_time = Some(0.0)).option, "sample_time");
        assert_eq!(of_condition(&|c| c.disturbance = Some(-1.0)).option, "disturbance");
        let error = of_condition(&|c| c.feedforward = Some("derivative".to_owned()));
        assert!(error.reason.contains("FORM:GAIN"), "{error}");
        let mut scenario = Scenario::condition(Condition::C1);
        scenario.remnant.strength = hoid_model::scenario::RemnantStrength::Gain {
            initial: 0.1,
            last: 0.1,
        };
        let definition = with(&|c| c.noise_definition = Some(NoiseDefinition::Remnant));
        let error = definition
            .apply(AnyScenario::Reference(Box::new(scenario)))
            .unwrap_err();
        assert_eq!(error.option, "noise_definition");
    }
}
