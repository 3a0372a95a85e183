//! What speaks for and against a fit of the family.
//!
//! Each rule is one observation with its own kind ([`hoid_model::Finding`]); the limits are stated
//! where they are used. Limits on residuals are sizes and not levels of significance: with the
//! samples of ten runs every model of a person is refuted by a test, and what matters is how much
//! the model misses.

use hoid_model::Finding;

use super::{agreement::Agreement, clusters::ClusterKind, line_fit::LineFit, parameter::Parameter, result::FreeModel};
use crate::Termination;

/// Autocorrelation of the residuals beyond which the noise model is too poor.
const LARGEST_AUTOCORRELATION: f64 = 0.1;
/// Correlation of the residuals with earlier errors beyond which the operator misses something.
const LARGEST_CROSS_CORRELATION: f64 = 0.1;
/// Part of the sum of squares in one sample beyond which it carries the fit.
const LARGEST_LEVERAGE: f64 = 0.05;
/// chi^2 per degree of freedom at the lines beyond which the describing function is missed.
const LARGEST_REDUCED_CHI_SQUARED: f64 = 3.0;
/// Level below which methods do not agree, and below which a free model refutes the form.
const LEVEL: f64 = 0.01;
/// Loss above that of a free model beyond which a refuted form is said to be so.
const LARGEST_EXCESS_LOSS: f64 = 0.01;
/// Relative error of the response, at its best, beyond which nothing is known of the person.
const LARGEST_RESPONSE_ERROR: f64 = 0.5;
/// Ratio of clustered to model-based standard errors that is worth a note.
const NOTED_ERROR_RATIO: f64 = 1.5;

/// What is judged.
pub(super) struct Judged<'a> {
    pub termination: Termination,
    pub delay: (f64, (f64, f64)),
    pub parameters: &'a [Parameter],
    pub residuals: ResidualMeasures,
    pub lines: Option<&'a LineFit>,
    pub no_lines: Option<&'a str>,
    pub agreement: Option<&'a Agreement>,
    pub free_model: Option<&'a FreeModel>,
    pub loss: f64,
    pub error_ratio: Option<f64>,
    pub cluster_kind: ClusterKind,
    pub clusters: usize,
    pub has_covariance: bool,
    /// Smallest relative standard error of the response over the band of manual control.
    pub response_error: Option<f64>,
}

/// How far the residuals are from white.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ResidualMeasures {
    /// Largest modulus of the autocorrelation over lags 1 to 25.
    pub autocorrelation: f64,
    /// Largest modulus of the correlation with e at lags of 0 to 0.6 s before.
    pub cross_correlation: f64,
    /// Largest part of the sum of squares in one sample.
    pub leverage: f64,
    /// Where that is: record and sample.
    pub at: (usize, usize),
}

/// Measures of the residuals of all records, with the error that belongs to each residual.
pub(super) fn residual_measures(records: &[(&[f64], &[f64])], sample_time_s: f64) -> ResidualMeasures {
    let total: f64 = records.iter().flat_map(|(eps, _)| eps.iter()).map(|x| x * x).sum();
    let error_power: f64 = records.iter().flat_map(|(_, e)| e.iter()).map(|x| x * x).sum();
    let mut measures = ResidualMeasures::default();
    if total <= 0.0 || error_power <= 0.0 {
        return measures;
    }
    let product = |lag: usize, of_error: bool| -> f64 {
        let one = |(eps, e): &(&[f64], &[f64])| {
            let past = if of_error { e } else { eps };
            (lag..eps.len()).map(|t| eps[t] * past[t - lag]).sum::<f64>()
        };
        records.iter().map(one).sum()
    };
    for lag in 1..=25 {
        measures.autocorrelation = measures.autocorrelation.max((product(lag, false) / total).abs());
    }
    let longest = (0.6 / sample_time_s).round().min(600.0) as usize;
    for lag in 0..=longest {
        let correlation = product(lag, true) / (total * error_power).sqrt();
        measures.cross_correlation = measures.cross_correlation.max(correlation.abs());
    }
    for (record, (eps, _)) in records.iter().enumerate() {
        for (t, x) in eps.iter().enumerate() {
            if x * x / total > measures.leverage {
                measures.leverage = x * x / total;
                measures.at = (record, t);
            }
        }
    }
    measures
}

/// All findings.
pub(super) fn findings(judged: &Judged<'_>) -> Vec<Finding> {
    let mut all = Vec::new();
    if !judged.termination.converged() {
        all.push(Finding::doubt(
            "not-converged",
            format!("the search did not converge: {}", judged.termination),
        ));
    }
    if !judged.has_covariance {
        all.push(Finding::undetermined(
            "singular",
            "the data leave a combination of parameters open: there are no error bars",
        ));
    }
    let (tau, (low, high)) = judged.delay;
    if high > low && (tau <= low || tau >= high) {
        all.push(Finding::doubt(
            "delay-at-bound",
            format!(
                "the delay {tau:.3} s lies at the end of the range {low} to {high} s in which it was sought; widen it"
            ),
        ));
    }
    determined(judged, &mut all);
    residuals(judged, &mut all);
    methods(judged, &mut all);
    if let Some(ratio) = judged.error_ratio.filter(|r| *r > NOTED_ERROR_RATIO) {
        let what = match judged.cluster_kind {
            ClusterKind::Runs => format!("{} runs", judged.clusters),
            ClusterKind::Blocks => format!("{} blocks of the records", judged.clusters),
        };
        all.push(Finding::note(
            "clustered-errors",
            format!(
                "error bars are those of the scatter between {what}, up to {ratio:.1} times those of the model, which \
                 takes residuals for white and the person for constant"
            ),
        ));
    }
    all
}

fn determined(judged: &Judged<'_>, all: &mut Vec<Finding>) {
    let find = |name: &str| {
        judged
            .parameters
            .iter()
            .find(|p| p.name.split('[').next() == Some(name))
    };
    if let Some(error) = judged.response_error.filter(|e| *e > LARGEST_RESPONSE_ERROR) {
        all.push(Finding::undetermined(
            "response",
            format!(
                "the response of the person is not determined: its error is {:.0} % at the frequency at which it is known best",
                100.0 * error
            ),
        ));
    }
    let gain = ["K_over_T_I", "K_I", "K_e", "K"].iter().find_map(|name| find(name));
    if let Some(gain) = gain.filter(|g| !g.determined) {
        all.push(Finding::note(
            "gain",
            format!(
                "{} is not determined, the response in the middle of the band is",
                gain.name
            ),
        ));
    }
    if let Some(tau) = find("tau_e").filter(|t| !t.determined) {
        let words = match tau.prior_share > 0.5 {
            true => "tau_e is determined by the prior alone".to_owned(),
            false => "tau_e is not determined".to_owned(),
        };
        all.push(Finding::doubt("delay", words));
    }
    if let Some((t_i, (low, high))) = find("T_I").and_then(|t| Some((t, t.interval?)))
        && !t_i.determined
    {
        let words = if high.is_infinite() {
            format!("T_I and K are not determined, K/T_I is: T_I is longer than {low:.2} s (95 %)")
        } else {
            format!("T_I is not determined: {low:.2} to {high:.2} s (95 %)")
        };
        all.push(Finding::note("lag", words));
    }
    let mut prior_alone: Vec<&str> = Vec::new();
    let mut open: Vec<&str> = Vec::new();
    for parameter in judged.parameters.iter().filter(|p| !p.determined) {
        let name = parameter.name.as_str();
        if matches!(name, "omega_nm" | "zeta_nm") && parameter.prior_share > 0.5 {
            prior_alone.push(name);
        } else if !matches!(name, "K" | "T_I" | "tau_e" | "K_over_T_I" | "K_I" | "K_e") {
            open.push(name);
        }
    }
    if !prior_alone.is_empty() {
        let verb = if prior_alone.len() == 1 { "is" } else { "are" };
        all.push(Finding::note(
            "prior",
            format!("{} {verb} determined by the prior alone", prior_alone.join(" and ")),
        ));
    }
    if !open.is_empty() {
        let verb = if open.len() == 1 { "is" } else { "are" };
        all.push(Finding::note(
            "undetermined-parameter",
            format!("{} {verb} not determined by the data", open.join(", ")),
        ));
    }
}

fn residuals(judged: &Judged<'_>, all: &mut Vec<Finding>) {
    let m = judged.residuals;
    if m.autocorrelation > LARGEST_AUTOCORRELATION {
        all.push(Finding::doubt(
            "residuals-not-white",
            format!(
                "the residuals are correlated by {:.2} with their own past: the noise model is too poor",
                m.autocorrelation
            ),
        ));
    }
    if m.cross_correlation > LARGEST_CROSS_CORRELATION {
        all.push(Finding::doubt(
            "structure",
            format!(
                "the residuals are correlated by {:.2} with past errors: the operator misses something of the response",
                m.cross_correlation
            ),
        ));
    }
    if m.leverage > LARGEST_LEVERAGE {
        all.push(Finding::doubt(
            "leverage",
            format!(
                "one sample (record {}, residual {}) makes {:.0} % of the sum of squares: look at it, or leave it out",
                m.at.0 + 1,
                m.at.1,
                100.0 * m.leverage
            ),
        ));
    }
}

fn methods(judged: &Judged<'_>, all: &mut Vec<Finding>) {
    if let Some(reduced) = judged.lines.and_then(LineFit::reduced_chi_squared)
        && reduced > LARGEST_REDUCED_CHI_SQUARED
    {
        all.push(Finding::doubt(
            "describing-function",
            format!("the operator misses the describing function: chi^2 per degree of freedom is {reduced:.1}"),
        ));
    }
    if let Some(agreement) = judged.agreement.filter(|a| a.p_value < LEVEL) {
        let worst = agreement
            .rows
            .iter()
            .max_by(|a, b| a.difference_in_errors.abs().total_cmp(&b.difference_in_errors.abs()));
        let where_ = worst.map_or(String::new(), |row| {
            format!(
                ", most in {} by {:.1} combined errors",
                row.coordinate.name(),
                row.difference_in_errors.abs()
            )
        });
        all.push(Finding::doubt(
            "agreement",
            format!(
                "the prediction error fit and the fit at the lines do not agree (p = {:.2e}{where_})",
                agreement.p_value
            ),
        ));
    }
    if let Some(free) = judged.free_model
        && judged.loss > free.loss * (1.0 + LARGEST_EXCESS_LOSS)
        && free.p_value < LEVEL
    {
        all.push(Finding::doubt(
            "form-refuted",
            format!(
                "a Box-Jenkins model of the same orders has a loss smaller by {:.1} % (likelihood ratio {:.0} with {} \
                 degrees of freedom): the form is refuted",
                100.0 * (judged.loss / free.loss - 1.0),
                free.likelihood_ratio,
                free.degrees_of_freedom
            ),
        ));
    }
    if let Some(why) = judged.no_lines {
        all.push(Finding::note(
            "no-lines",
            format!("no fit at the lines of the excitation: {why}"),
        ));
    }
}
