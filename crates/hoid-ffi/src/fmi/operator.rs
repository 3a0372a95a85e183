//! Operator of a scenario, either of the thesis or of the family, as the model of a unit.

use hoid_io::{AnyScenario, fmu::FmuSettings, parse_any_scenario};
use hoid_sim::{FamilyOperatorRun, FamilySimulator, OperatorRun, RunSeed, Simulator};

use super::values::{FmiResult, VariableValues};

/// Running operator of a scenario.
pub(super) struct OperatorModel {
    run: OperatorSimulation,
    sample_time_s: f64,
}

enum OperatorSimulation {
    Reference(Box<OperatorRun>),
    Family(Box<FamilyOperatorRun>),
}

impl OperatorModel {
    pub fn new(settings: &FmuSettings, given: &VariableValues<'_>, start_s: f64) -> FmiResult<Self> {
        let text = settings.scenario.as_deref();
        let text = text.ok_or("the unit has no scenario; build it with hoid fmu --operator SCENARIO")?;
        let seed = RunSeed {
            seed: given.count("seed"),
            replication: given.count("replication"),
            ..RunSeed::default()
        };
        let to_text = |error: hoid_sim::SimError| error.to_string();
        let scenario = parse_any_scenario(text, "the scenario of the unit", "scenario");
        Ok(match scenario.map_err(|error| error.to_string())? {
            AnyScenario::Reference(scenario) => {
                let simulator = Simulator::new(&scenario).map_err(to_text)?;
                Self {
                    run: OperatorSimulation::Reference(Box::new(OperatorRun::new(simulator, seed, start_s))),
                    sample_time_s: scenario.sample_time.s(),
                }
            }
            AnyScenario::Family(scenario) => {
                let simulator = FamilySimulator::new(&scenario).map_err(to_text)?;
                let run = FamilyOperatorRun::new(simulator, seed, start_s).map_err(to_text)?;
                Self {
                    run: OperatorSimulation::Family(Box::new(run)),
                    sample_time_s: scenario.sample_time.s(),
                }
            }
        })
    }

    pub fn sample_time_s(&self) -> f64 {
        self.sample_time_s
    }

    pub fn control(&self) -> f64 {
        match &self.run {
            OperatorSimulation::Reference(run) => run.control(),
            OperatorSimulation::Family(run) => run.control(),
        }
    }

    pub fn remnant(&self) -> f64 {
        match &self.run {
            OperatorSimulation::Reference(run) => run.remnant(),
            OperatorSimulation::Family(run) => run.remnant(),
        }
    }

    pub fn take(&mut self, e: f64) {
        match &mut self.run {
            OperatorSimulation::Reference(run) => run.push(e),
            OperatorSimulation::Family(run) => run.push(e),
        }
    }

    pub fn save_state(&mut self) -> Vec<f64> {
        match &mut self.run {
            OperatorSimulation::Reference(run) => run.saved_state(),
            OperatorSimulation::Family(run) => run.saved_state(),
        }
    }

    /// Restores a saved state. Returns false if the state belongs to another operator.
    pub fn restore(&mut self, saved: &[f64]) -> bool {
        match &mut self.run {
            OperatorSimulation::Reference(run) => run.restore(saved),
            OperatorSimulation::Family(run) => run.restore(saved),
        }
    }
}
