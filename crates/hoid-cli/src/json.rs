//! Results as JSON objects, the contract with other programs.

use hoid::analysis::Account;
use hoid::ident::{
    Choice, Fit, GreyBoxFit, IdentError, MarginEstimates, Root, Termination,
    grey_box::OrderCandidate,
    validation::{GoodnessOfFit, LjungBox, Validation},
};
use hoid::model::{
    Fault, Finding, NotConvertible, Orders, Record, Verdict,
    margins::Margins,
    uncertainty::{Estimate, OperatorEstimate, RemnantEstimate},
};
use hoid::track::{Change, Determined, NoCrossover, OpenLoop, Response, TrackFault};
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::{error::CliError, output};

/// A number, or null where there is none: JSON has no NaN.
pub fn number(value: f64) -> Value {
    serde_json::Number::from_f64(value).map_or(Value::Null, Value::Number)
}

pub fn optional(value: Option<f64>) -> Value {
    value.map_or(Value::Null, number)
}

pub fn estimate(e: &Estimate) -> Value {
    json!({"value": number(e.value), "standard_error": optional(e.standard_error)})
}

/// Gain and phase at frequencies in rad/s, each where there is an estimate.
pub fn responses(at_rad_s: &[f64], of: impl Fn(usize, f64) -> Option<Response>) -> Value {
    let each = at_rad_s.iter().enumerate().map(|(place, omega)| {
        let response = of(place, *omega);
        json!({
            "omega_rad_s": omega,
            "gain_db": response.map(|r| estimate(&r.gain_db())),
            "phase_deg": response.map(|r| estimate(&r.phase_deg())),
        })
    });
    Value::Array(each.collect())
}

/// Crossover and phase margin of a recursion, or why there are none.
pub fn open_loop(found: &Result<OpenLoop, NoCrossover>) -> Value {
    match found {
        Ok(found) => json!({
            "crossover_rad_s": estimate(&found.crossover_rad_s),
            "phase_margin_deg": estimate(&found.phase_margin_deg),
        }),
        Err(reason) => json!({"crossover_rad_s": null, "phase_margin_deg": null, "reason": reason.words()}),
    }
}

/// The operator of a recursion, which says of each parameter whether the data determine it.
pub fn tracked_operator(
    found: &Result<OperatorEstimate, NotConvertible>,
    determined: impl Fn(&OperatorEstimate) -> Vec<Determined>,
) -> Value {
    let mut whole = operator(found);
    for (name, yes) in found.as_ref().map(determined).unwrap_or_default() {
        whole[name]["determined"] = json!(yes);
    }
    whole
}

/// The same with its interval of 95 %, null where there is none.
pub fn estimate_within(e: &Estimate, interval: Option<(f64, f64)>) -> Value {
    json!({
        "value": number(e.value),
        "standard_error": optional(e.standard_error),
        "interval": interval.map(|(low, high)| [number(low), number(high)]),
    })
}

/// What a result is worth: the level, what speaks against it, what is worth knowing besides, and
/// all of it with its names for programs.
pub fn verdict(v: &Verdict) -> Value {
    json!({
        "level": v.level.name(),
        "reasons": v.reasons().collect::<Vec<_>>(),
        "notes": v.notes().collect::<Vec<_>>(),
        "findings": v.findings().iter().map(finding).collect::<Vec<_>>(),
    })
}

/// What makes a result doubtful, or is worth knowing.
pub fn finding(f: &Finding) -> Value {
    json!({"kind": f.kind, "severity": f.severity.name(), "words": f.words})
}

/// A span that the guard of a recursion found.
pub fn track_fault(fault: &TrackFault) -> Value {
    json!({
        "kind": fault.kind.name(),
        "channel": fault.channel.name(),
        "from": number(fault.from_s),
        "to": number(fault.to_s),
        "size": number(fault.size),
        "action": fault.action.name(),
    })
}

/// A change of the person, declared at a time in s.
pub fn change(declared_at: Option<f64>, c: &Change) -> Value {
    let before_and_after = |pair: &[Estimate; 2]| json!({"before": estimate(&pair[0]), "after": estimate(&pair[1])});
    let numbers = |pair: &[f64; 2]| json!({"before": number(pair[0]), "after": number(pair[1])});
    json!({
        "t": optional(declared_at),
        "since": optional(declared_at.map(|t| t - c.seconds_ago)),
        "probability": number(c.probability()),
        "log_odds": number(c.odds),
        "changed": c.changed(),
        "K_e": before_and_after(&c.k_e),
        "K_e_dot": before_and_after(&c.k_e_dot),
        "omega_nm": before_and_after(&c.omega_nm_rad_s),
        "zeta_nm": before_and_after(&c.zeta_nm),
        "tau_e": before_and_after(&c.tau_e_s),
        "T_L": numbers(&c.t_l_s),
        "innovation_variance": numbers(&c.innovation_variance),
        "z": {
            "K_e": number(c.z[0]),
            "K_e_dot": number(c.z[1]),
            "omega_nm": number(c.z[2]),
            "zeta_nm": number(c.z[3]),
            "remnant": number(c.z[4]),
            "tau_e": number(c.z[5]),
        },
    })
}

pub fn orders(o: &Orders) -> Value {
    json!({"na": o.na, "nb": o.nb, "nc": o.nc, "nd": o.nd, "nf": o.nf, "nk": o.nk})
}

/// The operator, or why there is none.
pub fn operator(found: &Result<OperatorEstimate, NotConvertible>) -> Value {
    match found {
        Ok(o) => {
            let mut map = Map::new();
            map.insert("convertible".to_owned(), json!(true));
            map.insert("stable".to_owned(), json!(o.parameters().is_stable()));
            for (name, _, e) in o.rows() {
                map.insert(name.to_owned(), estimate(&e));
            }
            Value::Object(map)
        }
        // Another order has no meaning as an operator at all.
        Err(NotConvertible::OtherOrders { .. } | NotConvertible::PolesInBoth { .. }) => Value::Null,
        Err(reason) => json!({"convertible": false, "reason": reason.to_string()}),
    }
}

fn remnant(found: &Result<RemnantEstimate, NotConvertible>) -> Value {
    match found {
        Ok(r) => json!({
            "convertible": true,
            "order": r.order,
            "discretisation": r.discretisation.name(),
            "T_n": estimate(&r.t_n_s),
            "K_n": estimate(&r.k_n),
        }),
        Err(reason) => json!({"convertible": false, "reason": reason.to_string()}),
    }
}

pub fn margins(m: &Margins) -> Map<String, Value> {
    let mut map = Map::new();
    map.insert("crossover_rad_s".to_owned(), optional(m.crossover_rad_s));
    map.insert("phase_margin_deg".to_owned(), optional(m.phase_margin_deg));
    map.insert("gain_margin_db".to_owned(), optional(m.gain_margin_db));
    map.insert("phase_crossover_rad_s".to_owned(), optional(m.phase_crossover_rad_s));
    map
}

pub fn margin_estimates(m: &MarginEstimates) -> Value {
    let or_null = |e: &Option<Estimate>| e.as_ref().map_or(Value::Null, estimate);
    json!({
        "crossover_rad_s": or_null(&m.crossover_rad_s),
        "phase_margin_deg": or_null(&m.phase_margin_deg),
        "gain_margin_db": or_null(&m.gain_margin_db),
        "phase_crossover_rad_s": or_null(&m.phase_crossover_rad_s),
    })
}

fn root(r: &Root, sample_time_s: f64) -> Value {
    let of_s = r.frequency_and_damping(sample_time_s);
    json!({
        "polynomial": r.polynomial.to_string(),
        "real": number(r.value.re),
        "imaginary": number(r.value.im),
        "standard_error_real": optional(r.standard_error.map(|e| e.0)),
        "standard_error_imaginary": optional(r.standard_error.map(|e| e.1)),
        "frequency_rad_s": optional(of_s.map(|s| s.0)),
        "damping": optional(of_s.map(|s| s.1)),
    })
}

pub fn ljung_box(test: Option<&LjungBox>) -> Value {
    test.map_or(Value::Null, |t| {
        json!({
            "statistic": number(t.statistic),
            "degrees_of_freedom": t.degrees_of_freedom,
            "p_value": number(t.p_value),
        })
    })
}

fn residual_tests(v: &Validation) -> Value {
    let signs = v.diagnostics();
    json!({
        "ljung_box": ljung_box(v.ljung_box.as_ref()),
        "coloured_residuals": signs.coloured_residuals,
        "under_modelled": signs.under_modelled,
        "feedback": signs.feedback,
    })
}

/// How well a model tells the records that it was fitted to, or others.
pub fn goodness(q: &GoodnessOfFit) -> Map<String, Value> {
    let rows = [
        ("vaf_simulation", q.vaf_simulation),
        ("vaf_prediction", q.vaf_prediction),
        ("nrmse_simulation", q.nrmse_simulation),
        ("nrmse_prediction", q.nrmse_prediction),
    ];
    rows.into_iter()
        .map(|(name, value)| (name.to_owned(), number(value)))
        .collect()
}

/// The same on another file.
pub fn validation(file: &str, q: &GoodnessOfFit) -> Value {
    let file = std::iter::once(("file".to_owned(), json!(file)));
    Value::Object(file.chain(goodness(q)).collect())
}

/// How a search ended.
pub fn termination(t: &Termination) -> Value {
    json!({
        "reason": t.reason.to_string(),
        "converged": t.converged(),
        "iterations": t.iterations,
    })
}

/// What the call was, by name.
pub fn settings(all: &[(String, String)]) -> Value {
    Value::Object(all.iter().map(|(k, v)| (k.clone(), json!(v))).collect())
}

/// A parameter with its name.
pub fn named(name: &str, e: &Estimate) -> Value {
    json!({"name": name, "value": number(e.value), "standard_error": optional(e.standard_error)})
}

fn quality(q: &GoodnessOfFit, fit: &Fit) -> Value {
    let mut map = goodness(q);
    for (name, value) in [
        ("aic", Some(fit.aic())),
        ("aicc", Some(fit.aicc())),
        ("bic", Some(fit.bic())),
        ("fpe", Some(fit.fpe())),
        ("mdl", Some(fit.mdl())),
        ("yic", fit.yic()),
    ] {
        map.insert(name.to_owned(), optional(value));
    }
    Value::Object(map)
}

/// Everything that `identify` found.
pub struct Identified<'a> {
    pub verdict: &'a Verdict,
    pub files: &'a [String],
    pub records: &'a [Record],
    pub accounts: &'a [Account],
    pub fit: &'a Fit,
    pub choice: Option<&'a Choice>,
    pub grey_box: Option<&'a GreyBoxFit>,
    pub quality: GoodnessOfFit,
    pub operator: &'a Result<OperatorEstimate, NotConvertible>,
    /// Of polynomials of other orders: the operator of the family that they stand for.
    pub family: Option<Value>,
    pub remnant: Option<&'a Result<RemnantEstimate, NotConvertible>>,
    pub margins: Option<&'a MarginEstimates>,
    /// Residual tests on each record.
    pub validations: &'a [Validation],
    /// Horizon, VAF and NRMSE of the prediction that far ahead.
    pub ahead: Option<(usize, f64, f64)>,
    pub validation: Option<(&'a str, GoodnessOfFit)>,
    pub settings: &'a [(String, String)],
}

impl Identified<'_> {
    /// The answer in words.
    pub fn sentence(&self) -> Option<String> {
        let of = self.operator.as_ref().ok().filter(|_| self.has_operator());
        let named = of.iter().flat_map(|o| o.rows()).map(|(name, _, e)| (name, e.value));
        let margins = self.margins;
        hoid::report::sentence(
            named,
            margins.and_then(|m| m.crossover_rad_s),
            margins.and_then(|m| m.phase_margin_deg),
        )
    }

    /// Whether the parameters of an operator were found, of a gain with a lead or of another form.
    pub fn has_operator(&self) -> bool {
        let of_family = self.family.as_ref().map(|found| found["convertible"] == json!(true));
        of_family.unwrap_or(self.operator.is_ok()) && self.fit.model().structure().has_input()
    }

    pub fn to_json(&self) -> Value {
        let fit = self.fit;
        let parameters: Vec<Value> = fit.parameters().iter().map(|(name, e)| named(name, e)).collect();
        let mut map = Map::new();
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        set("hoid", json!(env!("CARGO_PKG_VERSION")));
        set("records", records(self.files, self.records, self.accounts));
        set("warnings", warnings(self.files, self.accounts));
        set("faults", faults(self.files, self.accounts));
        set("verdict", verdict(self.verdict));
        let structure = fit.model().structure().name();
        set(
            "structure",
            json!(if fit.is_grey_box() { "grey-box" } else { structure }),
        );
        set("orders", orders(&fit.orders()));
        set("parameters", Value::Array(parameters));
        set("loss", number(fit.loss()));
        set("innovation_variance", number(fit.innovation_variance()));
        set("termination", termination(&fit.termination()));
        set("start", json!(fit.start()));
        set("residuals", json!(fit.residual_count()));
        set("initial_states", json!(fit.state_count()));
        set("stable", json!(fit.model().is_stable()));
        set("fit", quality(&self.quality, fit));
        set(
            "operator",
            self.family.clone().unwrap_or_else(|| operator(self.operator)),
        );
        set("remnant", self.remnant.map_or(Value::Null, remnant));
        if let Some(m) = self.margins {
            set("open_loop", margin_estimates(m));
        }
        let ts = fit.model().sample_time().s();
        set("roots", fit.roots().iter().map(|r| root(r, ts)).collect());
        // Residuals that are rounding say nothing.
        let tested = if fit.covariance().is_some() {
            self.validations
        } else {
            &[]
        };
        set("residual_tests", tested.iter().map(residual_tests).collect());
        if let Some((k, vaf, nrmse)) = self.ahead {
            set(
                "prediction_ahead",
                json!({"horizon": k, "vaf": number(vaf), "nrmse": number(nrmse)}),
            );
        }
        if let Some((file, q)) = &self.validation {
            set("validation", validation(file, q));
        }
        let interval = self.choice.and_then(Choice::delay_interval);
        set(
            "delay_interval",
            interval.map_or(Value::Null, |(low, high)| json!([low, high])),
        );
        set(
            "candidates",
            match (self.choice, self.grey_box) {
                (Some(choice), _) => candidates(choice),
                (None, Some(grey_box)) => remnant_orders(grey_box),
                (None, None) => json!([]),
            },
        );
        if let Some(grey_box) = self.grey_box {
            let each = (0..self.records.len()).map(|k| operator(&grey_box.operator(k)));
            set("operators", each.collect());
        }
        set("settings", settings(self.settings));
        Value::Object(map)
    }
}

/// Files and sampling of the records, and what was done to them.
pub fn records(files: &[String], records: &[Record], accounts: &[Account]) -> Value {
    let record = |((file, r), account): ((&String, &Record), &Account)| {
        let mut one = json!({
            "file": file,
            "samples": r.len(),
            "sample_time": number(r.sample_time().s()),
            "units": {
                "input": r.input_channel().map_or("", |channel| &channel.unit),
                "output": r.output_channel().unit,
            },
            "preparation": list(&account.steps),
            "trouble": list(&account.quality_issues),
        });
        if let Some(level) = &account.level {
            one["level"] = estimate(level);
        }
        one
    };
    files.iter().zip(records).zip(accounts).map(record).collect()
}

/// What is wrong with the sampling, in words.
pub fn warnings(files: &[String], accounts: &[Account]) -> Value {
    let all = files.iter().zip(accounts);
    all.flat_map(|(file, account)| {
        account
            .quality_issues
            .iter()
            .map(move |one| json!(format!("{file}: {one}")))
    })
    .collect()
}

/// All faults of the records, and what is wrong with their files, one object each.
pub fn faults(files: &[String], accounts: &[Account]) -> Value {
    let all = files.iter().zip(accounts);
    all.flat_map(|(file, account)| {
        let faults = account.faults.iter().map(move |one| fault(file, one));
        let issues = account.quality_issues.iter().map(move |issue| {
            let (first, last) = (issue.places.first(), issue.places.last());
            json!({
                "record": file,
                "kind": issue.kind.name(),
                "channel": issue.channel,
                "from": optional(first.and_then(|place| place.from_s)),
                "to": optional(last.and_then(|place| place.to_s)),
                "samples": issue.rows,
                "size": number(issue.size),
                "deviations": Value::Null,
                "action": "reported",
                "words": issue.text,
            })
        });
        faults.chain(issues)
    })
    .collect()
}

/// One fault as an object.
pub fn fault(record: &str, fault: &Fault) -> Value {
    json!({
        "record": record,
        "kind": fault.kind.name(),
        "channel": fault.channel,
        "from": number(fault.from_s),
        "to": number(fault.to_s),
        "samples": fault.samples,
        "size": number(fault.size),
        "deviations": optional(fault.deviations),
        "action": fault.action.name(),
        "words": fault.to_string(),
    })
}

/// What the library writes about itself, one object each.
pub fn list<T: Serialize>(items: &[T]) -> Value {
    // Numbers that JSON does not have become null; nothing else can fail.
    serde_json::to_value(items).unwrap_or(Value::Null)
}

/// Orders m of the remnant that a grey box tried.
fn remnant_orders(grey_box: &GreyBoxFit) -> Value {
    let row = |c: &OrderCandidate| match &c.outcome {
        Ok(f) => json!({
            "remnant_order": c.order,
            "loss": number(f.loss),
            "aic": number(f.aic),
            "bic": number(f.bic),
            "converged": f.converged,
        }),
        Err(reason) => json!({"remnant_order": c.order, "error": reason.to_string()}),
    };
    grey_box.candidates().iter().map(row).collect()
}

fn candidates(choice: &Choice) -> Value {
    let row = |c: &hoid::ident::Candidate| match &c.outcome {
        Ok(f) => json!({
            "orders": orders(&c.orders),
            "loss": number(f.loss),
            "aic": number(f.aic),
            "aicc": number(f.aicc),
            "bic": number(f.bic),
            "fpe": number(f.fpe),
            "mdl": number(f.mdl),
            "yic": optional(f.yic),
            "converged": f.converged,
        }),
        Err(reason) => json!({"orders": orders(&c.orders), "error": IdentError::to_string(reason)}),
    };
    Value::Array(choice.candidates.iter().map(row).collect())
}

/// Prints one object, indented, and nothing else.
///
/// # Errors
/// Those of [`output::print`].
pub fn print(value: &Value) -> Result<(), CliError> {
    output::print(&format!("{value:#}\n"))
}
