//! Findings for and against a fit of an operator of the family.
//!
//! Each rule yields one finding of a separate kind ([`hoid_model::Finding`]). The limits are defined next to the rules;
//! the limits for residuals are common to all fits.

use hoid_model::{Finding, Form};

use super::{
    agreement::Agreement,
    clusters::ClusterKind,
    deviation::ResponseDeviation,
    instrumental::InstrumentalFit,
    line_fit::LineFit,
    parameter::{DC_GAIN_NAME, Parameter, min_weight},
    prior::OperatorPrior,
    result::{FreeModel, WeighedForm},
};
use crate::{Termination, diagnostics::residuals::ResidualMeasures};

/// chi^2 per degree of freedom at the lines above which the operator does not fit the describing function.
const LARGEST_REDUCED_CHI_SQUARED: f64 = 3.0;
/// Root mean square deviation of the response from the form at the lines up to which the form is a sufficient
/// description of a person, because response and errors include the deviation. A form without a lead or lag that the
/// person has is off by more.
const LARGEST_DEVIATION: f64 = 0.2;
/// Significance level of two tests: agreement between methods, and the form against a free model.
const SIGNIFICANCE_LEVEL: f64 = 0.01;
/// Relative excess of the loss over the loss of a free model above which a rejected form is reported.
const LARGEST_EXCESS_LOSS: f64 = 0.01;
/// Relative error of the response, at the frequency with the smallest error, above which the response counts as
/// unknown.
pub(super) const LARGEST_RESPONSE_ERROR: f64 = 0.5;
/// Damping ratio above which the two neuromuscular poles count as separate lags: no muscle is so strongly damped.
pub(super) const MAX_DAMPING_RATIO: f64 = 1.5;
/// Smallest weight of the best form with which the form counts as determined.
const DETERMINED_FORM_WEIGHT: f64 = 0.95;
/// Ratio of standard errors from clusters to model-based standard errors above which a note is added.
const REPORTED_ERROR_RATIO: f64 = 1.5;

/// Shift of a parameter by the prior, in standard errors, above which the shift is reported.
const REPORTED_PULL: f64 = 0.5;

/// Inputs of the diagnostics.
pub(super) struct DiagnosticInputs<'a> {
    pub termination: Termination,
    pub delay: (f64, (f64, f64)),
    pub parameters: &'a [Parameter],
    pub prior: &'a OperatorPrior,
    pub residuals: ResidualMeasures,
    /// Power of the residual relative to the power of u if the residual is not noise; `None` if there is noise.
    pub noise_free: Option<f64>,
    /// A warning if the person changes over the records.
    pub not_constant: Option<Finding>,
    pub lines: Option<&'a LineFit>,
    pub no_lines: Option<&'a str>,
    pub agreement: Option<&'a Agreement>,
    pub instrumental: Option<&'a InstrumentalFit>,
    pub no_instrumental: Option<&'a str>,
    pub free_model: Option<&'a FreeModel>,
    pub loss: f64,
    pub error_ratio: Option<f64>,
    pub cluster_kind: ClusterKind,
    pub clusters: usize,
    pub has_covariance: bool,
    /// Smallest relative standard error of the response over the band of manual control.
    pub response_error: Option<f64>,
    /// True if there is one input, or if separate excitations distinguish the inputs; false if only their assumed forms
    /// do.
    pub apart: bool,
    /// The forms that the data do not reject, the best one first.
    pub weighed: &'a [WeighedForm],
    /// Evidence for the forms in which K has the same meaning as in the best form.
    pub dc_gain_share: f64,
}

/// Returns all findings.
pub(super) fn findings(judged: &DiagnosticInputs<'_>) -> Vec<Finding> {
    let mut all = Vec::new();
    if !judged.termination.converged() {
        all.push(Finding::warning(
            "not-converged",
            format!("the search has {}", judged.termination),
        ));
    }
    if !judged.has_covariance {
        all.push(Finding::undetermined(
            "singular",
            "the data leave a combination of parameters undetermined: there are no error bars",
        ));
    }
    let (tau, (low, high)) = judged.delay;
    if high > low && (tau <= low || tau >= high) {
        all.push(Finding::warning(
            "delay-at-bound",
            format!("the delay, {tau:.3} s, is at an end of its search range, {low} to {high} s; widen this range"),
        ));
    }
    if !judged.apart {
        all.push(Finding::warning(
            "inputs-together",
            "no excitation with separate lines distinguishes the error from the other inputs: the responses depend on \
             the assumed forms; record a target and a disturbance with separate lines, over whole periods",
        ));
    }
    add_parameter_findings(judged, &mut all);
    all.extend(undetermined_form(judged.weighed));
    if let Some(share) = judged.noise_free {
        // The residuals are rounding errors of the data; residual tests and other methods do not apply to them.
        all.push(Finding::note(
            "no-noise",
            format!(
                "the data contain no noise: the operator fits u to within {:.0e} of its size, which happens in a \
                 simulation but not with a person; the error bars reflect only the rounding of the data",
                share.sqrt()
            ),
        ));
        return all;
    }
    all.extend(judged.residuals.findings());
    all.extend(judged.not_constant.clone());
    add_method_findings(judged, &mut all);
    if let Some(ratio) = judged.error_ratio.filter(|r| *r > REPORTED_ERROR_RATIO) {
        let what = match judged.cluster_kind {
            ClusterKind::Runs => format!("{} runs", judged.clusters),
            ClusterKind::Blocks => format!("{} blocks of the records", judged.clusters),
        };
        all.push(Finding::note(
            "clustered-errors",
            format!(
                "error bars are computed from the scatter between {what}, and are up to {ratio:.1} times as large as \
                 those from the model, which assumes white residuals and a person who does not change"
            ),
        ));
    }
    all
}

/// Returns a finding about forms that the data do not distinguish; `None` if the form is determined.
fn undetermined_form(weighed: &[WeighedForm]) -> Option<Finding> {
    let best = weighed.first().filter(|best| best.weight < DETERMINED_FORM_WEIGHT)?;
    let mut all: Vec<&WeighedForm> = weighed
        .iter()
        .filter(|w| w.weight >= 1.0 - DETERMINED_FORM_WEIGHT)
        .collect();
    all.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    let named: Vec<String> = all.iter().map(|w| format!("{} {:.2}", w.form, w.weight)).collect();
    Some(Finding::note(
        "form",
        format!(
            "the form is not determined: the weights are {}; parameters are named as in {}, and all errors include \
             the differences between the forms",
            named.join(", "),
            best.form
        ),
    ))
}

/// True if the parameter is at the end of its search range and therefore has no standard error.
fn is_at_bound(parameter: &Parameter) -> bool {
    parameter.standard_error.is_none()
}

/// Formats how the prior changes a parameter, from the value without the prior to the value with it. `None` unless the
/// data determine the parameter and the prior shifts it noticeably.
fn describe_pull(parameter: &Parameter, prior: &OperatorPrior) -> Option<String> {
    let pull = prior.pull(parameter)?;
    let errors = pull.abs() * parameter.value / parameter.standard_error?;
    (parameter.determined && errors > REPORTED_PULL).then(|| {
        let unit = if parameter.unit.is_empty() {
            String::new()
        } else {
            format!(" {}", parameter.unit)
        };
        format!(
            "{} from {:.3} to {:.3}{unit} ({errors:.1} standard errors)",
            parameter.name,
            parameter.value * (-pull).exp(),
            parameter.value
        )
    })
}

/// Parameters that would be determined if the forms that have them were more likely than the others.
struct FormParameters<'a> {
    names: Vec<&'a str>,
    forms: Vec<Form>,
    /// Total weight of these forms.
    weight: f64,
}

impl<'a> FormParameters<'a> {
    /// Returns these parameters, grouped by the forms that have them.
    fn grouped_by_forms(parameters: &'a [Parameter], weighed: &[WeighedForm], dc_gain_share: f64) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        let is_undetermined = |p: &&Parameter| !p.determined && p.interval.is_some_and(|(low, high)| low * high > 0.0);
        for parameter in parameters.iter().filter(is_undetermined).filter(|p| !is_at_bound(p)) {
            let forms = match parameter.averaged_over.as_slice() {
                [] => weighed.first().map(|best| best.form).into_iter().collect(),
                several => several.to_vec(),
            };
            let weight = match parameter.name.as_str() {
                DC_GAIN_NAME => dc_gain_share,
                _ => (weighed.iter().filter(|of| forms.contains(&of.form)))
                    .map(|of| of.weight)
                    .sum(),
            };
            if forms.is_empty() || weight > min_weight(&parameter.name) {
                continue;
            }
            match all.iter_mut().find(|of| of.forms == forms) {
                Some(of) => of.names.push(&parameter.name),
                None => all.push(Self {
                    names: vec![&parameter.name],
                    forms,
                    weight,
                }),
            }
        }
        all
    }

    fn finding(&self) -> Finding {
        let forms: Vec<String> = self.forms.iter().map(Form::to_string).collect();
        Finding::note(
            "undetermined-parameter",
            format!(
                "not determined, because other forms are likely too: {}; the intervals apply only if the form is {} \
                 (weight {:.2}): use --form {} to report them",
                self.names.join(", "),
                forms.join(" or "),
                self.weight,
                forms[0]
            ),
        )
    }
}

fn add_parameter_findings(judged: &DiagnosticInputs<'_>, all: &mut Vec<Finding>) {
    let form_parameters = FormParameters::grouped_by_forms(judged.parameters, judged.weighed, judged.dc_gain_share);
    let is_explained = |parameter: &Parameter| {
        form_parameters
            .iter()
            .any(|of| of.names.contains(&parameter.name.as_str()))
    };
    all.extend(form_parameters.iter().map(FormParameters::finding));
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
                "the person's response is not determined: even at the best frequency, the error of the response is \
                 {:.0} %",
                100.0 * error
            ),
        ));
    }
    let gain = ["K_over_T_I", "K_I", "K_e", "K"].iter().find_map(|name| find(name));
    if let Some(gain) = gain.filter(|g| !g.determined && !is_explained(g)) {
        let response = match judged.response_error.is_some_and(|e| e > LARGEST_RESPONSE_ERROR) {
            true => "",
            false => ", but the response in the middle of the band is",
        };
        all.push(Finding::note(
            "gain",
            format!("{} is not determined{response}", gain.name),
        ));
    }
    if let Some(tau) = find("tau_e").filter(|t| !t.determined) {
        let words = match tau.prior_share > 0.5 {
            true => "tau_e is determined by the prior alone".to_owned(),
            false => "tau_e is not determined".to_owned(),
        };
        // As for other parameters, no value is printed without a standard error.
        all.push(Finding::note("delay", words));
    }
    if let Some((t_i, (low, high))) = find("T_I").and_then(|t| Some((t, t.interval?)))
        && !t_i.determined
        && !is_explained(t_i)
    {
        let words = if high.is_infinite() {
            format!("only K/T_I is determined, not T_I or K: T_I is longer than {low:.2} s (95 %)")
        } else {
            format!("T_I is not determined: {low:.2} to {high:.2} s (95 %)")
        };
        all.push(Finding::note("lag", words));
    }
    if let Some(zeta) = find("zeta_nm").filter(|z| z.value > MAX_DAMPING_RATIO) {
        all.push(Finding::warning(
            "neuromuscular-lag",
            format!(
                "zeta_nm = {:.1}: the neuromuscular poles describe lags and carry no information about the \
                 neuromuscular system; choose a form with a lag, or --neuromuscular no",
                zeta.value
            ),
        ));
    }
    let mut prior_alone: Vec<&str> = Vec::new();
    let mut open: Vec<&str> = Vec::new();
    for parameter in judged.parameters.iter().filter(|p| !p.determined && !is_explained(p)) {
        let name = parameter.name.as_str();
        if matches!(name, "omega_nm" | "zeta_nm") && parameter.value > 0.0 && is_at_bound(parameter) {
            open.push(name);
        } else if matches!(name, "omega_nm" | "zeta_nm") && parameter.prior_share > 0.5 {
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
    let pulled: Vec<String> = (judged.parameters.iter())
        .filter_map(|parameter| describe_pull(parameter, judged.prior))
        .collect();
    if !pulled.is_empty() {
        all.push(Finding::note(
            "prior-pull",
            format!("the prior shifts {}; use --prior none to omit it", pulled.join(" and ")),
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

fn add_method_findings(judged: &DiagnosticInputs<'_>, all: &mut Vec<Finding>) {
    if let Some(reduced) = judged.lines.and_then(LineFit::reduced_chi_squared)
        && reduced > LARGEST_REDUCED_CHI_SQUARED
    {
        let kind = "describing-function";
        let best = judged.weighed.first().and_then(|form| form.of(0)?.deviation.as_ref());
        all.push(match best.map(ResponseDeviation::size).filter(|s| *s <= LARGEST_DEVIATION) {
            Some(size) => Finding::note(
                kind,
                format!(
                    "the person deviates from the form by {:.0} % of the response at the lines (chi^2 per degree of \
                     freedom is {reduced:.1}): response, crossover and phase margin follow the lines, and all errors \
                     include the deviation",
                    100.0 * size
                ),
            ),
            None => Finding::warning(
                kind,
                format!("the operator does not fit the describing function: chi^2 per degree of freedom is {reduced:.1}"),
            ),
        });
    }
    if let Some(agreement) = judged.agreement.filter(|a| a.p_value < SIGNIFICANCE_LEVEL) {
        let (who, most) = match agreement.worst_pair() {
            Some(pair) => (
                format!("{} and {}", pair.methods.0.phrase(), pair.methods.1.phrase()),
                format!(
                    "; {} differs most, by {:.1} standard errors of the difference",
                    pair.most.0.name(),
                    pair.most.1.abs()
                ),
            ),
            None => ("the methods".to_owned(), String::new()),
        };
        all.push(Finding::warning(
            "agreement",
            format!("{who} do not agree (p = {:.2e}{most})", agreement.p_value),
        ));
    }
    let failed = match judged.instrumental {
        Some(found) if !found.termination.converged() => Some(found.termination.to_string()),
        _ => judged.no_instrumental.map(str::to_owned),
    };
    if let Some(why) = failed {
        all.push(Finding::note(
            "no-instruments",
            format!("no RIV-BJ estimate for comparison: {why}"),
        ));
    }
    if let Some(free) = judged.free_model
        && judged.loss > free.loss * (1.0 + LARGEST_EXCESS_LOSS)
        && free.p_value < SIGNIFICANCE_LEVEL
    {
        all.push(Finding::warning(
            "form-refuted",
            format!(
                "the loss is {:.1} % larger than that of a Box-Jenkins model of the same orders (likelihood-ratio \
                 statistic {:.0} with {} degrees of freedom): the form is rejected",
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn findings_name_the_forms_that_have_a_parameter() {
        let weighed =
            [(Form::Lead, 0.45), (Form::LeadLag, 0.04), (Form::Lag, 0.51)].map(|(form, weight)| WeighedForm {
                form,
                weight,
                operators: Vec::new(),
            });
        let parameter = |name: &str, averaged_over: &[Form]| Parameter {
            name: name.to_owned(),
            unit: "s",
            value: 0.4,
            standard_error: Some(0.1),
            standard_error_person: None,
            interval: Some((0.2, 0.6)),
            prior_share: 0.0,
            determined: false,
            averaged_over: averaged_over.to_vec(),
        };
        let all = [
            parameter("K_e", &[]),
            parameter("T_L", &[Form::Lead, Form::LeadLag]),
            parameter("K_e_dot", &[]),
            // This parameter is undetermined for another reason; the forms that have it are more likely than not.
            parameter("tau_e", &[Form::Lead, Form::Lag]),
        ];
        let messages: Vec<String> = FormParameters::grouped_by_forms(&all, &weighed, 1.0)
            .iter()
            .map(|of| of.finding().message)
            .collect();
        assert_eq!(messages.len(), 2);
        assert!(messages[0].contains("K_e, K_e_dot; the intervals apply only if the form is lead (weight 0.45)"));
        assert!(messages[1].contains("T_L; the intervals apply only if the form is lead or lead-lag (weight 0.49)"));
        // Forms in which K is another gain have evidence but no weight.
        let gain = [parameter("K", &[Form::Lead, Form::LeadLag, Form::Lag])];
        assert!(FormParameters::grouped_by_forms(&gain, &weighed, 1.0).is_empty());
        let found = FormParameters::grouped_by_forms(&gain, &weighed, 0.8);
        assert!(found[0].finding().message.contains("(weight 0.80)"));
    }
}
