//! Rows of the summaries in the results of a study.

use std::collections::BTreeMap;

use crate::Statistics;

/// A row of the summary: one quantity of one estimator in one cell.
#[derive(Debug, Clone, PartialEq)]
pub struct SummaryRow {
    /// Number of the cell.
    pub cell: u64,
    /// Name of the scenario.
    pub scenario: String,
    /// Name of the condition on which the scenario is based; empty if there is none.
    pub condition: String,
    /// Order m0 of the simulated remnant.
    pub remnant_order: usize,
    /// Specified noise level; NaN if the gain of the remnant was specified instead.
    pub noise_level: f64,
    /// Time constant T_n of the simulated remnant, s.
    pub t_n_s: f64,
    /// Selected entries of the lists in the tables of the scenario and the estimator, by key.
    pub axes: BTreeMap<String, String>,
    /// Label of the estimator: its name and the selected entries of its lists.
    pub estimator: String,
    /// Name of the estimator.
    pub name: String,
    /// Method of the estimator.
    pub method: String,
    /// Order m* of the noise model.
    pub nd: Option<usize>,
    /// Delay n_k* of the model, in samples.
    pub nk: Option<usize>,
    /// Label of the start; empty if the method finds its own start.
    pub start: String,
    /// Number n if the estimator used only every n-th sample.
    pub decimate: usize,
    /// Name of the quantity: a column of the table of fits, `bias_<column>`, a rate, or a settling time of median
    /// traces.
    pub quantity: String,
    /// Statistics over the replications, without the list of outliers.
    pub statistics: Statistics,
    /// Number of values beyond the whiskers.
    pub outliers: usize,
    /// True value of the quantity; NaN if there is none.
    pub truth: f64,
    /// Mean of the absolute values.
    pub absolute_mean: f64,
}

/// Summary of the traces of an estimator in a cell.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TraceSummary {
    /// Times of the points, s.
    pub times_s: Vec<f64>,
    /// Statistics of each parameter, by name.
    pub parameters: BTreeMap<String, TraceStatistics>,
}

/// Statistics of one parameter over the replications, at each time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TraceStatistics {
    /// Mean.
    pub mean: Vec<f64>,
    /// Standard deviation.
    pub sd: Vec<f64>,
    /// Lower quartile.
    pub lower_quartile: Vec<f64>,
    /// Median.
    pub median: Vec<f64>,
    /// Upper quartile.
    pub upper_quartile: Vec<f64>,
}

impl TraceStatistics {
    /// Returns the Monte Carlo error of the median at a point, computed as for a normal sample with the same
    /// interquartile range.
    pub fn error_of_median(&self, point: usize, replications: u64) -> f64 {
        match replications {
            0 | 1 => 0.0,
            n => 0.93 * (self.upper_quartile[point] - self.lower_quartile[point]) / (n as f64).sqrt(),
        }
    }
}
