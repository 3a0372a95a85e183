//! What is done with each run: the keys of `[analysis]`.

use hoid_track::Method;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is done with each run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AnalysisSettings {
    /// The two sub-batches, s; the first and the last three eighths of each record where they are
    /// left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub windows_s: Option<[(f64, f64); 2]>,
    /// Least and greatest order of the noise model; BIC chooses on each sub-batch, the greater one
    /// is taken.
    pub nd: (usize, usize),
    /// Range of the delay, s.
    pub delay_s: (f64, f64),
    /// Recursions by name, as in `hoid track`. Default: rls, rpem, physical.
    #[schemars(extend("items" = serde_json::json!({ "enum": method_names() })))]
    pub methods: Vec<String>,
    /// Samples from one kept point of a trace to the next.
    pub trace_every: usize,
    /// Whether the grey box is fitted too.
    pub grey_box: bool,
    /// Frequencies at which the response of the recursions is kept, rad/s.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub response_at_rad_s: Vec<f64>,
}

/// The names of the recursive methods, for the schema.
fn method_names() -> Vec<&'static str> {
    Method::registry().into_iter().map(|spec| spec.name).collect()
}

impl Default for AnalysisSettings {
    fn default() -> Self {
        Self {
            windows_s: None,
            nd: (1, 1),
            delay_s: (0.05, 0.6),
            methods: ["rls", "rpem", "physical"].map(str::to_owned).to_vec(),
            trace_every: 16,
            grey_box: false,
            response_at_rad_s: Vec::new(),
        }
    }
}

impl AnalysisSettings {
    /// The recursions with their defaults.
    ///
    /// # Errors
    /// A name that no method has.
    pub(super) fn recursions(&self) -> Result<Vec<Method>, String> {
        let of = |name: &String| {
            name.parse::<Method>()
                .map_err(|error| format!("analysis.methods: {error}"))
        };
        self.methods.iter().map(of).collect()
    }

    /// Why the settings have no meaning.
    pub(super) fn check(&self) -> Result<(), String> {
        self.recursions()?;
        if self.nd.0 == 0 || self.nd.0 > self.nd.1 || self.nd.1 > 20 {
            return Err(format!(
                "analysis.nd is {:?}, expected two orders from 1 to 20, the smaller first",
                self.nd
            ));
        }
        if !(self.delay_s.0 >= 0.0 && self.delay_s.0 < self.delay_s.1 && self.delay_s.1.is_finite()) {
            return Err(format!(
                "analysis.delay_s is {:?}, expected two times, the smaller first",
                self.delay_s
            ));
        }
        if let Some(omega) = self
            .response_at_rad_s
            .iter()
            .find(|omega| !(**omega > 0.0 && omega.is_finite()))
        {
            return Err(format!(
                "analysis.response_at_rad_s has {omega}, expected positive frequencies in rad/s"
            ));
        }
        if self.trace_every == 0 {
            return Err("analysis.trace_every is 0, expected 1 or more".to_owned());
        }
        for (from, to) in self.windows_s.iter().flatten() {
            if !(from < to && from.is_finite() && to.is_finite()) {
                return Err(format!(
                    "analysis.windows_s has [{from}, {to}], expected a beginning before its end"
                ));
            }
        }
        Ok(())
    }
}
