//! JSON form of a fit of polynomials, or of an operator with a remnant of order m.

use hoid_ident::{
    Candidate, Choice, Fit, GreyBoxFit, MarginEstimates, Root,
    family::{FamilyConversion, PoleRole},
    grey_box::OrderCandidate,
    validation::{GoodnessOfFit, Validation},
};
use hoid_model::{
    NotConvertible, Record, Verdict,
    remnant::RemnantDiscretisation,
    uncertainty::{OperatorEstimate, RemnantEstimate},
};
use serde_json::{Map, Value, json};

use super::{
    envelope, estimate, goodness, ljung_box, margin_estimates, named, number, operator, optional, orders,
    result::{JsonFit, OPERATOR_KIND, POLYNOMIAL_KIND},
    termination, validation,
};
use crate::{
    AnalysisError, answers::loop_margins, estimators::PolynomialFit, identified::IdentifiedModel, recordings::Account,
    registry, settings::Setting,
};

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

fn residual_tests(v: &Validation) -> Value {
    let signs = v.diagnostics();
    json!({
        "ljung_box": ljung_box(v.ljung_box.as_ref()),
        "coloured_residuals": signs.coloured_residuals,
        "under_modelled": signs.under_modelled,
        "feedback": signs.feedback,
    })
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

/// A fit of polynomials, and the quantities that follow from the fit and its records.
pub struct PolynomialResult<'a> {
    /// Verdict on the fit.
    pub verdict: &'a Verdict,
    /// Names of the fitted records.
    pub files: &'a [String],
    /// The fitted records.
    pub records: &'a [Record],
    /// Processing of each record.
    pub accounts: &'a [Account],
    /// Settings used in the fit.
    pub settings: &'a [Setting],
    /// The fitted polynomial model.
    pub fit: &'a Fit,
    /// The table of candidate orders, if orders were searched.
    pub choice: Option<&'a Choice>,
    /// The fit in physical parameters from which the polynomials were computed, if there is one.
    pub grey_box: Option<&'a GreyBoxFit>,
    /// VAF and NRMSE over all records.
    pub quality: GoodnessOfFit,
    /// Parameters of the model as an operator with a gain and a lead.
    pub operator: Result<OperatorEstimate, NotConvertible>,
    /// For polynomials of other orders: the operator of the family that the polynomials represent.
    pub family: Option<Result<FamilyConversion, NotConvertible>>,
    /// The noise model as a remnant filter.
    pub remnant: Option<Result<RemnantEstimate, NotConvertible>>,
    /// Crossover and margins of the loop, if the controlled element is given.
    pub margins: Option<MarginEstimates>,
    /// Residual tests, one per record.
    pub validations: Vec<Validation>,
    /// Horizon in samples, VAF and NRMSE of the prediction.
    pub ahead: Option<(usize, f64, f64)>,
    /// Name of another file and goodness of fit on it.
    pub validation: Option<(&'a str, GoodnessOfFit)>,
}

impl<'a> PolynomialResult<'a> {
    /// Collects the quantities that follow from an identified model.
    ///
    /// # Errors
    /// The errors of predicting the records.
    pub fn of<F>(found: &'a IdentifiedModel<F>, fit: &'a Fit) -> Result<Self, AnalysisError> {
        let (data, with_input) = (&found.data, fit.model().structure().has_input());
        let validations = data.records.iter().map(|record| fit.validate(record));
        let validations = validations.collect::<Result<Vec<_>, _>>()?;
        let operator = fit.operator();
        // A model with one or three poles does not represent a gain with a lead, but may represent another form.
        let family = match &operator {
            Err(NotConvertible::OtherOrders { poles: 1..=3, .. }) if with_input => Some(fit.family_operator(None)),
            _ => None,
        };
        Ok(Self {
            verdict: &found.verdict,
            files: &data.names,
            records: &data.records,
            accounts: &data.accounts,
            settings: &found.settings,
            fit,
            choice: None,
            grey_box: None,
            quality: GoodnessOfFit::pooled(data.records.iter().zip(&validations)),
            operator,
            family,
            remnant: (fit.orders().nd > 0).then(|| fit.remnant(RemnantDiscretisation::ZeroOrderHold)),
            margins: found
                .controlled_element
                .as_ref()
                .map(|element| loop_margins(fit, element)),
            validations,
            ahead: None,
            validation: None,
        })
    }

    /// True if the parameters of an operator (a gain with a lead, or another form) were found.
    pub fn has_operator(&self) -> bool {
        let of_family = self.family.as_ref().map(Result::is_ok);
        of_family.unwrap_or(self.operator.is_ok()) && self.fit.model().structure().has_input()
    }

    /// Returns the JSON object.
    pub fn object(&self) -> Map<String, Value> {
        let fit = self.fit;
        let parameters: Vec<Value> = fit.parameters().iter().map(|(name, e)| named(name, e)).collect();
        let physical = fit.is_grey_box();
        let kind = if physical { OPERATOR_KIND } else { POLYNOMIAL_KIND };
        let mut map = envelope(
            kind,
            self.files,
            self.records,
            self.accounts,
            self.verdict,
            self.settings,
        );
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        let structure = fit.model().structure().name();
        set("structure", json!(if physical { OPERATOR_KIND } else { structure }));
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
            self.family
                .as_ref()
                .map_or_else(|| operator(&self.operator), family_json),
        );
        set("remnant", self.remnant.as_ref().map_or(Value::Null, remnant));
        if let Some(m) = &self.margins {
            set("open_loop", margin_estimates(m));
        }
        let ts = fit.model().sample_time().s();
        set("roots", fit.roots().iter().map(|r| root(r, ts)).collect());
        // Residuals at the level of rounding errors contain no information.
        let tested = if fit.covariance().is_some() {
            self.validations.as_slice()
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
        map
    }
}

impl JsonFit for PolynomialFit {
    const ESTIMATOR: &'static str = registry::PEM;

    fn object(found: &IdentifiedModel<Self>) -> Result<Map<String, Value>, AnalysisError> {
        let answer = PolynomialResult::of(found, &found.fit.fit)?;
        let choice = found.fit.choice.as_ref();
        Ok(PolynomialResult { choice, ..answer }.object())
    }
}

impl JsonFit for GreyBoxFit {
    const ESTIMATOR: &'static str = registry::REMNANT;

    fn object(found: &IdentifiedModel<Self>) -> Result<Map<String, Value>, AnalysisError> {
        let answer = PolynomialResult::of(found, found.fit.polynomial_fit(0))?;
        let grey_box = Some(&found.fit);
        Ok(PolynomialResult { grey_box, ..answer }.object())
    }
}

/// Returns the remnant orders m that the grey-box fit tried.
fn remnant_orders(grey_box: &GreyBoxFit) -> Value {
    let row = |c: &OrderCandidate| match &c.outcome {
        Ok(f) => json!({
            "remnant_order": c.order,
            "loss": number(f.loss),
            "aic": number(f.aic),
            "bic": number(f.bic),
            "converged": f.converged,
        }),
        Err(reason) => json!({"remnant_order": c.order, "error": reason}),
    };
    grey_box.candidates().iter().map(row).collect()
}

fn candidates(choice: &Choice) -> Value {
    let row = |c: &Candidate| match &c.outcome {
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
        Err(reason) => json!({"orders": orders(&c.orders), "error": reason}),
    };
    Value::Array(choice.candidates.iter().map(row).collect())
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

/// Returns the operator of the family that the polynomials represent: form, parameters by name, the meaning of the real
/// poles, and the misfit.
pub fn family_json(found: &Result<FamilyConversion, NotConvertible>) -> Value {
    let found = match found {
        Ok(found) => found,
        Err(reason) => return json!({"convertible": false, "reason": reason.to_string()}),
    };
    let mut map = Map::new();
    map.insert("convertible".to_owned(), json!(true));
    map.insert("form".to_owned(), json!(found.operator.form().name()));
    for (name, unit, e) in found.parameters() {
        let mut value = estimate(&e);
        value["unit"] = json!(unit);
        map.insert(name.to_owned(), value);
    }
    let role = |role: PoleRole| match role {
        PoleRole::Lag => "lag",
        PoleRole::Neuromuscular => "neuromuscular",
    };
    let poles = found.real_poles.iter();
    let poles = poles.map(|p| json!({"rate_rad_s": number(p.rate), "role": role(p.role)}));
    map.insert("real_poles".to_owned(), poles.collect());
    map.insert("mismatch".to_owned(), number(found.mismatch));
    Value::Object(map)
}
