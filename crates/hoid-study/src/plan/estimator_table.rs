//! The table `[[estimators]]` as it stands in a plan: keys, defaults, what belongs to which method.

use std::collections::BTreeMap;

use hoid_ident::{Estimator, GreyBox, IdentError, InitialState, SearchOptions};
use hoid_model::{Detrend, Orders, Structure};
use hoid_track::{ForgettingRule, Memory, Method, Stable, StartAt, StartCovariance, TrackOptions};
use schemars::JsonSchema;
use serde::Deserialize;

use super::PlanProblem;

/// Keys that want a list or a table as it stands.
pub const WHOLE: [&str; 5] = ["scenarios", "span_s", "start_span_s", "delay_range_s", "track_delay_s"];

/// A whole number, or `"true"` for that of the scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "an order is a whole number from 0 on, \"true\" (nk, nd) or \"ramp\" (nk)"
)]
pub(crate) enum Order {
    /// This one.
    Number(usize),
    /// That of the scenario.
    Scenario(OfScenario),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum OfScenario {
    /// nk of the delay and sample time; nd of the order of the remnant.
    True,
    /// nk for an input that is a ramp between two samples, one less: a decimated signal is not held.
    Ramp,
}

/// Orders; those left out are those of the operator's structure.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct OrdersTable {
    pub na: Option<usize>,
    pub nb: Option<usize>,
    pub nc: Option<usize>,
    /// Order of D, or "true" for the order of the simulated remnant.
    pub nd: Option<Order>,
    pub nf: Option<usize>,
    /// Delay in samples, or "true" for that of the simulated operator (its default), or "ramp" for one less.
    pub nk: Option<Order>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum TaskKey {
    Fit,
    GreyBox,
    Rls,
    Rpem,
    Physical,
    Window,
    Rriv,
    Adaptive,
    Fused,
    Ekf,
    Ukf,
    Record,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum StructureKey {
    Fir,
    Ar,
    Ma,
    Arx,
    Arma,
    Armax,
    Ararx,
    Ararmax,
    Oe,
    Bj,
    General,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum InitialKey {
    Auto,
    Zero,
    Estimate,
    Backcast,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum DetrendKey {
    None,
    Mean,
    Linear,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ForgettingKey {
    Exponential,
    Window,
    Variable,
    Directional,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum StableKey {
    Predictor,
    PredictorAndNoise,
}

/// Samples as a number, or text: "256", "2.56s", "inf".
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a memory is a number of samples, or a text such as \"2.56s\" or \"inf\""
)]
pub(super) enum MemoryValue {
    Samples(f64),
    Text(String),
}

impl MemoryValue {
    fn memory(&self) -> Result<Memory, IdentError> {
        match self {
            Self::Samples(n) if *n == f64::INFINITY => Ok(Memory::Infinite),
            Self::Samples(n) => n.to_string().parse(),
            Self::Text(text) => text.parse(),
        }
    }
}

/// What is estimated from each record, and how. Each value may be a list, which makes it an axis of the grid.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct EstimatorTable {
    /// Name in the results.
    pub(super) name: String,
    /// Names of the scenarios that it takes. Default: all.
    pub(super) scenarios: Option<Vec<String>>,
    /// What is done.
    pub(super) method: TaskKey,
    /// Name of an estimator above, from whose VAF with the same nk on the same run that of this one is counted: delta_vaf.
    pub(super) versus: Option<String>,
    /// Structure of the polynomial model. Default: arx for rls, else bj.
    pub(super) structure: Option<StructureKey>,
    /// Orders.
    #[serde(default)]
    pub(super) orders: OrdersTable,
    /// Span of the record, s. Default: all of it.
    pub(super) span_s: Option<(f64, f64)>,
    /// Takes every so manieth sample of e and u, without a filter. Default 1.
    pub(super) decimate: Option<usize>,
    /// What is taken out of e and u before. Default: none.
    pub(super) detrend: Option<DetrendKey>,
    /// Initial states of a fit. Default: auto.
    pub(super) initial_state: Option<InitialKey>,
    /// Start of a search or a recursion: coefficients by name, those left out are zero; `name` labels it.
    pub(super) start: Option<BTreeMap<String, StartValue>>,
    /// Own starts from which a search runs to its end. Default 2.
    pub(super) starts: Option<usize>,
    /// Most iterations of a search. Default 100.
    pub(super) max_iterations: Option<usize>,
    /// Range of the delay of the grey box, s. Default 0.05 to 0.6.
    pub(super) delay_range_s: Option<(f64, f64)>,
    /// Memory of all parameters of a recursion, samples, or as "2.56s" or "inf".
    pub(super) memory: Option<MemoryValue>,
    /// Memory of single parameters, or of all of one letter; `name` labels it.
    pub(super) memory_of: Option<BTreeMap<String, MemoryValue>>,
    /// Factor of forgetting instead of a memory.
    pub(super) lambda: Option<f64>,
    /// How a recursion forgets. Default: exponential.
    pub(super) forgetting: Option<ForgettingKey>,
    /// P at the start, a multiple of the unit matrix in units of the innovation variance. Default: that of the start fit.
    pub(super) covariance: Option<f64>,
    /// Span of the start fit of a recursion, s. Default: the first third.
    pub(super) start_span_s: Option<(f64, f64)>,
    /// Time from which a recursion moves its estimate, s.
    pub(super) update_from_s: Option<f64>,
    /// Standard deviations beyond which an innovation moves an estimate no further; inf for none.
    pub(super) limit: Option<f64>,
    /// Polynomials that a recursion keeps stable. Default: predictor.
    pub(super) stable: Option<StableKey>,
    /// Length of the window of the window method. Default "20s".
    pub(super) window: Option<MemoryValue>,
    /// Samples between two fits of the window method. Default 25.
    pub(super) refit: Option<usize>,
    /// Two-sided estimates in place of causal ones, for adaptive. Default: no.
    pub(super) smooth: Option<bool>,
    /// Range of the delay that the physical recursion tracks, s.
    pub(super) track_delay_s: Option<(f64, f64)>,
}

#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a start has a number for each coefficient, and may have a name"
)]
pub(super) enum StartValue {
    Number(f64),
    Name(String),
}

impl EstimatorTable {
    /// Refuses keys that the method does not look at: a setting without effect would be believed.
    pub(super) fn check_placement(
        &self,
        method: Option<Method>,
        at: &impl Fn(&str, String) -> PlanProblem,
    ) -> Result<(), PlanProblem> {
        let fits = self.method == TaskKey::Fit;
        let tracks = method.is_some();
        let windowed = method == Some(Method::Window);
        let recursive = tracks && !windowed;
        let given = [
            (
                "structure",
                self.structure.is_some(),
                fits || tracks,
                "fit and the recursive methods",
            ),
            (
                "initial_state",
                self.initial_state.is_some(),
                fits || self.method == TaskKey::GreyBox,
                "fit and grey-box",
            ),
            (
                "start",
                self.start.is_some(),
                fits || recursive,
                "fit and the recursive methods",
            ),
            (
                "starts",
                self.starts.is_some(),
                fits || self.method == TaskKey::GreyBox,
                "fit and grey-box",
            ),
            (
                "max_iterations",
                self.max_iterations.is_some(),
                self.method != TaskKey::Record,
                "methods that search",
            ),
            (
                "versus",
                self.versus.is_some(),
                fits || self.method == TaskKey::GreyBox,
                "fit and grey-box",
            ),
            (
                "delay_range_s",
                self.delay_range_s.is_some(),
                self.method == TaskKey::GreyBox,
                "grey-box",
            ),
            ("memory", self.memory.is_some(), recursive, "the recursive methods"),
            (
                "memory_of",
                self.memory_of.is_some(),
                recursive,
                "the recursive methods",
            ),
            ("lambda", self.lambda.is_some(), recursive, "the recursive methods"),
            (
                "forgetting",
                self.forgetting.is_some(),
                recursive,
                "the recursive methods",
            ),
            (
                "covariance",
                self.covariance.is_some(),
                recursive,
                "the recursive methods",
            ),
            (
                "start_span_s",
                self.start_span_s.is_some(),
                tracks,
                "the recursive methods",
            ),
            (
                "update_from_s",
                self.update_from_s.is_some(),
                recursive,
                "the recursive methods",
            ),
            ("limit", self.limit.is_some(), recursive, "the recursive methods"),
            ("stable", self.stable.is_some(), recursive, "the recursive methods"),
            ("window", self.window.is_some(), windowed, "window"),
            ("refit", self.refit.is_some(), windowed, "window"),
            (
                "smooth",
                self.smooth.is_some(),
                method == Some(Method::Adaptive),
                "adaptive",
            ),
            (
                "track_delay_s",
                self.track_delay_s.is_some(),
                matches!(method, Some(Method::Physical | Method::Adaptive)),
                "physical and adaptive",
            ),
        ];
        for (key, is_given, has_effect, of) in given {
            if is_given && !has_effect {
                return Err(at(key, format!("has no effect here: it belongs to {of}")));
            }
        }
        if self.memory.is_some() && self.lambda.is_some() {
            return Err(at(
                "lambda",
                "and memory are both given: leave one of them out".to_owned(),
            ));
        }
        if self.start.is_some() && self.start_span_s.is_some() {
            return Err(at(
                "start_span_s",
                "and start are both given: leave one of them out".to_owned(),
            ));
        }
        Ok(())
    }

    fn search(&self) -> SearchOptions {
        let usual = SearchOptions::default();
        SearchOptions {
            max_iterations: self.max_iterations.unwrap_or(usual.max_iterations),
            ..usual
        }
    }

    fn initial_state(&self) -> Option<InitialState> {
        match self.initial_state {
            None | Some(InitialKey::Auto) => None,
            Some(InitialKey::Zero) => Some(InitialState::Zero),
            Some(InitialKey::Estimate) => Some(InitialState::Estimate),
            Some(InitialKey::Backcast) => Some(InitialState::Backcast),
        }
    }

    pub(super) fn fit(&self, structure: Structure) -> Estimator {
        let usual = Estimator::new(structure, Orders::default());
        Estimator {
            initial_state: self.initial_state(),
            search: self.search(),
            starts: self.starts.unwrap_or(usual.starts),
            ..usual
        }
    }

    pub(super) fn grey_box(&self, at: &impl Fn(&str, String) -> PlanProblem) -> Result<GreyBox, PlanProblem> {
        let usual = GreyBox::new(1..=1);
        let range = self.delay_range_s.unwrap_or(usual.delay_range_s);
        if !(range.0 > 0.0 && range.0 < range.1 && range.1.is_finite()) {
            return Err(at(
                "delay_range_s",
                format!("is {range:?}, expected two positive times, the smaller first"),
            ));
        }
        Ok(GreyBox {
            delay_range_s: range,
            initial_state: self.initial_state().unwrap_or(usual.initial_state),
            search: self.search(),
            starts: self.starts.unwrap_or(usual.starts),
            ..usual
        })
    }

    pub(super) fn track(
        &self,
        method: Method,
        structure: Structure,
        at: &impl Fn(&str, String) -> PlanProblem,
    ) -> Result<TrackOptions, PlanProblem> {
        let memory = |key: &str, value: &Option<MemoryValue>| match value {
            None => Ok(None),
            Some(value) => value
                .memory()
                .map(Some)
                .map_err(|error| at(key, format!("is wrong: {error}"))),
        };
        let lambda = match self.lambda {
            None => None,
            Some(1.0) => Some(Memory::Infinite),
            Some(l) if l > 0.0 && l < 1.0 => Some(Memory::Samples(1.0 / (1.0 - l))),
            Some(l) => return Err(at("lambda", format!("is {l}, expected a number above 0 and up to 1"))),
        };
        let mut memory_of = BTreeMap::new();
        for (name, value) in self.memory_of.iter().flatten() {
            if name == "name" {
                continue;
            }
            let value = value
                .memory()
                .map_err(|error| at("memory_of", format!("of {name} is wrong: {error}")))?;
            memory_of.insert(name.clone(), value);
        }
        let covariance = match self.covariance {
            None => StartCovariance::OfFit,
            Some(p) if p > 0.0 && p.is_finite() => StartCovariance::Multiple(p),
            Some(p) => return Err(at("covariance", format!("is {p}, expected a positive finite number"))),
        };
        let usual = TrackOptions::new(method, structure, Orders::default());
        Ok(TrackOptions {
            memory: memory("memory", &self.memory)?.or(lambda),
            memory_of,
            forgetting: match self.forgetting {
                None | Some(ForgettingKey::Exponential) => ForgettingRule::Exponential,
                Some(ForgettingKey::Window) => ForgettingRule::Window,
                Some(ForgettingKey::Variable) => ForgettingRule::Variable,
                Some(ForgettingKey::Directional) => ForgettingRule::Directional,
            },
            start: StartAt::Span(self.start_span_s),
            covariance,
            update_from_s: self.update_from_s,
            limit: self.limit,
            stable: match self.stable {
                None | Some(StableKey::Predictor) => Stable::Predictor,
                Some(StableKey::PredictorAndNoise) => Stable::PredictorAndNoise,
            },
            track_delay_s: self.track_delay_s,
            smooth: self.smooth.unwrap_or(false),
            window: memory("window", &self.window)?.unwrap_or(usual.window),
            every: self.refit.unwrap_or(usual.every),
            search: self.search(),
            ..usual
        })
    }
}

impl TaskKey {
    pub(super) fn recursion(self) -> Option<Method> {
        match self {
            Self::Fit | Self::GreyBox | Self::Record => None,
            Self::Rls => Some(Method::Rls),
            Self::Rpem => Some(Method::Rpem),
            Self::Physical => Some(Method::Physical),
            Self::Window => Some(Method::Window),
            Self::Rriv => Some(Method::Refined),
            Self::Adaptive => Some(Method::Adaptive),
            Self::Fused => Some(Method::Fused),
            Self::Ekf => Some(Method::Ekf),
            Self::Ukf => Some(Method::Ukf),
        }
    }
}

impl From<StructureKey> for Structure {
    fn from(key: StructureKey) -> Self {
        match key {
            StructureKey::Fir => Self::Fir,
            StructureKey::Ar => Self::Ar,
            StructureKey::Ma => Self::Ma,
            StructureKey::Arx => Self::Arx,
            StructureKey::Arma => Self::Arma,
            StructureKey::Armax => Self::Armax,
            StructureKey::Ararx => Self::Ararx,
            StructureKey::Ararmax => Self::Ararmax,
            StructureKey::Oe => Self::OutputError,
            StructureKey::Bj => Self::BoxJenkins,
            StructureKey::General => Self::General,
        }
    }
}

impl From<DetrendKey> for Detrend {
    fn from(key: DetrendKey) -> Self {
        match key {
            DetrendKey::None => Self::None,
            DetrendKey::Mean => Self::Mean,
            DetrendKey::Linear => Self::Linear,
        }
    }
}
