//! Treatment of each run: the keys of `[analysis]`.

use hoid_ident::family::FamilyEstimator;
use hoid_model::{Form, Structure, operator_family::Coordinate};
use hoid_track::Method;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Treatment of each run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AnalysisSettings {
    /// The two sub-batches, s. Default: the first and the last three eighths of each record.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub windows_s: Option<[(f64, f64); 2]>,
    /// Smallest and largest order of the noise model; BIC selects an order on each sub-batch, and the larger of the two
    /// is used.
    pub nd: (usize, usize),
    /// Range of the delay of ARX and Box-Jenkins models, s.
    pub delay_s: (f64, f64),
    /// Recursions by name, as in `hoid track`. Default: adaptive, rls, rpem.
    #[schemars(extend("items" = serde_json::json!({ "enum": method_names() })))]
    pub methods: Vec<String>,
    /// Polynomial models that are fitted in addition to the operator, for tables and figures: arx, bj, both or none.
    #[schemars(extend("items" = serde_json::json!({ "enum": POLYNOMIALS.map(Structure::name) })))]
    pub polynomials: Vec<String>,
    /// Samples from one kept point of a trace to the next.
    pub trace_every: usize,
    /// Whether the grey box is fitted too.
    pub grey_box: bool,
    /// Form of the operator of the family: auto, or the name of a form.
    #[schemars(extend("enum" = serde_json::json!(form_names())))]
    pub form: String,
    /// Prior knowledge of the operator before the data: population, none, or NAME=CENTRE:SPREAD
    /// separated by commas.
    pub prior: String,
    /// Parameters of the operator that each run has for itself, such as K; all others are common to
    /// the runs of a person in a condition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("items" = serde_json::json!({ "enum": Coordinate::ALL.map(Coordinate::parameter) })))]
    pub individual: Vec<String>,
    /// Whether the operator is also fitted to each run, with the common form of all runs.
    pub each_run: bool,
    /// Frequencies at which the response of the recursions is kept, rad/s.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub response_at_rad_s: Vec<f64>,
}

/// The structures that a group may fit.
const POLYNOMIALS: [Structure; 2] = [Structure::Arx, Structure::BoxJenkins];

/// The form that held-out runs choose.
const AUTO: &str = "auto";

/// The names of the forms, for the schema.
fn form_names() -> Vec<&'static str> {
    std::iter::once(AUTO)
        .chain(Form::ALL.iter().map(|form| form.name()))
        .collect()
}

/// The names of the recursive methods, for the schema.
fn method_names() -> Vec<&'static str> {
    hoid_survey::registry().into_iter().map(|spec| spec.name).collect()
}

impl Default for AnalysisSettings {
    fn default() -> Self {
        Self {
            windows_s: None,
            nd: (1, 1),
            delay_s: (0.05, 0.6),
            methods: ["adaptive", "rls", "rpem"].map(str::to_owned).to_vec(),
            polynomials: POLYNOMIALS.map(|structure| structure.name().to_owned()).to_vec(),
            trace_every: 16,
            grey_box: false,
            form: AUTO.to_owned(),
            prior: "population".to_owned(),
            individual: Vec::new(),
            each_run: true,
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
        let of = |name: &String| hoid_survey::method(name).map_err(|error| format!("analysis.methods: {error}"));
        self.methods.iter().map(of).collect()
    }

    /// The polynomial models that are fitted, in their default order.
    ///
    /// # Errors
    /// A name of another structure, or of none.
    pub(super) fn polynomials(&self) -> Result<Vec<Structure>, String> {
        let names = POLYNOMIALS.map(Structure::name);
        if let Some(name) = self.polynomials.iter().find(|name| !names.contains(&name.as_str())) {
            let expected = names.join(", ");
            return Err(format!(
                "analysis.polynomials has {name:?}, expected some of {expected}"
            ));
        }
        let asked = |structure: &Structure| self.polynomials.iter().any(|name| name == structure.name());
        Ok(POLYNOMIALS.into_iter().filter(asked).collect())
    }

    /// The structures whose orders are needed: of the polynomial models, and of the recursions that start from one.
    ///
    /// # Errors
    /// As [`Self::polynomials`] and [`Self::recursions`].
    pub(super) fn structures(&self) -> Result<Vec<Structure>, String> {
        let (fitted, recursions) = (self.polynomials()?, self.recursions()?);
        let started = |structure: Structure| {
            let mut from_fits = recursions.iter().filter(|method| !method.starts_itself());
            from_fits.any(|method| method.default_structure() == structure)
        };
        let needed = |structure: &Structure| fitted.contains(structure) || started(*structure);
        Ok(POLYNOMIALS.into_iter().filter(needed).collect())
    }

    /// Settings of the fit of the family; the form is selected by the data or given.
    ///
    /// # Errors
    /// A form, a prior or a parameter that does not exist.
    pub(super) fn family(&self) -> Result<FamilyEstimator, String> {
        let mut estimator = FamilyEstimator::default();
        if self.form != AUTO {
            let form = self.form.parse::<Form>();
            estimator.forms = vec![form.map_err(|error| format!("analysis.form: {error}, or {AUTO}"))?];
        }
        estimator.prior = self.prior.parse().map_err(|error| format!("analysis.prior: {error}"))?;
        for name in &self.individual {
            let coordinate = Coordinate::of_parameter(name).ok_or_else(|| {
                let names = Coordinate::ALL.map(Coordinate::parameter).join(", ");
                format!("analysis.individual has {name:?}, expected parameters among {names}")
            })?;
            estimator.individual.push(coordinate);
        }
        Ok(estimator)
    }

    /// Reason why the settings are not valid.
    pub(super) fn check(&self) -> Result<(), String> {
        self.structures()?;
        self.family()?;
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
                    "analysis.windows_s has [{from}, {to}], expected a start before its end"
                ));
            }
        }
        Ok(())
    }
}
