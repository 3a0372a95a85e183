//! Results as JSON objects, the contract with other programs: what `hoid::analysis` does not write, and how
//! one is printed.

pub use hoid::analysis::json::*;
use hoid::model::{
    NotConvertible,
    uncertainty::{Estimate, OperatorEstimate},
};
use hoid::track::{Change, Determined, NoCrossover, OpenLoop, Response, TrackFault};
use serde_json::{Value, json};

use crate::{error::CliError, output};

/// Gain and phase at frequencies in rad/s, each where there is an estimate.
pub fn responses(at_rad_s: &[f64], of: impl Fn(usize, f64) -> Option<Response>) -> Value {
    let each = at_rad_s.iter().enumerate().map(|(place, omega)| {
        let response = of(place, *omega);
        json!({
            "omega_rad_s": omega,
            "gain_db": response.map(|r| estimate(&r.gain_db())),
            "phase_deg": response.map(|r| estimate(&r.phase_deg())),
        })
    });
    Value::Array(each.collect())
}

/// Crossover and phase margin of a recursion, or why there are none.
pub fn open_loop(found: &Result<OpenLoop, NoCrossover>) -> Value {
    match found {
        Ok(found) => json!({
            "crossover_rad_s": estimate(&found.crossover_rad_s),
            "phase_margin_deg": estimate(&found.phase_margin_deg),
        }),
        Err(reason) => json!({"crossover_rad_s": null, "phase_margin_deg": null, "reason": reason.words()}),
    }
}

/// The operator of a recursion, which says of each parameter whether the data determine it.
pub fn tracked_operator(
    found: &Result<OperatorEstimate, NotConvertible>,
    determined: impl Fn(&OperatorEstimate) -> Vec<Determined>,
) -> Value {
    let mut whole = operator(found);
    for (name, yes) in found.as_ref().map(determined).unwrap_or_default() {
        whole[name]["determined"] = json!(yes);
    }
    whole
}

/// A span that the guard of a recursion found.
pub fn track_fault(fault: &TrackFault) -> Value {
    json!({
        "kind": fault.kind.name(),
        "channel": fault.channel.name(),
        "from": number(fault.from_s),
        "to": number(fault.to_s),
        "size": number(fault.size),
        "action": fault.action.name(),
    })
}

/// A change of the person, declared at a time in s.
pub fn change(declared_at: Option<f64>, c: &Change) -> Value {
    let before_and_after = |pair: &[Estimate; 2]| json!({"before": estimate(&pair[0]), "after": estimate(&pair[1])});
    let numbers = |pair: &[f64; 2]| json!({"before": number(pair[0]), "after": number(pair[1])});
    json!({
        "t": optional(declared_at),
        "since": optional(declared_at.map(|t| t - c.seconds_ago)),
        "probability": number(c.probability()),
        "log_odds": number(c.odds),
        "changed": c.changed(),
        "K_e": before_and_after(&c.k_e),
        "K_e_dot": before_and_after(&c.k_e_dot),
        "omega_nm": before_and_after(&c.omega_nm_rad_s),
        "zeta_nm": before_and_after(&c.zeta_nm),
        "tau_e": before_and_after(&c.tau_e_s),
        "T_L": numbers(&c.t_l_s),
        "innovation_variance": numbers(&c.innovation_variance),
        "z": {
            "K_e": number(c.z[0]),
            "K_e_dot": number(c.z[1]),
            "omega_nm": number(c.z[2]),
            "zeta_nm": number(c.z[3]),
            "remnant": number(c.z[4]),
            "tau_e": number(c.z[5]),
        },
    })
}

/// Prints one object, indented, and nothing else.
///
/// # Errors
/// Those of [`output::print`].
pub fn print(value: &Value) -> Result<(), CliError> {
    output::print(&format!("{value:#}\n"))
}
