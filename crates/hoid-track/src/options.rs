//! What is to be tracked, and how.

use std::{collections::BTreeMap, str::FromStr};

use hoid_core::{predictor::Regressor, recursion::Stable};
use hoid_model::{Orders, Record, SampleTime, Structure};

use crate::methods::LARGEST_ND;
use hoid_ident::{Constraint, Estimator, IdentError, SearchOptions};

/// Order of the noise model of the method adaptive when none is named.
const USUAL_ND: usize = 6;

/// A recursive method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Method {
    /// Recursive least squares: ARX and FIR.
    Rls,
    /// Recursive prediction-error method for every structure.
    Rpem,
    /// Recursive prediction-error method in physical parameters.
    Physical,
    /// Batch fit of the last seconds, again and again.
    Window,
    /// Recursive refined instrumental variable: Box-Jenkins with nc = 0.
    Refined,
    /// A bank of hypotheses of when the person changed, in physical parameters: Box-Jenkins with nc = 0.
    Adaptive,
    /// Recursive least squares for B with the poles of the recursive prediction-error method: Box-Jenkins.
    Fused,
    /// Extended Kalman filter of state and physical parameters: Box-Jenkins with nc = 0.
    Ekf,
    /// Unscented Kalman filter of state and physical parameters: Box-Jenkins with nc = 0.
    Ukf,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 9] = [
        Self::Rls,
        Self::Rpem,
        Self::Physical,
        Self::Window,
        Self::Refined,
        Self::Adaptive,
        Self::Fused,
        Self::Ekf,
        Self::Ukf,
    ];

    /// Name as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rls => "rls",
            Self::Rpem => "rpem",
            Self::Physical => "physical",
            Self::Window => "window",
            Self::Refined => "rriv",
            Self::Adaptive => "adaptive",
            Self::Fused => "fused",
            Self::Ekf => "ekf",
            Self::Ukf => "ukf",
        }
    }

    /// True for a method that estimates physical parameters.
    pub fn is_physical(self) -> bool {
        self == Self::Physical || self.is_model_of_change()
    }

    /// True for a method that has a model of how the person changes, and no memory: physical parameters behind the noise model of a batch fit, which stays.
    pub fn is_model_of_change(self) -> bool {
        matches!(self, Self::Adaptive | Self::Ekf | Self::Ukf)
    }

    /// The operator's orders with the noise model that the method takes when none is named: of order 1, for adaptive of order 6, for its
    /// odds need innovations that are white.
    pub fn usual_orders(self, nk: usize) -> Orders {
        let orders = self.usual_structure().operator_orders(nk);
        match self {
            Self::Adaptive => Orders { nd: USUAL_ND, ..orders },
            _ => orders,
        }
    }

    /// The structure that the method takes when none is named.
    pub fn usual_structure(self) -> Structure {
        match self {
            Self::Rls => Structure::Arx,
            _ => Structure::BoxJenkins,
        }
    }

    /// Memory when none is named: what the parameters in question keep, in seconds.
    ///
    /// RLS: 2.56 s for all, the text's 256 samples at 100 Hz. RPEM and RRIV: 2.56 s for B, 20.48 s for the others. Physical: 5 s for
    /// K_e, 1.5 s for K_e_dot, without end for the others, which a person hardly changes within a run. Fused: 2.56 s for B, without end for the others.
    /// Adaptive, ekf and ukf: none, their memory follows from a model of the change.
    pub fn usual_memory(self, parameter: &str) -> Memory {
        match (self, parameter) {
            (Self::Rls, _) => Memory::Seconds(2.56),
            (Self::Physical, "K_e") => Memory::Seconds(5.0),
            (Self::Physical, "K_e_dot") => Memory::Seconds(1.5),
            (Self::Physical | Self::Adaptive | Self::Ekf | Self::Ukf, _) => Memory::Infinite,
            (_, name) if name.starts_with('b') => Memory::Seconds(2.56),
            (Self::Fused, _) => Memory::Infinite,
            _ => Memory::Seconds(20.48),
        }
    }
}

/// How long an observation counts: the time in which its weight falls to 1/e.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Memory {
    /// N samples: `lambda = 1 - 1/N`.
    Samples(f64),
    /// T seconds: `lambda = 1 - Ts/T`. (`exp(-Ts/T)` agrees to first order.)
    Seconds(f64),
    /// For ever: `lambda = 1`.
    Infinite,
}

impl Memory {
    /// The factor lambda.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] unless the memory is longer than one sample.
    pub fn lambda(self, sample_time: SampleTime) -> Result<f64, IdentError> {
        match self {
            Self::Infinite => Ok(1.0),
            _ => Ok(1.0 - 1.0 / self.length(sample_time)?),
        }
    }

    /// Whole samples of a window as long as the memory.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for a memory without end, or not longer than one sample.
    pub fn samples(self, sample_time: SampleTime) -> Result<usize, IdentError> {
        Ok(self.length(sample_time)?.round() as usize)
    }

    fn length(self, sample_time: SampleTime) -> Result<f64, IdentError> {
        let samples = match self {
            Self::Samples(n) => n,
            Self::Seconds(t) => t / sample_time.s(),
            Self::Infinite => f64::INFINITY,
        };
        // A window of 1e9 samples would not fit in memory.
        if samples > 1.0 && samples <= 1e9 {
            Ok(samples)
        } else {
            Err(IdentError::BadOption {
                option: "the memory".to_owned(),
                found: format!("{samples} samples"),
                expected: "more than one sample and at most 1e9, or inf where nothing is to be forgotten".to_owned(),
            })
        }
    }
}

/// `256` samples, `2.56s`, or `inf`.
impl FromStr for Memory {
    type Err = IdentError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let trimmed = text.trim();
        if ["inf", "infinite"]
            .iter()
            .any(|word| trimmed.eq_ignore_ascii_case(word))
        {
            return Ok(Self::Infinite);
        }
        let number = |part: &str| part.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        let memory = match trimmed.strip_suffix('s') {
            Some(seconds) => number(seconds).filter(|s| *s > 0.0).map(Self::Seconds),
            None => number(trimmed).filter(|n| *n > 1.0).map(Self::Samples),
        };
        memory.ok_or_else(|| IdentError::BadOption {
            option: "the memory".to_owned(),
            found: text.to_owned(),
            expected: "more than 1 sample (256), seconds (2.56s) or inf".to_owned(),
        })
    }
}

/// How the recursion forgets. Memories are those of [`TrackOptions::memory_of`], [`TrackOptions::memory`] and [`Method::usual_memory`].
#[derive(Debug, Clone, PartialEq)]
pub enum ForgettingRule {
    /// A factor for each parameter; with equal memories the scalar factor.
    Exponential,
    /// Random walk: the standard deviation by which each parameter drifts in one second, in its unit. Parameters that are not named do not
    /// drift.
    RandomWalk(BTreeMap<String, f64>),
    /// Sliding rectangular window as long as the shortest memory.
    Window,
    /// Variable factor with the shortest memory while innovations are as expected.
    Variable,
    /// Directional forgetting with the shortest memory.
    Directional,
    /// Normalised gradient with this rate, between 0 and 2.
    Gradient(f64),
}

/// Covariance P at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StartCovariance {
    /// That of the start fit; `1e6 I` where there is none.
    OfFit,
    /// A multiple of the unit matrix, in units of the innovation variance; 0.1 in the text (eq. 38, 5.41, 5.55).
    Multiple(f64),
}

/// Where the recursion starts.
#[derive(Debug, Clone, PartialEq)]
pub enum StartAt {
    /// From a batch fit of this span of the record, s; `None` is the first third.
    Span(Option<(f64, f64)>),
    /// From this theta, in the order of [`Orders::parameter_names`].
    Theta(Vec<f64>),
    /// From nothing: coefficients of zero, or a typical operator for physical parameters.
    Nothing,
}

/// Options of a recursive estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackOptions {
    /// The method.
    pub method: Method,
    /// The structure.
    pub structure: Structure,
    /// The orders.
    pub orders: Orders,
    /// How the recursion forgets. Default: exponentially.
    pub forgetting: ForgettingRule,
    /// Memory of all parameters. Default: [`Method::usual_memory`].
    pub memory: Option<Memory>,
    /// Memory of some parameters, by name or by the letter of their polynomial.
    pub memory_of: BTreeMap<String, Memory>,
    /// Where to start. Default: a batch fit of the first third.
    pub start: StartAt,
    /// P at the start.
    pub covariance: StartCovariance,
    /// Time from which the estimate moves, s; before that only the filters follow. Default: the end of the start span when P is that of its fit,
    /// else the beginning of the record.
    pub update_from_s: Option<f64>,
    /// Gradient, or pseudo-linear regression.
    pub regressor: Regressor,
    /// Polynomials that are kept stable.
    pub stable: Stable,
    /// Bounds of physical parameters, by name.
    pub bounds: BTreeMap<String, Constraint>,
    /// Range of the delay tau_e in s that is tracked: by [`Method::Physical`] as a parameter, by [`Method::Adaptive`] as hypotheses of whole samples. Default:
    /// none, nk is fixed.
    pub track_delay_s: Option<(f64, f64)>,
    /// Channel of the signal from outside the loop that [`Method::Refined`] makes its instruments of. Default: f_t where a record has it,
    /// else the error itself.
    pub instruments: Option<String>,
    /// Length of the window of [`Method::Window`]. Default 20 s.
    pub window: Memory,
    /// Samples between two fits of [`Method::Window`]. Default 25.
    pub every: usize,
    /// Limits of the search of start fits and windows.
    pub search: SearchOptions,
    /// Multiple of the innovation's standard deviation beyond which an innovation moves the estimate no further. Default: 5 for rpem, fused
    /// and physical, 3.5 for adaptive, none (infinite) for rls, as in the text. A window has none, nor have ekf and ukf.
    pub limit: Option<f64>,
    /// Magnitude of e or u beyond which a sample is taken for a fault. Default 1e6.
    pub largest: f64,
    /// Logarithm of the odds from which [`Method::Adaptive`] declares a change. Default 6.
    pub alarm: f64,
    /// The two-sided estimate of a recorded run in place of the causal one, by [`Method::Adaptive`]; a tracker by itself has none. Default: no.
    pub smooth: bool,
}

impl TrackOptions {
    /// The batch fit from which a recursion starts.
    pub fn start_estimator(&self) -> Estimator {
        Estimator {
            search: self.search,
            ..Estimator::new(self.structure, self.orders)
        }
    }

    /// The span of a record that gives the start fit, s; none where there is no such fit.
    pub fn start_span(&self, record: &Record) -> Option<(f64, f64)> {
        let StartAt::Span(span) = self.start else { return None };
        let begin = record.time_s(0);
        let third = begin + record.len() as f64 * record.sample_time().s() / 3.0;
        Some(span.unwrap_or((begin, third)))
    }

    /// Default options of a method, for the orders given.
    pub fn new(method: Method, structure: Structure, orders: Orders) -> Self {
        Self {
            method,
            structure,
            orders,
            forgetting: ForgettingRule::Exponential,
            memory: None,
            memory_of: BTreeMap::new(),
            start: StartAt::Span(None),
            covariance: StartCovariance::OfFit,
            update_from_s: None,
            regressor: Regressor::default(),
            stable: Stable::default(),
            bounds: BTreeMap::new(),
            track_delay_s: None,
            instruments: None,
            window: Memory::Seconds(20.0),
            every: 25,
            search: SearchOptions::default(),
            limit: None,
            largest: 1e6,
            alarm: 6.0,
            smooth: false,
        }
    }

    /// Range of tau_e in s where it is one of the parameters that the recursion moves.
    pub(crate) fn delay_parameter_s(&self) -> Option<(f64, f64)> {
        self.track_delay_s.filter(|_| self.method == Method::Physical)
    }

    /// Names of the parameters that the recursion moves: theta, or the physical ones.
    pub fn parameter_names(&self) -> Vec<String> {
        if !self.method.is_physical() {
            return self.orders.parameter_names();
        }
        let mut names: Vec<String> = PHYSICAL_NAMES[..4].iter().map(|n| (*n).to_owned()).collect();
        if self.delay_parameter_s().is_some() {
            names.push(PHYSICAL_NAMES[4].to_owned());
        }
        names.extend((1..=self.orders.nc).map(|i| format!("c{i}")));
        names.extend((1..=self.orders.nd).map(|i| format!("d{i}")));
        names
    }

    /// Memory of each parameter, in the order of [`TrackOptions::parameter_names`].
    ///
    /// # Errors
    /// [`IdentError::UnknownParameter`] for a memory of a parameter that is not there.
    pub fn memories(&self) -> Result<Vec<Memory>, IdentError> {
        let names = self.parameter_names();
        for name in self.memory_of.keys() {
            if !names.iter().any(|n| is_named(n, name)) {
                return Err(IdentError::UnknownParameter {
                    name: name.clone(),
                    available: names.join(", "),
                });
            }
        }
        let of = |name: &String| {
            let by_letter = self
                .memory_of
                .iter()
                .find(|(key, _)| is_named(name, key))
                .map(|(_, m)| *m);
            let given = self.memory_of.get(name).copied().or(by_letter).or(self.memory);
            given.unwrap_or_else(|| self.method.usual_memory(name))
        };
        Ok(names.iter().map(of).collect())
    }

    /// The limit of innovations in use, in standard deviations.
    pub fn limit_in_use(&self) -> f64 {
        match (self.method, &self.forgetting) {
            (_, ForgettingRule::Window) => f64::INFINITY,
            (Method::Rpem | Method::Fused | Method::Physical, _) => self.limit.unwrap_or(5.0),
            (Method::Adaptive, _) => self.limit.unwrap_or(3.5),
            _ => self.limit.unwrap_or(f64::INFINITY),
        }
    }

    /// Checks method, structure, orders and options against each other.
    ///
    /// # Errors
    /// [`IdentError`] with what is wrong.
    pub fn check(&self) -> Result<(), IdentError> {
        self.orders.check(self.structure)?;
        self.memories()?;
        let bad = |option: &str, found: String, expected: &str| {
            Err(IdentError::BadOption {
                option: option.to_owned(),
                found,
                expected: expected.to_owned(),
            })
        };
        let o = &self.orders;
        match self.method {
            Method::Rls if !(o.nc == 0 && o.nd == 0 && o.nf == 0) => bad(
                "the structure of rls",
                format!("{} with {o}", self.structure),
                "arx or fir; take rpem for structures with C, D or F",
            ),
            m if m.is_physical() && !(o.na == 0 && o.nb == 2 && o.nf == 2) => bad(
                &format!("the orders of {}", self.method.name()),
                format!("{} with {o}", self.structure),
                "bj with nb = 2 and nf = 2, the operator; nc and nd are free",
            ),
            m if m.is_physical() && o.nk == 0 => bad(
                "the delay",
                "nk = 0".to_owned(),
                "nk of 1 or more: the hold alone delays by one sample",
            ),
            Method::Fused if !(o.na == 0 && o.nb == 2 && o.nf == 2) => bad(
                "the orders of fused",
                format!("{} with {o}", self.structure),
                "bj with nb = 2 and nf = 2, the operator; nc and nd are free",
            ),
            Method::Refined if !(o.na == 0 && o.nc == 0) => bad(
                "the structure of rriv",
                format!("{} with {o}", self.structure),
                "bj with nc = 0, or oe",
            ),
            m if self.forgetting != ForgettingRule::Exponential
                && (m.is_model_of_change() || matches!(m, Method::Window | Method::Refined | Method::Fused)) =>
            {
                bad(
                    "the way of forgetting",
                    format!("{:?} with {}", self.forgetting, m.name()),
                    "none for window, adaptive, ekf and ukf, which have their own, and exponential forgetting for rriv and fused",
                )
            }
            Method::Rls | Method::Window | Method::Refined | Method::Fused
                if self.regressor == Regressor::PseudoLinear =>
            {
                bad(
                    "the regressor",
                    format!("pseudo-linear with {}", self.method.name()),
                    "rpem, whose gradient it replaces",
                )
            }
            m if m.is_model_of_change() && !(o.nc == 0 && o.nd <= LARGEST_ND) => bad(
                &format!("the noise model of {}", m.name()),
                format!("nc={},nd={}", o.nc, o.nd),
                "nc = 0 and nd of at most 8",
            ),
            m if m.is_model_of_change() && (self.memory.is_some() || !self.memory_of.is_empty()) => bad(
                "the memory",
                format!("with {}", m.name()),
                "none: it follows from a model of how a person changes; take physical to set memories",
            ),
            m if m.is_model_of_change()
                && (self.covariance != StartCovariance::OfFit || !matches!(self.start, StartAt::Span(_))) =>
            {
                bad(
                    &format!("the start of {}", m.name()),
                    "no batch fit, or a covariance of its own".to_owned(),
                    "the batch fit of a span, whose noise model and covariance it needs",
                )
            }
            m if m.is_physical() && self.regressor == Regressor::PseudoLinear => bad(
                "the regressor",
                format!("pseudo-linear with {}", self.method.name()),
                "rpem, whose gradient it replaces",
            ),
            m if self.smooth && m != Method::Adaptive => bad(
                "the two-sided estimate",
                format!("with {}", m.name()),
                "adaptive, whose hypotheses are run from both ends",
            ),
            m if self.track_delay_s.is_some() && !matches!(m, Method::Physical | Method::Adaptive) => bad(
                "the range of the delay",
                format!("with {}", m.name()),
                "physical or adaptive, the methods that follow tau_e",
            ),
            _ if self
                .track_delay_s
                .is_some_and(|(low, high)| !(0.0 <= low && low <= high && high.is_finite())) =>
            {
                bad(
                    "the range of the delay",
                    format!("{:?} s", self.track_delay_s.unwrap_or_default()),
                    "two finite times, the shorter first",
                )
            }
            _ if self.track_delay_s.is_some() && self.smooth => bad(
                "the range of the delay",
                "with the two-sided estimate".to_owned(),
                "a delay that is given or searched on the start span: past and future are joined for one delay",
            ),
            _ => Ok(()),
        }?;
        if let ForgettingRule::Gradient(rate) = self.forgetting
            && !(rate > 0.0 && rate < 2.0)
        {
            return bad("the rate of the gradient", rate.to_string(), "a number between 0 and 2");
        }
        if let StartCovariance::Multiple(p) = self.covariance
            && !(p > 0.0 && p.is_finite())
        {
            return bad("the start covariance", p.to_string(), "a positive number, such as 0.1");
        }
        if self.every == 0 {
            return bad("the samples between two fits", "0".to_owned(), "1 or more");
        }
        if let Some(limit) = self.limit
            && (limit.is_nan() || limit <= 0.0)
        {
            return bad(
                "the limit of innovations",
                limit.to_string(),
                "a positive multiple of sigma, or inf",
            );
        }
        if self.alarm.is_nan() {
            return bad("the alarm", "NaN".to_owned(), "a logarithm of odds, such as 6");
        }
        if self.largest.is_nan() || self.largest <= 0.0 {
            return bad("the largest magnitude", self.largest.to_string(), "a positive number");
        }
        Ok(())
    }
}

/// Names of the operator's parameters in a physical recursion.
pub(crate) const PHYSICAL_NAMES: [&str; 5] = ["K_e", "K_e_dot", "omega_nm", "zeta_nm", "tau_e"];

/// True when `key` is the name, or the letter of its polynomial.
fn is_named(name: &str, key: &str) -> bool {
    name == key || (key.len() == 1 && name.starts_with(key) && name[1..].bytes().all(|b| b.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn memories_as_written() {
        assert_eq!("256".parse::<Memory>().unwrap(), Memory::Samples(256.0));
        assert_eq!("2.56s".parse::<Memory>().unwrap(), Memory::Seconds(2.56));
        assert_eq!("Inf".parse::<Memory>().unwrap(), Memory::Infinite);
        for bad in ["", "0", "1", "-5", "nan", "0s", "s", "-infs", "2m"] {
            assert!(bad.parse::<Memory>().is_err(), "{bad}");
        }
    }
}
