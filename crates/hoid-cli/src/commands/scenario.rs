//! The scenario of a command that simulates.

use hoid_io::read_scenario;
use hoid_model::scenario::Scenario;

use crate::{args::ScenarioChoice, error::CliError};

/// The scenario of the options; clap has made sure that it is one of the two.
pub fn chosen_scenario(choice: &ScenarioChoice) -> Result<Scenario, CliError> {
    match (&choice.condition, &choice.scenario) {
        (Some(condition), _) => Ok(Scenario::condition(*condition)),
        (None, Some(file)) => Ok(read_scenario(file)?),
        (None, None) => Err(CliError::Usage("give --condition or --scenario".to_owned())),
    }
}
