//! One command a file. A command resolves what was typed once, calls the library, and prints.

pub mod convert;
pub mod demo;
pub mod group;
pub mod identify;
pub mod info;
pub mod margins;
pub mod reading;
pub mod reproduce;
pub mod simulate;
pub mod stream;
pub mod study;
pub mod track;

use hoid_io::read_scenario;
use hoid_model::scenario::Scenario;

use crate::{args::ScenarioChoice, error::CliError};

/// The scenario that was asked for; clap has made sure that it is one of the two.
fn scenario(choice: &ScenarioChoice) -> Result<Scenario, CliError> {
    match (&choice.condition, &choice.scenario) {
        (Some(condition), _) => Ok(Scenario::condition(*condition)),
        (None, Some(file)) => Ok(read_scenario(file)?),
        (None, None) => Err(CliError::Usage("give --condition or --scenario".to_owned())),
    }
}
