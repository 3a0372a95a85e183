//! The summary of the traces.

use std::{collections::BTreeMap, path::Path};

use hoid_io::{ColumnKind, ColumnValues, OutputTable, TableWriter};
use hoid_numerics::statistics::{mean, sample_variance};

use super::layout::{MAX_VALUES, PartsOfCell, schema};
use crate::{
    Plan, StudyError,
    columns::{OPERATOR_PARAMETERS, Rows, Schemas},
    directory::part_path,
    plan::{Cell, EstimatorCell, Task},
    statistics::quantile,
};

/// Settling times of median traces, by cell and estimator.
pub(crate) type SettlingOfMedians = BTreeMap<(u64, String), Vec<(String, f64)>>;

/// Writes the summary of the traces and returns the settling times of the median traces.
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
    const PARAMETER_STATISTICS: [&str; 5] = ["mean", "sd", "lower_quartile", "median", "upper_quartile"];
    for name in &names {
        columns.extend(PARAMETER_STATISTICS.map(|figure| (format!("{name}_{figure}"), ColumnKind::Real)));
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
        let together = (MAX_VALUES / each.max(1)).clamp(1, tracking.len().max(1));
        for group in tracking.chunks(together) {
            let mut series: Vec<Series> = vec![Series::default(); group.len()];
            for (directory, block) in parts.get(&at).into_iter().flatten() {
                let table = hoid_io::read_table(&part_path(directory, *block, "traces"))?;
                collect_traces(&table, group, &names, &mut series);
            }
            let mut rows = Rows::new(&schema);
            for (estimator, series) in group.iter().zip(&series) {
                let medians = series.write(&mut rows, cell, estimator, &names);
                settling.insert(
                    (cell.index, estimator.label.clone()),
                    settling_times(cell, &names, &medians),
                );
            }
            writer.append(&rows.into_table(Vec::new()))?;
        }
    }
    writer.finish()?;
    Ok(settling)
}

/// Values by time and parameter. Times are stored as bits, which sort in the same order.
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
    /// Writes a row for each time; returns the times and the medians.
    fn write(&self, rows: &mut Rows, cell: &Cell, estimator: &EstimatorCell, names: &[&str]) -> Vec<(f64, Vec<f64>)> {
        let mut medians = Vec::with_capacity(self.0.len());
        for (bits, parameters) in &self.0 {
            let t = f64::from_bits(*bits);
            rows.start_row();
            rows.set_whole("cell", cell.index);
            rows.set_text("estimator", &estimator.label);
            rows.set_real("t", t);
            rows.set_real("count", parameters.iter().map(Vec::len).max().unwrap_or(0) as f64);
            let mut of_time = Vec::with_capacity(names.len());
            for (name, values) in names.iter().zip(parameters) {
                let mut sorted = values.clone();
                sorted.sort_by(f64::total_cmp);
                let median = quantile(&sorted, 0.5);
                of_time.push(median);
                for (figure, value) in [
                    ("mean", mean(&sorted)),
                    ("sd", sample_variance(&sorted).sqrt()),
                    ("lower_quartile", quantile(&sorted, 0.25)),
                    ("median", median),
                    ("upper_quartile", quantile(&sorted, 0.75)),
                ] {
                    rows.set_real(&format!("{name}_{figure}"), value);
                }
            }
            medians.push((t, of_time));
        }
        medians
    }
}

/// Returns the times after the change at which the median traces have covered 50 and 90 % of the steps of the
/// operator's parameters.
fn settling_times(cell: &Cell, names: &[&str], medians: &[(f64, Vec<f64>)]) -> Vec<(String, f64)> {
    let Some(midpoint_s) = cell.resolved.scenario().schedule.change_s() else {
        return Vec::new();
    };
    let [before, after] = cell.true_states();
    let mut found = Vec::new();
    for (i, name) in OPERATOR_PARAMETERS.iter().enumerate() {
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
