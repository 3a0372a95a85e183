//! The simulated scenarios: settings and true parameters of each cell.

use hoid_io::{ColumnKind, ColumnSchema, OutputTable, TableSchema};
use hoid_model::{
    scenario::{OperatingState, RemnantStrength},
    schedule::Schedule,
    uncertainty::OperatorEstimate,
};

use crate::{
    columns::{OPERATOR_PARAMETERS, Rows, comments},
    plan::{Cell, Plan},
};

/// True parameters of a cell before or after the change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueState {
    /// K_e, T_L, K_e_dot, omega_nm, zeta_nm.
    pub operator: [f64; 5],
    /// f1, f2 (a1, a2 of an ARX model), b0, b1, at the sample time of the simulation.
    pub discrete: [f64; 4],
    /// Remnant gain K_n, deg.
    pub k_n: f64,
}

impl Cell {
    /// Returns the true parameters before and after the change; both are equal if nothing changes.
    pub fn true_states(&self) -> [TrueState; 2] {
        let scenario = self.resolved.scenario();
        // The parameters are evaluated long before the change, and long after it or in the middle of the interval until
        // the operator changes back.
        let ends = match scenario.schedule {
            Schedule::Constant => [0.0; 2],
            Schedule::Sigmoid { .. } => [-1e9, 1e9],
            Schedule::Alternating {
                midpoint_s, interval_s, ..
            } => [-1e9, midpoint_s + interval_s / 2.0],
        };
        let states = [&scenario.initial, &scenario.last];
        [0, 1].map(|i| {
            let at = self.resolved.parameters_at(ends[i]);
            true_state(states[i], at.k_n, scenario.sample_time)
        })
    }
}

fn true_state(of: &OperatingState, k_n: f64, sample_time: hoid_model::SampleTime) -> TrueState {
    let rows = OperatorEstimate::from(of.operator).rows();
    let held = of.operator.discretise(sample_time).ok();
    TrueState {
        operator: [0, 1, 2, 3, 4].map(|i| rows[i].2.value),
        discrete: held.map_or([f64::NAN; 4], |h| [h.zoh.f1, h.zoh.f2, h.zoh.b0, h.zoh.b1]),
        k_n,
    }
}

/// Returns the table of cells.
pub(crate) fn cells_table(plan: &Plan) -> OutputTable {
    use ColumnKind::{Real, Text, Whole};
    let mut columns: Vec<(String, ColumnKind)> = vec![
        ("cell".to_owned(), Whole),
        ("scenario".to_owned(), Text),
        ("condition".to_owned(), Text),
        ("replications".to_owned(), Whole),
        ("remnant_order".to_owned(), Whole),
    ];
    columns.extend(
        [
            "noise_level",
            "T_n",
            "sample_time_s",
            "measurement_s",
            "change_s",
            "rate_per_s",
        ]
        .map(|n| (n.to_owned(), Real)),
    );
    const STATE_COLUMNS: [&str; 10] = [
        "K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm", "f1", "f2", "b0", "b1", "K_n",
    ];
    for when in ["initial", "last"] {
        columns.extend(STATE_COLUMNS.map(|name| (format!("{name}_{when}"), Real)));
        columns.push((format!("tau_e_{when}"), Real));
    }
    let schema = TableSchema {
        comments: comments(plan),
        columns: columns
            .into_iter()
            .map(|(name, kind)| ColumnSchema { name, kind })
            .collect(),
    };
    let mut rows = Rows::new(&schema);
    for cell in &plan.cells {
        let scenario = cell.resolved.scenario();
        rows.start_row();
        rows.set_whole("cell", cell.index);
        rows.set_text("scenario", &cell.scenario);
        rows.set_text("condition", &cell.condition);
        rows.set_whole("replications", cell.replications);
        rows.set_whole("remnant_order", scenario.remnant.order as u64);
        if let RemnantStrength::Level { level, .. } = scenario.remnant.strength {
            rows.set_real("noise_level", level);
        }
        rows.set_real("T_n", scenario.remnant.time_constant_s);
        rows.set_real("sample_time_s", scenario.sample_time.s());
        rows.set_real("measurement_s", scenario.measurement_s);
        if let (Some(change_s), Some(rate_per_s)) = (scenario.schedule.change_s(), scenario.schedule.rate_per_s()) {
            rows.set_real("change_s", change_s);
            rows.set_real("rate_per_s", rate_per_s);
        }
        rows.set_real("tau_e_initial", scenario.initial.operator.tau_e_s);
        rows.set_real("tau_e_last", scenario.last.operator.tau_e_s);
        for (state, when) in cell.true_states().iter().zip(["initial", "last"]) {
            for (name, value) in OPERATOR_PARAMETERS.iter().zip(state.operator) {
                rows.set_real(&format!("{name}_{when}"), value);
            }
            for (name, value) in STATE_COLUMNS[5..9].iter().zip(state.discrete) {
                rows.set_real(&format!("{name}_{when}"), value);
            }
            rows.set_real(&format!("K_n_{when}"), state.k_n);
        }
    }
    rows.into_table(schema.comments)
}
