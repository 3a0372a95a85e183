//! The fitted change with its standard errors.

use hoid_model::{Form, Record, SampleTime, Structure, uncertainty::Estimate};

use super::{
    ends::{ChangedOperator, NamedEstimate, ThetaEstimate, estimate},
    inference::{Comparison, Remark, constant_operator, inference},
    layout::Layout,
    objective::{ChangeCriterion, Data},
    profile_likelihood::{Interval, Profile, profile_likelihood_interval},
};
use crate::{IdentError, Series, Termination, informative_data::check_record, optimize::Minimum};

/// One parameter of the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangeParameter {
    /// Name.
    pub name: String,
    /// Unit; empty if there is none.
    pub unit: &'static str,
    /// Estimate.
    pub estimate: Estimate,
    /// The reason if it has no standard error.
    pub remark: Option<Remark>,
}

/// The changing parameters at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct GainsAt {
    /// Time on the axis of the record, s.
    pub time_s: f64,
    /// K_e, T_L and K_e_dot for a gain and a lead; otherwise K and, with a lag, K_over_T_I, followed by T_L and so on.
    pub gains: Vec<NamedEstimate>,
}

impl GainsAt {
    /// Returns one of them by name.
    pub fn get(&self, name: &str) -> Option<Estimate> {
        self.gains.iter().find(|g| g.name == name).map(|g| g.estimate)
    }
}

/// Fit of an operator that changes once.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SigmoidFit {
    layout: Layout,
    sample_time: SampleTime,
    first: usize,
    /// True if u of each record has a level.
    level: bool,
    /// theta, with ln G and 1/T_I.
    theta: Vec<f64>,
    covariance: Option<Vec<f64>>,
    #[serde(with = "each_or_none")]
    remarks: Vec<Option<Remark>>,
    midpoint_interval: Option<Interval>,
    rate_interval: Option<Interval>,
    change_point: bool,
    loss: f64,
    innovation_variance: f64,
    levels: Option<[f64; 2]>,
    residuals: usize,
    states: usize,
    termination: Termination,
    start: String,
    comparison: Comparison,
    initial: ChangedOperator,
    last: ChangedOperator,
    constant: ChangedOperator,
}

/// Serialises a list with missing elements as lists of one or none: not every format has a missing element.
mod each_or_none {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::Remark;

    pub fn serialize<S: Serializer>(all: &[Option<Remark>], to: S) -> Result<S::Ok, S::Error> {
        all.iter().map(Option::as_slice).collect::<Vec<_>>().serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Option<Remark>>, D::Error> {
        let all = Vec::<Vec<Remark>>::deserialize(from)?;
        Ok(all.into_iter().map(|mut one| one.pop()).collect())
    }
}

impl SigmoidFit {
    /// Creates the fit at the minimum with a change, compared with the one without, `constant`.
    pub(super) fn new(
        criterion: &ChangeCriterion<'_>,
        minimum: &Minimum,
        start: String,
        constant: &Minimum,
        levels: Option<[f64; 2]>,
    ) -> Result<Self, IdentError> {
        let found = inference(criterion, minimum, constant)?;
        let known = ThetaEstimate {
            layout: &criterion.layout,
            theta: &minimum.theta,
            covariance: found.covariance.as_deref(),
            change_point: None,
        };
        let squares = minimum.at.sum_of_squares - criterion.penalty_at(&minimum.theta);
        Ok(Self {
            layout: criterion.layout,
            sample_time: criterion.sample_time,
            first: criterion.first,
            level: criterion.level,
            loss: squares / criterion.residuals() as f64,
            initial: known.end(0)?,
            last: known.end(1)?,
            innovation_variance: found.innovation_variance,
            levels,
            residuals: criterion.residuals(),
            states: criterion.states(),
            termination: minimum.termination,
            start,
            comparison: found.comparison,
            constant: constant_operator(criterion, constant)?,
            theta: minimum.theta.clone(),
            covariance: found.covariance,
            remarks: found.remarks,
            midpoint_interval: None,
            rate_interval: None,
            change_point: found.change_point,
        })
    }

    /// The form of the operator.
    pub fn form(&self) -> Form {
        self.layout.form
    }

    /// True with the neuromuscular part.
    pub fn has_neuromuscular(&self) -> bool {
        self.layout.neuromuscular
    }

    /// Returns all parameters in the order of [`SigmoidChange::names`](crate::SigmoidChange::names): the changing ones
    /// before and after the change, t_M, G, the others, then d1 ... d_nd.
    pub fn parameters(&self) -> Vec<ChangeParameter> {
        let names = self.layout.names_and_units().into_iter().enumerate();
        names
            .map(|(i, (name, unit))| ChangeParameter {
                name,
                unit,
                estimate: self.estimate_of(i),
                remark: self.remarks[i],
            })
            .collect()
    }

    /// Returns one parameter by name.
    pub fn parameter(&self, name: &str) -> Option<ChangeParameter> {
        self.parameters().into_iter().find(|p| p.name == name)
    }

    fn estimate_of(&self, i: usize) -> Estimate {
        let value = self.layout.typed(i, self.theta[i]);
        let has_error = self.remarks[i].is_none_or(Remark::leaves_an_error);
        match self.covariance() {
            Some(c) if has_error => estimate(value, c[i * self.theta.len() + i]),
            _ => Estimate::fixed(value),
        }
    }

    /// Returns the covariance of the parameters in the order and the units of [`SigmoidFit::parameters`], by rows; zero
    /// for fixed parameters, `None` for an exact fit.
    pub fn covariance(&self) -> Option<Vec<f64>> {
        let p = self.theta.len();
        let scale: Vec<f64> = (0..p).map(|i| self.layout.typed_slope(i, self.theta[i])).collect();
        let c = self.covariance.as_ref()?;
        Some((0..p * p).map(|k| c[k] * scale[k / p] * scale[k % p]).collect())
    }

    /// Adds likelihood intervals of t_M and G, if there was a change and noise. If the walk along t_M or G finds a
    /// lower loss than at the minimum and `stay` is false, returns theta there.
    pub(super) fn add_intervals(
        &mut self,
        criterion: &ChangeCriterion<'_>,
        minimum: &Minimum,
        stay: bool,
    ) -> Option<Vec<f64>> {
        let p = self.theta.len();
        if !self.change_found() {
            return None;
        }
        let (midpoint, log_rate) = (self.layout.midpoint, self.layout.log_rate);
        let covariance = self.covariance.as_ref()?;
        let standard_error = |i: usize| Some(covariance[i * p + i].sqrt()).filter(|s| *s > 0.0);
        let standard_errors = [midpoint, log_rate].map(standard_error);
        for (place, standard_error) in [midpoint, log_rate].into_iter().zip(standard_errors) {
            if self.remarks[place] == Some(Remark::Fixed) {
                continue;
            }
            match profile_likelihood_interval(criterion, minimum, place, standard_error, self.change_point, stay) {
                Profile::Lower(theta) => return Some(theta),
                Profile::Interval(interval) if place == midpoint => self.midpoint_interval = Some(interval),
                Profile::Interval(interval) => self.rate_interval = Some(interval),
            }
        }
        if self.change_point
            && let (Some(interval), Some(covariance)) = (self.midpoint_interval, self.covariance.as_mut())
        {
            // A normal error with the same interval.
            for i in 0..p {
                (covariance[midpoint * p + i], covariance[i * p + midpoint]) = (0.0, 0.0);
            }
            covariance[midpoint * p + midpoint] = ((interval.high - interval.low) / (2.0 * 1.96)).powi(2);
            if self.remarks[midpoint] == Some(Remark::ChangePoint) {
                self.remarks[midpoint] = None;
            }
        }
        None
    }

    /// Returns the 95 % likelihood interval of t_M in s; `None` without noise, without a change, or if it was not
    /// requested.
    pub fn midpoint_interval(&self) -> Option<(f64, f64)> {
        self.midpoint_interval.map(|i| (i.low, i.high))
    }

    /// Returns the 95 % likelihood interval of G in 1/s, open to infinity if the change may have been abrupt; otherwise
    /// as [`SigmoidFit::midpoint_interval`].
    pub fn rate_interval(&self) -> Option<(f64, f64)> {
        self.rate_interval.map(|i| (i.low, i.high))
    }

    /// True if the change is too fast for a normally distributed error of t_M: a change point.
    pub fn is_change_point(&self) -> bool {
        self.change_point
    }

    /// Returns the operator before the change, if there was one ([`SigmoidFit::change_found`]).
    pub fn initial_operator(&self) -> &ChangedOperator {
        &self.initial
    }

    /// Returns the operator after the change, if there was one.
    pub fn last_operator(&self) -> &ChangedOperator {
        &self.last
    }

    /// Returns the operator of the fit without a change.
    pub fn constant_operator(&self) -> &ChangedOperator {
        &self.constant
    }

    /// Returns the comparison with the fit without a change.
    pub fn comparison(&self) -> Comparison {
        self.comparison
    }

    /// True if the change justifies its parameters by the BIC. Otherwise t_M and G have no meaning
    /// ([`Remark::NoChange`]), and [`SigmoidFit::constant_operator`] describes the records.
    pub fn change_found(&self) -> bool {
        self.comparison.bic_difference > 0.0
    }

    /// Returns the gains at a time on the axis of the record, with standard errors: those of the sigmoid if the records
    /// show a change, otherwise those of the fit without one.
    ///
    /// The errors are computed by the delta method and include those of t_M and G. Near a change point, where the
    /// sigmoid is not linear over the interval of t_M, its contribution is `step^2 p (1 - p)`, with p the probability
    /// that the change has happened.
    pub fn gains_at(&self, time_s: f64) -> GainsAt {
        let known = ThetaEstimate {
            layout: &self.layout,
            theta: &self.theta,
            covariance: self.covariance.as_deref(),
            change_point: self.covariance.as_ref().filter(|_| self.change_point).map(|c| {
                let (p, i) = (self.theta.len(), self.layout.midpoint);
                c[i * p + i]
            }),
        };
        let mut gains = known.at(time_s);
        if !self.change_found() {
            for gain in &mut gains {
                gain.estimate = self.constant.get(gain.name).unwrap_or(gain.estimate);
            }
        }
        GainsAt { time_s, gains }
    }

    /// Returns [`SigmoidFit::gains_at`] at every sample of a record.
    pub fn trace(&self, record: &Record) -> Vec<GainsAt> {
        record.times_s().into_iter().map(|t| self.gains_at(t)).collect()
    }

    /// Returns the coefficients of D.
    pub fn d(&self) -> &[f64] {
        &self.theta[self.layout.noise..]
    }

    /// Returns the loss: the mean of the squared residuals, weighted if the noise level changes (weights with the
    /// geometric mean 1).
    pub fn loss(&self) -> f64 {
        self.loss
    }

    /// Returns `sum eps^2/(n - p - s)` of the same residuals, with p parameters and s initial states.
    pub fn innovation_variance(&self) -> f64 {
        self.innovation_variance
    }

    /// Returns the standard deviation of the innovations before and after the change; `None` if a constant level was
    /// requested, or the residuals are zero.
    pub fn noise_levels(&self) -> Option<[f64; 2]> {
        self.levels
    }

    /// Returns the number n of residuals.
    pub fn residual_count(&self) -> usize {
        self.residuals
    }

    /// Returns the number s of estimated initial states.
    pub fn state_count(&self) -> usize {
        self.states
    }

    /// How the search ended.
    pub fn termination(&self) -> Termination {
        self.termination
    }

    /// Returns the name of the best start.
    pub fn start(&self) -> &str {
        &self.start
    }

    /// Returns the one-step-ahead residuals on a record (not weighted), with its initial state estimated.
    ///
    /// # Errors
    /// [`IdentError::MixedSampling`], [`IdentError::TooFewSamples`].
    pub fn residuals(&self, record: &Record) -> Result<Series, IdentError> {
        self.errors_of(self.layout, &self.theta, record)
    }

    /// Returns the output of the operator alone, without noise model; the initial state minimises the simulation error.
    ///
    /// # Errors
    /// As [`SigmoidFit::residuals`].
    pub fn simulate(&self, record: &Record) -> Result<Series, IdentError> {
        let silent = Layout { nd: 0, ..self.layout };
        let errors = self.errors_of(silent, &self.theta[..self.layout.noise], record)?;
        let output = &record.output()[errors.first..];
        Ok(Series {
            first: errors.first,
            values: output.iter().zip(&errors.values).map(|(u, e)| u - e).collect(),
        })
    }

    /// Returns the level of u in a record, in the unit of u, with its standard error; `None` if it was not estimated
    /// ([`crate::SigmoidChange::level`]), and for an exact fit.
    pub fn level(&self, record: &Record) -> Option<Estimate> {
        let (criterion, covariance) = (self.criterion(self.layout, record).ok()?, self.covariance.as_ref()?);
        let (value, variance) = criterion.level_of(&self.theta, 0, self.innovation_variance, covariance)?;
        Some(Estimate::with_variance(value, variance))
    }

    fn errors_of(&self, layout: Layout, theta: &[f64], record: &Record) -> Result<Series, IdentError> {
        let criterion = self.criterion(layout, record)?;
        let values = criterion.residuals_of(theta, 0).ok_or(IdentError::NoFiniteLoss)?;
        let first = criterion.first;
        Ok(Series { first, values })
    }

    /// Returns the criterion of this fit over another record, without weights.
    fn criterion<'a>(&self, layout: Layout, record: &'a Record) -> Result<ChangeCriterion<'a>, IdentError> {
        if !self.sample_time.matches(record.sample_time()) {
            return Err(IdentError::MixedSampling {
                label: record.label().to_owned(),
                found: record.sample_time().s(),
                expected: self.sample_time.s(),
            });
        }
        let first = self.first - self.layout.nd + layout.nd;
        check_record(
            Structure::BoxJenkins,
            &layout.orders(self.first - self.layout.nd),
            record,
            first,
        )?;
        Ok(ChangeCriterion {
            layout,
            data: vec![Data {
                e: record.input(),
                u: record.output(),
                start_s: record.time_s(0),
            }],
            sample_time: self.sample_time,
            first,
            limits: Vec::new(),
            piece: None,
            changes: true,
            weights: None,
            penalty: Vec::new(),
            level: self.level,
        })
    }
}
