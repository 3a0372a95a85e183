//! The summary of the fits.

use std::{collections::BTreeMap, path::Path};

use hoid_io::{ColumnKind, ColumnValues, OutputTable, TableWriter};
use hoid_model::{Form, NamedChoice, VerdictLevel};

use super::{
    layout::{MAX_VALUES, PartsOfCell, schema, setting_columns, start_row},
    traces::SettlingOfMedians,
};
use crate::{
    Plan, StudyError,
    columns::{Rows, Schemas, extra_axes},
    directory::part_path,
    plan::EstimatorCell,
    statistics::{Statistics, rate},
    true_value::true_value,
};

/// Real columns that are settings, not quantities.
const SETTING_COLUMNS: [&str; 11] = [
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

/// The levels of a verdict, and the names of their rates.
const VERDICT_LEVELS: [(VerdictLevel, &str); 3] = [
    (VerdictLevel::Trustworthy, "trustworthy"),
    (VerdictLevel::Doubtful, "doubtful"),
    (VerdictLevel::NotDetermined, "not_determined"),
];

/// Statistics in a row of the summary, in the order of their columns.
const STATISTIC_COLUMNS: [&str; 14] = [
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

/// Writes the summary of the fits.
pub(crate) fn write_fits(
    plan: &Plan,
    schemas: &Schemas,
    parts: &PartsOfCell<'_>,
    medians: &SettlingOfMedians,
    path: &Path,
) -> Result<(), StudyError> {
    use ColumnKind::{Real, Text, Whole};
    let mut columns = setting_columns(plan);
    columns.push(("quantity".to_owned(), Text));
    columns.extend(["count", "missing", "outliers"].map(|name| (name.to_owned(), Whole)));
    columns.extend(STATISTIC_COLUMNS.map(|name| (name.to_owned(), Real)));
    let schema = schema(plan, columns);
    let extra = extra_axes(plan);
    let mut writer = TableWriter::create(path, &schema)?;
    let quantities: Vec<&str> = schemas
        .fits
        .columns
        .iter()
        .filter(|c| c.kind == Real && !SETTING_COLUMNS.contains(&c.name.as_str()))
        .map(|c| c.name.as_str())
        .collect();
    for (at, cell) in plan.cells.iter().enumerate() {
        let estimators: Vec<&EstimatorCell> = plan.estimators_of(cell).map(|(_, e)| e).collect();
        let each = (quantities.len() + 4) * cell.replications as usize;
        let together = (MAX_VALUES / each.max(1)).clamp(1, estimators.len().max(1));
        for group in estimators.chunks(together) {
            let mut collected = CollectedValues::new(group, &quantities);
            for (directory, block) in parts.get(&at).into_iter().flatten() {
                collected.add(&hoid_io::read_table(&part_path(directory, *block, "fits"))?);
            }
            let mut rows = Rows::new(&schema);
            for (estimator, found) in group.iter().zip(&collected.estimators) {
                let mut put = |quantity: &str, values: &[f64], truth: f64| {
                    let statistics = Statistics::of(values);
                    if statistics.count == 0 {
                        return;
                    }
                    start_row(&mut rows, &extra, cell, estimator);
                    write_statistics_row(&mut rows, quantity, &statistics, values, truth);
                };
                for (name, values) in quantities.iter().zip(&found.values) {
                    let truth = true_value(cell, estimator, name);
                    put(name, values, truth);
                    if truth.is_finite() && truth != 0.0 {
                        // In any form other than a gain with a lead, T_L is a different quantity, so its bias is not
                        // computed.
                        let meant = |lead: &bool| *lead || !name.starts_with("T_L");
                        let error = |v: f64| 100.0 * (v - truth) / truth;
                        let of_each = values.iter().zip(&found.is_gain_with_lead);
                        let bias: Vec<f64> = of_each
                            .map(|(v, lead)| if meant(lead) { error(*v) } else { f64::NAN })
                            .collect();
                        put(&format!("bias_{name}"), &bias, 0.0);
                    }
                }
                let mut rates = vec![
                    ("failed", found.failed),
                    ("not_convertible", found.not_convertible),
                    ("converged", found.converged),
                    ("diverged", found.diverged),
                ];
                if estimator.task.analysis().is_some() {
                    rates.extend(
                        VERDICT_LEVELS
                            .iter()
                            .zip(found.levels)
                            .map(|((_, name), hits)| (*name, hits)),
                    );
                }
                for (name, hits) in rates {
                    let (p, se) = rate(hits, found.count);
                    start_row(&mut rows, &extra, cell, estimator);
                    rows.set_text("quantity", name);
                    rows.set_whole("count", found.count as u64);
                    rows.set_real("mean", p);
                    rows.set_real("mean_se", se);
                }
                for (name, value) in medians
                    .get(&(cell.index, estimator.label.clone()))
                    .into_iter()
                    .flatten()
                {
                    start_row(&mut rows, &extra, cell, estimator);
                    rows.set_text("quantity", name);
                    rows.set_whole("count", found.count as u64);
                    rows.set_real("median", *value);
                }
            }
            writer.append(&rows.into_table(Vec::new()))?;
        }
    }
    Ok(writer.finish()?)
}

fn write_statistics_row(rows: &mut Rows, quantity: &str, s: &Statistics, values: &[f64], truth: f64) {
    rows.set_text("quantity", quantity);
    rows.set_whole("count", s.count as u64);
    rows.set_whole("missing", s.missing as u64);
    rows.set_whole("outliers", s.outliers.len() as u64);
    let finite = values.iter().filter(|v| v.is_finite());
    let absolute_mean = finite.map(|v| v.abs()).sum::<f64>() / s.count as f64;
    let all = [
        s.mean,
        s.mean_se,
        s.sd,
        s.sd_se,
        s.min,
        s.lower_whisker,
        s.lower_quartile,
        s.median,
        s.median_se,
        s.upper_quartile,
        s.upper_whisker,
        s.max,
        absolute_mean,
        truth,
    ];
    for (name, value) in STATISTIC_COLUMNS.iter().zip(all) {
        rows.set_real(name, value);
    }
}

/// The values of all replications of a cell, by estimator.
struct CollectedValues<'a> {
    estimator_indices: BTreeMap<&'a str, usize>,
    quantities: &'a [&'a str],
    estimators: Vec<EstimatorResults>,
}

#[derive(Clone, Default)]
struct EstimatorResults {
    values: Vec<Vec<f64>>,
    /// For each fit, true if its form is a gain with a lead, as simulated, or if no form was selected.
    is_gain_with_lead: Vec<bool>,
    count: usize,
    failed: usize,
    not_convertible: usize,
    converged: usize,
    diverged: usize,
    /// Number of fits at each verdict level.
    levels: [usize; VERDICT_LEVELS.len()],
}

impl<'a> CollectedValues<'a> {
    fn new(group: &[&'a EstimatorCell], quantities: &'a [&'a str]) -> Self {
        let empty = EstimatorResults {
            values: vec![Vec::new(); quantities.len()],
            ..EstimatorResults::default()
        };
        Self {
            estimator_indices: group.iter().enumerate().map(|(i, e)| (e.label.as_str(), i)).collect(),
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
            .map(|label| self.estimator_indices.get(label.as_str()).copied())
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
            of.is_gain_with_lead.push(match table.column("form") {
                Some(ColumnValues::Text(forms)) => forms[row].is_empty() || forms[row] == Form::Lead.choice_name(),
                _ => true,
            });
            of.failed += usize::from(is("status", row, "failed"));
            of.not_convertible += usize::from(is("status", row, "not convertible"));
            of.converged += usize::from(flag("converged", row));
            of.diverged += usize::from(flag("diverged", row));
            for (count, (level, _)) in of.levels.iter_mut().zip(VERDICT_LEVELS) {
                *count += usize::from(is("verdict", row, level.choice_name()));
            }
        }
    }
}
