//! Rows of the summaries of a study.

use std::collections::BTreeMap;

use crate::Statistics;

/// A row of the summary: one quantity of one estimator in one cell.
#[derive(Debug, Clone, PartialEq)]
pub struct SummaryRow {
    /// Number of the cell.
    pub cell: u64,
    /// The condition on which it is based; empty if there is none.
    pub scenario: String,
    /// The condition from which it started, empty if there is none.
    pub condition: String,
    /// Order m0 of the simulated remnant.
    pub remnant_order: usize,
    /// Specified noise level; not a number if the gain was given.
    pub noise_level: f64,
    /// Time constant T_n of the simulated remnant, s.
    pub t_n_s: f64,
    /// Axes that replace the lists of scenario and estimator, by their keys joined by `_`.
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
    /// It took every `decimate`-th sample.
    pub decimate: usize,
    /// The quantity: a column of the table of fits, `bias_<column>`, a rate or a settling time of
    /// median traces.
    pub quantity: String,
    /// Statistics over the replications, without the outliers themselves.
    pub statistics: Statistics,
    /// Number of values beyond the whiskers.
    pub outliers: usize,
    /// True value; not a number if there is none.
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
    pub parameters: BTreeMap<String, TraceStatistics>,
}

/// Statistics of a trace over the replications, at each time.
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
    /// Monte Carlo error of the median of a point, computed as for a normal sample with the same
    /// interquartile range.
    pub fn error_of_median(&self, point: usize, replications: u64) -> f64 {
        match replications {
            0 | 1 => 0.0,
            n => 0.93 * (self.upper_quartile[point] - self.lower_quartile[point]) / (n as f64).sqrt(),
        }
    }
}
