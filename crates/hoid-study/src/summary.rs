//! Summaries of a study: a row for each cell, estimator and quantity.
//!
//! Quantities are all real columns of the table of fits that are no settings; `bias_<p>`, the relative bias in % (eq. 41), of theta, operator and
//! remnant where the truth is known and constant; and the rates `failed`, `not_convertible`, `converged` and `diverged` (mean and its Monte Carlo
//! error). Of traces each kept time has mean, standard deviation, quartiles and median of each parameter; `settle50_of_median_<p>` and
//! `settle90_of_median_<p>` are the times after t_M at which the median trace has covered 50 or 90 % of the step.
//!
//! Both are made from the parts of one cell at a time. When the numbers of a cell are more than fit in memory, its parts are read several
//! times, each time for some of its estimators.

use std::{collections::BTreeMap, path::Path};

use hoid_io::{ColumnKind, ColumnSchema, ColumnValues, OutputTable, TableSchema, TableWriter};

use hoid_model::remnant::{RemnantDiscretisation, RemnantFilter};

use crate::{
    Plan, StudyError,
    columns::{OPERATOR, Rows, Schemas, comments, extra_axes},
    manifest::part,
    plan::{Cell, EstimatorCell, Task},
    statistics::{Statistics, quantile, rate},
};

/// Numbers in memory at a time: 256 MB.
const BUDGET: usize = 1 << 25;

/// Settings among the real columns.
const SETTINGS: [&str; 11] = [
    "noise_level",
    "T_n_true",
    "sample_time_s",
    "na",
    "nb",
    "nc",
    "nd",
    "nf",
    "nk",
    "from_s",
    "to_s",
];

/// Statistics of a row of the summary, in the order of their columns.
const FIGURES: [&str; 14] = [
    "mean",
    "mean_se",
    "sd",
    "sd_se",
    "least",
    "lower_whisker",
    "lower_quartile",
    "median",
    "median_se",
    "upper_quartile",
    "upper_whisker",
    "most",
    "absolute_mean",
    "truth",
];

/// Parts of each cell: where they stand and their numbers.
pub(crate) type PartsOfCell<'a> = BTreeMap<usize, Vec<(&'a Path, u64)>>;

fn describing(plan: &Plan) -> Vec<(String, ColumnKind)> {
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

fn schema(plan: &Plan, columns: Vec<(String, ColumnKind)>) -> TableSchema {
    TableSchema {
        comments: comments(plan),
        columns: columns
            .into_iter()
            .map(|(name, kind)| ColumnSchema { name, kind })
            .collect(),
    }
}

/// Begins a row with what describes cell and estimator.
fn describe(rows: &mut Rows, extra: &[String], cell: &Cell, estimator: &EstimatorCell) {
    let scenario = cell.resolved.scenario();
    rows.begin();
    rows.whole("cell", cell.index);
    rows.text("scenario", &cell.scenario);
    rows.text("condition", &cell.condition);
    rows.whole("remnant_order", scenario.remnant.order as u64);
    if let hoid_model::scenario::RemnantStrength::Level { level, .. } = scenario.remnant.strength {
        rows.real("noise_level", level);
    }
    rows.real("T_n_true", scenario.remnant.time_constant_s);
    rows.real("sample_time_s", scenario.sample_time.s());
    for name in extra {
        let axis = cell.axes.iter().chain(&estimator.axes).find(|axis| axis.key == *name);
        rows.text(name, axis.map_or("", |axis| axis.value.as_str()));
    }
    rows.text("estimator", &estimator.label);
    rows.text("name", &estimator.name);
    rows.text("method", estimator.method());
    if estimator.task != Task::Describe {
        let orders = estimator.orders(&cell.resolved);
        rows.real("nd", orders.nd as f64);
        rows.real("nk", orders.nk as f64);
    }
    rows.text("start", &estimator.start);
    rows.whole("decimate", estimator.decimate as u64);
}

/// Writes the summary of the fits.
pub(crate) fn write_fits(
    plan: &Plan,
    schemas: &Schemas,
    parts: &PartsOfCell<'_>,
    medians: &SettlingOfMedians,
    path: &Path,
) -> Result<(), StudyError> {
    use ColumnKind::{Real, Text, Whole};
    let mut columns = describing(plan);
    columns.push(("quantity".to_owned(), Text));
    columns.extend(["count", "missing", "outliers"].map(|name| (name.to_owned(), Whole)));
    columns.extend(FIGURES.map(|name| (name.to_owned(), Real)));
    let schema = schema(plan, columns);
    let extra = extra_axes(plan);
    let mut writer = TableWriter::create(path, &schema)?;
    let quantities: Vec<&str> = schemas
        .fits
        .columns
        .iter()
        .filter(|c| c.kind == Real && !SETTINGS.contains(&c.name.as_str()))
        .map(|c| c.name.as_str())
        .collect();
    for (at, cell) in plan.cells.iter().enumerate() {
        let estimators: Vec<&EstimatorCell> = plan.estimators_of(cell).map(|(_, e)| e).collect();
        let each = (quantities.len() + 4) * cell.replications as usize;
        let together = (BUDGET / each.max(1)).clamp(1, estimators.len().max(1));
        for group in estimators.chunks(together) {
            let mut collected = Collected::new(group, &quantities);
            for (directory, block) in parts.get(&at).into_iter().flatten() {
                collected.add(&hoid_io::read_table(&part(directory, *block, "fits"))?);
            }
            let mut rows = Rows::new(&schema);
            for (estimator, found) in group.iter().zip(&collected.estimators) {
                let mut put = |quantity: &str, values: &[f64], truth: f64| {
                    let statistics = Statistics::of(values);
                    if statistics.count == 0 {
                        return;
                    }
                    describe(&mut rows, &extra, cell, estimator);
                    statistics_row(&mut rows, quantity, &statistics, values, truth);
                };
                for (name, values) in quantities.iter().zip(&found.values) {
                    let truth = true_value(cell, estimator, name);
                    put(name, values, truth);
                    if truth.is_finite() && truth != 0.0 {
                        let bias: Vec<f64> = values.iter().map(|v| 100.0 * (v - truth) / truth).collect();
                        put(&format!("bias_{name}"), &bias, 0.0);
                    }
                }
                for (name, hits) in [
                    ("failed", found.failed),
                    ("not_convertible", found.not_convertible),
                    ("converged", found.converged),
                    ("diverged", found.diverged),
                ] {
                    let (p, se) = rate(hits, found.count);
                    describe(&mut rows, &extra, cell, estimator);
                    rows.text("quantity", name);
                    rows.whole("count", found.count as u64);
                    rows.real("mean", p);
                    rows.real("mean_se", se);
                }
                for (name, value) in medians
                    .get(&(cell.index, estimator.label.clone()))
                    .into_iter()
                    .flatten()
                {
                    describe(&mut rows, &extra, cell, estimator);
                    rows.text("quantity", name);
                    rows.whole("count", found.count as u64);
                    rows.real("median", *value);
                }
            }
            writer.append(&rows.into_table(Vec::new()))?;
        }
    }
    Ok(writer.finish()?)
}

fn statistics_row(rows: &mut Rows, quantity: &str, s: &Statistics, values: &[f64], truth: f64) {
    rows.text("quantity", quantity);
    rows.whole("count", s.count as u64);
    rows.whole("missing", s.missing as u64);
    rows.whole("outliers", s.outliers.len() as u64);
    let finite = values.iter().filter(|v| v.is_finite());
    let absolute_mean = finite.map(|v| v.abs()).sum::<f64>() / s.count as f64;
    let all = [
        s.mean,
        s.mean_se,
        s.sd,
        s.sd_se,
        s.least,
        s.lower_whisker,
        s.lower_quartile,
        s.median,
        s.median_se,
        s.upper_quartile,
        s.upper_whisker,
        s.most,
        absolute_mean,
        truth,
    ];
    for (name, value) in FIGURES.iter().zip(all) {
        rows.real(name, value);
    }
}

/// True value of a column of the table of fits, where it is known and does not change within the span.
pub fn true_value(cell: &Cell, estimator: &EstimatorCell, name: &str) -> f64 {
    let scenario = cell.resolved.scenario();
    let (from, to) = match estimator.task {
        // A recursion ends in the last state.
        Task::Track(_) => (scenario.measurement_s, scenario.measurement_s),
        _ => estimator.span_s.unwrap_or((0.0, scenario.measurement_s)),
    };
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-2 * a.abs().max(b.abs());
    let [first, last] = [from, to].map(|t| cell.resolved.parameters_at(t).operator);
    if !close(first.k_e, last.k_e) || !close(first.t_l_s, last.t_l_s) {
        return f64::NAN;
    }
    let [before, after] = cell.truth();
    let state = if close(first.k_e_dot(), before.operator[2]) {
        before
    } else {
        after
    };
    if let Some(i) = OPERATOR.iter().position(|p| *p == name) {
        return state.operator[i];
    }
    let coefficient = match name {
        "tau_e" if close(first.tau_e_s, last.tau_e_s) => return last.tau_e_s,
        "tau_e" => return f64::NAN,
        "T_n" | "T_n_backward_euler" => return scenario.remnant.time_constant_s,
        "K_n" | "K_n_backward_euler" => return state.k_n,
        "f1" | "a1" => 0,
        "f2" | "a2" => 1,
        "b0" => 2,
        "b1" => 3,
        _ => return of_noise_model(cell, estimator, state.k_n, name),
    };
    if estimator.decimate > 1 {
        return f64::NAN;
    }
    state.discrete[coefficient]
}

/// Coefficients of D and the innovation variance of the remnant as it is held over each sample.
fn of_noise_model(cell: &Cell, estimator: &EstimatorCell, k_n: f64, name: &str) -> f64 {
    let remnant = cell.resolved.scenario().remnant;
    if estimator.decimate > 1 || !matches!(estimator.task, Task::Fit(_)) {
        return f64::NAN;
    }
    let model = RemnantFilter::new(k_n, remnant.time_constant_s, remnant.order).and_then(|filter| {
        filter.noise_model(
            cell.resolved.scenario().sample_time,
            RemnantDiscretisation::ZeroOrderHold,
        )
    });
    let Ok(model) = model else { return f64::NAN };
    match (name, name.strip_prefix('d').and_then(|i| i.parse::<usize>().ok())) {
        ("innovation_variance", _) => model.innovation_sd * model.innovation_sd,
        (_, Some(i)) => model.d.get(i).copied().unwrap_or(f64::NAN),
        _ => f64::NAN,
    }
}

/// The values of the replications of a cell, by estimator.
struct Collected<'a> {
    at: BTreeMap<&'a str, usize>,
    quantities: &'a [&'a str],
    estimators: Vec<OfEstimator>,
}

#[derive(Clone, Default)]
struct OfEstimator {
    values: Vec<Vec<f64>>,
    count: usize,
    failed: usize,
    not_convertible: usize,
    converged: usize,
    diverged: usize,
}

impl<'a> Collected<'a> {
    fn new(group: &[&'a EstimatorCell], quantities: &'a [&'a str]) -> Self {
        let empty = OfEstimator {
            values: vec![Vec::new(); quantities.len()],
            ..OfEstimator::default()
        };
        Self {
            at: group.iter().enumerate().map(|(i, e)| (e.label.as_str(), i)).collect(),
            quantities,
            estimators: vec![empty; group.len()],
        }
    }

    fn add(&mut self, table: &OutputTable) {
        let Some(ColumnValues::Text(labels)) = table.column("estimator") else {
            return;
        };
        let places: Vec<Option<usize>> = labels
            .iter()
            .map(|label| self.at.get(label.as_str()).copied())
            .collect();
        for (q, name) in self.quantities.iter().enumerate() {
            if let Some(ColumnValues::Real(values)) = table.column(name) {
                for (place, value) in places.iter().zip(values) {
                    if let Some(i) = place {
                        self.estimators[*i].values[q].push(*value);
                    }
                }
            }
        }
        let is = |name: &str, row: usize, what: &str| matches!(table.column(name), Some(ColumnValues::Text(v)) if v[row] == what);
        let flag = |name: &str, row: usize| matches!(table.column(name), Some(ColumnValues::Whole(v)) if v[row] == 1);
        for (row, place) in places.iter().enumerate() {
            let Some(i) = place else { continue };
            let of = &mut self.estimators[*i];
            of.count += 1;
            of.failed += usize::from(is("status", row, "failed"));
            of.not_convertible += usize::from(is("status", row, "not convertible"));
            of.converged += usize::from(flag("converged", row));
            of.diverged += usize::from(flag("diverged", row));
        }
    }
}

/// Settling times of median traces, by cell and estimator.
pub(crate) type SettlingOfMedians = BTreeMap<(u64, String), Vec<(String, f64)>>;

/// Writes the summary of the traces and finds when their medians settle.
pub(crate) fn write_traces(
    plan: &Plan,
    schemas: &Schemas,
    parts: &PartsOfCell<'_>,
    path: &Path,
) -> Result<SettlingOfMedians, StudyError> {
    let mut settling = SettlingOfMedians::new();
    let Some(traces) = &schemas.traces else {
        return Ok(settling);
    };
    let names: Vec<&str> = traces
        .columns
        .iter()
        .map(|c| c.name.as_str())
        .filter(|name| !["cell", "replication", "estimator", "t"].contains(name) && !name.ends_with("_se"))
        .collect();
    let mut columns = vec![
        ("cell".to_owned(), ColumnKind::Whole),
        ("estimator".to_owned(), ColumnKind::Text),
    ];
    columns.extend(["t", "count"].map(|name| (name.to_owned(), ColumnKind::Real)));
    const OF_A_PARAMETER: [&str; 5] = ["mean", "sd", "lower_quartile", "median", "upper_quartile"];
    for name in &names {
        columns.extend(OF_A_PARAMETER.map(|figure| (format!("{name}_{figure}"), ColumnKind::Real)));
    }
    let schema = schema(plan, columns);
    let mut writer = TableWriter::create(path, &schema)?;
    let every = plan.trace_every.unwrap_or(1);
    for (at, cell) in plan.cells.iter().enumerate() {
        let tracking: Vec<&EstimatorCell> = plan
            .estimators_of(cell)
            .map(|(_, e)| e)
            .filter(|e| matches!(e.task, Task::Track(_)))
            .collect();
        let points = cell.resolved.measurement_samples() / every + 1;
        let each = names.len() * cell.replications as usize * points;
        let together = (BUDGET / each.max(1)).clamp(1, tracking.len().max(1));
        for group in tracking.chunks(together) {
            let mut series: Vec<Series> = vec![Series::default(); group.len()];
            for (directory, block) in parts.get(&at).into_iter().flatten() {
                let table = hoid_io::read_table(&part(directory, *block, "traces"))?;
                collect_traces(&table, group, &names, &mut series);
            }
            let mut rows = Rows::new(&schema);
            for (estimator, series) in group.iter().zip(&series) {
                let medians = series.write(&mut rows, cell, estimator, &names);
                settling.insert((cell.index, estimator.label.clone()), settled(cell, &names, &medians));
            }
            writer.append(&rows.into_table(Vec::new()))?;
        }
    }
    writer.finish()?;
    Ok(settling)
}

/// Values by time (in its bits, which sort as the times do) and parameter.
#[derive(Clone, Default)]
struct Series(BTreeMap<u64, Vec<Vec<f64>>>);

fn collect_traces(table: &OutputTable, group: &[&EstimatorCell], names: &[&str], series: &mut [Series]) {
    let (Some(ColumnValues::Text(labels)), Some(ColumnValues::Real(times))) =
        (table.column("estimator"), table.column("t"))
    else {
        return;
    };
    let columns: Vec<&[f64]> = names
        .iter()
        .map(|name| match table.column(name) {
            Some(ColumnValues::Real(values)) => values.as_slice(),
            _ => &[],
        })
        .collect();
    for (row, (label, t)) in labels.iter().zip(times).enumerate() {
        let Some(i) = group.iter().position(|e| e.label == *label) else {
            continue;
        };
        let at = series[i]
            .0
            .entry(t.max(0.0).to_bits())
            .or_insert_with(|| vec![Vec::new(); names.len()]);
        for (values, column) in at.iter_mut().zip(&columns) {
            if let Some(value) = column.get(row).filter(|v| v.is_finite()) {
                values.push(*value);
            }
        }
    }
}

impl Series {
    /// Writes a row for each time; gives time and medians.
    fn write(&self, rows: &mut Rows, cell: &Cell, estimator: &EstimatorCell, names: &[&str]) -> Vec<(f64, Vec<f64>)> {
        let mut medians = Vec::with_capacity(self.0.len());
        for (bits, parameters) in &self.0 {
            let t = f64::from_bits(*bits);
            rows.begin();
            rows.whole("cell", cell.index);
            rows.text("estimator", &estimator.label);
            rows.real("t", t);
            rows.real("count", parameters.iter().map(Vec::len).max().unwrap_or(0) as f64);
            let mut of_time = Vec::with_capacity(names.len());
            for (name, values) in names.iter().zip(parameters) {
                let mut sorted = values.clone();
                sorted.sort_by(f64::total_cmp);
                let n = sorted.len() as f64;
                let mean = sorted.iter().sum::<f64>() / n;
                let sd = (sorted.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
                let median = quantile(&sorted, 0.5);
                of_time.push(median);
                for (figure, value) in [
                    ("mean", mean),
                    ("sd", sd),
                    ("lower_quartile", quantile(&sorted, 0.25)),
                    ("median", median),
                    ("upper_quartile", quantile(&sorted, 0.75)),
                ] {
                    rows.real(&format!("{name}_{figure}"), value);
                }
            }
            medians.push((t, of_time));
        }
        medians
    }
}

/// When the median traces have covered 50 and 90 % of the steps of the operator's parameters.
fn settled(cell: &Cell, names: &[&str], medians: &[(f64, Vec<f64>)]) -> Vec<(String, f64)> {
    let Some(midpoint_s) = cell.resolved.scenario().schedule.change_s() else {
        return Vec::new();
    };
    let [before, after] = cell.truth();
    let mut found = Vec::new();
    for (i, name) in OPERATOR.iter().enumerate() {
        let (from, to) = (before.operator[i], after.operator[i]);
        let Some(at) = names.iter().position(|n| n == name) else {
            continue;
        };
        if (to - from).abs() <= 1e-3 * from.abs() {
            continue;
        }
        for (share, percent) in [(0.5, 50), (0.9, 90)] {
            let first = medians
                .iter()
                .find(|(t, m)| *t > midpoint_s && (m[at] - from) / (to - from) >= share);
            let time = first.map_or(f64::NAN, |(t, _)| t - midpoint_s);
            found.push((format!("settle{percent}_of_median_{name}"), time));
        }
    }
    found
}
