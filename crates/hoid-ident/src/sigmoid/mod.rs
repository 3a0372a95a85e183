//! An operator who changes once: gains that follow a sigmoid, with the time and the rate of the change estimated.
//!
//! `u(t) = K_e(t - tau) y1(t) + K_e_dot(t - tau) y2(t) + (1/D) eps`, `K_e_dot = K_e T_L`, where K_e and T_L go from their initial to
//! their last value as `1/(1 + e^{-G (t - t_M)})` (eq. 5) and y1, y2 are the exact responses of the neuromuscular system and
//! the delay to the held error (`objective`). Gains at both ends, t_M, G, omega_nm, zeta_nm, a real tau_e and D are found
//! together by the prediction error method, which is maximum likelihood for normal innovations. Source: P. M. T. Zaal, *Manual
//! control adaptation to changing vehicle dynamics in roll-pitch control tasks*, J. Guidance, Control, and Dynamics 39 (2016).
//!
//! The innovations may have another size after the change ([`NoiseLevel`]). Without that the error bars of one end would be too
//! small and those of the other too large.
//!
//! **Was there a change?** The same model without one is fitted to the same residuals with the same weights:
//! `LR = n ln(V_0/V_1)`. Without a change t_M and G mean nothing, so that LR has no chi-square distribution then (R. B. Davies,
//! *Biometrika* 74 (1987) 33-43); the decision is by the BIC, `LR > 4 ln n`.

use std::collections::BTreeMap;

use hoid_model::{Orders, Record, SampleTime, Structure, delayed_operator::whole_samples};

use crate::{
    Constraint, IdentError, Reason, SearchOptions, informative_data,
    linalg::least_squares::dot,
    optimize::{Minimum, minimise},
    pem::criterion::Workspace,
};

mod assemble;
mod interval;
mod layout;
mod noise_level;
mod objective;
mod result;
mod starts;

pub use layout::TIME_VARYING_NAMES;
pub use result::{ChangeParameter, Comparison, GainsAt, Remark, TimeVaryingFit};

use layout::{DELAY, Frame, Instant, OF_THE_CHANGE, limits};
use objective::{ChangeCriterion, Data};

/// Size of the innovations over the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NoiseLevel {
    /// The same throughout.
    Constant,
    /// One level before and one after the change, with the same sigmoid between them.
    #[default]
    Changing,
}

/// What is to be estimated, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeVarying {
    /// Order nd of D.
    pub nd: usize,
    /// Shortest and longest delay tau_e, s; any fraction of a sample. Equal ends fix it.
    pub delay_range_s: (f64, f64),
    /// Fixed and bounded parameters by name ([`TIME_VARYING_NAMES`], d1 ...). By default t_M lies in the middle nine tenths of
    /// the span that the records have in common, and G between 5/span and 2/Ts.
    pub constraints: BTreeMap<String, Constraint>,
    /// Size of the innovations over the record.
    pub noise_level: NoiseLevel,
    /// Start instead of the own ones: the parameters of [`TIME_VARYING_NAMES`] in their units, then d1 ... d_nd.
    pub start: Option<Vec<f64>>,
    /// Method and limits of each search.
    pub search: SearchOptions,
    /// Whether t_M and G get likelihood intervals; they take about as long as the fit. Default true.
    pub likelihood_intervals: bool,
}

impl Default for TimeVarying {
    /// First-order noise, delay between 0.05 and 0.6 s, noise level that changes, own starts; searches of up to 200 steps
    /// to a relative decrease of 1e-10 (a thousandth of a standard error): a small change fills its loss with ripples in t_M.
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

/// Steps from each start before the best of them is followed to its end.
const LOOK: usize = 30;
/// Rounds of fit and noise levels in turn.
const ROUNDS: usize = 20;
/// Rounds end when the ratio of the levels moves by less than this share; its own standard error is `1/sqrt n`, about 1 %.
const SETTLED: f64 = 1e-6;
/// Relative change of the loss that does not matter: of the log-likelihood of 10000 residuals, a two-hundredth.
const NO_MATTER: f64 = 1e-6;
/// Lower minima that the walks along t_M and G may come upon before the fit is left at the last one.
const MOST_LOWER: usize = 10;
/// Distance to the border of a sample, in samples, below which the next sample is tried.
const NEAR_BORDER: f64 = 1e-6;

impl TimeVarying {
    /// Fits one change to all records: parameters and t_M in common (t_M on the time axis of each record), initial states of
    /// each.
    ///
    /// # Errors
    /// [`IdentError`]; how the search ended, and what the data do not determine, is part of the fit.
    pub fn fit(&self, records: &[Record]) -> Result<TimeVaryingFit, IdentError> {
        let sample_time = informative_data::common_sample_time(records)?;
        let mut criterion = self.criterion(records, sample_time)?;
        let (mut start, minimum) = self.best_minimum(&criterion, records)?;
        let (mut minimum, mut levels) = self.with_levels(&mut criterion, minimum)?;
        let (mut lower, mut stay) = (0, false);
        loop {
            let constant = self.without_change(&criterion, &minimum.theta)?;
            let mut found = assemble::assemble(&criterion, &minimum, start.clone(), &constant, levels)?;
            let walk = self
                .likelihood_intervals
                .then(|| found.add_intervals(&criterion, &minimum, stay));
            let Some(theta) = walk.flatten() else {
                return Ok(found);
            };
            // With the weights of the other minimum this one may be the lower: the likelihood decides, weights and all.
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

    /// The minimum with the noise levels found in turn with the fit.
    fn with_levels(
        &self,
        criterion: &mut ChangeCriterion<'_>,
        mut minimum: Minimum,
    ) -> Result<(Minimum, Option<[f64; 2]>), IdentError> {
        let mut levels = None;
        if self.noise_level == NoiseLevel::Constant {
            return Ok((minimum, levels));
        }
        let mut iterations = minimum.termination.iterations;
        for round in 0..ROUNDS {
            let Some(found) = levels_at(criterion, &minimum.theta) else {
                break;
            };
            let before = levels.replace(found);
            let ratio = |s: [f64; 2]| s[1] / s[0];
            if before.is_some_and(|b: [f64; 2]| (ratio(found) / ratio(b) - 1.0).abs() < SETTLED) {
                break;
            }
            let weights = noise_level::weights(found, &shares(criterion, &minimum.theta));
            let kept = criterion.weights.replace(weights);
            let next = search(criterion, minimum.theta.clone(), &self.search, None).ok_or(IdentError::NoFiniteLoss)?;
            iterations += next.termination.iterations;
            let change = next.at.sum_of_squares / minimum.at.sum_of_squares - 1.0;
            if round > 0 && change > NO_MATTER {
                // Two changes that each look worse with the noise levels of the other: the likelier one stays.
                (criterion.weights, levels) = (kept, before);
                break;
            }
            minimum = next;
            if round + 1 == ROUNDS && change < -NO_MATTER && minimum.termination.converged() {
                minimum.termination.reason = Reason::IterationLimit;
            }
        }
        minimum.termination.iterations = iterations;
        Ok((minimum, levels))
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
            informative_data::check_record(Structure::BoxJenkins, &orders, record, criterion.first)?;
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

    fn best_minimum(
        &self,
        criterion: &ChangeCriterion<'_>,
        records: &[Record],
    ) -> Result<(String, Minimum), IdentError> {
        let candidates = match &self.start {
            Some(start) => vec![("given".to_owned(), self.given_start(start)?)],
            None => starts::propose(criterion, records)
                .into_iter()
                .map(|s| (s.label, s.theta))
                .collect(),
        };
        // A look at each start, then the best to its end.
        let look = SearchOptions {
            max_iterations: self.search.max_iterations.min(LOOK),
            ..self.search
        };
        let mut best: Option<(String, Minimum)> = None;
        for (label, theta) in candidates {
            let known = best.as_ref().map(|(_, b)| b.at.sum_of_squares);
            let Some(minimum) = minimise(criterion, theta, &look, known, &mut Workspace::of_thread()) else {
                continue;
            };
            if known.is_none_or(|known| minimum.at.sum_of_squares < known) {
                best = Some((label, minimum));
            }
        }
        let (label, seen) = best.ok_or(IdentError::NoFiniteLoss)?;
        if seen.termination.converged() {
            return Ok((label, seen));
        }
        let mut minimum = search(criterion, seen.theta, &self.search, None).ok_or(IdentError::NoFiniteLoss)?;
        minimum.termination.iterations += seen.termination.iterations;
        Ok((label, minimum))
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

    /// The minimum of the model without a change, with the weights of the other.
    fn without_change(&self, criterion: &ChangeCriterion<'_>, theta: &[f64]) -> Result<Minimum, IdentError> {
        let mut constant = ChangeCriterion {
            changes: false,
            ..criterion.clone()
        };
        let start = starts::without_change(&constant, theta);
        for place in OF_THE_CHANGE {
            constant.limits[place] = (start[place], start[place]);
        }
        search(&constant, start, &self.search, None).ok_or(IdentError::NoFiniteLoss)
    }
}

/// Share of the change at the time of each residual, without the delay: the remnant has none.
fn shares(criterion: &ChangeCriterion<'_>, theta: &[f64]) -> Vec<Vec<f64>> {
    let ts = criterion.sample_time.s();
    let of = |d: &Data<'_>| {
        (criterion.first..d.u.len())
            .map(|t| Instant::at(theta, d.start_s + t as f64 * ts).share)
            .collect()
    };
    criterion.data.iter().map(of).collect()
}

fn levels_at(criterion: &ChangeCriterion<'_>, theta: &[f64]) -> Option<[f64; 2]> {
    let residuals: Option<Vec<Vec<f64>>> = (0..criterion.data.len())
        .map(|record| criterion.residuals_of(theta, record))
        .collect();
    let residuals = residuals?;
    let size: f64 = residuals.iter().map(|r| dot(r, r)).sum();
    let power = crate::optimize::Objective::output_power(criterion);
    // Rounding has no level.
    (size > 1e-24 * power).then(|| noise_level::levels(&residuals, &shares(criterion, theta)))?
}

/// Searches from theta. The loss has kinks where tau_e is a whole number of samples, and a search may come to rest in one;
/// it is then finished inside each of the samples that meet there.
fn search(
    criterion: &ChangeCriterion<'_>,
    theta: Vec<f64>,
    options: &SearchOptions,
    rival: Option<f64>,
) -> Option<Minimum> {
    let mut workspace = Workspace::of_thread();
    let minimum = minimise(criterion, theta, options, rival, &mut workspace)?;
    let (low, high) = criterion.limits[DELAY];
    if minimum.termination.converged() || low == high {
        return Some(minimum);
    }
    let ts = criterion.sample_time.s();
    let mut inside = |sample: usize, theta: &[f64]| {
        let mut within = criterion.clone();
        within.sample = Some(sample);
        within.limits[DELAY] = (
            (sample as f64 * ts).clamp(low, high),
            ((sample + 1) as f64 * ts).clamp(low, high),
        );
        minimise(&within, theta.to_vec(), options, None, &mut workspace)
    };
    let mut sample = (minimum.theta[DELAY] / ts + NEAR_BORDER).floor() as usize;
    let mut iterations = minimum.termination.iterations;
    let mut best = inside(sample, &minimum.theta)?;
    iterations += best.termination.iterations;
    // Each move lowers the loss; the limit only guards against rounding.
    for _ in 0..100 {
        let position = best.theta[DELAY] / ts;
        let neighbours = [
            (position <= sample as f64 + NEAR_BORDER)
                .then(|| sample.checked_sub(1))
                .flatten(),
            (position >= (sample + 1) as f64 - NEAR_BORDER).then_some(sample + 1),
        ];
        let better = neighbours.into_iter().flatten().find_map(|there| {
            if (there + 1) as f64 * ts <= low || there as f64 * ts >= high {
                return None;
            }
            let found = inside(there, &best.theta)?;
            let lower = found.at.sum_of_squares < best.at.sum_of_squares * (1.0 - options.tolerance);
            lower.then_some((there, found))
        });
        let Some((there, found)) = better else { break };
        iterations += found.termination.iterations;
        (sample, best) = (there, found);
    }
    best.termination.iterations = iterations;
    Some(best)
}
