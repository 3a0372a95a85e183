//! The estimator of an operator who changes once: options, and the fit.

use std::collections::BTreeMap;

use hoid_model::{Form, Record, SampleTime, Structure, delayed_operator::whole_samples};

use super::{
    bounds::{Frame, limits},
    fit::SigmoidFit,
    layout::{Element, Layout},
    noise_level::NoiseLevel,
    objective::{ChangeCriterion, Data},
    prior,
    search::{best_minimum, search, without_change},
    starts,
};
use crate::{
    Constraint, IdentError, SearchOptions,
    family::OperatorPrior,
    informative_data::{check_record, common_sample_time},
    level::without_level,
    order_selection::{NamedOrders, written},
};

/// Lower minima that the walks along t_M and G may come upon before the fit is left at the last
/// one.
const MOST_LOWER: usize = 10;

/// What is to be estimated, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct SigmoidChange {
    /// Form of the operator: what changes is its numerator (K, T_L, c_1, c_2, alpha), with a lag the
    /// gain K/T_I. Lag, neuromuscular part and delay do not change. Default a gain and a lead.
    pub form: Form,
    /// With the neuromuscular part. Default true.
    pub neuromuscular: bool,
    /// A level of u in each record, estimated: of recorded data ([`SigmoidFit::level`]). Default false.
    pub level: bool,
    /// What is known of the person before the data; that of T_L counts before and after the change.
    /// Default nothing.
    pub prior: OperatorPrior,
    /// Order nd of D.
    pub nd: usize,
    /// Shortest and longest delay tau_e, s; any fraction of a sample. Equal ends fix it.
    pub delay_range_s: (f64, f64),
    /// Fixed and bounded parameters by name ([`SigmoidChange::names`]). By default t_M lies in the middle nine tenths of the span that the records have in common, and
    /// G between 5/span and 2/Ts.
    pub constraints: BTreeMap<String, Constraint>,
    /// Size of the innovations over the record.
    pub noise_level: NoiseLevel,
    /// Start instead of the own ones: the parameters of [`SigmoidChange::names`] in their units.
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
            form: Form::Lead,
            neuromuscular: true,
            level: false,
            prior: OperatorPrior::none(),
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
    /// With an order nd of the noise that is named.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for another order, and for a range.
    pub fn with_noise_orders(self, named: &NamedOrders) -> Result<Self, IdentError> {
        for (name, range) in named {
            if name != "nd" || range.start() != range.end() {
                return Err(IdentError::BadOption {
                    option: format!("order {name}"),
                    found: written(range),
                    expected: "a single number nd of an operator that changes, as nd=2".to_owned(),
                });
            }
        }
        let nd = named.get("nd").map_or(self.nd, |nd| *nd.start());
        Ok(Self { nd, ..self })
    }

    /// Fits one change to all records: parameters and t_M in common (t_M on the time axis of each
    /// record), initial states of each.
    ///
    /// # Errors
    /// [`IdentError`]; how the search ended, and what the data do not determine, is part of the
    /// fit.
    pub fn fit(&self, records: &[Record]) -> Result<SigmoidFit, IdentError> {
        let sample_time = common_sample_time(records)?;
        let mut criterion = self.criterion(records, sample_time)?;
        let unit = prior::penalties(&criterion.layout, &self.prior);
        for penalty in &unit {
            // What has a prior is positive.
            let (low, high) = criterion.limits[penalty.place];
            criterion.limits[penalty.place] = (low.max(0.0), high);
        }
        let starts = self.starts(&criterion, records)?;
        if let Some((_, theta)) = starts.first() {
            criterion.penalty = prior::begun(&criterion, &unit, theta);
        }
        let (mut start, minimum) = best_minimum(starts, &criterion, &self.search)?;
        let settled = |criterion: &mut ChangeCriterion<'_>, minimum| {
            prior::settled(criterion, &unit, minimum, self.noise_level, &self.search)
        };
        let (mut minimum, mut levels) = settled(&mut criterion, minimum)?;
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
            let penalty = criterion.penalty.clone();
            let (mut other, other_levels) = settled(&mut criterion, other)?;
            lower += 1;
            if other.at.sum_of_squares < minimum.at.sum_of_squares && lower <= MOST_LOWER {
                other.termination.iterations += minimum.termination.iterations;
                (minimum, levels) = (other, other_levels);
                if lower == 1 {
                    start += "; then a lower minimum along t_M or G";
                }
            } else {
                (criterion.weights, criterion.penalty) = (weights, penalty);
                stay = true;
            }
        }
    }

    /// Names of the parameters of this form and noise model: `K_e1`, `K_e2`, `T_L1`, `T_L2`, `t_M`,
    /// `G`, `omega_nm`, `zeta_nm`, `tau_e`, `d1` ... of a gain and a lead.
    pub fn names(&self) -> Vec<String> {
        self.layout().names()
    }

    fn layout(&self) -> Layout {
        Layout::new(self.form, self.neuromuscular, self.nd)
    }

    /// Name and theta of each start.
    fn starts(
        &self,
        criterion: &ChangeCriterion<'_>,
        records: &[Record],
    ) -> Result<Vec<(String, Vec<f64>)>, IdentError> {
        Ok(match &self.start {
            Some(start) => vec![("given".to_owned(), self.given_start(criterion, start)?)],
            None => {
                // The regressions that rank the starts know of no level.
                let off_level = if self.level {
                    without_level(records)
                } else {
                    records.to_vec()
                };
                let of_starts = ChangeCriterion {
                    limits: criterion.limits.clone(),
                    ..self.criterion(&off_level, criterion.sample_time)?
                };
                starts::initial_guesses(&of_starts, &off_level)
                    .into_iter()
                    .map(|s| (s.label, s.theta))
                    .collect()
            }
        })
    }

    fn criterion<'a>(&self, records: &'a [Record], sample_time: SampleTime) -> Result<ChangeCriterion<'a>, IdentError> {
        let layout = self.layout();
        if !self.form.is_proper(self.neuromuscular) {
            return Err(IdentError::BadOption {
                option: "the form of the operator".to_owned(),
                found: format!("{} without neuromuscular dynamics", self.form),
                expected: "one that is no pure derivative: with neuromuscular dynamics, or with a lag".to_owned(),
            });
        }
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
        let limits = limits(&layout, &frame, &self.constraints)?;
        let longest = whole_samples(limits[layout.delay].1, sample_time)? + layout.reach().max(1);
        let orders = layout.orders(longest);
        let criterion = ChangeCriterion {
            layout,
            data: records
                .iter()
                .map(|r| Data {
                    e: r.input(),
                    u: r.output(),
                    start_s: r.time_s(0),
                })
                .collect(),
            sample_time,
            first: longest + self.nd,
            limits,
            piece: None,
            changes: true,
            weights: None,
            penalty: Vec::new(),
            level: self.level,
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

    fn given_start(&self, criterion: &ChangeCriterion<'_>, start: &[f64]) -> Result<Vec<f64>, IdentError> {
        let bad = |reason: String| Err(IdentError::BadStart { reason });
        let layout = &criterion.layout;
        let names = layout.names();
        if start.len() != names.len() {
            return bad(format!(
                "it has {} numbers, expected {}: {}",
                start.len(),
                names.len(),
                names.join(", ")
            ));
        }
        let positive = |(place, element): (usize, &Element)| match element {
            Element::LogRate => Some(place),
            Element::Constant(_) if place != layout.delay => Some(place),
            _ => None,
        };
        for place in layout.elements().iter().enumerate().filter_map(positive) {
            if start[place].is_nan() || start[place] <= 0.0 {
                return bad(format!(
                    "{} = {}, expected a positive number",
                    names[place], start[place]
                ));
            }
        }
        if let Some(i) = start.iter().position(|v| !v.is_finite()) {
            return bad(format!("{} = {}, expected a finite number", names[i], start[i]));
        }
        let typed = start.iter().enumerate();
        Ok(typed.map(|(place, value)| layout.of_typed(place, *value)).collect())
    }
}
