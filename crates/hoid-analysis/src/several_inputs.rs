//! Polynomial models with several inputs, from text options and recordings to a result and its verdict.
//!
//! An order, or the delay nk, is one number for all inputs (`nb=2`) or one number per input (`nb=2,3`).

use hoid_ident::{
    family::{ChannelRole, SeenChannel},
    several_inputs::{InputOrders, SeveralInputs, SeveralInputsFit},
};
use hoid_model::{Decimation, FaultHandling, Finding, Structure, Verdict};
use serde_json::{Map, Value, json};

use crate::{
    AnalysisError,
    json::{envelope, number, optional, termination},
    quality::SystemKind,
    recordings::Recordings,
    settings::Setting,
};

/// Frequencies at which responses are given, as fractions of the Nyquist frequency.
const RESPONSE_FREQUENCIES: [f64; 12] = [0.001, 0.002, 0.005, 0.01, 0.02, 0.035, 0.05, 0.1, 0.2, 0.35, 0.5, 0.9];
/// Minimum distance from zero, in standard errors, at which a coefficient counts as determined.
const MIN_STANDARD_ERRORS: f64 = 2.0;

/// A fit with several inputs, and its verdict.
#[derive(Debug, Clone)]
pub struct SeveralInputsResult {
    /// Fit of the model with several inputs.
    pub fit: SeveralInputsFit,
    /// Role of each further input in the task of the person.
    pub roles: Vec<ChannelRole>,
    /// Verdict on the fit.
    pub verdict: Verdict,
    /// The fitted recordings.
    pub data: Recordings,
}

/// Builds a model from its structure, its orders (such as `na=2,nb=2,3`), its delays (such as `29,12`) and its inputs.
///
/// # Errors
/// [`AnalysisError::Options`] for invalid orders.
pub fn several_inputs(
    structure: Structure,
    orders: &str,
    nk: Option<&str>,
    inputs: &[String],
) -> Result<SeveralInputs, AnalysisError> {
    let options = |reason: String| AnalysisError::Options { reason };
    let number = |name: &str, text: &str| {
        text.trim().parse::<usize>().map_err(|_| {
            options(format!(
                "orders: {name} is {text:?}, expected a number for each input, such as nb=2,3"
            ))
        })
    };
    let mut named: Vec<(String, Vec<usize>)> = Vec::new();
    for part in orders.split(',').map(str::trim).filter(|part| !part.is_empty()) {
        match (part.split_once('='), named.last_mut()) {
            (Some((name, value)), _) => named.push((name.trim().to_owned(), vec![number(name, value)?])),
            (None, Some((name, values))) => values.push(number(name, part)?),
            (None, None) => {
                return Err(options(format!(
                    "orders: found {part:?}, expected NAME=NUMBER, such as na=2,nb=2,3"
                )));
            }
        }
    }
    if let Some(text) = nk {
        let values = text
            .split(',')
            .map(|value| number("nk", value))
            .collect::<Result<_, _>>()?;
        named.push(("nk".to_owned(), values));
    }
    let count = inputs.len();
    let all = |name: &str| {
        named
            .iter()
            .find(|(known, _)| known == name)
            .map(|(_, values)| values.as_slice())
    };
    if let Some((name, _)) = named
        .iter()
        .find(|(name, _)| !["na", "nb", "nc", "nd", "nf", "nk"].contains(&name.as_str()))
    {
        return Err(options(format!(
            "orders: there is no order {name}; expected na, nb, nc, nd, nf, nk"
        )));
    }
    let each = |name: &str, default: usize| match all(name) {
        None => Ok(vec![default; count]),
        Some([one]) => Ok(vec![*one; count]),
        Some(values) if values.len() == count => Ok(values.to_vec()),
        Some(values) => Err(options(format!(
            "orders: {name} has {} numbers for {count} inputs; give one number for all inputs, or one for each input",
            values.len()
        ))),
    };
    let one = |name: &str, default: usize| match all(name) {
        None => Ok(default),
        Some([one]) => Ok(*one),
        Some(values) => Err(options(format!(
            "orders: {name} has {} numbers, expected one number",
            values.len()
        ))),
    };
    let default = structure.operator_orders(1);
    let (nb, nf, nk) = (
        each("nb", default.nb)?,
        each("nf", default.nf)?,
        each("nk", default.nk)?,
    );
    let model = SeveralInputs {
        na: one("na", default.na)?,
        nc: one("nc", default.nc)?,
        nd: one("nd", default.nd)?,
        inputs: (inputs.iter().enumerate())
            .map(|(i, name)| {
                (
                    name.clone(),
                    InputOrders {
                        nb: nb[i],
                        nf: nf[i],
                        nk: nk[i],
                    },
                )
            })
            .collect(),
        ..SeveralInputs::new(structure)
    };
    model.check()?;
    Ok(model)
}

/// Parses the roles of the further inputs from text such as `r=motion,y=output`; inputs that the text does not name are
/// targets.
///
/// # Errors
/// [`AnalysisError::Options`] if the text is not a role, names something other than a further input, or gives a preview
/// or a form, which polynomials do not have.
pub fn parse_roles(further: &[String], text: &str) -> Result<Vec<ChannelRole>, AnalysisError> {
    let all = parse_seen_channels(further, text)?;
    if let Some(named) = all
        .iter()
        .find(|named| **named != SeenChannel::new(named.name.clone(), named.role))
    {
        return Err(AnalysisError::Options {
            reason: format!(
                "role: found {named}; polynomials have neither a preview nor a form: expected {}={}",
                named.name, named.role
            ),
        });
    }
    Ok(all.into_iter().map(|named| named.role).collect())
}

/// Like [`parse_roles`], with the preview and the forms of each input.
///
/// # Errors
/// [`AnalysisError::Options`] if the text is not a role or names something other than a further input.
pub(crate) fn parse_seen_channels(further: &[String], text: &str) -> Result<Vec<SeenChannel>, AnalysisError> {
    let options = |reason: String| AnalysisError::Options { reason };
    let default = |name: &String| SeenChannel::new(name.clone(), ChannelRole::default());
    let mut all: Vec<SeenChannel> = further.iter().map(default).collect();
    for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
        let named: SeenChannel = part
            .parse()
            .map_err(|why| options(format!("role: found {part:?}; expected {why}")))?;
        let Some(index) = further.iter().position(|name| *name == named.name) else {
            return Err(options(format!(
                "role: {} is not one of the further inputs {}; add it as an input first",
                named.name,
                further.join(", ")
            )));
        };
        all[index] = named;
    }
    Ok(all)
}

impl SeveralInputsResult {
    /// Repairs the recordings, fits the model and forms the verdict.
    ///
    /// # Errors
    /// [`AnalysisError`] if there is no result.
    pub fn of(
        model: &SeveralInputs,
        roles: Vec<ChannelRole>,
        recordings: Recordings,
        faults: FaultHandling,
        rate: Decimation,
    ) -> Result<Self, AnalysisError> {
        if recordings.is_empty() {
            return Err(AnalysisError::NoRecordings);
        }
        let data = recordings.repaired(faults, SystemKind::System)?.at_rate(rate, true)?;
        let fit = model.fit(&data.records)?;
        let mut findings = Vec::new();
        if !fit.termination.converged() {
            findings.push(Finding::warning(
                "not-converged",
                format!("the search did not converge: {}", fit.termination),
            ));
        }
        if fit.covariance().is_none() {
            let message = "the data leave a combination of coefficients undetermined: there are no error bars";
            findings.push(Finding::undetermined("singular", message));
        }
        for (name, _) in &model.inputs {
            let own = format!("[{name}]");
            let gains = fit
                .parameters()
                .into_iter()
                .filter(|(p, _)| p.starts_with('b') && p.ends_with(&own));
            let open = |e: &hoid_model::uncertainty::Estimate| {
                e.standard_error
                    .is_some_and(|s| e.value.abs() < MIN_STANDARD_ERRORS * s)
            };
            if gains.clone().count() > 0 && gains.clone().all(|(_, e)| open(&e)) {
                findings.push(Finding::warning(
                    "undetermined-input",
                    format!(
                        "no coefficient of {name} differs from zero by at least two standard errors: the response to \
                         {name} is not determined"
                    ),
                ));
            }
        }
        let inputs: Vec<&str> = model.inputs.iter().map(|(name, _)| name.as_str()).collect();
        findings.extend(data.loop_findings(None, None, &inputs));
        let verdict = data.with_findings(Verdict::of(findings));
        Ok(Self {
            fit,
            roles,
            verdict,
            data,
        })
    }

    /// Returns the result as a JSON object.
    pub fn json(&self) -> Map<String, Value> {
        let (fit, data) = (&self.fit, &self.data);
        let model = &fit.model;
        let settings = [Setting::new("structure", model.structure.name().to_owned())];
        let mut map = envelope(
            "polynomial",
            &data.names,
            &data.records,
            &data.accounts,
            &self.verdict,
            &settings,
        );
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        let of_inputs = |of: fn(&InputOrders) -> usize| model.inputs.iter().map(|(_, o)| of(o)).collect::<Vec<_>>();
        set("structure", json!(model.structure.name()));
        set(
            "orders",
            json!({
                "na": model.na, "nb": of_inputs(|o| o.nb), "nc": model.nc, "nd": model.nd,
                "nf": of_inputs(|o| o.nf), "nk": of_inputs(|o| o.nk),
            }),
        );
        let parameters = fit.parameters();
        let coefficient = |(name, e): &(String, hoid_model::uncertainty::Estimate)| json!({"name": name, "value": number(e.value), "standard_error": optional(e.standard_error)});
        set("parameters", parameters.iter().map(coefficient).collect());
        set("loss", number(fit.loss));
        set("innovation_variance", number(fit.innovation_variance));
        set("residuals", json!(fit.residuals));
        set("termination", termination(&fit.termination));
        set(
            "fit",
            json!({"vaf_prediction": number(fit.vaf_prediction), "aic": number(fit.aic())}),
        );
        let nyquist = fit.sample_time.nyquist_rad_s();
        let omega: Vec<f64> = RESPONSE_FREQUENCIES.iter().map(|share| share * nyquist).collect();
        let channel = |(k, (name, _)): (usize, &(String, InputOrders))| {
            let own = format!("[{name}]");
            let own = parameters.iter().filter(|(p, _)| p.ends_with(&own));
            json!({
                "input": name,
                "role": k.checked_sub(1).map_or("feedback", |k| self.roles[k].name()),
                "form": Value::Null,
                "parameters": own.map(coefficient).collect::<Vec<_>>(),
                "response": crate::json::response(&fit.frequency_response(k, &omega)),
            })
        };
        set("channels", model.inputs.iter().enumerate().map(channel).collect());
        set(
            "covariance",
            fit.covariance().map_or(Value::Null, |c| {
                let rows = c.chunks(parameters.len());
                rows.map(|row| row.iter().map(|v| number(*v)).collect::<Vec<_>>())
                    .collect::<Vec<_>>()
                    .into()
            }),
        );
        map
    }
}
