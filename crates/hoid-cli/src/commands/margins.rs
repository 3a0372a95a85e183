//! `hoid margins`: crossover, margins and remnant gains of a scenario.

use hoid::io::AnyScenario;
use hoid::model::{
    FamilyScenario, ModelError,
    margins::{MANUAL_CONTROL_RANGE_RAD_S, crossings},
    remnant::HIGHEST_ORDER,
    remnant_gain::NoiseDefinition,
};
use hoid::sim::FamilySimulator;
use serde_json::{Value, json};

use super::scenario::chosen_scenario;
use crate::{
    args::{MarginsArgs, StateName},
    error::CliError,
    json, output, text,
};

/// Loop whose margins are printed.
const CONTINUOUS_LOOP: &str = "The loop is continuous. In hoid identify the loop includes the hold of the sampled error, \
                               so its phase margin is smaller by half a sample (omega_c Ts/2).";

/// K_n for one order and noise level, or the reason why there is none.
struct RemnantGain {
    order: usize,
    level: f64,
    k_n: Result<f64, ModelError>,
}

pub fn run(args: &MarginsArgs) -> Result<(), CliError> {
    let scenario = match chosen_scenario(&args.base)? {
        AnyScenario::Reference(scenario) => *scenario,
        AnyScenario::Family(scenario) => return print_family_margins(&scenario, args),
    };
    let state = match args.state {
        StateName::Initial => scenario.initial,
        StateName::Last => scenario.last,
    };
    let open_loop = state
        .operator
        .transfer_function()?
        .series(&state.controlled_element.transfer_function()?);
    let found = crossings(|omega| open_loop.response(omega), MANUAL_CONTROL_RANGE_RAD_S);
    let definition = args.noise_definition;
    let gains: Vec<RemnantGain> = (1..=HIGHEST_ORDER)
        .flat_map(|order| args.noise_levels.iter().map(move |&level| (order, level)))
        .map(|(order, level)| RemnantGain {
            order,
            level,
            k_n: scenario.remnant_gain_for(&state, order, level, definition),
        })
        .collect();
    // A noise level that cannot be reached gives a row of the table; any other error concerns all noise levels.
    for g in &gains {
        if let Err(error) = &g.k_n
            && !matches!(error, ModelError::UnreachableNoiseLevel { .. })
        {
            return Err(error.clone().into());
        }
    }
    let name = args.noise_definition.name();
    if args.json {
        let mut object = json::margins(&found);
        let rows = gains
            .iter()
            .map(|g| match &g.k_n {
                Ok(k_n) => json!({"remnant_order": g.order, "noise_level": g.level, "definition": name, "K_n": json::number(*k_n)}),
                Err(reason) => json!({
                    "remnant_order": g.order, "noise_level": g.level, "definition": name, "K_n": null, "reason": reason.to_string(),
                }),
            })
            .collect();
        object.insert("remnant_gain".to_owned(), Value::Array(rows));
        json::print(&Value::Object(object))?;
        return Ok(());
    }
    let mut header = vec!["K_n of order".to_owned()];
    header.extend(args.noise_levels.iter().map(|l| format!("P_n = {l}")));
    let mut table = text::table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    for rows in gains.chunks(args.noise_levels.len().max(1)) {
        let mut cells = vec![format!("m = {}", rows[0].order)];
        cells.extend(rows.iter().map(|g| match &g.k_n {
            Ok(k_n) => format!("{k_n:.5}"),
            Err(_) => "unreachable".to_owned(),
        }));
        table.add_row(cells);
    }
    let share = match definition {
        NoiseDefinition::Response => "var(u_n)/var(u)",
        NoiseDefinition::Remnant => "var(n)/var(u)",
    };
    let state_name = state_name(args.state);
    output::show(&format!(
        "{}, {state_name} state.\n{}\n{CONTINUOUS_LOOP}\nRemnant gain K_n for P_n = {share}, T_n = {} s, Ts = {} s:\n{table}\n",
        scenario.name,
        text::crossings(&found),
        scenario.remnant.time_constant_s,
        scenario.sample_time.s(),
    ))?;
    Ok(())
}

/// Prints the margins of the loop for an operator of the family, and the gains of the parts of its remnant.
fn print_family_margins(scenario: &FamilyScenario, args: &MarginsArgs) -> Result<(), CliError> {
    let (state, which) = match args.state {
        StateName::Initial => (&scenario.initial, 0),
        StateName::Last => (&scenario.last, 1),
    };
    let found = state.crossings()?;
    let simulator = FamilySimulator::new(scenario)?;
    let gains = simulator.remnant_gains()[which];
    let shares: Vec<Option<f64>> = scenario.remnant.iter().map(|part| part.share()).collect();
    if args.json {
        let mut object = json::margins(&found);
        let rows = gains
            .iter()
            .zip(&shares)
            .map(|(gain, share)| json!({"share": share, "gain": json::number(*gain)}))
            .collect();
        object.insert("remnant_gain".to_owned(), Value::Array(rows));
        json::print(&Value::Object(object))?;
        return Ok(());
    }
    let mut table = text::table(&["part of the remnant", "share of var(u)", "gain"]);
    for ((k, gain), share) in (1..).zip(gains).zip(shares) {
        let share = share.map_or_else(|| "given gain".to_owned(), |share| format!("{share}"));
        table.add_row(vec![format!("{k}"), share, format!("{gain:.5}")]);
    }
    let parts = if gains.is_empty() {
        String::new()
    } else {
        format!("{table}\n")
    };
    output::show(&format!(
        "{}, {} state.\n{}\n{CONTINUOUS_LOOP}\n{parts}",
        scenario.name,
        state_name(args.state),
        text::crossings(&found),
    ))?;
    Ok(())
}

fn state_name(state: StateName) -> &'static str {
    match state {
        StateName::Initial => "initial",
        StateName::Last => "last",
    }
}
