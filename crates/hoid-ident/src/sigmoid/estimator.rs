//! The estimator of an operator who changes once: options, and the fit.

use std::collections::BTreeMap;

use hoid_model::{Orders, Record, SampleTime, Structure, delayed_operator::whole_samples};

use super::{
    fit::SigmoidFit,
    layout::{self, DELAY, Frame, limits},
    noise_level::NoiseLevel,
    objective::{ChangeCriterion, Data},
    reweighting::with_levels,
    search::{best_minimum, search, without_change},
    starts,
};
use crate::{
    Constraint, IdentError, SearchOptions,
    informative_data::{check_record, common_sample_time},
    optimize::Minimum,
};

/// Lower minima that the walks along t_M and G may come upon before the fit is left at the last
/// one.
const MOST_LOWER: usize = 10;

/// What is to be estimated, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct SigmoidChange {
    /// Order nd of D.
    pub nd: usize,
    /// Shortest and longest delay tau_e, s; any fraction of a sample. Equal ends fix it.
    pub delay_range_s: (f64, f64),
    /// Fixed and bounded parameters by name ([`SIGMOID_NAMES`](crate::SIGMOID_NAMES), d1 ...). By
    /// default t_M lies in the middle nine tenths of the span that the records have in common, and
    /// G between 5/span and 2/Ts.
    pub constraints: BTreeMap<String, Constraint>,
    /// Size of the innovations over the record.
    pub noise_level: NoiseLevel,
    /// Start instead of the own ones: the parameters of [`SIGMOID_NAMES`](crate::SIGMOID_NAMES) in
    /// their units, then d1 ... d_nd.
    pub start: Option<Vec<f64>>,
    /// Method and limits of each search.
    pub search: SearchOptions,
    /// Whether t_M and G get likelihood intervals; they take about as long as the fit. Default
    /// true.
    pub likelihood_intervals: bool,
}

impl Default for SigmoidChange {
    /// First-order noise, delay between 0.05 and 0.6 s, noise level that changes, own starts;
    /// searches of up to 200 steps to a relative decrease of 1e-10 (a thousandth of a standard
    /// error): a small change fills its loss with ripples in t_M.
    fn default() -> Self {
        Self {
            nd: 1,
            delay_range_s: (0.05, 0.6),
            constraints: BTreeMap::new(),
            noise_level: NoiseLevel::default(),
            start: None,
            search: SearchOptions {
                max_iterations: 200,
                tolerance: 1e-10,
                ..SearchOptions::default()
            },
            likelihood_intervals: true,
        }
    }
}

impl SigmoidChange {
    /// Fits one change to all records: parameters and t_M in common (t_M on the time axis of each
    /// record), initial states of each.
    ///
    /// # Errors
    /// [`IdentError`]; how the search ended, and what the data do not determine, is part of the
    /// fit.
    pub fn fit(&self, records: &[Record]) -> Result<SigmoidFit, IdentError> {
        let sample_time = common_sample_time(records)?;
        let mut criterion = self.criterion(records, sample_time)?;
        let (mut start, minimum) = best_minimum(self.starts(&criterion, records)?, &criterion, &self.search)?;
        let (mut minimum, mut levels) = self.with_levels(&mut criterion, minimum)?;
        let (mut lower, mut stay) = (0, false);
        loop {
            let constant = without_change(&criterion, &minimum.theta, &self.search)?;
            let mut found = SigmoidFit::new(&criterion, &minimum, start.clone(), &constant, levels)?;
            let walk = self
                .likelihood_intervals
                .then(|| found.add_intervals(&criterion, &minimum, stay));
            let Some(theta) = walk.flatten() else {
                return Ok(found);
            };
            // With the weights of the other minimum this one may be the lower: the likelihood
            // decides, weights and all.
            let weights = criterion.weights.clone();
            let other = search(&criterion, theta, &self.search, None).ok_or(IdentError::NoFiniteLoss)?;
            let (mut other, other_levels) = self.with_levels(&mut criterion, other)?;
            lower += 1;
            if other.at.sum_of_squares < minimum.at.sum_of_squares && lower <= MOST_LOWER {
                other.termination.iterations += minimum.termination.iterations;
                (minimum, levels) = (other, other_levels);
                if lower == 1 {
                    start += "; then a lower minimum along t_M or G";
                }
            } else {
                criterion.weights = weights;
                stay = true;
            }
        }
    }

    /// The minimum with the noise levels that were chosen.
    fn with_levels(
        &self,
        criterion: &mut ChangeCriterion<'_>,
        minimum: Minimum,
    ) -> Result<(Minimum, Option<[f64; 2]>), IdentError> {
        match self.noise_level {
            NoiseLevel::Constant => Ok((minimum, None)),
            NoiseLevel::Changing => with_levels(criterion, minimum, &self.search),
        }
    }

    /// Name and theta of each start.
    fn starts(
        &self,
        criterion: &ChangeCriterion<'_>,
        records: &[Record],
    ) -> Result<Vec<(String, Vec<f64>)>, IdentError> {
        Ok(match &self.start {
            Some(start) => vec![("given".to_owned(), self.given_start(start)?)],
            None => starts::initial_guesses(criterion, records)
                .into_iter()
                .map(|s| (s.label, s.theta))
                .collect(),
        })
    }

    fn criterion<'a>(&self, records: &'a [Record], sample_time: SampleTime) -> Result<ChangeCriterion<'a>, IdentError> {
        let (low, high) = self.delay_range_s;
        if !(low.is_finite() && high.is_finite() && 0.0 <= low && low <= high) {
            return Err(IdentError::BadOption {
                option: "the range of the delay tau_e".to_owned(),
                found: format!("{low} to {high} s"),
                expected: "two times that are not negative, the shorter one first".to_owned(),
            });
        }
        let span_s = records
            .iter()
            .fold((f64::NEG_INFINITY, f64::INFINITY), |(from, to), r| {
                (from.max(r.time_s(0)), to.min(r.time_s(r.len() - 1)))
            });
        if span_s.0 >= span_s.1 {
            return Err(IdentError::BadOption {
                option: "the records".to_owned(),
                found: "no time in common".to_owned(),
                expected: "records whose time axes overlap around the change: t_M is a time on each of them".to_owned(),
            });
        }
        let frame = Frame {
            ts_s: sample_time.s(),
            span_s,
            delay_range_s: self.delay_range_s,
        };
        let limits = limits(self.nd, &frame, &self.constraints)?;
        let longest = whole_samples(limits[DELAY].1, sample_time)? + 1;
        let orders = Orders {
            nb: 3,
            nd: self.nd,
            nf: 2,
            nk: longest,
            ..Orders::default()
        };
        let criterion = ChangeCriterion {
            data: records
                .iter()
                .map(|r| Data {
                    e: r.input(),
                    u: r.output(),
                    start_s: r.time_s(0),
                })
                .collect(),
            sample_time,
            nd: self.nd,
            first: longest + self.nd,
            limits,
            sample: None,
            changes: true,
            weights: None,
        };
        for record in records {
            check_record(Structure::BoxJenkins, &orders, record, criterion.first)?;
        }
        let unknowns = criterion.limits.len() + criterion.states();
        if criterion.residuals() <= unknowns {
            return Err(IdentError::TooFewSamples {
                label: records[0].label().to_owned(),
                samples: records[0].len(),
                orders: orders.to_string(),
                needed: criterion.first + unknowns.div_ceil(records.len()),
            });
        }
        Ok(criterion)
    }

    fn given_start(&self, start: &[f64]) -> Result<Vec<f64>, IdentError> {
        let bad = |reason: String| Err(IdentError::BadStart { reason });
        let names = layout::names(self.nd);
        if start.len() != names.len() {
            return bad(format!(
                "it has {} numbers, expected {}: {}",
                start.len(),
                names.len(),
                names.join(", ")
            ));
        }
        for (place, quantity) in [
            (layout::LOG_RATE, "G"),
            (layout::OMEGA, "omega_nm"),
            (layout::ZETA, "zeta_nm"),
        ] {
            if start[place].is_nan() || start[place] <= 0.0 {
                return bad(format!("{quantity} = {}, expected a positive number", start[place]));
            }
        }
        if let Some(i) = start.iter().position(|v| !v.is_finite()) {
            return bad(format!("{} = {}, expected a finite number", names[i], start[i]));
        }
        let mut theta = start.to_vec();
        theta[layout::LOG_RATE] = theta[layout::LOG_RATE].ln();
        Ok(theta)
    }
}
