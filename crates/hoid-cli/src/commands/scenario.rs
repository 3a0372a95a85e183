//! Choice of the scenario for commands that simulate.

use hoid::io::{AnyScenario, read_any_scenario};
use hoid::model::scenario::Scenario;

use crate::{args::ScenarioChoice, error::CliError};

/// Returns the scenario given by a condition or a file; clap ensures that exactly one of these options is given.
pub fn chosen_scenario(choice: &ScenarioChoice) -> Result<AnyScenario, CliError> {
    match (&choice.condition, &choice.scenario) {
        (Some(condition), _) => Ok(AnyScenario::Reference(Box::new(Scenario::condition(*condition)))),
        (None, Some(file)) => Ok(read_any_scenario(file)?),
        (None, None) => Err(CliError::Usage("give --condition or --scenario".to_owned())),
    }
}
