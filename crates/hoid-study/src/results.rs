//! Reading a finished study back: rows of its summary, values of its replications, traces.
//!
//! What describes a cell and an estimator comes from the plan that stands beside the tables, numbers come from the tables. Rows are found by
//! what describes them:
//!
//! ```no_run
//! use hoid_study::{Query, Results};
//!
//! let results = Results::read("out".as_ref())?;
//! let query = Query::of("bias_b0").condition("C1").remnant_order(2).noise_level(0.1).name("BJ").nd(1).nk(29);
//! let median = results.one(&query).map(|row| row.statistics.median);
//! let each = results.values(&query);
//! # Ok::<(), hoid_study::StudyError>(())
//! ```

use std::{
    collections::{BTreeMap, HashMap},
    path::Path,
};

use crate::{
    Plan, Statistics, StudyError,
    manifest::{Manifest, PLAN},
    plan::{Cell, EstimatorCell, Task},
    query::{Query, Subject},
    summary::true_value,
    tables::{Columns, table_path},
};

/// A finished study.
#[derive(Debug, Clone)]
pub struct Results {
    /// The plan, with the replications that were run.
    pub plan: Plan,
    /// Each cell with each of its estimators, in the order of the tables.
    pairs: Vec<Pair>,
    rows: Vec<SummaryRow>,
    /// Numbers of the table of fits by column.
    fits: BTreeMap<String, Vec<f64>>,
    traces: HashMap<(u64, String), TraceSummary>,
}

/// A cell and an estimator.
#[derive(Debug, Clone)]
struct Pair {
    cell: usize,
    estimator: usize,
    subject: Subject,
    /// Row of the summary of each quantity.
    rows: BTreeMap<String, usize>,
    /// Rows of the table of fits, one a replication.
    fits: Vec<usize>,
}

/// A row of the summary: one quantity of one estimator in one cell.
#[derive(Debug, Clone, PartialEq)]
pub struct SummaryRow {
    /// Number of the cell.
    pub cell: u64,
    /// Name of the scenario.
    pub scenario: String,
    /// The condition from which it started, empty for none.
    pub condition: String,
    /// Order m0 of the simulated remnant.
    pub remnant_order: usize,
    /// Demanded noise level, not a number where the gain was given.
    pub noise_level: f64,
    /// Time constant T_n of the simulated remnant, s.
    pub t_n_s: f64,
    /// What stands for the lists of scenario and estimator, by their keys joined by `_`.
    pub axes: BTreeMap<String, String>,
    /// Label of the estimator: its name and its axes.
    pub estimator: String,
    /// Name of the estimator.
    pub name: String,
    /// Its method.
    pub method: String,
    /// Order m* of its noise model.
    pub nd: Option<usize>,
    /// Its delay n_k*, samples.
    pub nk: Option<usize>,
    /// Label of its start, empty for its own.
    pub start: String,
    /// It took every so manieth sample.
    pub decimate: usize,
    /// The quantity: a column of the table of fits, `bias_<column>`, a rate or a settling time of median traces.
    pub quantity: String,
    /// Statistics over the replications; the outliers themselves are not kept.
    pub statistics: Statistics,
    /// Values beyond the whiskers.
    pub outliers: usize,
    /// True value, not a number where there is none.
    pub truth: f64,
    /// Mean of the absolute values.
    pub absolute_mean: f64,
}

/// Summary of the traces of an estimator in a cell.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TraceSummary {
    /// Times, s.
    pub times_s: Vec<f64>,
    /// By name of a parameter.
    pub parameters: BTreeMap<String, Bands>,
}

/// What the replications of a trace say together at each time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bands {
    /// Mean.
    pub mean: Vec<f64>,
    /// Standard deviation.
    pub sd: Vec<f64>,
    /// Quantile of 25 %.
    pub lower_quartile: Vec<f64>,
    /// Median.
    pub median: Vec<f64>,
    /// Quantile of 75 %.
    pub upper_quartile: Vec<f64>,
}

impl Bands {
    /// Monte Carlo error of the median of a point, taken as that of a normal sample of the same interquartile range.
    pub fn error_of_median(&self, point: usize, replications: u64) -> f64 {
        match replications {
            0 | 1 => 0.0,
            n => 0.93 * (self.upper_quartile[point] - self.lower_quartile[point]) / (n as f64).sqrt(),
        }
    }
}

impl Results {
    /// Reads the directory of a finished study; tables as Parquet or CSV.
    ///
    /// # Errors
    /// [`StudyError::NoStudy`] and [`StudyError::Unfinished`] for a directory without one or with a part of one,
    /// [`StudyError::OtherStudy`] when its plan was changed since, [`StudyError::Table`] for a table that lacks a column or does not fit the plan,
    /// [`StudyError::Io`] for one that cannot be read.
    pub fn read(directory: &Path) -> Result<Self, StudyError> {
        let shown = || directory.display().to_string();
        let manifest = Manifest::read(directory)?.ok_or_else(|| StudyError::NoStudy { directory: shown() })?;
        if !manifest.complete {
            return Err(StudyError::Unfinished { directory: shown() });
        }
        let plan = Plan::read(&directory.join(PLAN))?.with_replications(manifest.replications)?;
        if plan.hash() != manifest.plan_sha256 {
            return Err(StudyError::OtherStudy {
                directory: shown(),
                reason: format!("its {PLAN} is not the one that was run"),
            });
        }
        let mut results = Self::without_tables(plan);
        let at: HashMap<(u64, String), usize> = results
            .pairs
            .iter()
            .enumerate()
            .map(|(i, pair)| ((pair.subject.cell, pair.subject.estimator.clone()), i))
            .collect();
        results.read_summary(&Columns::read(directory, "summary")?, &at)?;
        results.read_fits(&Columns::read(directory, "fits")?, &at)?;
        if table_path(directory, "trace-summary").exists() {
            results.read_traces(&Columns::read(directory, "trace-summary")?)?;
        }
        Ok(results)
    }

    fn without_tables(plan: Plan) -> Self {
        let mut pairs = Vec::new();
        for (i, cell) in plan.cells.iter().enumerate() {
            for (j, estimator) in plan.estimators_of(cell) {
                pairs.push(Pair {
                    cell: i,
                    estimator: j,
                    subject: subject(cell, estimator),
                    rows: BTreeMap::new(),
                    fits: Vec::new(),
                });
            }
        }
        Self {
            plan,
            pairs,
            rows: Vec::new(),
            fits: BTreeMap::new(),
            traces: HashMap::new(),
        }
    }

    /// The rows of the summary that a query describes, in the order of the table. A query without quantity takes all of them.
    pub fn find(&self, query: &Query) -> Vec<&SummaryRow> {
        let mut found = Vec::new();
        for pair in self.pairs.iter().filter(|pair| query.takes(&pair.subject)) {
            match query.quantity() {
                Some(quantity) => found.extend(pair.rows.get(quantity).copied()),
                None => {
                    let first = found.len();
                    found.extend(pair.rows.values().copied());
                    found[first..].sort_unstable();
                }
            }
        }
        found.into_iter().map(|row| &self.rows[row]).collect()
    }

    /// The row of the summary that a query describes; none when there are none or several.
    pub fn one(&self, query: &Query) -> Option<&SummaryRow> {
        match self.find(query).as_slice() {
            [row] => Some(row),
            _ => None,
        }
    }

    /// The values of a quantity replication by replication, cells and estimators in the order of the table; what does not exist is no
    /// number. `bias_<column>` is computed from the column and its true value; `failed`, `not_convertible`, `converged`
    /// and `diverged` are 0 or 1. Empty when the query names no quantity, or one that the table of fits does not have.
    pub fn values(&self, query: &Query) -> Vec<f64> {
        let Some(quantity) = query.quantity() else {
            return Vec::new();
        };
        let biased = quantity.strip_prefix("bias_");
        let Some(column) = self.fits.get(biased.unwrap_or(quantity)) else {
            return Vec::new();
        };
        let mut values = Vec::new();
        for pair in self.pairs.iter().filter(|pair| query.takes(&pair.subject)) {
            let of_pair = pair.fits.iter().map(|row| column[*row]);
            match biased {
                Some(name) => {
                    let truth = true_value(&self.plan.cells[pair.cell], &self.plan.estimators[pair.estimator], name);
                    values.extend(of_pair.map(|value| 100.0 * (value - truth) / truth));
                }
                None => values.extend(of_pair),
            }
        }
        values
    }

    /// The summary of the traces of an estimator, named by its label.
    pub fn traces(&self, cell: u64, estimator: &str) -> Option<&TraceSummary> {
        self.traces.get(&(cell, estimator.to_owned()))
    }

    /// The cells in which a query describes anything.
    pub fn cells(&self, query: &Query) -> Vec<&Cell> {
        let mut found: Vec<usize> = self
            .pairs
            .iter()
            .filter(|pair| query.takes(&pair.subject))
            .map(|pair| pair.cell)
            .collect();
        found.dedup();
        found.into_iter().map(|i| &self.plan.cells[i]).collect()
    }

    /// How many estimators in how many cells a query describes, whatever their quantities.
    pub fn describes(&self, query: &Query) -> usize {
        self.pairs.iter().filter(|pair| query.takes(&pair.subject)).count()
    }

    /// Whether there are values of the quantity of a query.
    pub fn has_quantity(&self, query: &Query) -> bool {
        let column = query
            .quantity()
            .map(|quantity| quantity.strip_prefix("bias_").unwrap_or(quantity));
        column.is_some_and(|column| self.fits.contains_key(column))
    }

    /// The first estimator that a query describes.
    pub fn estimator(&self, query: &Query) -> Option<&EstimatorCell> {
        let pair = self.pairs.iter().find(|pair| query.takes(&pair.subject));
        pair.map(|pair| &self.plan.estimators[pair.estimator])
    }

    fn read_summary(&mut self, table: &Columns, at: &HashMap<(u64, String), usize>) -> Result<(), StudyError> {
        let (cells, labels, quantities) = (table.real("cell")?, table.text("estimator")?, table.text("quantity")?);
        let figure = |name: &str| table.real(name);
        let [count, missing, outliers] = [figure("count")?, figure("missing")?, figure("outliers")?];
        let [mean, mean_se, sd, sd_se] = [figure("mean")?, figure("mean_se")?, figure("sd")?, figure("sd_se")?];
        let [least, lower_whisker, lower_quartile, median] = [
            figure("least")?,
            figure("lower_whisker")?,
            figure("lower_quartile")?,
            figure("median")?,
        ];
        let [median_se, upper_quartile, upper_whisker, most] = [
            figure("median_se")?,
            figure("upper_quartile")?,
            figure("upper_whisker")?,
            figure("most")?,
        ];
        let [absolute_mean, truth] = [figure("absolute_mean")?, figure("truth")?];
        for (i, quantity) in quantities.iter().enumerate() {
            let pair = table.pair(at, cells[i], &labels[i])?;
            let statistics = Statistics {
                count: count[i] as usize,
                missing: missing[i] as usize,
                mean: mean[i],
                mean_se: mean_se[i],
                sd: sd[i],
                sd_se: sd_se[i],
                least: least[i],
                lower_whisker: lower_whisker[i],
                lower_quartile: lower_quartile[i],
                median: median[i],
                median_se: median_se[i],
                upper_quartile: upper_quartile[i],
                upper_whisker: upper_whisker[i],
                most: most[i],
                outliers: Vec::new(),
            };
            let of = &mut self.pairs[pair];
            of.rows.insert(quantity.clone(), self.rows.len());
            let s = of.subject.clone();
            self.rows.push(SummaryRow {
                cell: s.cell,
                scenario: s.scenario,
                condition: s.condition,
                remnant_order: s.remnant_order,
                noise_level: s.noise_level,
                t_n_s: s.t_n_s,
                axes: s.axes,
                estimator: s.estimator,
                name: s.name,
                method: s.method,
                nd: s.nd,
                nk: s.nk,
                start: s.start,
                decimate: s.decimate,
                quantity: quantity.clone(),
                statistics,
                outliers: outliers[i] as usize,
                truth: truth[i],
                absolute_mean: absolute_mean[i],
            });
        }
        Ok(())
    }

    fn read_fits(&mut self, table: &Columns, at: &HashMap<(u64, String), usize>) -> Result<(), StudyError> {
        let (cells, labels, status) = (table.real("cell")?, table.text("estimator")?, table.text("status")?);
        for (i, label) in labels.iter().enumerate() {
            let pair = table.pair(at, cells[i], label)?;
            self.pairs[pair].fits.push(i);
        }
        for name in table.numbers() {
            self.fits.insert(name.to_owned(), table.real(name)?);
        }
        for (name, shown) in [("failed", "failed"), ("not_convertible", "not convertible")] {
            let hits = status
                .iter()
                .map(|status| f64::from(u8::from(status == shown)))
                .collect();
            self.fits.insert(name.to_owned(), hits);
        }
        Ok(())
    }

    fn read_traces(&mut self, table: &Columns) -> Result<(), StudyError> {
        let (cells, labels, times) = (table.real("cell")?, table.text("estimator")?, table.real("t")?);
        let names: Vec<String> = table
            .numbers()
            .filter_map(|name| name.strip_suffix("_median"))
            .map(str::to_owned)
            .collect();
        let mut columns = Vec::new();
        for name in names {
            let figure = |figure: &str| table.real(&format!("{name}_{figure}"));
            let five = [
                figure("mean")?,
                figure("sd")?,
                figure("lower_quartile")?,
                figure("median")?,
                figure("upper_quartile")?,
            ];
            columns.push((name, five));
        }
        let same = |i: usize| cells[i] == cells[i - 1] && labels[i] == labels[i - 1];
        let mut first = 0;
        for end in 1..=times.len() {
            if end < times.len() && same(end) {
                continue;
            }
            let span = first..end;
            let of = |values: &[f64]| values[span.clone()].to_vec();
            let parameters = columns
                .iter()
                .filter(|(_, five)| five[3][span.clone()].iter().any(|v| v.is_finite()));
            let parameters = parameters.map(|(name, five)| {
                let [mean, sd, lower_quartile, median, upper_quartile] = five.each_ref().map(|values| of(values));
                let bands = Bands {
                    mean,
                    sd,
                    lower_quartile,
                    median,
                    upper_quartile,
                };
                (name.clone(), bands)
            });
            let summary = TraceSummary {
                times_s: of(&times),
                parameters: parameters.collect(),
            };
            self.traces
                .insert((cells[first] as u64, labels[first].clone()), summary);
            first = end;
        }
        Ok(())
    }
}

fn subject(cell: &Cell, estimator: &EstimatorCell) -> Subject {
    let scenario = cell.resolved.scenario();
    let orders = (estimator.task != Task::Describe).then(|| estimator.orders(&cell.resolved));
    let level = match scenario.remnant.strength {
        hoid_model::scenario::RemnantStrength::Level { level, .. } => level,
        hoid_model::scenario::RemnantStrength::Gain { .. } => f64::NAN,
    };
    let axes = cell.axes.iter().chain(&estimator.axes);
    Subject {
        cell: cell.index,
        scenario: cell.scenario.clone(),
        condition: cell.condition.clone(),
        remnant_order: scenario.remnant.order,
        noise_level: level,
        t_n_s: scenario.remnant.time_constant_s,
        axes: axes.map(|axis| (axis.key.clone(), axis.value.clone())).collect(),
        estimator: estimator.label.clone(),
        name: estimator.name.clone(),
        method: estimator.method().to_owned(),
        nd: orders.map(|orders| orders.nd),
        nk: orders.map(|orders| orders.nk),
        start: estimator.start.clone(),
        decimate: estimator.decimate,
    }
}

#[cfg(any(test, feature = "synthetic"))]
mod synthetic;

#[cfg(test)]
#[path = "results_tests.rs"]
mod tests;
