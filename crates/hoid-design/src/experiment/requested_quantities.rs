//! Requested quantities with their accepted errors, and the number of runs that they need. The errors of N runs are
//! those of one run divided by `sqrt(N)`, so a quantity with the error s of one run and the accepted error a needs
//! `(s/a)^2` runs.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::{DesignError, Expected};

/// A quantity to be estimated, with its accepted error. In text form: `crossover=3%`, `tau_e=0.05`, `phase_margin=2`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RequestedQuantity {
    /// Name of the quantity: `crossover`, `phase_margin`, or a parameter.
    pub name: String,
    /// Accepted standard error: in deg for the phase margin, in s for the delay to a target, and relative to the value
    /// for other quantities.
    pub error: f64,
}

/// Returns the standard name of a quantity, which may be given by a synonym.
pub(super) fn known_name(name: &str) -> String {
    match name.trim() {
        "margin" => "phase_margin",
        "delay" => "tau_e",
        name => name,
    }
    .to_owned()
}

/// Parses `NAME=5%` or `NAME=0.05`; returns the name, the number, and whether it has a percent sign.
pub(super) fn parse_named_number(text: &str, what: &'static str) -> Result<(String, f64, bool), DesignError> {
    let unreadable = || DesignError::Unreadable {
        what,
        found: text.to_owned(),
    };
    let (name, number) = text.split_once('=').ok_or_else(unreadable)?;
    let number = number.trim();
    let (digits, percent) = match number.strip_suffix('%') {
        Some(digits) => (digits, true),
        None => (number, false),
    };
    let value: f64 = digits.trim().parse().map_err(|_| unreadable())?;
    Ok((known_name(name), value, percent))
}

impl FromStr for RequestedQuantity {
    type Err = DesignError;

    fn from_str(text: &str) -> Result<Self, DesignError> {
        let (name, number, percent) = parse_named_number(text, "quantity with its error")?;
        Ok(Self {
            name,
            error: if percent { number / 100.0 } else { number },
        })
    }
}

/// Returns the number of periods needed for the accepted errors of all quantities.
pub fn period_count(of_one: &Expected, wanted: &[RequestedQuantity]) -> usize {
    let needed = wanted
        .iter()
        .filter_map(|w| Some((of_one.error(&w.name)? / w.error).powi(2)));
    needed.fold(1.0, f64::max).ceil() as usize
}
