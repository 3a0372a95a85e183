//! Estimators of a plan: `[[estimators]]`.
//!
//! ```toml
//! [[estimators]]
//! name = "BJ"
//! method = "fit"                  # or "operator", "grey-box", "sriv", "record", a recursive method ...
//! structure = "bj"
//! orders = { nd = [1, 2], nk = "true" }
//! ```
//!
//! The keys are the options of the command line, with the unit in the name if the value has none. If an order is
//! `"true"`, it is taken from the scenario: nk from its delay, nd from its remnant. `nk = "ramp"` is one less than
//! `nk = "true"`. Orders that are not given are those of the operator's structure, with `nk = "true"`.

use std::collections::BTreeMap;

use hoid_analysis::ResolvedRequest;
use hoid_ident::{Estimator, GreyBox, IdentError};
use hoid_model::{Detrend, Orders, SampleTime, Structure, scenario::ResolvedScenario};
use hoid_track::{Method, StartSource, TrackOptions};

use super::{
    analysis,
    estimator_table::{
        EstimatorTable, FIT_METHOD, GREY_BOX_METHOD, OfScenario, Order, OrdersTable, RECORD_METHOD, StartValue,
        method_names,
    },
    grid::{Axis, Variant},
    problem::PlanProblem,
};

/// One estimator of a study, which is applied to each record.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimatorCell {
    /// Name of the estimator in the plan.
    pub name: String,
    /// Name of the estimator, followed by the selected entries of the lists in its table.
    pub label: String,
    /// For each list in the estimator's table, the selected entry.
    pub axes: Vec<Axis>,
    /// Name of the estimator whose VAF is subtracted from the VAF of this one.
    pub versus: Option<String>,
    /// Names of the scenarios to which the estimator is applied; `None` for all scenarios.
    pub scenarios: Option<Vec<String>>,
    /// Span of the record that is used (in s); `None` for the whole record.
    pub span_s: Option<(f64, f64)>,
    /// Number n if only every n-th sample is used.
    pub decimate: usize,
    /// Trend removed from e and u before the estimate.
    pub detrend: Detrend,
    /// Method with its options.
    pub task: Task,
    /// Label of the start values; empty if the method finds its own.
    pub start: String,
    pub(crate) orders: OrdersTable,
    pub(crate) start_values: BTreeMap<String, f64>,
}

/// Method of an estimator, with its options.
#[derive(Debug, Clone, PartialEq)]
pub enum Task {
    /// Describes the record itself: RMS values and noise levels.
    Describe,
    /// Fits a polynomial model.
    Fit(Box<Estimator>),
    /// Fits the operator's parameters.
    GreyBox(Box<GreyBox>),
    /// Analyses the record as `hoid identify` does, and gives a verdict.
    Analysis(Box<ResolvedRequest>),
    /// Tracks the operator.
    Track(Box<TrackOptions>),
}

impl Task {
    /// Returns the request of an estimator that runs as in `hoid identify`; `None` for any other estimator.
    pub(crate) fn analysis(&self) -> Option<&ResolvedRequest> {
        match self {
            Self::Analysis(asked) => Some(asked),
            _ => None,
        }
    }
}

impl EstimatorCell {
    pub(crate) fn of(variant: &Variant) -> Result<Self, PlanProblem> {
        let table: EstimatorTable = variant.read()?;
        let at = |key: &str, reason: String| PlanProblem {
            line: variant.line_of_key(key).or_else(|| variant.lines.first().copied()),
            reason: format!("{key} {reason}"),
        };
        let asked = table.identify_request(&at)?;
        let method = match table.method.as_str() {
            FIT_METHOD | GREY_BOX_METHOD | RECORD_METHOD => None,
            _ if asked.is_some() => None,
            name => Some(hoid_survey::method(name).map_err(|_| at("method", unknown_method(name)))?),
        };
        let structure = match &table.structure {
            None => method.as_ref().map_or(Structure::BoxJenkins, Method::default_structure),
            Some(name) => name
                .parse::<Structure>()
                .map_err(|error| at("structure", format!("is invalid: {error}")))?,
        };
        if asked.is_none() {
            table.check_placement(method.as_ref(), None, &at)?;
        }
        if table.method == FIT_METHOD && table.structure.is_none() {
            return Err(at(
                "structure",
                "is missing, expected one such as \"arx\" or \"bj\"".to_owned(),
            ));
        }
        let decimate = table.decimate.unwrap_or(1);
        if decimate == 0 {
            return Err(at("decimate", "is 0, expected 1 or more".to_owned()));
        }
        for (key, span) in [("span_s", table.span_s), ("start_span_s", table.start_span_s)] {
            if let Some((from, to)) = span
                && !(from < to && from.is_finite() && to.is_finite())
            {
                return Err(at(key, format!("is [{from}, {to}], expected the start before the end")));
            }
        }
        let (mut start, mut start_values) = (String::new(), BTreeMap::new());
        for (name, value) in table.start.iter().flatten() {
            match value {
                StartValue::Name(text) if name == "name" => start.clone_from(text),
                StartValue::Name(text) => {
                    return Err(at("start", format!("has {name} = {text:?}, expected a number")));
                }
                StartValue::Number(value) => {
                    start_values.insert(name.clone(), *value);
                }
            }
        }
        if start.is_empty() && !start_values.is_empty() {
            "given".clone_into(&mut start);
        }
        let task = match (table.method.as_str(), method) {
            (RECORD_METHOD, _) => Task::Describe,
            (GREY_BOX_METHOD, _) => Task::GreyBox(Box::new(table.grey_box(&at)?)),
            _ if let Some(asked) = asked => Task::Analysis(Box::new(asked)),
            (_, Some(method)) => Task::Track(Box::new(table.track(method, structure, &at)?)),
            _ => Task::Fit(Box::new(table.fit(structure))),
        };
        let short = |axis: &Axis| format!("{}={}", axis.key.trim_start_matches("orders_"), axis.value);
        let label: Vec<String> = variant.axes.iter().map(short).collect();
        let cell = Self {
            label: [std::slice::from_ref(&table.name), label.as_slice()].concat().join(" "),
            name: table.name,
            axes: variant.axes.clone(),
            versus: table.versus,
            scenarios: table.scenarios,
            span_s: table.span_s,
            decimate,
            detrend: table.detrend.unwrap_or(Detrend::None),
            task,
            start,
            orders: table.orders,
            start_values,
        };
        Ok(cell)
    }

    /// True if the estimator is applied to the records of a scenario.
    pub fn applies_to(&self, scenario: &str) -> bool {
        self.scenarios
            .as_ref()
            .is_none_or(|names| names.iter().any(|n| n == scenario))
    }

    /// Returns the polynomial structure; `None` if an operator is fitted or the record itself is described.
    pub fn structure(&self) -> Option<Structure> {
        match &self.task {
            Task::Describe => None,
            Task::Fit(estimator) => Some(estimator.structure),
            Task::GreyBox(_) => Some(Structure::BoxJenkins),
            Task::Analysis(asked) => asked.structure(),
            Task::Track(options) => Some(options.structure),
        }
    }

    /// Returns the method as named in the plan.
    pub fn method(&self) -> &'static str {
        match &self.task {
            Task::Describe => RECORD_METHOD,
            Task::Fit(_) => FIT_METHOD,
            Task::GreyBox(_) => GREY_BOX_METHOD,
            Task::Analysis(asked) => analysis::name(asked),
            Task::Track(options) => options.method.name(),
        }
    }

    /// Returns the orders for a scenario.
    pub fn orders(&self, scenario: &ResolvedScenario) -> Orders {
        let Some(structure) = self.structure() else {
            return Orders::default();
        };
        let (ts, table) = (scenario.scenario().sample_time.s() * self.decimate as f64, &self.orders);
        // The delay in whole samples. The small number compensates for the rounding of the quotient; b0 and the
        // following coefficients represent the remaining fraction of a sample.
        let delay = (scenario.scenario().initial.operator.tau_e_s / ts + 1e-9).floor() as usize;
        let of = |order: Option<Order>, default: usize, simulated: usize| match order {
            None | Some(Order::Range(_)) => default,
            Some(Order::Number(n)) => n,
            Some(Order::Scenario(OfScenario::True)) => simulated,
            Some(Order::Scenario(OfScenario::Ramp)) => simulated.saturating_sub(1),
        };
        let default = structure.operator_orders(if structure.has_input() { delay + 1 } else { 0 });
        let nd = match &self.task {
            Task::GreyBox(_) => scenario.scenario().remnant.order,
            _ => default.nd,
        };
        Orders {
            na: table.na.unwrap_or(default.na),
            nb: table.nb.unwrap_or(default.nb),
            nc: of(table.nc, default.nc, 0),
            nd: of(table.nd, nd, scenario.scenario().remnant.order),
            nf: table.nf.unwrap_or(default.nf),
            nk: of(table.nk, default.nk, delay + 1),
        }
    }

    /// Returns the start value of a coefficient, if the plan gives one.
    pub fn start_value(&self, name: &str) -> Option<f64> {
        self.start_values.get(name).copied()
    }

    /// Returns the start value of theta for these orders, with zero for coefficients that are not given; `None` if the
    /// plan gives no start.
    pub(crate) fn start_theta(&self, orders: &Orders) -> Option<Vec<f64>> {
        if self.start.is_empty() {
            return None;
        }
        let of = |name: &String| self.start_values.get(name).copied().unwrap_or(0.0);
        Some(orders.parameter_names().iter().map(of).collect())
    }

    /// Returns the method with its options, including the orders and the start for a scenario.
    pub fn task_for(&self, scenario: &ResolvedScenario) -> Task {
        let orders = self.orders(scenario);
        let mut task = self.task.clone();
        match &mut task {
            Task::Describe => {}
            Task::Fit(estimator) => {
                estimator.orders = orders;
                estimator.start = self.start_theta(&orders);
            }
            Task::GreyBox(grey) => grey.order = orders.nd..=orders.nd,
            Task::Analysis(asked) => {
                // The orders were checked when the plan was read.
                if let Ok(of_scenario) = self.with_orders(asked, scenario) {
                    **asked = of_scenario;
                }
            }
            Task::Track(options) => {
                options.orders = orders;
                if let Some(theta) = self.start_theta(&orders) {
                    options.start = StartSource::Theta(theta);
                }
            }
        }
        task
    }

    fn with_orders(&self, asked: &ResolvedRequest, scenario: &ResolvedScenario) -> Result<ResolvedRequest, IdentError> {
        let noise = self.orders.noise_orders(scenario.scenario().remnant.order);
        analysis::with_orders(asked.clone(), &noise, &self.orders(scenario))
    }

    /// Checks orders, start and options against a scenario. The error is the key and its problem.
    pub(crate) fn check(&self, scenario: &ResolvedScenario) -> Result<(), (&'static str, String)> {
        let orders = self.orders(scenario);
        if let Some(structure) = self.structure() {
            orders.check(structure).map_err(|error| ("orders", error.to_string()))?;
        }
        if let Task::Analysis(asked) = &self.task {
            let asked = self
                .with_orders(asked, scenario)
                .map_err(|error| ("orders", error.to_string()))?;
            if let Some((name, known)) = analysis::unknown_parameter(&asked) {
                let reason = format!(
                    "fix or bound names the parameter {name}, expected one of {}",
                    known.join(", ")
                );
                return Err(("fix", reason));
            }
        }
        let names = orders.parameter_names();
        if let Some(name) = self.start_values.keys().find(|name| !names.contains(name)) {
            return Err((
                "start",
                format!("start has {name}, expected one of {}", names.join(", ")),
            ));
        }
        let ts = scenario.scenario().sample_time.s();
        let end_s = scenario.scenario().measurement_s;
        for (key, span) in [("span_s", self.span_s), ("start_span_s", self.start_span_s())] {
            if let Some((from, to)) = span
                && (from < -1e-9 || to > end_s + ts)
            {
                return Err((
                    key,
                    format!("the span {from} to {to} s extends beyond the record, which runs from 0 to {end_s} s"),
                ));
            }
        }
        match self.task_for(scenario) {
            Task::Track(options) => {
                options.check().map_err(|error| ("memory_of", error.to_string()))?;
                let sample_time =
                    SampleTime::new(ts * self.decimate as f64).map_err(|error| ("decimate", error.to_string()))?;
                for memory in options.memories().map_err(|error| ("memory_of", error.to_string()))? {
                    memory
                        .lambda(sample_time)
                        .map_err(|error| ("memory", error.to_string()))?;
                }
                Ok(())
            }
            Task::GreyBox(grey) if grey.order.start() == &0 => Err((
                "orders",
                "orders.nd is 0, expected 1 or more: for the grey box it is the order of the remnant filter".to_owned(),
            )),
            _ => Ok(()),
        }
    }

    fn start_span_s(&self) -> Option<(f64, f64)> {
        match &self.task {
            Task::Track(options) => match options.start {
                StartSource::Span(span) => span,
                _ => None,
            },
            _ => None,
        }
    }
}

fn unknown_method(name: &str) -> String {
    format!("is {name:?}, expected one of {}", method_names().join(", "))
}
