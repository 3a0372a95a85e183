//! Settings of the analysis of each run: the keys of `[analysis]`.

use hoid_ident::family::FamilyEstimator;
use hoid_model::{Form, Structure, operator_family::Coordinate};
use hoid_track::Method;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of the analysis of each run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AnalysisSettings {
    /// The two sub-batches, in s. Default: the first three eighths and the last three eighths of each record.
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
    /// Polynomial models that are fitted in addition to the operator, for tables and figures: arx, bj, both or neither.
    #[schemars(extend("items" = serde_json::json!({ "enum": POLYNOMIAL_STRUCTURES.map(Structure::name) })))]
    pub polynomials: Vec<String>,
    /// Number of samples from one stored point of a trace to the next.
    pub trace_every: usize,
    /// Whether the grey-box model is also fitted.
    pub grey_box: bool,
    /// Form of the operator: auto, or the name of a form.
    #[schemars(extend("enum" = serde_json::json!(form_names())))]
    pub form: String,
    /// Prior knowledge of the operator: population, none, or NAME=CENTRE:SPREAD, separated by commas.
    pub prior: String,
    /// Parameters of the operator that differ between runs, such as K; all other parameters are common to the runs of a
    /// person in a condition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("items" = serde_json::json!({ "enum": Coordinate::ALL.map(Coordinate::parameter) })))]
    pub individual: Vec<String>,
    /// Whether the operator is also fitted to each single run, in the form common to all runs.
    pub each_run: bool,
    /// Frequencies at which the response of the recursions is stored, rad/s.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub response_at_rad_s: Vec<f64>,
}

/// Polynomial structures that a group can fit.
const POLYNOMIAL_STRUCTURES: [Structure; 2] = [Structure::Arx, Structure::BoxJenkins];

/// Name for the form chosen by the fit.
const AUTO_FORM: &str = "auto";

/// Returns the names of the forms, for the schema.
fn form_names() -> Vec<&'static str> {
    std::iter::once(AUTO_FORM)
        .chain(Form::ALL.iter().map(|form| form.name()))
        .collect()
}

/// Returns the names of the recursive methods, for the schema.
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
            polynomials: POLYNOMIAL_STRUCTURES
                .map(|structure| structure.name().to_owned())
                .to_vec(),
            trace_every: 16,
            grey_box: false,
            form: AUTO_FORM.to_owned(),
            prior: "population".to_owned(),
            individual: Vec::new(),
            each_run: true,
            response_at_rad_s: Vec::new(),
        }
    }
}

impl AnalysisSettings {
    /// Returns the recursive methods with their default options.
    ///
    /// # Errors
    /// A name that is not the name of a recursive method.
    pub(super) fn recursions(&self) -> Result<Vec<Method>, String> {
        let of = |name: &String| hoid_survey::method(name).map_err(|error| format!("analysis.methods: {error}"));
        self.methods.iter().map(of).collect()
    }

    /// Returns the polynomial models to fit, in default order.
    ///
    /// # Errors
    /// A name that is neither `arx` nor `bj`.
    pub(super) fn polynomials(&self) -> Result<Vec<Structure>, String> {
        let names = POLYNOMIAL_STRUCTURES.map(Structure::name);
        if let Some(name) = self.polynomials.iter().find(|name| !names.contains(&name.as_str())) {
            let expected = names.join(", ");
            return Err(format!(
                "analysis.polynomials has {name:?}, expected one or more of {expected}"
            ));
        }
        let asked = |structure: &Structure| self.polynomials.iter().any(|name| name == structure.name());
        Ok(POLYNOMIAL_STRUCTURES.into_iter().filter(asked).collect())
    }

    /// Returns the structures whose orders are needed: the structures of the polynomial models to fit, and of
    /// recursions that start from a fit.
    ///
    /// # Errors
    /// Same as [`Self::polynomials`] and [`Self::recursions`].
    pub(super) fn structures(&self) -> Result<Vec<Structure>, String> {
        let (fitted, recursions) = (self.polynomials()?, self.recursions()?);
        let started = |structure: Structure| {
            let mut from_fits = recursions.iter().filter(|method| !method.is_self_starting());
            from_fits.any(|method| method.default_structure() == structure)
        };
        let needed = |structure: &Structure| fitted.contains(structure) || started(*structure);
        Ok(POLYNOMIAL_STRUCTURES.into_iter().filter(needed).collect())
    }

    /// Returns the settings for fitting the family; the form is given, or selected from the data.
    ///
    /// # Errors
    /// An unknown form, prior or parameter.
    pub(super) fn family_estimator(&self) -> Result<FamilyEstimator, String> {
        let mut estimator = FamilyEstimator::default();
        if self.form != AUTO_FORM {
            let form = self.form.parse::<Form>();
            estimator.forms = vec![form.map_err(|error| format!("analysis.form: {error}, or {AUTO_FORM}"))?];
        }
        estimator.prior = self.prior.parse().map_err(|error| format!("analysis.prior: {error}"))?;
        for name in &self.individual {
            let coordinate = Coordinate::from_parameter(name).ok_or_else(|| {
                let names = Coordinate::ALL.map(Coordinate::parameter).join(", ");
                format!("analysis.individual has {name:?}, expected parameters from {names}")
            })?;
            estimator.individual.push(coordinate);
        }
        Ok(estimator)
    }

    /// Checks the settings; the error is the reason why they are invalid.
    pub(super) fn check(&self) -> Result<(), String> {
        self.structures()?;
        self.family_estimator()?;
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
                    "analysis.windows_s has [{from}, {to}], expected the start before the end"
                ));
            }
        }
        Ok(())
    }
}
