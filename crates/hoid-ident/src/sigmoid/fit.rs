//! The fitted change with its standard errors.

use hoid_model::{Form, Record, SampleTime, Structure, uncertainty::Estimate};

use super::{
    inference::{Comparison, Remark, constant_operator, infer},
    layout::Layout,
    objective::{ChangeCriterion, Data},
    operator_states::{ChangedOperator, NamedEstimate, ThetaEstimate, estimate},
    profile_likelihood::{Interval, ProfileEnd, profile_likelihood_interval},
};
use crate::{IdentError, Series, Termination, informative_data::check_record, optimize::Minimum};

/// A parameter of the fit, with its estimate and remark.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangeParameter {
    /// Name of the parameter.
    pub name: String,
    /// Unit; empty if there is none.
    pub unit: &'static str,
    /// Value and standard error.
    pub estimate: Estimate,
    /// Reason why the parameter has no standard error, or a standard error that does not come from the data; `None` for
    /// a normal estimate.
    pub remark: Option<Remark>,
}

/// The changing parameters at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct InstantGains {
    /// Time on the axis of the record, s.
    pub time_s: f64,
    /// K_e, T_L and K_e_dot for a gain and a lead; for other forms K (and K_over_T_I with a lag), followed by T_L and
    /// further parameters of the form.
    pub gains: Vec<NamedEstimate>,
}

impl InstantGains {
    /// Returns a gain by its name.
    pub fn get(&self, name: &str) -> Option<Estimate> {
        self.gains.iter().find(|g| g.name == name).map(|g| g.estimate)
    }
}

/// Fit of an operator whose gains change once.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SigmoidFit {
    layout: Layout,
    sample_time: SampleTime,
    first: usize,
    /// True if a level of u is estimated for each record.
    level: bool,
    /// theta, which contains ln G and 1/T_I.
    theta: Vec<f64>,
    covariance: Option<Vec<f64>>,
    #[serde(with = "each_or_none")]
    remarks: Vec<Option<Remark>>,
    midpoint_interval: Option<Interval>,
    rate_interval: Option<Interval>,
    #[serde(rename = "change_point")]
    is_change_point: bool,
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

/// Serialises each optional element as a list of zero or one elements, because not every format supports missing
/// elements.
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
    /// Creates the fit from the minimum with a change; `constant` is the minimum without a change, for comparison.
    pub(super) fn new(
        criterion: &ChangeCriterion<'_>,
        minimum: &Minimum,
        start: String,
        constant: &Minimum,
        levels: Option<[f64; 2]>,
    ) -> Result<Self, IdentError> {
        let found = infer(criterion, minimum, constant)?;
        let known = ThetaEstimate {
            layout: &criterion.layout,
            theta: &minimum.theta,
            covariance: found.covariance.as_deref(),
            change_point: None,
        };
        let squares = minimum.linearisation.sum_of_squares - criterion.penalty_at(&minimum.theta);
        Ok(Self {
            layout: criterion.layout,
            sample_time: criterion.sample_time,
            first: criterion.first,
            level: criterion.level,
            loss: squares / criterion.residual_count() as f64,
            initial: known.operator_at_end(0)?,
            last: known.operator_at_end(1)?,
            innovation_variance: found.innovation_variance,
            levels,
            residuals: criterion.residual_count(),
            states: criterion.state_count(),
            termination: minimum.termination,
            start,
            comparison: found.comparison,
            constant: constant_operator(criterion, constant)?,
            theta: minimum.theta.clone(),
            covariance: found.covariance,
            remarks: found.remarks,
            midpoint_interval: None,
            rate_interval: None,
            is_change_point: found.is_change_point,
        })
    }

    /// Returns the form of the operator.
    pub fn form(&self) -> Form {
        self.layout.form
    }

    /// True if the operator has a neuromuscular part.
    pub fn has_neuromuscular(&self) -> bool {
        self.layout.neuromuscular
    }

    /// Returns all parameters in the order of [`SigmoidChange::names`](crate::SigmoidChange::names): the changing
    /// parameters before and after the change, t_M, G, the parameters that do not change, then d1 ... d_nd.
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

    /// Returns a parameter by its name.
    pub fn parameter(&self, name: &str) -> Option<ChangeParameter> {
        self.parameters().into_iter().find(|p| p.name == name)
    }

    fn estimate_of(&self, i: usize) -> Estimate {
        let value = self.layout.user_value(i, self.theta[i]);
        let has_error = self.remarks[i].is_none_or(Remark::has_standard_error);
        match self.covariance() {
            Some(c) if has_error => estimate(value, c[i * self.theta.len() + i]),
            _ => Estimate::fixed(value),
        }
    }

    /// Returns the covariance of the parameters by rows, in the order and the units of [`SigmoidFit::parameters`]; it
    /// contains zeros for fixed parameters. `None` for an exact fit.
    pub fn covariance(&self) -> Option<Vec<f64>> {
        let p = self.theta.len();
        let scale: Vec<f64> = (0..p).map(|i| self.layout.user_value_slope(i, self.theta[i])).collect();
        let c = self.covariance.as_ref()?;
        Some((0..p * p).map(|k| c[k] * scale[k / p] * scale[k % p]).collect())
    }

    /// Adds likelihood intervals of t_M and G if a change was found and the fit is not exact. If the loss at some t_M
    /// or G is lower than at the minimum, and `stay` is false, returns theta at the lowest such point instead.
    pub(super) fn add_intervals(
        &mut self,
        criterion: &ChangeCriterion<'_>,
        minimum: &Minimum,
        stay: bool,
    ) -> Option<Vec<f64>> {
        let p = self.theta.len();
        if !self.has_change() {
            return None;
        }
        let (midpoint, log_rate) = (self.layout.midpoint, self.layout.log_rate);
        let covariance = self.covariance.as_ref()?;
        let standard_error = |i: usize| Some(covariance[i * p + i].sqrt()).filter(|s| *s > 0.0);
        let standard_errors = [midpoint, log_rate].map(standard_error);
        for (index, standard_error) in [midpoint, log_rate].into_iter().zip(standard_errors) {
            if self.remarks[index] == Some(Remark::Fixed) {
                continue;
            }
            match profile_likelihood_interval(criterion, minimum, index, standard_error, self.is_change_point, stay) {
                ProfileEnd::Lower(theta) => return Some(theta),
                ProfileEnd::Interval(interval) if index == midpoint => self.midpoint_interval = Some(interval),
                ProfileEnd::Interval(interval) => self.rate_interval = Some(interval),
            }
        }
        if self.is_change_point
            && let (Some(interval), Some(covariance)) = (self.midpoint_interval, self.covariance.as_mut())
        {
            // At a change point, the variance of a normal distribution with the same 95 % interval replaces the
            // covariance of t_M.
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

    /// Returns the 95 % likelihood interval of t_M in s; `None` if there is no noise or no change, or if the interval
    /// was not requested.
    pub fn midpoint_interval(&self) -> Option<(f64, f64)> {
        self.midpoint_interval.map(|i| (i.low, i.high))
    }

    /// Returns the 95 % likelihood interval of G in 1/s, open to infinity if the change may have been abrupt; `None` in
    /// the same cases as [`SigmoidFit::midpoint_interval`].
    pub fn rate_interval(&self) -> Option<(f64, f64)> {
        self.rate_interval.map(|i| (i.low, i.high))
    }

    /// True if t_M is a change point: the change is too fast for a normally distributed error of t_M.
    pub fn is_change_point(&self) -> bool {
        self.is_change_point
    }

    /// Returns the operator before the change, which is valid only if [`SigmoidFit::has_change`] is true.
    pub fn initial_operator(&self) -> &ChangedOperator {
        &self.initial
    }

    /// Returns the operator after the change, which is valid only if [`SigmoidFit::has_change`] is true.
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

    /// True if the BIC justifies the additional parameters of the change. Otherwise t_M and G have no meaning
    /// ([`Remark::NoChange`]), and [`SigmoidFit::constant_operator`] describes the records.
    pub fn has_change(&self) -> bool {
        self.comparison.bic_difference > 0.0
    }

    /// Returns the gains with their standard errors at a time on the axis of the record. They come from the sigmoid if
    /// the records show a change, otherwise from the fit without a change.
    ///
    /// The errors are computed by the delta method and include the errors of t_M and G. At a change point the sigmoid
    /// is not linear over the interval of t_M; there t_M contributes `step^2 p (1 - p)` to the variance, where p is the
    /// probability that the change has happened.
    pub fn gains_at(&self, time_s: f64) -> InstantGains {
        let known = ThetaEstimate {
            layout: &self.layout,
            theta: &self.theta,
            covariance: self.covariance.as_deref(),
            change_point: self.covariance.as_ref().filter(|_| self.is_change_point).map(|c| {
                let (p, i) = (self.theta.len(), self.layout.midpoint);
                c[i * p + i]
            }),
        };
        let mut gains = known.at(time_s);
        if !self.has_change() {
            for gain in &mut gains {
                gain.estimate = self.constant.get(gain.name).unwrap_or(gain.estimate);
            }
        }
        InstantGains { time_s, gains }
    }

    /// Returns [`SigmoidFit::gains_at`] at every sample of a record.
    pub fn trace(&self, record: &Record) -> Vec<InstantGains> {
        record.times_s().into_iter().map(|t| self.gains_at(t)).collect()
    }

    /// Returns the coefficients of D.
    pub fn d(&self) -> &[f64] {
        &self.theta[self.layout.noise..]
    }

    /// Returns the loss, i.e. the mean of the squared residuals. If the noise level changes, the residuals are
    /// weighted, and their weights have the geometric mean 1.
    pub fn loss(&self) -> f64 {
        self.loss
    }

    /// Returns `sum eps^2/(n - p - s)` of the residuals in the loss, with p parameters and s initial states.
    pub fn innovation_variance(&self) -> f64 {
        self.innovation_variance
    }

    /// Returns the standard deviation of the innovations before and after the change; `None` if a constant noise level
    /// was requested or the residuals are zero.
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

    /// Returns how the search ended.
    pub fn termination(&self) -> Termination {
        self.termination
    }

    /// Returns the name of the start that led to the minimum.
    pub fn start(&self) -> &str {
        &self.start
    }

    /// Returns the unweighted one-step-ahead residuals of a record, with its initial state estimated.
    ///
    /// # Errors
    /// [`IdentError::MixedSampling`] if the sample time of the record differs from that of the fit,
    /// [`IdentError::TooFewSamples`] if the record is too short.
    pub fn residuals(&self, record: &Record) -> Result<Series, IdentError> {
        self.residual_series(self.layout, &self.theta, record)
    }

    /// Returns the simulated output of the operator without the noise model; the initial state minimises the simulation
    /// error.
    ///
    /// # Errors
    /// The errors of [`SigmoidFit::residuals`].
    pub fn simulate(&self, record: &Record) -> Result<Series, IdentError> {
        let silent = Layout { nd: 0, ..self.layout };
        let errors = self.residual_series(silent, &self.theta[..self.layout.noise], record)?;
        let output = &record.output()[errors.first..];
        Ok(Series {
            first: errors.first,
            values: output.iter().zip(&errors.values).map(|(u, e)| u - e).collect(),
        })
    }

    /// Returns the level of u in a record with its standard error, in the unit of u; `None` if the level was not
    /// estimated ([`crate::SigmoidChange::level`]) or the fit is exact.
    pub fn level(&self, record: &Record) -> Option<Estimate> {
        let (criterion, covariance) = (self.criterion(self.layout, record).ok()?, self.covariance.as_ref()?);
        let (value, variance) = criterion.level_of(&self.theta, 0, self.innovation_variance, covariance)?;
        Some(Estimate::with_variance(value, variance))
    }

    fn residual_series(&self, layout: Layout, theta: &[f64], record: &Record) -> Result<Series, IdentError> {
        let criterion = self.criterion(layout, record)?;
        let values = criterion.residuals_of(theta, 0).ok_or(IdentError::NoFiniteLoss)?;
        let first = criterion.first;
        Ok(Series { first, values })
    }

    /// Returns the criterion of this fit for another record, without weights.
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
