//! Queries that select rows of the results of a study.

use std::collections::BTreeMap;

/// A selection of rows. A property that is not specified may have any value.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Query {
    quantity: Option<String>,
    cell: Option<u64>,
    scenario: Option<String>,
    condition: Option<String>,
    remnant_order: Option<usize>,
    noise_level: Option<f64>,
    t_n_s: Option<f64>,
    axes: Vec<(String, String)>,
    estimator: Option<String>,
    name: Option<String>,
    method: Option<String>,
    nd: Option<usize>,
    nk: Option<usize>,
    start: Option<String>,
    decimate: Option<usize>,
}

impl std::fmt::Display for Query {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        fn display_term<T: ToString>(name: &str, asked: Option<&T>) -> Option<String> {
            asked.map(|asked| format!("{name} {}", asked.to_string()))
        }
        let mut all: Vec<String> = [
            self.quantity.clone(),
            display_term("cell", self.cell.as_ref()),
            display_term("scenario", self.scenario.as_ref()),
            display_term("condition", self.condition.as_ref()),
            display_term("m0 =", self.remnant_order.as_ref()),
            display_term("P_n =", self.noise_level.as_ref()),
            display_term("T_n =", self.t_n_s.as_ref()),
            display_term("estimator", self.estimator.as_ref()),
            display_term("name", self.name.as_ref()),
            display_term("method", self.method.as_ref()),
            display_term("m* =", self.nd.as_ref()),
            display_term("n_k* =", self.nk.as_ref()),
            display_term("start", self.start.as_ref()),
            display_term("decimate", self.decimate.as_ref()),
        ]
        .into_iter()
        .flatten()
        .collect();
        all.extend(self.axes.iter().map(|(key, value)| format!("{key} {value}")));
        f.write_str(&all.join(", "))
    }
}

/// Properties of a cell and an estimator by which rows are selected.
#[derive(Debug, Clone)]
pub(crate) struct RowKey {
    pub cell: u64,
    pub scenario: String,
    pub condition: String,
    pub remnant_order: usize,
    pub noise_level: f64,
    pub t_n_s: f64,
    pub axes: BTreeMap<String, String>,
    pub estimator: String,
    pub name: String,
    pub method: String,
    pub nd: Option<usize>,
    pub nk: Option<usize>,
    pub start: String,
    pub decimate: usize,
}

impl Query {
    /// Selects all rows of a quantity.
    pub fn of(quantity: &str) -> Self {
        Self::default().with_quantity(quantity)
    }

    /// Selects the same cells and estimators for another quantity.
    #[must_use]
    pub fn with_quantity(mut self, quantity: &str) -> Self {
        self.quantity = Some(quantity.to_owned());
        self
    }

    /// Returns the quantity, if specified.
    pub fn quantity(&self) -> Option<&str> {
        self.quantity.as_deref()
    }

    /// Selects the cell with this number.
    #[must_use]
    pub fn cell(mut self, cell: u64) -> Self {
        self.cell = Some(cell);
        self
    }

    /// Selects the scenario with this name.
    #[must_use]
    pub fn scenario(mut self, scenario: &str) -> Self {
        self.scenario = Some(scenario.to_owned());
        self
    }

    /// Selects the cells whose scenario is based on this condition.
    #[must_use]
    pub fn condition(mut self, condition: &str) -> Self {
        self.condition = Some(condition.to_owned());
        self
    }

    /// Selects cells with a simulated remnant of this order m0.
    #[must_use]
    pub fn remnant_order(mut self, order: usize) -> Self {
        self.remnant_order = Some(order);
        self
    }

    /// Selects cells with this specified noise level.
    #[must_use]
    pub fn noise_level(mut self, level: f64) -> Self {
        self.noise_level = Some(level);
        self
    }

    /// Selects cells with this time constant of the simulated remnant, s.
    #[must_use]
    pub fn t_n_s(mut self, t_n_s: f64) -> Self {
        self.t_n_s = Some(t_n_s);
        self
    }

    /// Selects this entry of a list of the plan; for example, the key "memory" with the value "1s".
    #[must_use]
    pub fn axis(mut self, key: &str, value: &str) -> Self {
        self.axes.push((key.to_owned(), value.to_owned()));
        self
    }

    /// Selects the estimator with this label.
    #[must_use]
    pub fn estimator(mut self, label: &str) -> Self {
        self.estimator = Some(label.to_owned());
        self
    }

    /// Selects the estimators with this name.
    #[must_use]
    pub fn name(mut self, name: &str) -> Self {
        self.name = Some(name.to_owned());
        self
    }

    /// Selects the estimators with this method.
    #[must_use]
    pub fn method(mut self, method: &str) -> Self {
        self.method = Some(method.to_owned());
        self
    }

    /// Selects estimators with a noise model of this order m*.
    #[must_use]
    pub fn nd(mut self, nd: usize) -> Self {
        self.nd = Some(nd);
        self
    }

    /// Selects estimators with this delay n_k*, in samples.
    #[must_use]
    pub fn nk(mut self, nk: usize) -> Self {
        self.nk = Some(nk);
        self
    }

    /// Selects the estimators whose start has this label.
    #[must_use]
    pub fn start(mut self, start: &str) -> Self {
        self.start = Some(start.to_owned());
        self
    }

    /// Selects estimators that use every n-th sample.
    #[must_use]
    pub fn decimate(mut self, decimate: usize) -> Self {
        self.decimate = Some(decimate);
        self
    }

    pub(crate) fn matches(&self, s: &RowKey) -> bool {
        fn is<T: PartialEq>(asked: Option<&T>, found: &T) -> bool {
            asked.is_none_or(|asked| asked == found)
        }
        // Noise levels and time constants have few decimal places in a plan and in a query, so they agree except for
        // rounding.
        let near = |asked: Option<f64>, found: f64| asked.is_none_or(|asked| (asked - found).abs() <= 1e-9);
        is(self.cell.as_ref(), &s.cell)
            && is(self.remnant_order.as_ref(), &s.remnant_order)
            && near(self.noise_level, s.noise_level)
            && (self.nd.is_none() || self.nd == s.nd)
            && (self.nk.is_none() || self.nk == s.nk)
            && is(self.name.as_ref(), &s.name)
            && is(self.condition.as_ref(), &s.condition)
            && is(self.scenario.as_ref(), &s.scenario)
            && near(self.t_n_s, s.t_n_s)
            && is(self.estimator.as_ref(), &s.estimator)
            && is(self.method.as_ref(), &s.method)
            && is(self.start.as_ref(), &s.start)
            && is(self.decimate.as_ref(), &s.decimate)
            && self.axes.iter().all(|(key, value)| s.axes.get(key) == Some(value))
    }
}
