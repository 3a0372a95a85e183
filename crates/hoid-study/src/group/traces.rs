//! Recursive estimates of one run as table rows: coefficients and operator with their standard errors, correlations of
//! the coefficients, and the frequency response at the frequencies given in the manifest.
//!
//! The covariance of the errors of two coefficients is their correlation times the product of their standard errors;
//! the report pages show it for RPEM. The response at a frequency between the lines of the excitation is determined
//! even if single parameters are not.

use hoid_io::TableSchema;
use hoid_model::PolynomialModel;
use hoid_track::{Method, Trace};

use super::{
    analysis_settings::AnalysisSettings,
    manifest::RunEntry,
    tables::{real_columns, schema, text_columns},
};
use crate::columns::{OPERATOR_PARAMETERS, Rows};

/// Maximum number of noise-model coefficients in the tables.
const MAX_ND: usize = 20;

/// Coefficients of RPEM whose correlations are stored.
const CORRELATED_COEFFICIENTS: [&str; 4] = ["f1", "f2", "b0", "b1"];

/// Columns of the table of traces.
#[derive(Debug, Clone)]
pub(super) struct TraceColumns {
    /// Quantities with a standard error: coefficients of RLS and of Box-Jenkins models, and parameters of the operator.
    pub parameters: Vec<String>,
    /// Quantities without a standard error: correlations, and the response at the frequencies given in the manifest.
    pub others: Vec<String>,
    response_at_rad_s: Vec<f64>,
}

/// Returns the names of the columns for magnitude and phase at a frequency.
pub(super) fn response_names(omega_rad_s: f64) -> [String; 2] {
    ["magnitude_db", "phase_deg"].map(|name| format!("{name}_at_{omega_rad_s}"))
}

impl TraceColumns {
    pub fn of(analysis: &AnalysisSettings) -> Self {
        let fixed = ["a1", "a2", "b0", "b1", "f1", "f2"].map(str::to_owned);
        let d = (1..=analysis.nd.1.min(MAX_ND)).map(|i| format!("d{i}"));
        let correlations = coefficient_pairs().map(|(i, j)| {
            format!(
                "correlation_{}_{}",
                CORRELATED_COEFFICIENTS[i], CORRELATED_COEFFICIENTS[j]
            )
        });
        let responses = analysis.response_at_rad_s.iter().flat_map(|w| response_names(*w));
        Self {
            parameters: fixed
                .into_iter()
                .chain(d)
                .chain(OPERATOR_PARAMETERS.map(str::to_owned))
                .collect(),
            others: correlations.chain(responses).collect(),
            response_at_rad_s: analysis.response_at_rad_s.clone(),
        }
    }

    /// Returns all column names: the quantities, their standard errors, and the quantities without a standard error.
    pub fn names(&self) -> Vec<String> {
        let errors = self.parameters.iter().map(|name| format!("{name}_se"));
        self.parameters
            .iter()
            .cloned()
            .chain(errors)
            .chain(self.others.iter().cloned())
            .collect()
    }

    /// Returns the columns whose settling times are computed.
    pub fn settling_columns(&self) -> Vec<String> {
        let responses = self.others.iter().filter(|name| !name.starts_with("correlation"));
        self.parameters.iter().chain(responses).cloned().collect()
    }

    /// Returns the columns of the table, with one stored point of a recursion per row.
    pub fn schema(&self) -> TableSchema {
        let pairs: Vec<String> = self
            .parameters
            .iter()
            .flat_map(|name| [name.clone(), format!("{name}_se")])
            .collect();
        schema(
            text_columns(&["subject", "condition", "run", "estimator"])
                .chain(real_columns(&["t"]))
                .chain(real_columns(&pairs))
                .chain(real_columns(&self.others)),
        )
    }
}

/// Returns the positions of all pairs of different coefficients in [`CORRELATED_COEFFICIENTS`].
fn coefficient_pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..CORRELATED_COEFFICIENTS.len()).flat_map(|i| (i + 1..CORRELATED_COEFFICIENTS.len()).map(move |j| (i, j)))
}

/// Returns the label of a recursion in the tables.
pub(super) fn label_of(method: &Method) -> String {
    method.name().to_uppercase()
}

/// Returns the rows of a trace from the first update on. Earlier rows only repeat the fit from which the recursion
/// starts.
pub(super) fn updated_rows(trace: &Trace) -> impl Iterator<Item = usize> + '_ {
    let from_s = trace.updated_from_s() - 0.5 * trace.sample_time().s();
    (0..trace.len()).filter(move |k| trace.times_s()[*k] >= from_s)
}

/// Writes the rows of a trace from its first update on.
pub(super) fn write(rows: &mut Rows, columns: &TraceColumns, entry: &RunEntry, trace: &Trace) {
    let label = label_of(&trace.options().method);
    let names = trace.parameter_names();
    let correlated = CORRELATED_COEFFICIENTS.map(|name| names.iter().position(|n| n == name));
    for k in updated_rows(trace) {
        rows.start_row();
        rows.set_text("subject", &entry.subject);
        rows.set_text("condition", &entry.condition);
        rows.set_text("run", &entry.run);
        rows.set_text("estimator", &label);
        rows.set_real("t", trace.times_s()[k]);
        let operator = trace.operator(k).ok();
        let of_operator = operator
            .iter()
            .flat_map(|o| o.rows().into_iter().take(OPERATOR_PARAMETERS.len()));
        let parameters = names.iter().map(String::as_str).zip(trace.parameters(k));
        for (name, estimate) in parameters.chain(of_operator.map(|(name, _, estimate)| (name, estimate))) {
            rows.set_real(name, estimate.value);
            if let Some(se) = estimate.standard_error {
                rows.set_real(&format!("{name}_se"), se);
            }
        }
        if let ([Some(_), ..], Some(covariance)) = (correlated, trace.covariance(k)) {
            let p = names.len();
            for ((i, j), name) in coefficient_pairs().zip(&columns.others) {
                if let (Some(a), Some(b)) = (correlated[i], correlated[j]) {
                    let of = covariance[a * p + b] / (covariance[a * p + a] * covariance[b * p + b]).sqrt();
                    rows.set_real(name, of);
                }
            }
        }
        write_response(rows, columns, trace, k);
    }
}

fn write_response(rows: &mut Rows, columns: &TraceColumns, trace: &Trace, k: usize) {
    let options = trace.options();
    let theta = trace.theta(k).to_vec();
    let Ok(model) = PolynomialModel::new(options.structure, options.orders, trace.sample_time(), theta) else {
        return;
    };
    for omega in &columns.response_at_rad_s {
        let h = model.response(*omega);
        let [magnitude, phase] = response_names(*omega);
        rows.set_real(&magnitude, 20.0 * h.norm().log10());
        rows.set_real(&phase, h.arg().to_degrees());
    }
}

/// Returns the values of each coefficient and of each operator parameter in a window, from the first update on.
pub(super) fn values_within(trace: &Trace, from_s: f64, to_s: f64) -> Vec<(String, Vec<f64>)> {
    let names = trace
        .parameter_names()
        .into_iter()
        .chain(OPERATOR_PARAMETERS.map(str::to_owned));
    let mut columns: Vec<(String, Vec<f64>)> = names.map(|name| (name, Vec::new())).collect();
    for k in updated_rows(trace).filter(|k| (from_s..to_s).contains(&trace.times_s()[*k])) {
        let operator = trace.operator(k).ok();
        let of_operator = |i: usize| operator.as_ref().map_or(f64::NAN, |o| o.rows()[i].2.value);
        let values = trace
            .theta(k)
            .iter()
            .copied()
            .chain((0..OPERATOR_PARAMETERS.len()).map(of_operator));
        for ((_, column), value) in columns.iter_mut().zip(values) {
            column.push(value);
        }
    }
    columns
}
