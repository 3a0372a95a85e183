//! The operator of a person, shown to people and to programs.

use hoid::analysis::Account;
use hoid::ident::{
    MarginEstimates,
    family::{
        AgreementMethod, AgreementPair, AgreementRow, ClusterKind, FamilyFit, FormFigures, LoopMeasures,
        OperatorOfRecord, Parameter,
    },
    validation::GoodnessOfFit,
};
use hoid::model::{ContinuousTransferFunction, FamilyOperator, GainUnit, Record, uncertainty::Estimate};
use hoid::report::{Answer, AnswerRow, numbers, sentence};
use serde_json::{Map, Value, json};

use crate::{
    error::CliError,
    json::{self, number, optional},
    text,
};

/// Everything that was found.
pub struct Found<'a> {
    pub fit: &'a FamilyFit,
    pub files: &'a [String],
    /// As they were fitted: without their mean.
    pub records: &'a [Record],
    pub accounts: &'a [Account],
    pub element: Option<&'a ContinuousTransferFunction>,
    pub validation: Option<(&'a str, GoodnessOfFit)>,
    pub settings: &'a [(String, String)],
}

impl Found<'_> {
    /// The answer in words.
    fn sentence(&self) -> Option<String> {
        let of = self.fit.operator(0);
        let known = of.parameters.iter().filter(|p| p.determined);
        let here = self.element.and_then(|element| self.fit.loop_measures(0, element));
        sentence(
            known.map(|p| (p.name.as_str(), p.value)),
            here.as_ref().map(|m| m.crossover_rad_s),
            here.as_ref().map(|m| m.phase_margin_deg),
        )
    }

    /// The head of a page.
    pub fn answer_of_page(&self) -> Answer {
        let gain = self.records.first().map(GainUnit::of).unwrap_or_default();
        let row = |p: &Parameter| AnswerRow {
            name: p.name.clone(),
            unit: gain.unit(&p.name, p.unit),
            estimate: p.determined.then_some(Estimate {
                value: p.value,
                standard_error: p.standard_error,
            }),
            interval: p.interval,
            remark: remark(p),
        };
        Answer {
            verdict: self.fit.verdict.clone(),
            sentence: self.sentence(),
            parameters: self.fit.operator(0).parameters.iter().map(row).collect(),
        }
    }

    /// Crossover and margin in the form of all reports.
    pub fn margins(&self) -> Option<MarginEstimates> {
        let found = self.fit.loop_measures(0, self.element?)?;
        Some(MarginEstimates {
            crossover_rad_s: Some(found.crossover_rad_s),
            phase_margin_deg: Some(found.phase_margin_deg),
            phase_crossover_rad_s: None,
            gain_margin_db: None,
        })
    }

    fn quality(&self) -> Result<GoodnessOfFit, CliError> {
        let mut validations = Vec::with_capacity(self.records.len());
        for (k, record) in self.records.iter().enumerate() {
            validations.push(self.fit.operator(k).polynomial_fit.validate(record)?);
        }
        Ok(GoodnessOfFit::pooled(self.records.iter().zip(&validations)))
    }

    /// The answer, and with `verbose` what is behind it.
    pub fn page(&self, verbose: bool) -> Result<String, CliError> {
        let mut page = self.answer()?;
        if !verbose {
            page.push_str(text::MORE);
            return Ok(page);
        }
        page.push_str(&self.methods());
        if self.fit.forms.len() > 1 {
            page.push_str(&format!("\n{}\n", forms(&self.fit.forms, self.fit.form.name())));
        }
        page.push_str(&self.about()?);
        page.push_str(&text::levels(self.files, self.accounts));
        page.push_str(&text::settings(self.settings));
        Ok(page)
    }

    /// Verdict, parameters with their intervals, loop, fit, and what they are of.
    fn answer(&self) -> Result<String, CliError> {
        let fit = self.fit;
        let gain = self.records.first().map(GainUnit::of).unwrap_or_default();
        let mut page = text::verdict(&fit.verdict);
        page.push_str(&self.fit.title());
        page.push('\n');
        if let Some(words) = self.sentence() {
            page.push_str(&format!("{words}\n"));
        }
        for (k, of) in fit.operators.iter().enumerate() {
            if fit.operators.len() > 1 {
                page.push_str(&format!("{}:\n", self.files[k]));
            }
            page.push_str(&parameters(of, &gain));
            page.push('\n');
        }
        if let Some(element) = self.element {
            let here = fit.loop_measures(0, element);
            page.push_str(&format!("Open loop with {element}: {}\n", measures(here.as_ref())));
        }
        let quality = self.quality()?;
        let coherence = fit.coherent_share;
        page.push_str(&format!(
            "Fit: VAF of the prediction {:.2} %{}{}.\n",
            quality.vaf_prediction,
            coherence.map_or_else(String::new, |share| format!(
                "; coherence of u with the excitation {share:.2}"
            )),
            fit.agreement
                .as_ref()
                .map_or_else(String::new, |a| format!("; methods agree with p = {:.2}", a.p_value)),
        ));
        if let Some((file, q)) = &self.validation {
            page.push_str(&format!(
                "On {file}: VAF simulation {:.2} %, prediction {:.2} %.\n",
                q.vaf_simulation, q.vaf_prediction
            ));
        }
        page.push_str(&text::records(self.files, self.records, self.accounts, false));
        Ok(page)
    }

    /// The methods side by side.
    fn methods(&self) -> String {
        let fit = self.fit;
        let gain = self.records.first().map(GainUnit::of).unwrap_or_default();
        let lines = fit.lines.as_ref().map(|lines| lines.parameters());
        let instrumental = (fit.instrumental.as_ref())
            .filter(|found| found.termination.converged())
            .map(|found| found.parameters());
        if lines.is_none() && instrumental.is_none() {
            return String::new();
        }
        let columns = [("at the lines", lines), ("RIV-BJ", instrumental)];
        let others: Vec<_> = columns.into_iter().filter_map(|(head, of)| Some((head, of?))).collect();
        let heads: Vec<&str> = ["parameter", "prediction error"]
            .into_iter()
            .chain(others.iter().map(|(head, _)| *head))
            .collect();
        let mut rows = text::table(&heads);
        for (k, here) in fit.operator(0).parameters.iter().enumerate() {
            let beside = others.iter().filter_map(|(_, of)| of.get(k));
            let beside = beside.map(|(_, there)| with_error(there.value, there.standard_error));
            rows.add_row(
                [named(here, &gain), with_error(here.value, here.standard_error)]
                    .into_iter()
                    .chain(beside),
            );
        }
        let mut page = format!("\n{rows}\n");
        if let Some(element) = self.element {
            if fit.lines.is_some() {
                let at_lines = fit.loop_measures_at_lines(element);
                page.push_str(&format!(
                    "Open loop by the fit at the lines: {}\n",
                    measures(at_lines.as_ref())
                ));
            }
            if fit.instrumental.as_ref().is_some_and(|i| i.termination.converged()) {
                let by_instruments = fit.loop_measures_by_instruments(element);
                page.push_str(&format!("Open loop by RIV-BJ: {}\n", measures(by_instruments.as_ref())));
            }
        }
        if let Some(lines) = &fit.lines {
            let reduced = lines.reduced_chi_squared();
            page.push_str(&format!(
                "At the lines: chi^2 = {:.1} with {} degrees of freedom{}.\n",
                lines.chi_squared,
                lines.degrees_of_freedom,
                reduced.map_or(String::new(), |r| format!(" ({r:.2} each)"))
            ));
        }
        if let Some(agreement) = &fit.agreement {
            let pairs = agreement.pairs.iter().map(|pair| {
                format!(
                    "{} and {} p = {:.2}",
                    pair.methods.0.words(),
                    pair.methods.1.words(),
                    pair.p_value
                )
            });
            page.push_str(&format!(
                "Agreement over {} coordinates that the data determine: {}; together p = {:.2}.\n",
                agreement.rows.len(),
                pairs.collect::<Vec<_>>().join(", "),
                agreement.p_value
            ));
        }
        page
    }

    fn about(&self) -> Result<String, CliError> {
        let fit = self.fit;
        let mut page = String::from("\n");
        if let Some(free) = &fit.free_model {
            page.push_str(&format!(
                "Box-Jenkins of the same orders: loss {} against {}, likelihood ratio {:.1} with {} degrees of freedom (p = {:.2}).\n",
                numbers::plain(free.loss),
                numbers::plain(fit.loss),
                free.likelihood_ratio,
                free.degrees_of_freedom,
                free.p_value
            ));
        }
        let clusters = match fit.cluster_kind {
            ClusterKind::Runs => format!("{} runs", fit.clusters),
            ClusterKind::Blocks => format!("{} blocks of the records", fit.clusters),
        };
        page.push_str(&format!(
            "Errors by the scatter of {clusters}: variances {:.2} times those of white residuals. Intervals of 95 %, Student's.\n",
            fit.inflation
        ));
        let quality = self.quality()?;
        page.push_str(&format!(
            "VAF prediction {:.2} %; simulation {:.2} %, which says little of people: an operator with a lag integrates offset and \
             drift of e{}.\n",
            quality.vaf_prediction,
            quality.vaf_simulation,
            fit.coherent_share.map_or(String::new(), |share| format!(
                "; at the lines the mean coherence of u with the excitation is {:.2}",
                share
            ))
        ));
        page.push_str(&format!("Search: {}.\n", fit.termination));
        let entries = fit.prior.entries();
        let entry = |e: &hoid::ident::family::ParameterPrior| {
            format!(
                "{} = {} within a factor of {:.2}",
                e.parameter,
                e.centre,
                e.spread.exp()
            )
        };
        let mut sources: Vec<&str> = entries.iter().map(|e| e.source.as_str()).collect();
        sources.dedup();
        page.push_str(&match entries {
            [] => "Prior: none.\n".to_owned(),
            all => format!(
                "Prior: {} ({}).\n",
                all.iter().map(entry).collect::<Vec<_>>().join(", "),
                sources.join("; ")
            ),
        });
        Ok(page)
    }

    pub fn to_json(&self) -> Result<Value, CliError> {
        let fit = self.fit;
        let of = fit.operator(0);
        let mut map = Map::new();
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        set("hoid", json!(env!("CARGO_PKG_VERSION")));
        set("verdict", json::verdict(&fit.verdict));
        set("records", json::records(self.files, self.records, self.accounts));
        set("warnings", json::warnings(self.files, self.accounts));
        set("faults", json::faults(self.files, self.accounts));
        set("structure", json!("grey-box"));
        set("form", json!(fit.form.name()));
        set("neuromuscular", json!(fit.neuromuscular));
        set("orders", json::orders(&of.polynomial_fit.orders()));
        set("parameters", of.parameters.iter().map(parameter).collect());
        if let Some(element) = self.element {
            set("open_loop", open_loop(fit.loop_measures(0, element).as_ref()));
        }
        set("loss", number(fit.loss));
        set("innovation_variance", number(fit.innovation_variance));
        set("residuals", json!(fit.residuals));
        set("termination", json::termination(&fit.termination));
        let mut quality = json::goodness(&self.quality()?);
        quality.insert("coherent_share".to_owned(), optional(fit.coherent_share));
        set("fit", Value::Object(quality));
        set("operator", operator(of));
        if fit.operators.len() > 1 {
            set("operators", fit.operators.iter().map(operator).collect());
        }
        set("remnant", Value::Null);
        set("noise", json!({"c": fit.noise.0, "d": fit.noise.1}));
        set("forms", fit.forms.iter().map(form_figures).collect());
        set("lines", self.lines_json());
        set("riv_bj", self.instrumental_json());
        set("agreement", self.agreement_json());
        set(
            "box_jenkins",
            fit.free_model.map_or(Value::Null, |free| {
                json!({
                    "loss": number(free.loss),
                    "likelihood_ratio": number(free.likelihood_ratio),
                    "degrees_of_freedom": free.degrees_of_freedom,
                    "p_value": number(free.p_value),
                })
            }),
        );
        set("covariance", covariance(&of.operator, of.covariance.as_deref()));
        set(
            "errors",
            json!({
                "clusters": fit.clusters,
                "kind": match fit.cluster_kind {
                    ClusterKind::Runs => "runs",
                    ClusterKind::Blocks => "blocks",
                },
                "inflation": number(fit.inflation),
                "largest_ratio_to_model_based": optional(fit.error_ratio),
                "model_based": covariance(&of.operator, of.model_based.as_deref()),
            }),
        );
        let prior = fit.prior.entries().iter();
        set(
            "prior",
            prior
                .map(|e| json!({"parameter": e.parameter, "centre": e.centre, "spread": e.spread, "source": e.source}))
                .collect(),
        );
        if let Some((file, q)) = &self.validation {
            set("validation", json::validation(file, q));
        }
        set("candidates", json!([]));
        set("settings", json::settings(self.settings));
        Ok(Value::Object(map))
    }

    fn lines_json(&self) -> Value {
        let Some(lines) = &self.fit.lines else {
            return why_not(self.fit.no_lines.as_ref());
        };
        let mut map = Map::new();
        map.insert("parameters".to_owned(), all_named(&lines.parameters()));
        map.insert("chi2".to_owned(), number(lines.chi_squared));
        map.insert("degrees_of_freedom".to_owned(), json!(lines.degrees_of_freedom));
        map.insert("held_out".to_owned(), optional(lines.held_out_total()));
        map.insert("converged".to_owned(), json!(lines.termination.converged()));
        if let Some(element) = self.element {
            let measures = self.fit.loop_measures_at_lines(element);
            map.insert("open_loop".to_owned(), open_loop(measures.as_ref()));
        }
        Value::Object(map)
    }

    fn instrumental_json(&self) -> Value {
        let Some(found) = &self.fit.instrumental else {
            return why_not(self.fit.no_instrumental.as_ref());
        };
        let mut map = Map::new();
        map.insert("parameters".to_owned(), all_named(&found.parameters()));
        map.insert("nd".to_owned(), json!(found.noise_order));
        map.insert("converged".to_owned(), json!(found.termination.converged()));
        map.insert("termination".to_owned(), json!(found.termination.to_string()));
        if let Some(element) = self.element {
            let measures = self.fit.loop_measures_by_instruments(element);
            map.insert("open_loop".to_owned(), open_loop(measures.as_ref()));
        }
        Value::Object(map)
    }

    fn agreement_json(&self) -> Value {
        self.fit.agreement.as_ref().map_or(Value::Null, |agreement| {
            let row = |r: &AgreementRow| {
                let mut map = Map::new();
                map.insert("coordinate".to_owned(), json!(r.coordinate.name()));
                for method in [
                    AgreementMethod::PredictionError,
                    AgreementMethod::Lines,
                    AgreementMethod::Instrumental,
                ] {
                    let pair = r.of(method).map_or(
                        Value::Null,
                        |(value, error)| json!({"value": number(value), "standard_error": number(error)}),
                    );
                    map.insert(method.name().to_owned(), pair);
                }
                map.insert("difference_in_errors".to_owned(), number(r.difference_in_errors));
                Value::Object(map)
            };
            let pair = |pair: &AgreementPair| {
                json!({
                    "methods": [pair.methods.0.name(), pair.methods.1.name()],
                    "chi2": number(pair.statistic),
                    "p_value": number(pair.p_value),
                })
            };
            json!({
                "coordinates": agreement.rows.iter().map(row).collect::<Vec<_>>(),
                "pairs": agreement.pairs.iter().map(pair).collect::<Vec<_>>(),
                "chi2": number(agreement.statistic),
                "p_value": number(agreement.p_value),
            })
        })
    }
}

/// Of a method that gave nothing: the reason, where there is one.
fn why_not(reason: Option<&String>) -> Value {
    reason.map_or(Value::Null, |why| json!({"reason": why}))
}

/// Estimates in the order of the form, each with its name.
fn all_named(parameters: &[(&'static str, Estimate)]) -> Value {
    parameters.iter().map(|(name, e)| json::named(name, e)).collect()
}

fn named(p: &Parameter, gain: &GainUnit) -> String {
    match gain.unit(&p.name, p.unit) {
        unit if unit.is_empty() => p.name.clone(),
        unit => format!("{} ({unit})", p.name),
    }
}

/// Value and error with the digits that the error allows; no false digits where the error exceeds
/// the value.
fn with_error(value: f64, error: Option<f64>) -> String {
    match error {
        _ if value.is_infinite() => "infinite".to_owned(),
        Some(error) if error > value.abs() => "not known".to_owned(),
        Some(_) => {
            let (value, error) = numbers::with_uncertainty(value, error);
            format!("{value} ± {error}")
        }
        None => numbers::plain(value),
    }
}

/// What a parameter is that the data do not determine.
fn undetermined(p: &Parameter) -> &'static str {
    match (p.determined, p.prior_share > 0.5) {
        (true, _) => "",
        (false, true) => "the prior alone",
        (false, false) => "not determined",
    }
}

/// The same with the share of the prior.
fn remark(p: &Parameter) -> String {
    let words = undetermined(p);
    match (words, p.prior_share > 0.01) {
        (_, false) => words.to_owned(),
        ("", true) => format!("{:.0} % of it prior", 100.0 * p.prior_share),
        (_, true) => format!("{words}, {:.0} % of it prior", 100.0 * p.prior_share),
    }
}

/// Parameters with interval, prior share and whether they are determined.
fn parameters(of: &OperatorOfRecord, gain: &GainUnit) -> String {
    let mut rows = text::table(&["parameter", "value", "95 % from", "to", "of it prior"]);
    for p in &of.parameters {
        let end = |v: f64| {
            if v.is_infinite() {
                "open".to_owned()
            } else {
                text::significant(v)
            }
        };
        let (low, high) = p
            .interval
            .map_or_else(Default::default, |(low, high)| (end(low), end(high)));
        let share = if p.prior_share > 0.0 {
            format!("{:.0} %", 100.0 * p.prior_share)
        } else {
            String::new()
        };
        let value = match undetermined(p) {
            "" => with_error(p.value, p.standard_error),
            why => why.to_owned(),
        };
        rows.add_row([named(p, gain), value, low, high, share]);
    }
    rows.to_string()
}

fn measures(found: Option<&LoopMeasures>) -> String {
    let Some(m) = found else {
        return "no crossover".to_owned();
    };
    let interval = |of: Option<(f64, f64)>| match of {
        Some((low, high)) => format!(" (95 %: {} to {})", text::significant(low), text::significant(high)),
        None => String::new(),
    };
    format!(
        "crossover {} rad/s{}, phase margin {} deg{}",
        with_error(m.crossover_rad_s.value, m.crossover_rad_s.standard_error),
        interval(m.crossover_interval()),
        with_error(m.phase_margin_deg.value, m.phase_margin_deg.standard_error),
        interval(m.phase_margin_interval()),
    )
}

fn forms(all: &[FormFigures], chosen: &str) -> String {
    let mut rows = text::table(&["form", "loss", "criterion", "held out", "chi^2", "degrees", ""]);
    let least = all.iter().filter_map(|f| f.criterion).fold(f64::INFINITY, f64::min);
    for f in all {
        let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.1}"));
        let sign = if f.form.name() == chosen { "chosen" } else { "" };
        rows.add_row([
            f.form.to_string(),
            f.loss.map_or("none".to_owned(), numbers::plain),
            f.criterion.map_or(String::new(), |c| format!("+{:.1}", c - least)),
            number(f.held_out),
            number(f.chi_squared),
            f.degrees_of_freedom.map_or(String::new(), |d| d.to_string()),
            sign.to_owned(),
        ]);
    }
    rows.to_string()
}

fn parameter(p: &Parameter) -> Value {
    json!({
        "name": p.name,
        "unit": p.unit,
        "value": number(p.value),
        "standard_error": optional(p.standard_error),
        "interval": p.interval.map_or(Value::Null, |(low, high)| json!([number(low), number(high)])),
        "prior_share": number(p.prior_share),
        "determined": p.determined,
    })
}

/// The operator by the names of its parameters.
fn operator(of: &OperatorOfRecord) -> Value {
    let mut map = Map::new();
    map.insert("convertible".to_owned(), json!(true));
    map.insert("form".to_owned(), json!(of.operator.form().name()));
    for p in &of.parameters {
        let mut value = parameter(p);
        if let Some(fields) = value.as_object_mut() {
            fields.remove("name");
        }
        map.insert(p.name.clone(), value);
    }
    Value::Object(map)
}

fn open_loop(found: Option<&LoopMeasures>) -> Value {
    let of = |value: fn(&LoopMeasures) -> Estimate, interval: fn(&LoopMeasures) -> Option<(f64, f64)>| {
        found.map(|m| json::estimate_within(&value(m), interval(m)))
    };
    json!({
        "crossover_rad_s": of(|m| m.crossover_rad_s, LoopMeasures::crossover_interval),
        "phase_margin_deg": of(|m| m.phase_margin_deg, LoopMeasures::phase_margin_interval),
    })
}

fn form_figures(f: &FormFigures) -> Value {
    json!({
        "form": f.form.name(),
        "loss": optional(f.loss),
        "criterion": optional(f.criterion),
        "held_out": optional(f.held_out),
        "chi2": optional(f.chi_squared),
        "degrees_of_freedom": f.degrees_of_freedom,
        "converged": f.converged,
    })
}

/// Coordinates with their names and the rows of their covariance.
fn covariance(operator: &FamilyOperator, covariance: Option<&[f64]>) -> Value {
    let coordinates = operator.form().coordinates(operator.has_neuromuscular());
    let p = coordinates.len();
    let names: Vec<&str> = coordinates.iter().map(|c| c.name()).collect();
    covariance.map_or(Value::Null, |c| {
        let rows: Vec<Vec<Value>> = c
            .chunks(p)
            .map(|row| row.iter().map(|v| number(*v)).collect())
            .collect();
        json!({"coordinates": names, "values": operator.coordinates(), "matrix": rows})
    })
}
