//! The tables of a study: their columns, and rows whose cells are set by column name.
//!
//! | table | content of a row | columns |
//! |---|---|---|
//! | fits | one estimator on one replication | settings of scenario and estimator; status and verdict; theta, operator and remnant with standard errors; error measures |
//! | traces | one stored point of a recursion | cell, replication, estimator, t; theta and operator |
//! | cells | one scenario of the grid | settings and true parameters |
//!
//! An entry is empty if its number does not exist, such as a parameter of the operator if the model cannot be
//! converted, or nk of a model without input.

use std::collections::BTreeMap;

use hoid_analysis::ResolvedRequest;
use hoid_io::{ColumnKind, ColumnSchema, ColumnValues, OutputColumn, OutputTable, TableSchema};

use crate::plan::{Plan, Task, analysis};

/// Parameters of the operator, in the order used by all tables.
pub const OPERATOR_PARAMETERS: [&str; 5] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm"];
/// Quantities evaluated in a trace: the parameters of the operator and the delay, in the order of
/// [`hoid_model::uncertainty::OperatorEstimate::rows`].
pub(crate) const TRACED_QUANTITIES: [&str; 6] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm", "tau_e"];

/// Rows of a table with given columns.
#[derive(Debug, Clone)]
pub(crate) struct Rows {
    columns: Vec<OutputColumn>,
    column_indices: BTreeMap<String, usize>,
    rows: usize,
}

impl Rows {
    pub fn new(schema: &TableSchema) -> Self {
        let empty = |column: &ColumnSchema| OutputColumn {
            name: column.name.clone(),
            values: match column.kind {
                ColumnKind::Real => ColumnValues::Real(Vec::new()),
                ColumnKind::Whole => ColumnValues::Whole(Vec::new()),
                ColumnKind::Text => ColumnValues::Text(Vec::new()),
            },
        };
        Self {
            columns: schema.columns.iter().map(empty).collect(),
            column_indices: schema
                .columns
                .iter()
                .enumerate()
                .map(|(i, c)| (c.name.clone(), i))
                .collect(),
            rows: 0,
        }
    }

    /// Starts a row in which strings are empty, real numbers are NaN, and whole numbers are zero.
    pub fn start_row(&mut self) {
        self.rows += 1;
        for column in &mut self.columns {
            match &mut column.values {
                ColumnValues::Real(values) => values.push(f64::NAN),
                ColumnValues::Whole(values) => values.push(0),
                ColumnValues::Text(values) => values.push(String::new()),
            }
        }
    }

    /// Sets a real number of the current row. A column that the table does not have is ignored, since the plan
    /// determines the columns.
    pub fn set_real(&mut self, name: &str, value: f64) {
        if let Some(ColumnValues::Real(values)) = self.column(name)
            && let Some(last) = values.last_mut()
        {
            *last = value;
        }
    }

    pub fn set_whole(&mut self, name: &str, value: u64) {
        if let Some(ColumnValues::Whole(values)) = self.column(name)
            && let Some(last) = values.last_mut()
        {
            *last = value;
        }
    }

    pub fn set_text(&mut self, name: &str, value: &str) {
        if let Some(ColumnValues::Text(values)) = self.column(name)
            && let Some(last) = values.last_mut()
        {
            value.clone_into(last);
        }
    }

    fn column(&mut self, name: &str) -> Option<&mut ColumnValues> {
        self.column_indices.get(name).map(|i| &mut self.columns[*i].values)
    }

    /// Returns the position of a column, for faster access in tables with many rows.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.column_indices.get(name).copied()
    }

    /// Sets a real number of the current row, with the column given by position.
    pub fn set_real_at(&mut self, position: usize, value: f64) {
        if let Some(OutputColumn {
            values: ColumnValues::Real(values),
            ..
        }) = self.columns.get_mut(position)
            && let Some(last) = values.last_mut()
        {
            *last = value;
        }
    }

    pub fn into_table(self, comments: Vec<String>) -> OutputTable {
        OutputTable {
            comments,
            columns: self.columns,
        }
    }
}

/// The columns of each table of a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Schemas {
    pub fits: TableSchema,
    /// `None` if traces are not stored.
    pub traces: Option<TableSchema>,
}

impl Schemas {
    pub fn of(plan: &Plan) -> Self {
        let theta = theta_names(plan);
        let comments = comments(plan);
        Self {
            fits: fits_schema(plan, &theta, comments.clone()),
            traces: traces_schema(plan, &theta, comments),
        }
    }
}

/// Returns the comments that every table of a study carries.
pub(crate) fn comments(plan: &Plan) -> Vec<String> {
    vec![
        format!("hoid {} study {}", env!("CARGO_PKG_VERSION"), plan.name),
        format!("plan sha256 {}", plan.hash()),
        format!("seed {}, {} replications", plan.seed, plan.replications),
    ]
}

/// Returns the axes without a dedicated column; each of them gets a column with its name.
pub(crate) fn extra_axes(plan: &Plan) -> Vec<String> {
    const DEDICATED_COLUMNS: [&str; 15] = [
        "name",
        "condition",
        "sample_time_s",
        "remnant_order",
        "remnant_noise_level",
        "remnant_noise_definition",
        "remnant_T_n_s",
        "method",
        "structure",
        "orders_na",
        "orders_nb",
        "orders_nc",
        "orders_nd",
        "orders_nf",
        "orders_nk",
    ];
    let of_cells = plan.cells.iter().flat_map(|cell| &cell.axes);
    let of_estimators = plan.estimators.iter().flat_map(|estimator| &estimator.axes);
    let mut names: Vec<String> = Vec::new();
    for axis in of_cells.chain(of_estimators) {
        let has_column =
            DEDICATED_COLUMNS.contains(&axis.key.as_str()) || axis.key == "start" || axis.key == "decimate";
        if !has_column && !names.contains(&axis.key) {
            names.push(axis.key.clone());
        }
    }
    names
}

fn theta_names(plan: &Plan) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for cell in &plan.cells {
        for (_, estimator) in plan.estimators_of(cell) {
            for name in estimator.orders(&cell.resolved).parameter_names() {
                if !names.contains(&name) {
                    names.push(name);
                }
            }
        }
    }
    let key = |name: &String| (name.chars().next(), name[1..].parse::<usize>().unwrap_or(0));
    names.sort_by_key(key);
    names
}

struct Columns(Vec<ColumnSchema>);

impl Columns {
    fn add(&mut self, kind: ColumnKind, names: &[&str]) {
        self.0.extend(names.iter().map(|name| ColumnSchema {
            name: (*name).to_owned(),
            kind,
        }));
    }
}

fn fits_schema(plan: &Plan, theta: &[String], comments: Vec<String>) -> TableSchema {
    use ColumnKind::{Real, Text, Whole};
    let mut c = Columns(Vec::new());
    c.add(Whole, &["cell"]);
    c.add(Text, &["scenario", "condition"]);
    c.add(Whole, &["remnant_order"]);
    c.add(Real, &["noise_level"]);
    c.add(Text, &["noise_definition"]);
    c.add(Real, &["T_n_true", "sample_time_s"]);
    for axis in extra_axes(plan) {
        c.add(Text, &[&axis]);
    }
    c.add(Whole, &["replication"]);
    c.add(Text, &["estimator", "name", "method", "structure"]);
    c.add(Real, &["na", "nb", "nc", "nd", "nf", "nk"]);
    c.add(Text, &["start"]);
    c.add(Whole, &["decimate"]);
    c.add(Real, &["from_s", "to_s"]);
    c.add(Text, &["status", "reason", "termination"]);
    let analyses: Vec<&ResolvedRequest> = plan.estimators.iter().filter_map(|e| e.task.analysis()).collect();
    if !analyses.is_empty() {
        c.add(Text, &["verdict", "findings", "form"]);
    }
    c.add(Whole, &["converged", "iterations"]);
    c.add(Real, &["loss", "innovation_variance", "vaf", "response_error"]);
    if plan.estimators.iter().any(|e| e.versus.is_some()) {
        c.add(Real, &["delta_vaf"]);
    }
    let mut estimated: Vec<&str> = theta.iter().map(String::as_str).collect();
    estimated.extend(OPERATOR_PARAMETERS);
    estimated.extend(["tau_e", "T_n", "K_n"]);
    let of_analyses: Vec<String> = analyses.iter().flat_map(|asked| analysis::parameters(asked)).collect();
    for name in &of_analyses {
        if !estimated.contains(&name.as_str()) {
            estimated.push(name);
        }
    }
    for name in &estimated {
        c.add(Real, &[name]);
        if plan.standard_errors {
            c.add(Real, &[&format!("{name}_se")]);
        }
    }
    c.add(Real, &["T_n_backward_euler", "K_n_backward_euler"]);
    if analyses.iter().any(|asked| matches!(asked, ResolvedRequest::Change(_))) {
        c.add(Real, &["change_found"]);
    }
    if plan.estimators.iter().any(|e| matches!(e.task, Task::Track(_))) {
        for name in TRACED_QUANTITIES {
            c.add(
                Real,
                &[
                    &format!("rms_{name}"),
                    &format!("settle50_{name}"),
                    &format!("settle90_{name}"),
                ],
            );
        }
        if plan.changes {
            for name in TRACED_QUANTITIES {
                let of = ["before", "after", "covered", "covered_through"].map(|what| format!("{what}_{name}"));
                c.add(Real, &of.each_ref().map(String::as_str));
            }
            c.add(Real, &["false_alarms", "hours", "found", "lag"]);
        }
        c.add(Whole, &["diverged", "steps_shortened"]);
        c.add(Real, &["share_not_convertible"]);
    }
    if plan.estimators.iter().any(|e| e.task == Task::Describe) {
        c.add(
            Real,
            &[
                "noise_level_obtained",
                "noise_level_response",
                "noise_level_remnant",
                "rms_e",
                "rms_u",
                "rms_n",
            ],
        );
    }
    TableSchema { comments, columns: c.0 }
}

fn traces_schema(plan: &Plan, theta: &[String], comments: Vec<String>) -> Option<TableSchema> {
    use ColumnKind::{Real, Text, Whole};
    let tracks = plan.estimators.iter().any(|e| matches!(e.task, Task::Track(_)));
    plan.trace_every.filter(|_| tracks)?;
    let mut c = Columns(Vec::new());
    c.add(Whole, &["cell", "replication"]);
    c.add(Text, &["estimator"]);
    c.add(Real, &["t"]);
    for name in theta.iter().map(String::as_str).chain(OPERATOR_PARAMETERS) {
        c.add(Real, &[name]);
        if plan.standard_errors {
            c.add(Real, &[&format!("{name}_se")]);
        }
    }
    Some(TableSchema { comments, columns: c.0 })
}
