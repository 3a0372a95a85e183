//! The table `[[estimators]]` as written in a plan: keys, defaults, and the keys of each method.

use std::collections::BTreeMap;

use hoid_analysis::{AnalysisError, ResolvedRequest, registry::estimator_setting};
use hoid_ident::{
    Estimator, GreyBox, IdentError, InitialState, NamedOrders, SearchOptions,
    settings::{Kind, MethodSpec, Setting},
};
use hoid_model::{Detrend, NamedChoice, Orders, Structure};
use hoid_track::{Method, StartSource, TrackOptions};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, de::Error as _};

use super::{analysis, problem::PlanProblem};

/// Returns the keys whose value is itself a list or a table, for which a list is not an axis.
pub fn non_axis_keys() -> Vec<String> {
    let fixed = ["scenarios", "span_s", "start_span_s", "delay_s", "delay_range_s"].map(str::to_owned);
    let settings = methods().into_iter().flat_map(|spec| spec.settings);
    let spans = settings
        .filter(|setting| setting.kind == Kind::Span)
        .map(|setting| plan_key(&setting));
    fixed.into_iter().chain(spans).collect()
}

/// Returns the recursive methods, and the estimators that run as in `hoid identify`, with their options.
pub(super) fn methods() -> Vec<MethodSpec> {
    [hoid_survey::registry(), analysis::methods()].concat()
}

/// A whole number, or `"true"` for the value that corresponds to the scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "an order is a whole number of 0 or more, \"true\" (nk, nd), \"ramp\" (nk) or a range such as \"0..8\" \
                 (nc, nd of operator)"
)]
pub(crate) enum Order {
    /// The number itself.
    Number(usize),
    /// A value derived from the scenario.
    Scenario(OfScenario),
    /// A number selected from the range LO..HI.
    Range(#[schemars(with = "String")] OrderRange),
}

/// First and last order of a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct OrderRange(usize, usize);

impl TryFrom<String> for OrderRange {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        let number = |part: &str| part.trim().parse::<usize>().ok();
        let ends = text.split_once("..").and_then(|(a, b)| Some((number(a)?, number(b)?)));
        match ends {
            Some((low, high)) if low <= high => Ok(Self(low, high)),
            _ => Err("expected a range such as 0..8"),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum OfScenario {
    /// nk from the delay and the sample time of the scenario; nd from the order of the remnant.
    True,
    /// nk one less than for "true", for an input that is linear between samples (a decimated signal is not held).
    Ramp,
}

/// Orders of a model. Default: those of the operator's structure.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct OrdersTable {
    pub na: Option<usize>,
    pub nb: Option<usize>,
    /// Order of C; for operator also a range, such as 0..8.
    pub nc: Option<Order>,
    /// Order of D, or "true" for the order of the simulated remnant; for operator also a range, such as 0..8.
    pub nd: Option<Order>,
    pub nf: Option<usize>,
    /// Delay in samples, or "true" for the delay of the simulated operator (the default), or "ramp" for one sample
    /// less.
    pub nk: Option<Order>,
}

impl OrdersTable {
    /// True if at least one order is a range.
    fn has_range(&self) -> bool {
        [self.nc, self.nd, self.nk]
            .into_iter()
            .flatten()
            .any(|order| matches!(order, Order::Range(_)))
    }

    /// Returns all given orders, for an estimator that has orders only of its noise model.
    pub(super) fn noise_orders(&self, remnant_order: usize) -> NamedOrders {
        let numbers = [("na", self.na), ("nb", self.nb), ("nf", self.nf)];
        let numbers = numbers.map(|(name, n)| (name, n.map(Order::Number)));
        let all = numbers
            .into_iter()
            .chain([("nc", self.nc), ("nd", self.nd), ("nk", self.nk)]);
        let range = |name: &str, order: Order| match order {
            Order::Number(n) => n..=n,
            Order::Range(OrderRange(low, high)) => low..=high,
            Order::Scenario(_) if name == "nd" => remnant_order..=remnant_order,
            Order::Scenario(_) => 0..=0,
        };
        all.filter_map(|(name, order)| Some((name.to_owned(), range(name, order?))))
            .collect()
    }
}

/// How the estimated gains change within the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum Change {
    None,
    Sigmoid,
}

/// Table of an estimator, which is applied to each record. Any value may be a list, which makes it an axis of the grid.
#[derive(Debug, Deserialize, JsonSchema)]
pub(crate) struct EstimatorTable {
    /// Name of the estimator in the results.
    pub(super) name: String,
    /// Names of the scenarios to which the estimator is applied. Default: all.
    pub(super) scenarios: Option<Vec<String>>,
    /// Method applied to each record.
    #[schemars(extend("enum" = method_names()))]
    pub(super) method: String,
    /// Name of an estimator earlier in the plan; delta_vaf is the VAF of this estimator minus the VAF of that estimator
    /// on the same run with the same nk.
    pub(super) versus: Option<String>,
    /// Structure of the polynomial model. Default: arx for rls, otherwise bj.
    #[schemars(extend("enum" = structure_names()))]
    pub(super) structure: Option<String>,
    /// Orders of the model.
    #[serde(default)]
    pub(super) orders: OrdersTable,
    /// Span of the record that is used, s. Default: the whole record.
    pub(super) span_s: Option<(f64, f64)>,
    /// Every N-th sample of e and u is used, without a filter. Default 1.
    pub(super) decimate: Option<usize>,
    /// Trend removed from e and u before the estimate. Default: none.
    #[serde(default, deserialize_with = "choice")]
    #[schemars(with = "Option<String>", extend("enum" = names::<Detrend>(&[])))]
    pub(super) detrend: Option<Detrend>,
    /// Initial states of a fit. Default: auto.
    #[serde(default, deserialize_with = "choice_or_auto")]
    #[schemars(with = "Option<String>", extend("enum" = names::<InitialState>(&["auto"])))]
    pub(super) initial_state: Option<InitialState>,
    /// Start of a search or a recursion: coefficients by name; coefficients that are not given are zero. `name` is a
    /// label for the start.
    pub(super) start: Option<BTreeMap<String, StartValue>>,
    /// Number of automatic starts from which the search is completed. Default 2.
    pub(super) starts: Option<usize>,
    /// Largest number of iterations of a search. Default 100.
    pub(super) max_iterations: Option<usize>,
    /// Shortest and longest delay tau_e of an operator, s. Default: 0.02 to 0.8 for operator, otherwise 0.05 to 0.6.
    #[serde(alias = "delay_range_s")]
    pub(super) delay_s: Option<(f64, f64)>,
    /// Change of the operator's gains: none or sigmoid. Default: none.
    pub(super) change: Option<Change>,
    /// Span of the start fit of a recursion, s. Default: the first third.
    pub(super) start_span_s: Option<(f64, f64)>,
    /// Time after which a recursion updates its estimate, s.
    pub(super) update_from_s: Option<f64>,
    /// Options of the method, as in the registries of recursive methods and of estimators.
    #[serde(flatten)]
    #[schemars(skip)]
    pub(super) settings: BTreeMap<String, toml::Value>,
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
    /// Rejects keys that the method does not use, since a setting without effect would mislead the user.
    pub(super) fn check_placement(
        &self,
        method: Option<&Method>,
        asked: Option<&ResolvedRequest>,
        at: &impl Fn(&str, String) -> PlanProblem,
    ) -> Result<(), PlanProblem> {
        let (fits, grey_box) = (self.method == FIT_METHOD, self.method == GREY_BOX_METHOD);
        let operator = asked.is_some_and(|asked| asked.structure().is_none());
        let tracks = method.is_some();
        // A method that repeats a batch fit has no start coefficients and no time of the first update.
        let moves = method.is_some_and(|method| !method.refits_stored_samples());
        let both = "fit and grey-box";
        let recursive = "the recursive methods";
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
                fits || grey_box || operator,
                "fit, grey-box and operator",
            ),
            (
                "start",
                self.start.is_some(),
                fits || moves,
                "fit and the recursive methods",
            ),
            ("starts", self.starts.is_some(), fits || grey_box, both),
            (
                "max_iterations",
                self.max_iterations.is_some(),
                self.method != RECORD_METHOD,
                "methods that search",
            ),
            ("versus", self.versus.is_some(), fits || grey_box, both),
            (
                "delay_s",
                self.delay_s.is_some(),
                grey_box || operator,
                "grey-box and operator",
            ),
            ("change", self.change.is_some(), operator, "operator"),
            ("start_span_s", self.start_span_s.is_some(), tracks, recursive),
            ("update_from_s", self.update_from_s.is_some(), moves, recursive),
        ];
        for (key, is_given, has_effect, of) in given {
            if is_given && !has_effect {
                return Err(at(key, format!("has no effect here: it applies to {of}")));
            }
        }
        if self.orders.has_range() && !operator {
            return Err(at(
                "orders",
                "has a range, which only operator accepts: give single numbers".to_owned(),
            ));
        }
        if self.settings.contains_key("memory") && self.settings.contains_key("lambda") {
            return Err(at(
                "lambda",
                "and memory are both given: leave one of them out".to_owned(),
            ));
        }
        if let (None, None, Some(key)) = (method, asked, self.settings.keys().next()) {
            return Err(at(key, unknown_key_problem(key)));
        }
        if self.method == analysis::TIME_VARYING_METHOD && self.change == Some(Change::None) {
            return Err(at(
                "change",
                "is none, but method time-varying means operator with change = \"sigmoid\": leave one of them out"
                    .to_owned(),
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
        let default = SearchOptions::default();
        SearchOptions {
            max_iterations: self.max_iterations.unwrap_or(default.max_iterations),
            ..default
        }
    }

    pub(super) fn fit(&self, structure: Structure) -> Estimator {
        let default = Estimator::new(structure, Orders::default());
        Estimator {
            initial_state: self.initial_state,
            search: self.search(),
            starts: self.starts.unwrap_or(default.starts),
            ..default
        }
    }

    pub(super) fn grey_box(&self, at: &impl Fn(&str, String) -> PlanProblem) -> Result<GreyBox, PlanProblem> {
        let default = GreyBox::new(1..=1);
        let range = self.delay_s.unwrap_or(default.delay_range_s);
        if !(range.0 > 0.0 && range.0 < range.1 && range.1.is_finite()) {
            return Err(at(
                "delay_s",
                format!("is {range:?}, expected two positive times, the smaller first"),
            ));
        }
        Ok(GreyBox {
            delay_range_s: range,
            initial_state: self.initial_state.unwrap_or(default.initial_state),
            search: self.search(),
            starts: self.starts.unwrap_or(default.starts),
            ..default
        })
    }

    /// Returns the request of an estimator that runs as in `hoid identify`, with the options of the table except its
    /// orders; `None` for any other method.
    pub(super) fn identify_request(
        &self,
        at: &impl Fn(&str, String) -> PlanProblem,
    ) -> Result<Option<ResolvedRequest>, PlanProblem> {
        let changes = self.change == Some(Change::Sigmoid);
        let Some(mut asked) = analysis::request_for_method(&self.method, changes) else {
            return Ok(None);
        };
        self.check_placement(None, Some(&asked), at)?;
        let settings = analysis::methods()
            .into_iter()
            .find(|spec| spec.name == analysis::name(&asked));
        let mut left = self.settings.clone();
        let mut given: Vec<(Setting, String, String)> = Vec::new();
        for setting in settings.into_iter().flat_map(|spec| spec.settings) {
            let key = plan_key(&setting);
            if let Some(value) = left.remove(&key) {
                let text = value_text(&value, setting.kind).map_err(|reason| at(&key, reason))?;
                given.push((setting, key, text));
            }
        }
        if let Some(key) = left.keys().next() {
            return Err(at(key, unknown_key_problem(key)));
        }
        for (name, key, text) in [
            (
                "delay",
                "delay_s",
                self.delay_s.map(|(low, high)| format!("{low}..{high}")),
            ),
            (
                "initial_state",
                "initial_state",
                self.initial_state.map(|rule| rule.name().to_owned()),
            ),
            (
                "max_iterations",
                "max_iterations",
                self.max_iterations.map(|n| n.to_string()),
            ),
        ] {
            let setting = estimator_setting(name).zip(text);
            given.extend(setting.map(|(setting, text)| (setting, key.to_owned(), text)));
        }
        for (setting, key, text) in given {
            let set = asked.set(setting.name, &text);
            let known = set.map_err(|error| match error {
                AnalysisError::Ident(error) => at(&key, problem_text(&error)),
                AnalysisError::Option { reason, .. } => at(&key, format!("is invalid: {reason}")),
                other => at(&key, format!("is invalid: {other}")),
            })?;
            if !known {
                return Err(at(&key, unknown_key_problem(&key)));
            }
        }
        Ok(Some(asked))
    }

    /// Returns a recursive method with the options of the table.
    pub(super) fn track(
        &self,
        mut method: Method,
        structure: Structure,
        at: &impl Fn(&str, String) -> PlanProblem,
    ) -> Result<TrackOptions, PlanProblem> {
        // Options are set in the order of the registry, in which the forgetting rule precedes its own options.
        let known = hoid_survey::registry().into_iter().flat_map(|spec| spec.settings);
        let mut left: BTreeMap<&str, &toml::Value> = self.settings.iter().map(|(k, v)| (k.as_str(), v)).collect();
        for setting in known {
            let key = plan_key(&setting);
            let Some(value) = left.remove(key.as_str()) else {
                continue;
            };
            let text = value_text(value, setting.kind).map_err(|reason| at(&key, reason))?;
            if !method.settings().list().iter().any(|own| own.name == setting.name) {
                let of = methods_with(&key).join(", ");
                return Err(at(&key, format!("has no effect here: it applies to {of}")));
            }
            method
                .set(setting.name, &text)
                .map_err(|error| at(&key, problem_text(&error)))?;
        }
        if let Some(key) = left.keys().next() {
            return Err(at(key, unknown_key(&method)));
        }
        Ok(TrackOptions {
            start: StartSource::Span(self.start_span_s),
            update_from_s: self.update_from_s,
            search: self.search(),
            ..TrackOptions::new(method, structure, Orders::default())
        })
    }
}

/// Values of `method` in addition to the names of the recursive methods.
pub(super) const FIT_METHOD: &str = "fit";
pub(super) const GREY_BOX_METHOD: &str = "grey-box";
pub(super) const RECORD_METHOD: &str = "record";

/// Returns all values of `method`; the default of `hoid identify` is first.
pub(super) fn method_names() -> Vec<&'static str> {
    let analysed = analysis::methods().into_iter().map(|spec| spec.name);
    let (first, others): (Vec<_>, Vec<_>) = analysed.partition(|name| *name == analysis::OPERATOR_METHOD);
    let recursive = hoid_survey::registry().into_iter().map(|spec| spec.name);
    let own = [FIT_METHOD, GREY_BOX_METHOD, RECORD_METHOD];
    first.into_iter().chain(own).chain(others).chain(recursive).collect()
}

fn structure_names() -> Vec<&'static str> {
    Structure::ALL.iter().map(|structure| structure.name()).collect()
}

/// Returns the key of an option: its name, with `_s` appended if the value is a number of seconds.
pub(super) fn plan_key(setting: &Setting) -> String {
    match (setting.kind, setting.unit) {
        (Kind::Span | Kind::NumberOrSpan | Kind::Number, "s") => format!("{}_s", setting.name),
        _ => setting.name.to_owned(),
    }
}

/// Converts a value of a plan to the form used on the command line.
fn value_text(value: &toml::Value, kind: Kind) -> Result<String, String> {
    let wrong = || format!("is {value}, expected {}", kind_text(kind));
    Ok(match (value, kind) {
        (toml::Value::String(text), Kind::Prior) if hoid_io::is_fit_file(text) => {
            let reason = "is a file, but a plan must not depend on other files; give the parameters, such as \
                          \"omega_nm=9:0.2\"";
            return Err(reason.to_owned());
        }
        (toml::Value::String(text), _) => text.clone(),
        (toml::Value::Integer(n), _) => n.to_string(),
        (toml::Value::Float(x), _) => x.to_string(),
        (toml::Value::Boolean(b), _) => b.to_string(),
        (toml::Value::Array(ends), Kind::Span | Kind::OpenSpan | Kind::NumberOrSpan | Kind::Counts) => {
            match ends.as_slice() {
                [low, high] => format!(
                    "{}..{}",
                    value_text(low, Kind::Number)?,
                    value_text(high, Kind::Number)?
                ),
                _ => return Err(wrong()),
            }
        }
        (toml::Value::Table(values), Kind::Named(of)) => {
            // `name` is the label of the table.
            let named = values.iter().filter(|(name, _)| *name != "name");
            let each: Vec<String> = named
                .map(|(name, value)| Ok(format!("{name}={}", value_text(value, *of)?)))
                .collect::<Result<_, String>>()?;
            each.join(",")
        }
        _ => return Err(wrong()),
    })
}

fn kind_text(kind: Kind) -> &'static str {
    match kind {
        Kind::Flag => "true or false",
        Kind::Count => "a whole number",
        Kind::Number => "a number",
        Kind::NumberOrDefault(_) => "a number, or true",
        Kind::Counts => "one or two whole numbers",
        Kind::NumberOrSpan => "one or two numbers",
        Kind::Delay => "a whole number of samples, or a text such as \"0.28s\"",
        Kind::Memory => "a number of samples, or a text such as \"2.56s\" or \"inf\"",
        Kind::NumberOrOff => "a number, or the text \"off\"",
        Kind::Span | Kind::OpenSpan => "two numbers",
        Kind::Choice(_) | Kind::Channel | Kind::Names | Kind::Guess | Kind::Element | Kind::Prior => "a text",
        Kind::Named(_) => "a table of values by name",
    }
}

/// Returns the problem with a value, as text that follows its key.
fn problem_text(error: &IdentError) -> String {
    match error {
        IdentError::BadOption { found, expected, .. } => format!("is {found}, expected {expected}"),
        other => format!("is invalid: {other}"),
    }
}

/// Returns the methods that have an option with this key.
fn methods_with(key: &str) -> Vec<&'static str> {
    let all = methods().into_iter();
    let with = all.filter(|spec| spec.settings.iter().any(|setting| plan_key(setting) == key));
    with.map(|spec| spec.name).collect()
}

/// Returns the problem with a key that the method does not have.
fn unknown_key_problem(key: &str) -> String {
    match methods_with(key).as_slice() {
        [] => "is unknown; the page Monte Carlo studies of the book lists the keys of an estimator".to_owned(),
        of => format!("has no effect here: it applies to {}", of.join(", ")),
    }
}

fn unknown_key(method: &Method) -> String {
    let keys: Vec<String> = method.settings().list().iter().map(plan_key).collect();
    format!("is unknown; {method} has {}", keys.join(", "))
}

/// Appends the names of the values of a choice to other names.
fn names<T: NamedChoice>(others: &[&'static str]) -> Vec<&'static str> {
    let own = T::CHOICES.iter().map(|choice| choice.choice_name());
    others.iter().copied().chain(own).collect()
}

/// Deserialises a value of a choice from its name.
fn choice<'de, T: NamedChoice, D: Deserializer<'de>>(from: D) -> Result<Option<T>, D::Error> {
    let name = String::deserialize(from)?;
    T::from_name(&name).map(Some).map_err(D::Error::custom)
}

/// Deserialises a value of a choice from its name; `None` for `auto`.
fn choice_or_auto<'de, T: NamedChoice, D: Deserializer<'de>>(from: D) -> Result<Option<T>, D::Error> {
    let name = String::deserialize(from)?;
    match name.as_str() {
        "auto" => Ok(None),
        name => T::from_name(name).map(Some).map_err(D::Error::custom),
    }
}
