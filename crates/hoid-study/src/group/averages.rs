//! Averages over the runs of a subject in a condition: means with their errors, chosen delays, and mean traces.

use std::collections::BTreeMap;

use hoid_io::{OutputTable, TableSchema};

use super::tables::{numbers, real_columns, schema, text_columns, texts};
use crate::{
    columns::Rows,
    statistics::{Statistics, median},
};

/// Subject, condition, window, estimator, parameter.
type Key = [String; 5];

/// Estimates of all runs, by subject, condition, window, estimator and parameter.
#[derive(Debug, Clone, Default)]
pub(super) struct Averages(BTreeMap<Key, Vec<f64>>);

impl Averages {
    /// Adds the estimates of a run.
    pub fn add(&mut self, estimates: &OutputTable) {
        let columns = ["subject", "condition", "window", "estimator", "parameter"].map(|name| texts(estimates, name));
        let values = numbers(estimates, "value");
        for (row, status) in texts(estimates, "status").iter().enumerate() {
            if status == "ok" {
                let key = columns.map(|column| column[row].clone());
                self.0.entry(key).or_default().push(values[row]);
            }
        }
    }

    /// Returns the table of means, standard deviations and standard errors over the runs.
    pub fn table(&self) -> OutputTable {
        let mut rows = Rows::new(&schema(
            text_columns(&["subject", "condition", "window", "estimator", "parameter"]).chain(real_columns(&[
                "runs",
                "mean",
                "standard_error",
                "sd",
                "median",
                "least",
                "most",
            ])),
        ));
        for (key, values) in &self.0 {
            let s = Statistics::of(values);
            rows.start_row();
            for (name, text) in ["subject", "condition", "window", "estimator", "parameter"]
                .iter()
                .zip(key)
            {
                rows.set_text(name, text);
            }
            let figures = [s.count as f64, s.mean, s.mean_se, s.sd, s.median, s.min, s.max];
            for (name, value) in ["runs", "mean", "standard_error", "sd", "median", "least", "most"]
                .iter()
                .zip(figures)
            {
                rows.set_real(name, value);
            }
        }
        rows.into_table(Vec::new())
    }
}

/// Chosen delays and orders, and T_n (Table 3 of the thesis): one row for each subject and condition.
#[derive(Debug, Clone, Default)]
pub(super) struct Delays(BTreeMap<(String, String), BTreeMap<&'static str, f64>>);

const DELAY_COLUMNS: [(&str, &str, &str); 4] = [
    ("ARX", "nk", "ARX_nk"),
    ("BJ", "nk", "BJ_nk"),
    ("BJ", "nd", "BJ_nd"),
    ("BJ", "T_n", "BJ_T_n"),
];

impl Delays {
    /// Adds the values chosen for a subject in a condition.
    pub fn add(&mut self, estimates: &OutputTable) {
        let [subject, condition, window, estimator, parameter] =
            ["subject", "condition", "window", "estimator", "parameter"].map(|name| texts(estimates, name));
        let values = numbers(estimates, "value");
        for row in 0..values.len() {
            let column = DELAY_COLUMNS
                .iter()
                .find(|(of, name, _)| estimator[row] == *of && parameter[row] == *name && window[row].is_empty());
            if let Some((_, _, column)) = column {
                let key = (subject[row].clone(), condition[row].clone());
                self.0.entry(key).or_default().insert(column, values[row]);
            }
        }
    }

    /// Returns the table of the chosen values.
    pub fn table(&self) -> OutputTable {
        let columns = DELAY_COLUMNS.map(|(_, _, column)| column);
        let mut rows = Rows::new(&schema(
            text_columns(&["subject", "condition"]).chain(real_columns(&columns)),
        ));
        for ((subject, condition), values) in &self.0 {
            rows.start_row();
            rows.set_text("subject", subject);
            rows.set_text("condition", condition);
            for column in columns {
                rows.set_real(column, values.get(column).copied().unwrap_or(f64::NAN));
            }
        }
        rows.into_table(Vec::new())
    }
}

/// Statistics of a parameter over the runs at each time.
const STATISTIC_COLUMNS: [&str; 6] = ["runs", "mean", "sd", "lower_quartile", "median", "upper_quartile"];

/// Traces of all runs, collected by time.
#[derive(Debug, Clone, Default)]
pub(super) struct TraceAverages {
    names: Vec<String>,
    values: BTreeMap<[String; 3], BTreeMap<u64, Vec<Vec<f64>>>>,
}

impl TraceAverages {
    /// Creates an empty collection for these columns. For a name that ends in `_se`, the table gives the squared median
    /// of the standard errors, as a variance.
    pub fn new(names: Vec<String>) -> Self {
        Self {
            names,
            values: BTreeMap::new(),
        }
    }

    /// Returns the columns of the table.
    pub fn schema(names: &[String]) -> TableSchema {
        let mut columns: Vec<String> = vec!["t".to_owned()];
        for name in names {
            match name.strip_suffix("_se") {
                Some(of) => columns.push(format!("{of}_variance")),
                None => columns.extend(STATISTIC_COLUMNS.map(|figure| format!("{name}_{figure}"))),
            }
        }
        schema(text_columns(&["subject", "condition", "estimator"]).chain(real_columns(&columns)))
    }

    /// Adds the traces of a run.
    pub fn add(&mut self, traces: &OutputTable) {
        let keys = ["subject", "condition", "estimator"].map(|name| texts(traces, name));
        let columns: Vec<&[f64]> = self.names.iter().map(|name| numbers(traces, name)).collect();
        for (row, t) in numbers(traces, "t").iter().enumerate() {
            let key = keys.map(|column| column[row].clone());
            let at = self.values.entry(key).or_default().entry(t.max(0.0).to_bits());
            let all = at.or_insert_with(|| vec![Vec::new(); columns.len()]);
            for (values, column) in all.iter_mut().zip(&columns) {
                if let Some(value) = column.get(row).filter(|v| v.is_finite()) {
                    values.push(*value);
                }
            }
        }
    }

    /// Returns the times of the rows of an estimator, and the medians of a parameter over the runs at these times.
    pub fn medians(&self, key: &[String; 3], name: &str) -> (Vec<f64>, Vec<f64>) {
        let at = self.names.iter().position(|known| known == name);
        let (Some(times), Some(at)) = (self.values.get(key), at) else {
            return (Vec::new(), Vec::new());
        };
        times
            .iter()
            .map(|(bits, all)| (f64::from_bits(*bits), median(&all[at])))
            .unzip()
    }

    /// Returns the table of median, quartiles, mean and standard deviation over the runs at each time; for a standard
    /// error, its squared median over the runs.
    pub fn table(&self) -> OutputTable {
        let mut rows = Rows::new(&Self::schema(&self.names));
        for (key, times) in &self.values {
            for (bits, all) in times {
                rows.start_row();
                for (name, text) in ["subject", "condition", "estimator"].iter().zip(key) {
                    rows.set_text(name, text);
                }
                rows.set_real("t", f64::from_bits(*bits));
                for (name, values) in self.names.iter().zip(all).filter(|(_, values)| !values.is_empty()) {
                    let s = Statistics::of(values);
                    match name.strip_suffix("_se") {
                        Some(of) => rows.set_real(&format!("{of}_variance"), s.median * s.median),
                        None => {
                            let figures = [
                                s.count as f64,
                                s.mean,
                                s.sd,
                                s.lower_quartile,
                                s.median,
                                s.upper_quartile,
                            ];
                            for (figure, value) in STATISTIC_COLUMNS.iter().zip(figures) {
                                rows.set_real(&format!("{name}_{figure}"), value);
                            }
                        }
                    }
                }
            }
        }
        rows.into_table(Vec::new())
    }
}
