//! Estimator for an operator that changes once.

use hoid_model::{Record, SampleTime, Structure, delayed_operator::whole_samples};

use super::{
    bounds::{BoundInputs, limits},
    fit::SigmoidFit,
    layout::{Layout, ThetaElement},
    objective::{ChangeCriterion, Data},
    options::SigmoidChange,
    prior,
    search::{best_minimum, minimum_without_change, search},
    starts,
};
use crate::{
    IdentError,
    family::{FamilyEstimator, Intersample},
    informative_data::{check_record, common_sample_time},
    level::without_level,
    optimize::Reason,
};

/// Largest order of the noise model in an automatic choice (`MAX_NOISE_ORDER`), and the order without a choice, i.e.
/// for exact data or a given start (`DEFAULT_NOISE_ORDER`).
const MAX_NOISE_ORDER: usize = 12;
const DEFAULT_NOISE_ORDER: usize = 1;
/// Number of lower minima along t_M or G that the fit accepts before it stays at the last one.
const MAX_LOWER_MINIMA: usize = 10;

impl SigmoidChange {
    /// Fits one change to all records. The parameters are common to the records, including t_M on the time axis of each
    /// record; the initial states are estimated for each record.
    ///
    /// # Errors
    /// [`IdentError`] if no model can be fitted. The fit itself reports how the search ended and which parameters the
    /// data do not determine.
    pub fn fit(&self, records: &[Record]) -> Result<SigmoidFit, IdentError> {
        let sample_time = common_sample_time(records)?;
        // The regressions that compute and rank the starts do not estimate a level, so the means are removed for them.
        let off_level = self.level.then(|| without_level(records));
        let off_level = off_level.as_deref().unwrap_or(records);
        let guess = match self.start {
            Some(_) => None,
            None => self.estimator_without_change().first_guess(off_level, MAX_NOISE_ORDER),
        };
        let order = guess.as_ref().map(|(_, noise)| noise.d.len());
        let guess = guess.map(|(coordinates, _)| coordinates);
        let with_noise = |nd| {
            let ordered = Self {
                nd: Some(nd),
                ..self.clone()
            };
            ordered.fit_from(records, (sample_time, off_level), guess.as_deref())
        };
        // Exact data do not determine a noise model, so the first order is sufficient.
        let is_exact = |fit: &SigmoidFit| fit.termination().reason == Reason::ExactFit;
        let chosen = order
            .filter(|nd| self.nd.is_none() && *nd > DEFAULT_NOISE_ORDER)
            .and_then(|nd| with_noise(nd).ok())
            .filter(|fit| !is_exact(fit));
        chosen.map_or_else(|| with_noise(self.nd.unwrap_or(DEFAULT_NOISE_ORDER)), Ok)
    }

    /// Returns the estimator for an operator without a change, whose result gives a start.
    fn estimator_without_change(&self) -> FamilyEstimator {
        FamilyEstimator {
            forms: vec![self.form],
            neuromuscular: self.neuromuscular,
            delay_range_s: self.delay_range_s,
            prior: self.prior.clone(),
            intersample: Intersample::Zoh,
            ..FamilyEstimator::default()
        }
    }

    fn fit_from(
        &self,
        records: &[Record],
        (sample_time, off_level): (SampleTime, &[Record]),
        guess: Option<&[f64]>,
    ) -> Result<SigmoidFit, IdentError> {
        let mut criterion = self.criterion(records, sample_time)?;
        let unit = prior::penalties(&criterion.layout, &self.prior);
        for penalty in &unit {
            // A parameter with a prior must be positive.
            let (low, high) = criterion.limits[penalty.index];
            criterion.limits[penalty.index] = (low.max(0.0), high);
        }
        let starts = self.starts(&criterion, off_level, guess)?;
        if let Some((_, theta)) = starts.first() {
            criterion.penalty = prior::penalties_at_start(&criterion, &unit, theta);
        }
        let (mut start, minimum) = best_minimum(starts, &criterion, &self.search)?;
        let settled = |criterion: &mut ChangeCriterion<'_>, minimum| {
            prior::minimum_with_scaled_prior(criterion, &unit, minimum, self.noise_level, &self.search)
        };
        let (mut minimum, mut levels) = settled(&mut criterion, minimum)?;
        let (mut lower, mut stay) = (0, false);
        loop {
            let constant = minimum_without_change(&criterion, &minimum.theta, &self.search)?;
            let mut found = SigmoidFit::new(&criterion, &minimum, start.clone(), &constant, levels)?;
            let walk = self
                .likelihood_intervals
                .then(|| found.add_intervals(&criterion, &minimum, stay));
            let Some(theta) = walk.flatten() else {
                return Ok(found);
            };
            // Each of two minima may have the lower loss with the weights of the other. The decision is therefore based
            // on the likelihood, which includes the weights.
            let weights = criterion.weights.clone();
            let other = search(&criterion, theta, &self.search, None).ok_or(IdentError::NoFiniteLoss)?;
            let penalty = criterion.penalty.clone();
            let (mut other, other_levels) = settled(&mut criterion, other)?;
            lower += 1;
            if other.linearisation.sum_of_squares < minimum.linearisation.sum_of_squares && lower <= MAX_LOWER_MINIMA {
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

    /// Returns the names of the parameters for this form and noise model (of order 1 if the order is chosen
    /// automatically): `K_e1`, `K_e2`, `T_L1`, `T_L2`, `t_M`, `G`, `omega_nm`, `zeta_nm`, `tau_e`, `d1` ... for a gain
    /// and a lead.
    pub fn names(&self) -> Vec<String> {
        self.layout().names()
    }

    /// Returns the names of all parameters that a fit may have: the names of [`Self::names`], with every `d` that can
    /// be chosen.
    pub fn possible_names(&self) -> Vec<String> {
        Layout::new(self.form, self.neuromuscular, self.nd.unwrap_or(MAX_NOISE_ORDER)).names()
    }

    fn layout(&self) -> Layout {
        Layout::new(self.form, self.neuromuscular, self.nd.unwrap_or(DEFAULT_NOISE_ORDER))
    }

    /// Returns the starts, each with its name and its theta.
    fn starts(
        &self,
        criterion: &ChangeCriterion<'_>,
        off_level: &[Record],
        guess: Option<&[f64]>,
    ) -> Result<Vec<(String, Vec<f64>)>, IdentError> {
        if let Some(start) = &self.start {
            return Ok(vec![("given".to_owned(), self.given_start(criterion, start)?)]);
        }
        let of_starts = ChangeCriterion {
            limits: criterion.limits.clone(),
            ..self.criterion(off_level, criterion.sample_time)?
        };
        let starts = starts::initial_guesses(&of_starts, off_level, guess);
        Ok(starts.into_iter().map(|s| (s.label, s.theta)).collect())
    }

    fn criterion<'a>(&self, records: &'a [Record], sample_time: SampleTime) -> Result<ChangeCriterion<'a>, IdentError> {
        let layout = self.layout();
        if !self.form.is_proper(self.neuromuscular) {
            return Err(IdentError::BadOption {
                option: "the form of the operator".to_owned(),
                found: format!("{} without neuromuscular dynamics", self.form),
                expected: "a form with a lag, or neuromuscular dynamics".to_owned(),
            });
        }
        let (low, high) = self.delay_range_s;
        if !(low.is_finite() && high.is_finite() && 0.0 <= low && low <= high) {
            return Err(IdentError::BadOption {
                option: "the range of the delay tau_e".to_owned(),
                found: format!("{low} to {high} s"),
                expected: "two nonnegative times, the shorter time first".to_owned(),
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
                expected: "records whose time axes overlap around the change, because all share one t_M".to_owned(),
            });
        }
        let frame = BoundInputs {
            ts_s: sample_time.s(),
            span_s,
            delay_range_s: self.delay_range_s,
        };
        let limits = limits(&layout, &frame, &self.constraints)?;
        let longest = whole_samples(limits[layout.delay].1, sample_time)? + layout.direct_sample_count().max(1);
        let orders = layout.orders(longest);
        let criterion = ChangeCriterion {
            first: longest + layout.nd,
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
        let unknowns = criterion.limits.len() + criterion.state_count();
        if criterion.residual_count() <= unknowns {
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
        let positive = |(slot, element): (usize, &ThetaElement)| match element {
            ThetaElement::LogRate => Some(slot),
            ThetaElement::Constant(_) if slot != layout.delay => Some(slot),
            _ => None,
        };
        for slot in layout.elements().iter().enumerate().filter_map(positive) {
            if start[slot].is_nan() || start[slot] <= 0.0 {
                return bad(format!("{} = {}, expected a positive number", names[slot], start[slot]));
            }
        }
        if let Some(i) = start.iter().position(|v| !v.is_finite()) {
            return bad(format!("{} = {}, expected a finite number", names[i], start[i]));
        }
        let typed = start.iter().enumerate();
        Ok(typed
            .map(|(slot, value)| layout.theta_from_user_value(slot, *value))
            .collect())
    }
}
