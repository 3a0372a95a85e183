//! Common parts of the two summaries: the columns of the settings, and the memory limit.

use std::{collections::BTreeMap, path::Path};

use hoid_io::{ColumnKind, ColumnSchema, TableSchema};

use crate::{
    Plan,
    columns::{Rows, comments, extra_axes},
    plan::{Cell, EstimatorCell},
};

/// Largest number of values in memory at a time: 256 MB.
pub(super) const MAX_VALUES: usize = 1 << 25;

/// The parts of each cell, by the position of the cell in the plan: directory and block number.
pub(crate) type PartsOfCell<'a> = BTreeMap<usize, Vec<(&'a Path, u64)>>;

/// Returns the columns that identify the cell and the estimator of a row.
pub(super) fn setting_columns(plan: &Plan) -> Vec<(String, ColumnKind)> {
    use ColumnKind::{Real, Text, Whole};
    let mut columns: Vec<(String, ColumnKind)> = Vec::new();
    let mut add = |kind, names: &[&str]| columns.extend(names.iter().map(|name| ((*name).to_owned(), kind)));
    add(Whole, &["cell"]);
    add(Text, &["scenario", "condition"]);
    add(Whole, &["remnant_order"]);
    add(Real, &["noise_level", "T_n_true", "sample_time_s"]);
    let extra = extra_axes(plan);
    add(Text, &extra.iter().map(String::as_str).collect::<Vec<_>>());
    add(Text, &["estimator", "name", "method"]);
    add(Real, &["nd", "nk"]);
    add(Text, &["start"]);
    add(Whole, &["decimate"]);
    columns
}

/// Returns the schema of a table of a study with these columns.
pub(super) fn schema(plan: &Plan, columns: Vec<(String, ColumnKind)>) -> TableSchema {
    TableSchema {
        comments: comments(plan),
        columns: columns
            .into_iter()
            .map(|(name, kind)| ColumnSchema { name, kind })
            .collect(),
    }
}

/// Starts a row with the settings of the cell and the estimator.
pub(super) fn start_row(rows: &mut Rows, extra: &[String], cell: &Cell, estimator: &EstimatorCell) {
    let scenario = cell.resolved.scenario();
    rows.start_row();
    rows.set_whole("cell", cell.index);
    rows.set_text("scenario", &cell.scenario);
    rows.set_text("condition", &cell.condition);
    rows.set_whole("remnant_order", scenario.remnant.order as u64);
    if let hoid_model::scenario::RemnantStrength::Level { level, .. } = scenario.remnant.strength {
        rows.set_real("noise_level", level);
    }
    rows.set_real("T_n_true", scenario.remnant.time_constant_s);
    rows.set_real("sample_time_s", scenario.sample_time.s());
    for name in extra {
        let axis = cell.axes.iter().chain(&estimator.axes).find(|axis| axis.key == *name);
        rows.set_text(name, axis.map_or("", |axis| axis.value.as_str()));
    }
    rows.set_text("estimator", &estimator.label);
    rows.set_text("name", &estimator.name);
    rows.set_text("method", estimator.method());
    if estimator.structure().is_some() {
        let orders = estimator.orders(&cell.resolved);
        rows.set_real("nd", orders.nd as f64);
        rows.set_real("nk", orders.nk as f64);
    }
    rows.set_text("start", &estimator.start);
    rows.set_whole("decimate", estimator.decimate as u64);
}
