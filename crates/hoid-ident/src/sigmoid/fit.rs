//! The fitted change with its uncertainty.

use hoid_model::{
    Orders, Record, SampleTime, Structure,
    uncertainty::{Estimate, OperatorEstimate, variance_along},
};

use super::{
    inference::{Comparison, Remark, constant_operator, estimate, inference, operator},
    layout::{Instant, K_E, LOG_RATE, MIDPOINT, NOISE, SIGMOID_NAMES, T_L, names},
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

/// Gains in force at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainsAt {
    /// Time on the axis of the record, s.
    pub time_s: f64,
    /// Error gain K_e, deg/deg.
    pub k_e: Estimate,
    /// Lead time constant T_L, s.
    pub t_l_s: Estimate,
    /// Error-rate gain K_e_dot, s.
    pub k_e_dot: Estimate,
}

/// An operator who changes once.
#[derive(Debug, Clone, PartialEq)]
pub struct SigmoidFit {
    nd: usize,
    sample_time: SampleTime,
    first: usize,
    /// With ln G.
    theta: Vec<f64>,
    covariance: Option<Vec<f64>>,
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
    constant: OperatorEstimate,
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
        Ok(Self {
            nd: criterion.nd,
            sample_time: criterion.sample_time,
            first: criterion.first,
            loss: minimum.at.sum_of_squares / criterion.residuals() as f64,
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

    /// All parameters: those of [`SIGMOID_NAMES`], then d1 ... d_nd.
    pub fn parameters(&self) -> Vec<ChangeParameter> {
        let names = names(self.nd).into_iter().enumerate();
        names
            .map(|(i, name)| ChangeParameter {
                name,
                unit: SIGMOID_NAMES.get(i).map_or("", |(_, unit)| unit),
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
        let value = if i == LOG_RATE {
            self.theta[i].exp()
        } else {
            self.theta[i]
        };
        match self.covariance() {
            Some(c) if self.remarks[i].is_none() => estimate(value, c[i * self.theta.len() + i]),
            _ => Estimate::fixed(value),
        }
    }

    /// Covariance of the parameters in the order and the units of [`SigmoidFit::parameters`], by
    /// rows; zero for what was held, `None` for an exact fit.
    pub fn covariance(&self) -> Option<Vec<f64>> {
        let p = self.theta.len();
        let rate = self.theta[LOG_RATE].exp();
        let scale = |i: usize| if i == LOG_RATE { rate } else { 1.0 };
        let c = self.covariance.as_ref()?;
        Some((0..p * p).map(|k| c[k] * scale(k / p) * scale(k % p)).collect())
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
        let covariance = self.covariance.as_ref()?;
        let standard_error = |i: usize| Some(covariance[i * p + i].sqrt()).filter(|s| *s > 0.0);
        let standard_errors = [MIDPOINT, LOG_RATE].map(standard_error);
        for (place, standard_error) in [MIDPOINT, LOG_RATE].into_iter().zip(standard_errors) {
            if self.remarks[place] == Some(Remark::Fixed) {
                continue;
            }
            match profile_likelihood_interval(criterion, minimum, place, standard_error, self.change_point, stay) {
                Profile::Lower(theta) => return Some(theta),
                Profile::Interval(interval) if place == MIDPOINT => self.midpoint_interval = Some(interval),
                Profile::Interval(interval) => self.rate_interval = Some(interval),
            }
        }
        if self.change_point
            && let (Some(interval), Some(covariance)) = (self.midpoint_interval, self.covariance.as_mut())
        {
            // A normal error with the same interval.
            for i in 0..p {
                (covariance[MIDPOINT * p + i], covariance[i * p + MIDPOINT]) = (0.0, 0.0);
            }
            covariance[MIDPOINT * p + MIDPOINT] = ((interval.high - interval.low) / (2.0 * 1.96)).powi(2);
            if self.remarks[MIDPOINT] == Some(Remark::ChangePoint) {
                self.remarks[MIDPOINT] = None;
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

    /// True where the change is too fast for t_M to have an error that is normally distributed: a
    /// change point.
    pub fn is_change_point(&self) -> bool {
        self.change_point
    }

    /// The operator before the change, where there was one ([`SigmoidFit::change_found`]).
    pub fn initial_operator(&self) -> OperatorEstimate {
        operator(&self.theta, self.covariance.as_deref(), 0)
    }

    /// The operator after the change, where there was one.
    pub fn last_operator(&self) -> OperatorEstimate {
        operator(&self.theta, self.covariance.as_deref(), 1)
    }

    /// The operator of the fit without a change.
    pub fn constant_operator(&self) -> OperatorEstimate {
        self.constant
    }

    /// The fit against the one without a change.
    pub fn comparison(&self) -> Comparison {
        self.comparison
    }

    /// True where the change is worth its parameters by the BIC. Otherwise t_M and G mean nothing
    /// ([`Remark::NoChange`]), and [`SigmoidFit::constant_operator`] describes the records.
    pub fn change_found(&self) -> bool {
        self.comparison.bic_difference > 0.0
    }

    /// Gains in force at a time on the axis of the record, with standard errors: those of the
    /// sigmoid where the records show a change, else those of the fit without one.
    ///
    /// The errors are those of the delta method, t_M and G included. Around a change point, where
    /// the sigmoid is no line over the interval of t_M, `step^2 p (1 - p)` stands for the latter,
    /// with p the probability that the change has happened.
    pub fn gains_at(&self, time_s: f64) -> GainsAt {
        if !self.change_found() {
            return GainsAt {
                time_s,
                k_e: self.constant.k_e,
                t_l_s: self.constant.t_l_s,
                k_e_dot: self.constant.k_e_dot,
            };
        }
        let here = Instant::at(&self.theta, time_s);
        let p = self.theta.len();
        let step = |[first, last]: [usize; 2]| self.theta[last] - self.theta[first];
        let along = |value: f64, by_k: f64, by_t: f64| {
            let Some(covariance) = &self.covariance else {
                return Estimate::fixed(value);
            };
            let mut g = vec![0.0; p];
            (g[K_E[0]], g[K_E[1]]) = (by_k * (1.0 - here.share), by_k * here.share);
            (g[T_L[0]], g[T_L[1]]) = (by_t * (1.0 - here.share), by_t * here.share);
            let by_share = by_k * step(K_E) + by_t * step(T_L);
            let mut of_time = 0.0;
            if self.change_point {
                let x = (time_s - self.theta[MIDPOINT]) / covariance[MIDPOINT * p + MIDPOINT].sqrt();
                // The logistic function that is nearest to the normal distribution.
                let happened = 1.0 / (1.0 + (-1.702 * x).exp());
                of_time = by_share * by_share * happened * (1.0 - happened);
            } else {
                (g[MIDPOINT], g[LOG_RATE]) = (by_share * here.by_midpoint, by_share * here.by_log_rate);
            }
            estimate(value, variance_along(&g, covariance) + of_time)
        };
        GainsAt {
            time_s,
            k_e: along(here.k_e, 1.0, 0.0),
            t_l_s: along(here.t_l, 0.0, 1.0),
            k_e_dot: along(here.k_e_dot(), here.t_l, here.k_e),
        }
    }

    /// [`SigmoidFit::gains_at`] at every sample of a record.
    pub fn trace(&self, record: &Record) -> Vec<GainsAt> {
        record.times_s().into_iter().map(|t| self.gains_at(t)).collect()
    }

    /// Coefficients of D.
    pub fn d(&self) -> &[f64] {
        &self.theta[NOISE..]
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

    /// Standard deviation of the innovations before and after the change; `None` where the same
    /// throughout was asked for, or the residuals have no size.
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

    /// The start that won.
    pub fn start(&self) -> &str {
        &self.start
    }

    /// One-step-ahead residuals on a record (not weighted), its initial state estimated.
    ///
    /// # Errors
    /// [`IdentError::MixedSampling`], [`IdentError::TooFewSamples`].
    pub fn residuals(&self, record: &Record) -> Result<Series, IdentError> {
        self.errors_of(&self.theta, self.nd, record)
    }

    /// Output of the operator alone, without noise model; the initial state is that of the least
    /// simulation error.
    ///
    /// # Errors
    /// As [`SigmoidFit::residuals`].
    pub fn simulate(&self, record: &Record) -> Result<Series, IdentError> {
        let errors = self.errors_of(&self.theta[..NOISE], 0, record)?;
        let output = &record.output()[errors.first..];
        Ok(Series {
            first: errors.first,
            values: output.iter().zip(&errors.values).map(|(u, e)| u - e).collect(),
        })
    }

    fn errors_of(&self, theta: &[f64], nd: usize, record: &Record) -> Result<Series, IdentError> {
        if !self.sample_time.matches(record.sample_time()) {
            return Err(IdentError::MixedSampling {
                label: record.label().to_owned(),
                found: record.sample_time().s(),
                expected: self.sample_time.s(),
            });
        }
        let first = self.first - self.nd + nd;
        let orders = Orders {
            nb: 3,
            nd,
            nf: 2,
            nk: self.first - self.nd,
            ..Orders::default()
        };
        check_record(Structure::BoxJenkins, &orders, record, first)?;
        let criterion = ChangeCriterion {
            data: vec![Data {
                e: record.input(),
                u: record.output(),
                start_s: record.time_s(0),
            }],
            sample_time: self.sample_time,
            nd,
            first,
            limits: Vec::new(),
            sample: None,
            changes: true,
            weights: None,
        };
        let values = criterion.residuals_of(theta, 0).ok_or(IdentError::NoFiniteLoss)?;
        Ok(Series { first, values })
    }
}
