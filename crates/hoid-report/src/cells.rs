//! Symbols and numbers as template values for the pages.

use hoid_model::{Record, uncertainty::Estimate};
use minijinja::Value;

use crate::numbers::{DASH, with_uncertainty};

pub fn html(text: impl Into<String>) -> Value {
    Value::from_safe_string(text.into())
}

/// HTML symbol and unit of an operator parameter. Gains have no unit here, because their unit depends on the record
/// ([`hoid_model::GainUnit`]).
pub fn symbol(name: &str) -> (Value, &'static str) {
    let (symbol, unit) = match name {
        "K_e" => ("<i>K</i><sub>e</sub>", ""),
        "T_L" => ("<i>T</i><sub>L</sub>", "s"),
        "K_e_dot" => ("<i>K</i><sub>\u{117}</sub>", "s"),
        "omega_nm" => ("<i>\u{3c9}</i><sub>nm</sub>", "rad/s"),
        "zeta_nm" => ("<i>\u{3b6}</i><sub>nm</sub>", "-"),
        "tau_e" => ("<i>\u{3c4}</i><sub>e</sub>", "s"),
        "K_f" => ("<i>K</i><sub>f</sub>", ""),
        "K_f_dot" => ("<i>K</i><sub>\u{1e1f}</sub>", "s"),
        "tau_f" => ("<i>\u{3c4}</i><sub>f</sub>", "s"),
        "K" => ("<i>K</i>", ""),
        "K_I" => ("<i>K</i><sub>I</sub>", "1/s"),
        "K_over_T_I" => ("<i>K</i>/<i>T</i><sub>I</sub>", "1/s"),
        "T_I" => ("<i>T</i><sub>I</sub>", "s"),
        other => return (Value::from(other), ""),
    };
    (html(symbol), unit)
}

pub fn cell(estimate: Estimate) -> Value {
    let (value, error) = with_uncertainty(estimate.value, estimate.standard_error);
    Value::from(if error == DASH {
        value
    } else {
        format!("{value} \u{b1} {error}")
    })
}

/// Label of a record; `record N`, counted from 1, if it has no label.
pub fn record_name(record: &Record, index: usize) -> String {
    match record.label() {
        "" => format!("record {}", index + 1),
        label => label.to_owned(),
    }
}
