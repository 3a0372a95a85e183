//! Figures of merit of claims: medians, jackknifed functions of paired values, errors of median traces.
//!
//! - The error of a median is that of the module [`crate::statistics`].
//! - Anything else that is made of the values of replications gets the error of the delete-a-group jackknife (Kott, *Journal of Official Statistics*
//!   17, 2001): with the g-th tenth of the replications left out of all samples at once, `s^2 = (G - 1)/G sum (x_g - mean x_g)^2`.
//!   Estimators that saw the same records stay paired.
//! - *Bias of a median trace*: mean over a span of the relative error of the median over replications. Were all times of a run in error alike, its
//!   error would be the mean over the span of that of a median, 0.93 IQR / sqrt(M) (of a normal sample 1.253 s / sqrt(M), IQR = 1.349 s).
//!   A bootstrap over runs gave for the span of 30.72 s: 0.3 to 0.57 of it where all parameters forget in 2.56 s (RLS and RPEM), and
//!   0.33 to 0.45 for K_e, T_L and K_e_dot where b alone does (RLS); 0.46 to 1.5 for the others there. So half of it is
//!   taken in the first two cases, all of it in the last.
//! - *Settling of a median trace*: time after t_M at which it has covered 90 % of its own step, from its mean over the 10.24 s before t_M to its
//!   mean over the last 15.36 s: an estimate with a bias settles at its own value. Its error is half of what lies between the settling of
//!   the median plus and minus its own error, and at least half the step of the kept times.

use std::collections::BTreeMap;

use hoid_track::Memory;

use hoid_study::{
    OPERATOR, Query, Results, Statistics, TraceSummary, TrueState,
    plan::{EstimatorCell, Task},
    statistics::median,
};

use super::rules::Value;

/// Groups of the jackknife.
const GROUPS: usize = 10;
/// Share of replications that a figure needs.
const ENOUGH: f64 = 0.5;

/// The results of studies, by the names of their plans.
#[derive(Debug, Clone, Default)]
pub struct Evidence<'a>(BTreeMap<&'a str, &'a Results>);

impl<'a> Evidence<'a> {
    /// No studies yet.
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
    /// The reason when it was not run.
    pub(super) fn study(&self, name: &str) -> Result<Study<'a>, String> {
        let results = self
            .0
            .get(name)
            .ok_or_else(|| format!("the study {name} was not run"))?;
        Ok(Study { results })
    }
}

/// A study that is asked for numbers; what it does not have is an error with the reason.
#[derive(Debug, Clone, Copy)]
pub(super) struct Study<'a> {
    results: &'a Results,
}

impl<'a> Study<'a> {
    /// The values of a quantity of one estimator in one cell, replication by replication.
    pub fn sample(&self, query: &Query) -> Result<Vec<f64>, String> {
        let name = &self.results.plan.name;
        match self.results.describes(query) {
            1 => {}
            n => return Err(format!("the study {name} has {n} estimators of {query}, expected one")),
        }
        if !self.results.has_quantity(query) {
            return Err(format!("the study {name} has no column for {query}"));
        }
        Ok(self.results.values(query))
    }

    /// True parameters in the cell that a query describes, after the change.
    pub fn truth(&self, query: &Query) -> Result<TrueState, String> {
        let cells = self.results.cells(query);
        let cell = cells.first().ok_or_else(|| format!("no cell has {query}"))?;
        Ok(cell.truth()[1])
    }

    /// Median over replications.
    pub fn median(&self, query: &Query) -> Result<Value, String> {
        Ok(median_of(&self.sample(query)?))
    }

    /// Mean over replications.
    pub fn mean(&self, query: &Query) -> Result<Value, String> {
        Ok(mean_of(&self.sample(query)?))
    }

    /// Median of the magnitude: the error that one estimate typically has.
    pub fn typical(&self, query: &Query) -> Result<Value, String> {
        Ok(median_of(&magnitudes(&self.sample(query)?)))
    }

    /// A function of the values of several queries; replications stay paired.
    pub fn of(&self, queries: &[Query], f: &dyn Fn(&[Vec<f64>]) -> f64) -> Result<Value, String> {
        let samples: Result<Vec<_>, _> = queries.iter().map(|query| self.sample(query)).collect();
        Ok(jackknife(&samples?, f))
    }

    /// Median over replications of the difference of two quantities, first less second.
    pub fn difference(&self, first: &Query, second: &Query) -> Result<Value, String> {
        let (a, b) = (self.sample(first)?, self.sample(second)?);
        Ok(median_of(&a.iter().zip(&b).map(|(a, b)| a - b).collect::<Vec<_>>()))
    }

    /// Share of hits of a quantity of 0 and 1 over all replications of all that a query describes. None or all of n hits has an error of 1.5 / n:
    /// its limit of 95 % is 3 / n.
    pub fn share(&self, query: &Query) -> Result<Value, String> {
        if self.results.describes(query) == 0 || !self.results.has_quantity(query) {
            return Err(format!(
                "the study {} has no column for {query}",
                self.results.plan.name
            ));
        }
        Ok(share_of(&self.results.values(query)))
    }

    /// Bias of the median trace of a parameter, % of the true value of the last state, over the span from 51.2 s on.
    pub fn trace_bias(&self, query: &Query, parameter: &str) -> Result<Value, String> {
        let (traces, truth) = self.trace(query, parameter)?;
        let Some(bands) = traces.parameters.get(parameter) else {
            return Ok(NOTHING);
        };
        // The median of the few runs that convert says nothing of the others.
        if OPERATOR.contains(&parameter)
            && self.mean(&query.clone().quantity_of("share_not_convertible"))?.value > ENOUGH
        {
            return Ok(NOTHING);
        }
        let replications = self.results.cells(query).first().map_or(1, |cell| cell.replications);
        let alike = if self.results.estimator(query).is_some_and(|of| forgets(of, parameter)) {
            0.5
        } else {
            1.0
        };
        let (mut sum, mut errors, mut count) = (0.0, 0.0, 0.0);
        for (k, t) in traces.times_s.iter().enumerate() {
            if *t >= LAST_SPAN_FROM_S {
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

    /// Settling time of the median trace of a parameter, s. A trace that does not settle has the time to its end.
    pub fn settling(&self, query: &Query, parameter: &str) -> Result<Value, String> {
        let (traces, _) = self.trace(query, parameter)?;
        let cell = self.results.cells(query);
        let (Some(bands), Some(cell)) = (traces.parameters.get(parameter), cell.first()) else {
            return Ok(NOTHING);
        };
        let Some(midpoint_s) = cell.resolved.scenario().schedule.change_s() else {
            return Err(format!("nothing changes in {query}"));
        };
        let end = traces.times_s.last().copied().unwrap_or(midpoint_s);
        let level = |from_s: f64, to_s: f64| {
            let within = traces
                .times_s
                .iter()
                .zip(&bands.median)
                .filter(|(t, _)| (from_s..=to_s).contains(*t));
            let values: Vec<f64> = within.map(|(_, value)| *value).collect();
            values.iter().sum::<f64>() / values.len() as f64
        };
        let (from, to) = (level(midpoint_s - BEFORE_S, midpoint_s), level(end - AFTER_S, end));
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

    /// The traces of one estimator in one cell, and the true value of a parameter before and after the change.
    fn trace(&self, query: &Query, parameter: &str) -> Result<(&'a TraceSummary, [f64; 2]), String> {
        let missing = || {
            format!(
                "the study {} has no traces of {parameter} of one {query}",
                self.results.plan.name
            )
        };
        let cells = self.results.cells(query);
        let ([cell], Some(estimator), 1) = (
            cells.as_slice(),
            self.results.estimator(query),
            self.results.describes(query),
        ) else {
            return Err(missing());
        };
        let traces = self.results.traces(cell.index, &estimator.label).ok_or_else(missing)?;
        let operator = OPERATOR.iter().position(|name| *name == parameter);
        let discrete = ["f1", "f2", "b0", "b1"].iter().position(|name| *name == parameter);
        let same = match parameter {
            "a1" => Some(0),
            "a2" => Some(1),
            _ => discrete,
        };
        let truth = cell.truth().map(|state| match (operator, same) {
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

/// Whether the estimate of a parameter forgets within a small part of the span: gains do so with b, others when all parameters do.
fn forgets(estimator: &EstimatorCell, parameter: &str) -> bool {
    const LONGEST_S: f64 = 5.0;
    const TEXT_SAMPLE_TIME_S: f64 = 0.01;
    let Task::Track(options) = &estimator.task else {
        return false;
    };
    let is_short = |memory: &Memory| match memory {
        Memory::Samples(n) => n * TEXT_SAMPLE_TIME_S <= LONGEST_S,
        Memory::Seconds(t) => *t <= LONGEST_S,
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

/// Spans of the levels between which a trace steps, s: before the change and at the end.
const BEFORE_S: f64 = 10.24;
const AFTER_S: f64 = 15.36;

/// The second span of the batch fits of section V.B starts here, s.
const LAST_SPAN_FROM_S: f64 = 51.2;

const NOTHING: Value = Value {
    value: f64::NAN,
    error: f64::NAN,
};

/// Magnitudes of some values.
pub(super) fn magnitudes(values: &[f64]) -> Vec<f64> {
    values.iter().map(|v| v.abs()).collect()
}

/// Values enough to speak for all replications.
fn enough(values: &[f64]) -> bool {
    let finite = values.iter().filter(|v| v.is_finite()).count();
    finite > 0 && finite as f64 >= ENOUGH * values.len() as f64
}

fn value_of(values: &[f64], figure: fn(&Statistics) -> (f64, f64)) -> Value {
    if !enough(values) {
        return NOTHING;
    }
    let (value, error) = figure(&Statistics::of(values));
    Value {
        value,
        // A scenario without remnant has one replication, which says all.
        error: if values.len() == 1 { 0.0 } else { error },
    }
}

pub(super) fn median_of(values: &[f64]) -> Value {
    value_of(values, |s| (s.median, s.median_se))
}

pub(super) fn mean_of(values: &[f64]) -> Value {
    value_of(values, |s| (s.mean, s.mean_se))
}

pub(super) fn share_of(values: &[f64]) -> Value {
    let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let n = finite.len() as f64;
    let p = finite.iter().sum::<f64>() / n;
    Value {
        value: p,
        error: (p * (1.0 - p) / n).sqrt().max(1.5 / n),
    }
}

/// The median of values that are enough.
pub(super) fn med(values: &[f64]) -> f64 {
    if enough(values) { median(values) } else { f64::NAN }
}

/// The magnitude of the median.
pub(super) fn bias(values: &[f64]) -> f64 {
    med(values).abs()
}

/// The median of the magnitude.
pub(super) fn size(values: &[f64]) -> f64 {
    med(&magnitudes(values))
}

/// The interquartile range.
pub(super) fn range(values: &[f64]) -> f64 {
    if !enough(values) {
        return f64::NAN;
    }
    let s = Statistics::of(values);
    s.upper_quartile - s.lower_quartile
}

/// Largest less smallest.
pub(super) fn spread(values: impl Iterator<Item = f64>) -> f64 {
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in values {
        if value.is_nan() {
            return value;
        }
        least = least.min(value);
        most = most.max(value);
    }
    most - least
}

/// R^2 of the straight line through values at equal distances.
pub(super) fn linearity(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let (x0, y0) = (0.5 * (n - 1.0), values.iter().sum::<f64>() / n);
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for (k, y) in values.iter().enumerate() {
        let (x, y) = (k as f64 - x0, y - y0);
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    xy * xy / (xx * yy)
}

/// A function of samples with the error of the delete-a-group jackknife.
pub(super) fn jackknife(samples: &[Vec<f64>], f: &dyn Fn(&[Vec<f64>]) -> f64) -> Value {
    let value = f(samples);
    let n = samples.iter().map(Vec::len).max().unwrap_or(0);
    let groups = GROUPS.min(n);
    if groups < 2 {
        return Value { value, error: 0.0 };
    }
    let left: Vec<f64> = (0..groups)
        .map(|group| {
            let without = |sample: &Vec<f64>| match sample.len() {
                1 => sample.clone(),
                _ => sample
                    .iter()
                    .enumerate()
                    .filter(|(i, _)| i % groups != group)
                    .map(|(_, v)| *v)
                    .collect(),
            };
            f(&samples.iter().map(without).collect::<Vec<_>>())
        })
        .collect();
    let g = groups as f64;
    let mean = left.iter().sum::<f64>() / g;
    let squares: f64 = left.iter().map(|x| (x - mean).powi(2)).sum();
    Value {
        value,
        error: ((g - 1.0) / g * squares).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normals(n: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..n).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
    }

    #[test]
    fn the_jackknife_of_a_mean_is_its_error() {
        // The expectation of s^2 is exact for a mean; with 9 degrees of freedom s scatters by 24 % and 400 samples bring that to 1.2 %, the root of
        // a chi-square of 9 degrees is 2.7 % below.
        let errors: f64 = (0..400)
            .map(|seed| jackknife(&[normals(100, seed)], &|s| s[0].iter().sum::<f64>() / s[0].len() as f64).error)
            .sum();
        assert!((errors / 400.0 - 0.1 * 0.973).abs() < 0.005, "{}", errors / 400.0);
    }

    #[test]
    fn pairs_stay_pairs() {
        let a = normals(100, 3);
        let b: Vec<f64> = a.iter().map(|a| a + 1.0).collect();
        let found = jackknife(&[a, b], &|s| med(&s[1]) - med(&s[0]));
        assert!((found.value - 1.0).abs() < 1e-12 && found.error < 1e-12, "{found:?}");
    }

    #[test]
    fn few_values_say_nothing() {
        let most = [1.0, 2.0, f64::NAN];
        let few = [1.0, f64::NAN, f64::NAN];
        assert_eq!(median_of(&most).value, 1.5);
        assert!(median_of(&few).value.is_nan() && med(&few).is_nan() && size(&few).is_nan() && range(&few).is_nan());
        assert_eq!(median_of(&[7.0]), Value { value: 7.0, error: 0.0 });
        assert_eq!(jackknife(&[vec![7.0]], &|s| s[0][0]), Value { value: 7.0, error: 0.0 });
        assert_eq!(
            share_of(&[0.0; 30]),
            Value {
                value: 0.0,
                error: 0.05
            }
        );
        assert_eq!(spread([3.0, -1.0, 2.0].into_iter()), 4.0);
        assert!(spread([3.0, f64::NAN].into_iter()).is_nan());
    }

    #[test]
    fn linearity_of_a_line_and_of_a_parabola() {
        assert!((linearity(&[1.0, 3.0, 5.0, 7.0]) - 1.0).abs() < 1e-12);
        assert!(linearity(&[1.0, 0.0, 0.0, 1.0]) < 1e-12);
        // NumPy: corrcoef([0, 1, 2, 3], [0, 1, 4, 9])^2 = 0.9184
        assert!((linearity(&[0.0, 1.0, 4.0, 9.0]) - 0.918_4).abs() < 1e-4);
    }
}
