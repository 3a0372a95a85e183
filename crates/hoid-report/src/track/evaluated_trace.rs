//! A trace with the operator in each of its rows, and the operator's parameters by name.

use hoid_model::{
    NotConvertible,
    uncertainty::{Estimate, OperatorEstimate},
};
use hoid_track::OPERATOR_COLUMNS;

use super::section::TraceSection;

/// A trace with the operator in each row.
pub struct EvaluatedTrace<'a> {
    pub section: &'a TraceSection<'a>,
    pub operators: Vec<Result<OperatorEstimate, NotConvertible>>,
}

impl<'a> EvaluatedTrace<'a> {
    pub fn new(section: &'a TraceSection<'a>) -> Self {
        let rows = 0..section.trace.len();
        Self {
            section,
            operators: rows.map(|row| section.trace.operator(row)).collect(),
        }
    }
}

/// Returns the estimate of the operator parameter with this name; `None` for an unknown name.
pub fn operator_estimate(operator: &OperatorEstimate, name: &str) -> Option<Estimate> {
    operator.rows().into_iter().find(|r| r.0 == name).map(|r| r.2)
}

/// Names of the displayed parameters; tau_e is included only if a method tracks it.
pub fn operator_names(traces: &[EvaluatedTrace<'_>]) -> Vec<&'static str> {
    let mut names = OPERATOR_COLUMNS.to_vec();
    if traces
        .iter()
        .any(|t| t.section.trace.operator_columns().contains(&"tau_e"))
    {
        names.push("tau_e");
    }
    names
}

pub fn unit(name: &str) -> &'static str {
    match name {
        "T_L" | "K_e_dot" | "tau_e" | "K_f_dot" | "tau_f" => "s",
        "omega_nm" => "rad/s",
        "zeta_nm" => "-",
        _ => "",
    }
}
