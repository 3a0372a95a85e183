//! A finished study in memory; queries select its rows.

use std::collections::{BTreeMap, HashMap};

use super::rows::{SummaryRow, TraceSummary};
use crate::{
    Plan,
    plan::{Cell, EstimatorCell},
    query::{Query, RowKey},
    true_value::true_value,
};

/// A finished study.
#[derive(Debug, Clone)]
pub struct Results {
    /// The plan, with the actual number of replications.
    pub plan: Plan,
    /// Each cell with each of its estimators, in the order of the tables.
    pub(super) pairs: Vec<CellEstimator>,
    pub(super) rows: Vec<SummaryRow>,
    /// Numeric columns of the table of fits, by name.
    pub(super) fits: BTreeMap<String, Vec<f64>>,
    pub(super) traces: HashMap<(u64, String), TraceSummary>,
}

/// A cell with one of its estimators.
#[derive(Debug, Clone)]
pub(super) struct CellEstimator {
    pub(super) cell: usize,
    pub(super) estimator: usize,
    pub(super) key: RowKey,
    /// Index of the summary row of each quantity.
    pub(super) rows: BTreeMap<String, usize>,
    /// Indices of the rows in the table of fits, one per replication.
    pub(super) fits: Vec<usize>,
}

impl Results {
    pub(super) fn without_tables(plan: Plan) -> Self {
        let mut pairs = Vec::new();
        for (i, cell) in plan.cells.iter().enumerate() {
            for (j, estimator) in plan.estimators_of(cell) {
                pairs.push(CellEstimator {
                    cell: i,
                    estimator: j,
                    key: row_key(cell, estimator),
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

    /// Returns the rows of the summary that a query selects, in the order of the table. A query without a quantity
    /// selects all quantities.
    pub fn find(&self, query: &Query) -> Vec<&SummaryRow> {
        let mut found = Vec::new();
        for pair in self.pairs.iter().filter(|pair| query.matches(&pair.key)) {
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

    /// Returns the row of the summary that a query selects; `None` unless it selects exactly one.
    pub fn find_one(&self, query: &Query) -> Option<&SummaryRow> {
        match self.find(query).as_slice() {
            [row] => Some(row),
            _ => None,
        }
    }

    /// Returns the values of a quantity for all replications, with cells and estimators in the order of the table;
    /// missing values are NaN. `bias_<column>` is computed from the column and its true value; `failed`,
    /// `not_convertible`, `converged` and `diverged` are 0 or 1. The result is empty if the query has no quantity or
    /// the table of fits does not have this quantity.
    pub fn values(&self, query: &Query) -> Vec<f64> {
        let Some(quantity) = query.quantity() else {
            return Vec::new();
        };
        let biased = quantity.strip_prefix("bias_");
        let Some(column) = self.fits.get(biased.unwrap_or(quantity)) else {
            return Vec::new();
        };
        let mut values = Vec::new();
        for pair in self.pairs.iter().filter(|pair| query.matches(&pair.key)) {
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

    /// Returns the summary of the traces of an estimator, given by its label.
    pub fn traces(&self, cell: u64, estimator: &str) -> Option<&TraceSummary> {
        self.traces.get(&(cell, estimator.to_owned()))
    }

    /// Returns the cells of the rows that a query selects.
    pub fn cells(&self, query: &Query) -> Vec<&Cell> {
        let mut found: Vec<usize> = self
            .pairs
            .iter()
            .filter(|pair| query.matches(&pair.key))
            .map(|pair| pair.cell)
            .collect();
        found.dedup();
        found.into_iter().map(|i| &self.plan.cells[i]).collect()
    }

    /// Returns the number of pairs of cell and estimator that a query selects, regardless of its quantity.
    pub fn count(&self, query: &Query) -> usize {
        self.pairs.iter().filter(|pair| query.matches(&pair.key)).count()
    }

    /// True if the table of fits has the quantity of a query.
    pub fn has_quantity(&self, query: &Query) -> bool {
        let column = query
            .quantity()
            .map(|quantity| quantity.strip_prefix("bias_").unwrap_or(quantity));
        column.is_some_and(|column| self.fits.contains_key(column))
    }

    /// Returns the first estimator that a query selects.
    pub fn estimator(&self, query: &Query) -> Option<&EstimatorCell> {
        let pair = self.pairs.iter().find(|pair| query.matches(&pair.key));
        pair.map(|pair| &self.plan.estimators[pair.estimator])
    }
}

fn row_key(cell: &Cell, estimator: &EstimatorCell) -> RowKey {
    let scenario = cell.resolved.scenario();
    let orders = estimator.structure().map(|_| estimator.orders(&cell.resolved));
    let level = match scenario.remnant.strength {
        hoid_model::scenario::RemnantStrength::Level { level, .. } => level,
        hoid_model::scenario::RemnantStrength::Gain { .. } => f64::NAN,
    };
    let axes = cell.axes.iter().chain(&estimator.axes);
    RowKey {
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
