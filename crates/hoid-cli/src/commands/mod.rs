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
use hoid_model::{OperatorParameters, Record, scenario::Scenario};

use crate::{args::ScenarioChoice, error::CliError};

/// The scenario that was asked for; clap has made sure that it is one of the two.
fn scenario(choice: &ScenarioChoice) -> Result<Scenario, CliError> {
    match (&choice.condition, &choice.scenario) {
        (Some(condition), _) => Ok(Scenario::condition(*condition)),
        (None, Some(file)) => Ok(read_scenario(file)?),
        (None, None) => Err(CliError::Usage("give --condition or --scenario".to_owned())),
    }
}

/// The operator of records that carry the truth, when it is the same throughout (a simulated run without a change).
fn known_operator(records: &[Record]) -> Option<OperatorParameters> {
    let constant = |name: &str| {
        let first = *records.first()?.channel(name)?.first()?;
        // A sigmoid far from its middle still moves in the last digits.
        let same = |v: &f64| (v - first).abs() <= 1e-6 * first.abs();
        records
            .iter()
            .all(|r| r.channel(name).is_some_and(|c| c.iter().all(same)))
            .then_some(first)
    };
    Some(OperatorParameters {
        k_e: constant("K_e")?,
        t_l_s: constant("T_L")?,
        omega_nm_rad_s: constant("omega_nm")?,
        zeta_nm: constant("zeta_nm")?,
        tau_e_s: constant("tau_e")?,
    })
}
