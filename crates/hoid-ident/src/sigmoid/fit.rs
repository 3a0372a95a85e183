//! The fitted change with its uncertainty.

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
    /// Unit; empty for none.
    pub unit: &'static str,
    /// Estimate.
    pub estimate: Estimate,
    /// Why it has no standard error, where it has none.
    pub remark: Option<Remark>,
}

/// The part that changes, as it is in force at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct GainsAt {
    /// Time on the axis of the record, s.
    pub time_s: f64,
    /// K_e, T_L and K_e_dot of a gain and a lead; else K and, with a lag, K_over_T_I, then T_L and
    /// so on.
    pub gains: Vec<NamedEstimate>,
}

impl GainsAt {
    /// One of them by name.
    pub fn get(&self, name: &str) -> Option<Estimate> {
        self.gains.iter().find(|g| g.name == name).map(|g| g.estimate)
    }
}

/// An operator who changes once.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SigmoidFit {
    layout: Layout,
    sample_time: SampleTime,
    first: usize,
    /// u of each record has a level.
    level: bool,
    /// With ln G and 1/T_I.
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

/// A list of which some are missing, as lists of one or none: not every format has a missing element.
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
    /// The fit at the minimum with a change, compared with the one without, `constant`.
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

    /// All parameters in the order of [`SigmoidChange::names`](crate::SigmoidChange::names): what
    /// changes before and after the change, t_M, G, the others, then d1 ... d_nd.
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

    /// One parameter by name.
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

    /// Covariance of the parameters in the order and the units of [`SigmoidFit::parameters`], by
    /// rows; zero for fixed parameters, `None` for an exact fit.
    pub fn covariance(&self) -> Option<Vec<f64>> {
        let p = self.theta.len();
        let scale: Vec<f64> = (0..p).map(|i| self.layout.typed_slope(i, self.theta[i])).collect();
        let c = self.covariance.as_ref()?;
        Some((0..p * p).map(|k| c[k] * scale[k / p] * scale[k % p]).collect())
    }

    /// Likelihood intervals of t_M and G, if there was a change and noise. Returns theta where the
    /// loss is lower than at the minimum, if the walk along t_M or G comes upon such a place and is
    /// not to stay.
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

    /// 95 % likelihood interval of t_M in s; `None` without noise, without a change, or if it was
    /// not asked for.
    pub fn midpoint_interval(&self) -> Option<(f64, f64)> {
        self.midpoint_interval.map(|i| (i.low, i.high))
    }

    /// 95 % likelihood interval of G in 1/s, open to infinity where the change may have been
    /// abrupt; else as [`SigmoidFit::midpoint_interval`].
    pub fn rate_interval(&self) -> Option<(f64, f64)> {
        self.rate_interval.map(|i| (i.low, i.high))
    }

    /// True if the change is too fast for t_M to have an error that is normally distributed: a
    /// change point.
    pub fn is_change_point(&self) -> bool {
        self.change_point
    }

    /// The operator before the change, where there was one ([`SigmoidFit::change_found`]).
    pub fn initial_operator(&self) -> &ChangedOperator {
        &self.initial
    }

    /// The operator after the change, where there was one.
    pub fn last_operator(&self) -> &ChangedOperator {
        &self.last
    }

    /// The operator of the fit without a change.
    pub fn constant_operator(&self) -> &ChangedOperator {
        &self.constant
    }

    /// The fit against the one without a change.
    pub fn comparison(&self) -> Comparison {
        self.comparison
    }

    /// True if the change is worth its parameters by the BIC. Otherwise t_M and G mean nothing
    /// ([`Remark::NoChange`]), and [`SigmoidFit::constant_operator`] describes the records.
    pub fn change_found(&self) -> bool {
        self.comparison.bic_difference > 0.0
    }

    /// Gains in force at a time on the axis of the record, with standard errors: those of the
    /// sigmoid where the records show a change, else those of the fit without one.
    ///
    /// The errors are those of the delta method, t_M and G included. Around a change point, where
    /// the sigmoid is not a line over the interval of t_M, `step^2 p (1 - p)` represents the
    /// latter, with p the probability that the change has happened.
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

    /// [`SigmoidFit::gains_at`] at every sample of a record.
    pub fn trace(&self, record: &Record) -> Vec<GainsAt> {
        record.times_s().into_iter().map(|t| self.gains_at(t)).collect()
    }

    /// Coefficients of D.
    pub fn d(&self) -> &[f64] {
        &self.theta[self.layout.noise..]
    }

    /// Loss: mean of the squared residuals, weighted where the noise level changes (weights with
    /// the geometric mean 1).
    pub fn loss(&self) -> f64 {
        self.loss
    }

    /// `sum eps^2/(n - p - s)` of the same residuals, with p parameters and s initial states.
    pub fn innovation_variance(&self) -> f64 {
        self.innovation_variance
    }

    /// Standard deviation of the innovations before and after the change; `None` if the same
    /// throughout was requested, or the residuals have no size.
    pub fn noise_levels(&self) -> Option<[f64; 2]> {
        self.levels
    }

    /// Number n of residuals.
    pub fn residual_count(&self) -> usize {
        self.residuals
    }

    /// Number s of initial states that were estimated.
    pub fn state_count(&self) -> usize {
        self.states
    }

    /// How the search ended.
    pub fn termination(&self) -> Termination {
        self.termination
    }

    /// The best start.
    pub fn start(&self) -> &str {
        &self.start
    }

    /// One-step-ahead residuals on a record (not weighted), its initial state estimated.
    ///
    /// # Errors
    /// [`IdentError::MixedSampling`], [`IdentError::TooFewSamples`].
    pub fn residuals(&self, record: &Record) -> Result<Series, IdentError> {
        self.errors_of(self.layout, &self.theta, record)
    }

    /// Output of the operator alone, without noise model; the initial state is that of the least
    /// simulation error.
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

    /// The level of u in a record, in the unit of u, with its standard error; `None` if it was not estimated
    /// ([`crate::SigmoidChange::level`]), and of an exact fit.
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

    /// The criterion of this fit over another record, without weights.
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
