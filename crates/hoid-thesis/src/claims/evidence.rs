//! The results of studies as evidence: statistics of a cell and their Monte Carlo errors.
//!
//! - *Bias of a median trace*: mean over a span of the relative error of the median over replications. If the errors at
//!   all times of a run were fully correlated, the error of the bias would be the mean over the span of the error of a
//!   median, 0.93 IQR / sqrt(M) (for a normal sample 1.253 s / sqrt(M) with IQR = 1.349 s). For the span of 30.72 s a
//!   bootstrap over runs gave 0.3 to 0.57 of the fully correlated error if all parameters forget within 2.56 s (RLS and
//!   RPEM). If only b forgets this fast (RLS), the bootstrap gave 0.33 to 0.45 for K_e, T_L and K_e_dot, and 0.46 to
//!   1.5 for the other parameters. Therefore half of the fully correlated error is used if all parameters forget this
//!   fast, and for K_e, T_L and K_e_dot if only b does; otherwise the full error is used.
//! - *Settling of a median trace*: time after t_M at which the trace has covered 90 % of its own step, from its mean
//!   over the 10.24 s before t_M to its mean over the last 15.36 s: a biased estimate settles at a biased value. The
//!   error is half the difference between the settling times of the median plus and minus its error, and at least half
//!   the interval between stored times.

use std::collections::BTreeMap;

use hoid_numerics::statistics::mean;
use hoid_study::{
    OPERATOR_PARAMETERS, Query, Results, TraceSummary, TrueState,
    plan::{EstimatorCell, Task},
};
use hoid_track::Memory;

use super::{
    statistics::{MIN_VALID_SHARE, MISSING_VALUE, jackknife, magnitudes, mean_of, median_of, share_value},
    value::Value,
};

/// Length of the span before the change that gives the initial level (s); `FINAL_SPAN_S` is the length of the span at
/// the end that gives the final level.
const INITIAL_SPAN_S: f64 = 10.24;

const FINAL_SPAN_S: f64 = 15.36;

/// Start of the second span of the batch fits of section V.B, s.
const LAST_SPAN_START_S: f64 = 51.2;

/// The results of studies by the names of their plans.
#[derive(Debug, Clone, Default)]
pub struct Evidence<'a>(BTreeMap<&'a str, &'a Results>);

impl<'a> Evidence<'a> {
    /// Creates evidence without any studies.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds the results of a study.
    pub fn add(&mut self, results: &'a Results) {
        self.0.insert(results.plan.name.as_str(), results);
    }

    /// The results of a plan.
    ///
    /// # Errors
    /// The reason if the plan was not run.
    pub(super) fn study(&self, name: &str) -> Result<Study<'a>, String> {
        let results = self
            .0
            .get(name)
            .ok_or_else(|| format!("the study {name} was not run"))?;
        Ok(Study { results })
    }
}

/// The results of one study; a query that finds nothing returns the reason as an error.
#[derive(Debug, Clone, Copy)]
pub(super) struct Study<'a> {
    results: &'a Results,
}

impl<'a> Study<'a> {
    /// The values of a quantity for one estimator in one cell, one value per replication.
    pub fn sample(&self, query: &Query) -> Result<Vec<f64>, String> {
        let name = &self.results.plan.name;
        match self.results.count(query) {
            1 => {}
            n => {
                return Err(format!(
                    "the study {name} has {n} estimators that match {query}, expected one"
                ));
            }
        }
        if !self.results.has_quantity(query) {
            return Err(format!("the study {name} has no column for {query}"));
        }
        Ok(self.results.values(query))
    }

    /// True parameters after the change in the first cell that a query selects.
    pub fn truth(&self, query: &Query) -> Result<TrueState, String> {
        let cells = self.results.cells(query);
        let cell = cells.first().ok_or_else(|| format!("no cell matches {query}"))?;
        Ok(cell.true_states()[1])
    }

    /// Median over replications.
    pub fn median(&self, query: &Query) -> Result<Value, String> {
        Ok(median_of(&self.sample(query)?))
    }

    /// Mean over replications.
    pub fn mean(&self, query: &Query) -> Result<Value, String> {
        Ok(mean_of(&self.sample(query)?))
    }

    /// Median of the magnitude, which is the typical error of one estimate.
    pub fn median_magnitude(&self, query: &Query) -> Result<Value, String> {
        Ok(median_of(&magnitudes(&self.sample(query)?)))
    }

    /// A function of the samples of several queries; values of the same replication stay paired.
    pub fn evaluate(&self, queries: &[Query], f: &dyn Fn(&[Vec<f64>]) -> f64) -> Result<Value, String> {
        let samples: Result<Vec<_>, _> = queries.iter().map(|query| self.sample(query)).collect();
        Ok(jackknife(&samples?, f))
    }

    /// Median over replications of the difference between two quantities, the first minus the second.
    pub fn difference(&self, first: &Query, second: &Query) -> Result<Value, String> {
        let (a, b) = (self.sample(first)?, self.sample(second)?);
        Ok(median_of(&a.iter().zip(&b).map(|(a, b)| a - b).collect::<Vec<_>>()))
    }

    /// Share of ones in a quantity that is 0 or 1, over all replications of all rows that a query selects. The error is
    /// at least 1.5 / n, because the 95 % limit for none or all of n values is 3 / n.
    pub fn share(&self, query: &Query) -> Result<Value, String> {
        if self.results.count(query) == 0 || !self.results.has_quantity(query) {
            return Err(format!(
                "the study {} has no column for {query}",
                self.results.plan.name
            ));
        }
        Ok(share_value(&self.results.values(query)))
    }

    /// Bias of the median trace of a parameter over the span from 51.2 s to the end, in % of the true value at the end.
    pub fn trace_bias(&self, query: &Query, parameter: &str) -> Result<Value, String> {
        let (traces, truth) = self.trace(query, parameter)?;
        let Some(bands) = traces.parameters.get(parameter) else {
            return Ok(MISSING_VALUE);
        };
        // If only a few runs can be converted, their median carries no information about the others.
        if OPERATOR_PARAMETERS.contains(&parameter)
            && self.mean(&query.clone().with_quantity("share_not_convertible"))?.value > MIN_VALID_SHARE
        {
            return Ok(MISSING_VALUE);
        }
        let replications = self.results.cells(query).first().map_or(1, |cell| cell.replications);
        let alike = if self
            .results
            .estimator(query)
            .is_some_and(|of| has_short_memory(of, parameter))
        {
            0.5
        } else {
            1.0
        };
        let (mut sum, mut errors, mut count) = (0.0, 0.0, 0.0);
        for (k, t) in traces.times_s.iter().enumerate() {
            if *t >= LAST_SPAN_START_S {
                sum += (bands.median[k] - truth[1]) / truth[1];
                errors += bands.error_of_median(k, replications) / truth[1].abs();
                count += 1.0;
            }
        }
        Ok(Value {
            value: 100.0 * sum / count,
            error: 100.0 * alike * errors / count,
        })
    }

    /// Interquartile range over the runs of the traces of a parameter, averaged over a span, in % of the true value at
    /// the end. The relative error of this range is taken from the interquartile range of a normal sample, 1.166 /
    /// sqrt(M), if errors are fully correlated over the span.
    pub fn trace_range(&self, query: &Query, parameter: &str, (from_s, to_s): (f64, f64)) -> Result<Value, String> {
        let (traces, truth) = self.trace(query, parameter)?;
        let Some(bands) = traces.parameters.get(parameter) else {
            return Ok(MISSING_VALUE);
        };
        let replications = self.results.cells(query).first().map_or(1, |cell| cell.replications);
        let within = traces
            .times_s
            .iter()
            .enumerate()
            .filter(|(_, t)| (from_s..to_s).contains(*t));
        let ranges: Vec<f64> = within
            .map(|(k, _)| 100.0 * (bands.upper_quartile[k] - bands.lower_quartile[k]) / truth[1].abs())
            .collect();
        let value = mean(&ranges);
        Ok(Value {
            value,
            error: 1.166 * value / (replications as f64).sqrt(),
        })
    }

    /// Settling time of the median trace of a parameter, s. For a trace that does not settle, the value is the time
    /// from the change to the end of the trace.
    pub fn settling(&self, query: &Query, parameter: &str) -> Result<Value, String> {
        let (traces, _) = self.trace(query, parameter)?;
        let cell = self.results.cells(query);
        let (Some(bands), Some(cell)) = (traces.parameters.get(parameter), cell.first()) else {
            return Ok(MISSING_VALUE);
        };
        let Some(midpoint_s) = cell.resolved.scenario().schedule.change_s() else {
            return Err(format!("the controlled element does not change in {query}"));
        };
        let end = traces.times_s.last().copied().unwrap_or(midpoint_s);
        let level = |from_s: f64, to_s: f64| {
            let within = traces
                .times_s
                .iter()
                .zip(&bands.median)
                .filter(|(t, _)| (from_s..=to_s).contains(*t));
            let values: Vec<f64> = within.map(|(_, value)| *value).collect();
            mean(&values)
        };
        let (from, to) = (
            level(midpoint_s - INITIAL_SPAN_S, midpoint_s),
            level(end - FINAL_SPAN_S, end),
        );
        let settled = |errors: f64| {
            let first = traces.times_s.iter().enumerate().find(|(k, t)| {
                let error = errors * (to - from).signum() * bands.error_of_median(*k, cell.replications);
                **t > midpoint_s && (bands.median[*k] + error - from) / (to - from) >= 0.9
            });
            first.map_or(end, |(_, t)| *t) - midpoint_s
        };
        let step = traces.times_s.windows(2).next().map_or(0.0, |pair| pair[1] - pair[0]);
        Ok(Value {
            value: settled(0.0),
            error: (0.5 * (settled(-1.0) - settled(1.0))).max(0.5 * step),
        })
    }

    /// The traces of one estimator in one cell, and the true values of a parameter before and after the change.
    fn trace(&self, query: &Query, parameter: &str) -> Result<(&'a TraceSummary, [f64; 2]), String> {
        let missing = || {
            format!(
                "the study {} has no traces of {parameter} for {query}",
                self.results.plan.name
            )
        };
        let cells = self.results.cells(query);
        let ([cell], Some(estimator), 1) = (
            cells.as_slice(),
            self.results.estimator(query),
            self.results.count(query),
        ) else {
            return Err(missing());
        };
        let traces = self.results.traces(cell.index, &estimator.label).ok_or_else(missing)?;
        let operator = OPERATOR_PARAMETERS.iter().position(|name| *name == parameter);
        let discrete = ["f1", "f2", "b0", "b1"].iter().position(|name| *name == parameter);
        let same = match parameter {
            "a1" => Some(0),
            "a2" => Some(1),
            _ => discrete,
        };
        let truth = cell.true_states().map(|state| match (operator, same) {
            (Some(i), _) => state.operator[i],
            (None, Some(i)) => state.discrete[i],
            (None, None) => f64::NAN,
        });
        if truth[1].is_nan() {
            return Err(missing());
        }
        Ok((traces, truth))
    }
}

/// True if the estimate of a parameter forgets within a small part of the span: a gain if the memory length of b is
/// short, any other parameter if all memory lengths are short.
fn has_short_memory(estimator: &EstimatorCell, parameter: &str) -> bool {
    const MAX_MEMORY_S: f64 = 5.0;
    const TEXT_SAMPLE_TIME_S: f64 = 0.01;
    let Task::Track(options) = &estimator.task else {
        return false;
    };
    let is_short = |memory: &Memory| match memory {
        Memory::Samples(n) => n * TEXT_SAMPLE_TIME_S <= MAX_MEMORY_S,
        Memory::Seconds(t) => *t <= MAX_MEMORY_S,
        Memory::Infinite => false,
    };
    let Some(given) = options.method.memories() else {
        return false;
    };
    match given.memory_of.get("b") {
        Some(of_b) if ["K_e", "T_L", "K_e_dot"].contains(&parameter) => is_short(of_b),
        _ => given.memory.0.as_ref().is_some_and(is_short) && given.memory_of.values().all(is_short),
    }
}
