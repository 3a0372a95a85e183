//! Estimators of a plan that run as in `hoid identify` and give a verdict: the operator of a person, an operator with
//! changing gains, and instrumental variables.
//!
//! The options of these estimators are those in the registry of estimators.

use hoid_analysis::{
    Identification, ResolvedRequest,
    registry::{self, CHANGE, estimators},
};
use hoid_ident::{IdentError, NamedOrders, family::OperatorPrior, settings::MethodSpec};
use hoid_model::{Form, Orders, Structure};

/// Value of `method` for the operator of a person.
pub(super) const OPERATOR_METHOD: &str = registry::OPERATOR;
/// Value of `method` equivalent to `operator` with `change = "sigmoid"`.
pub(super) const TIME_VARYING_METHOD: &str = "time-varying";
/// Alternative name for `operator`.
const FAMILY_METHOD: &str = "family";

/// Options of the registry that a plan does not use: either a plan has its own typed keys for them, or they do not
/// apply to single runs.
const EXCLUDED_OPTIONS: [&str; 10] = [
    "noise",
    "change",
    "orders",
    "nk",
    "delay",
    "criterion",
    "controlled_element",
    "individual",
    "initial_state",
    "max_iterations",
];

/// Returns the methods with their options in plans.
pub(super) fn methods() -> Vec<MethodSpec> {
    let in_plan = |spec: MethodSpec| {
        let name = match spec.name {
            CHANGE => TIME_VARYING_METHOD,
            name => name,
        };
        request_for_method(name, false)?;
        let mut settings = spec.settings;
        settings.retain(|setting| !EXCLUDED_OPTIONS.contains(&setting.name));
        Some(MethodSpec { name, settings, ..spec })
    };
    estimators().into_iter().filter_map(in_plan).collect()
}

/// Returns the estimator of a method that runs as in `hoid identify`, with its defaults and without a prior; `None` for
/// any other method.
pub(super) fn request_for_method(method: &str, changes: bool) -> Option<ResolvedRequest> {
    let estimator = match method {
        TIME_VARYING_METHOD => CHANGE,
        OPERATOR_METHOD | FAMILY_METHOD if changes => CHANGE,
        OPERATOR_METHOD | FAMILY_METHOD => OPERATOR_METHOD,
        // In a plan these estimators have other names.
        registry::PEM | registry::REMNANT | CHANGE => return None,
        name => name,
    };
    let mut asked = ResolvedRequest::from_estimator(estimator, Structure::BoxJenkins)?;
    if let ResolvedRequest::Operator(how) = &mut asked {
        how.estimator.prior = OperatorPrior::none();
    }
    Some(asked)
}

/// Returns the name of the estimator as a method of plans.
pub(crate) fn name(asked: &ResolvedRequest) -> &'static str {
    match asked.estimator() {
        CHANGE => TIME_VARYING_METHOD,
        name => name,
    }
}

/// Returns the estimator with the orders of its noise model or of its polynomials.
pub(super) fn with_orders(
    asked: ResolvedRequest,
    noise: &NamedOrders,
    polynomials: &Orders,
) -> Result<ResolvedRequest, IdentError> {
    Ok(match asked {
        ResolvedRequest::Operator(how) => ResolvedRequest::Operator(Identification {
            estimator: how.estimator.with_noise_orders(noise)?,
            ..how
        }),
        ResolvedRequest::Change(how) => ResolvedRequest::Change(Identification {
            estimator: how.estimator.with_noise_orders(noise)?,
            ..how
        }),
        ResolvedRequest::Polynomials(mut how) => {
            let all = polynomials.named_orders().map(|(name, n)| (name.to_owned(), n..=n));
            how.estimator.orders = all.into_iter().collect();
            ResolvedRequest::Polynomials(how)
        }
        ResolvedRequest::Remnant(how) => ResolvedRequest::Remnant(how),
    })
}

/// Returns the first fixed or bounded parameter that the model does not have, with the names of the parameters of the
/// model; `None` if there is no such parameter, or if the gains do not change.
pub(super) fn unknown_parameter(asked: &ResolvedRequest) -> Option<(&str, Vec<String>)> {
    let ResolvedRequest::Change(how) = asked else {
        return None;
    };
    let names = how.estimator.names();
    let held = how.estimator.constraints.keys();
    let unknown = held
        .map(String::as_str)
        .find(|name| !names.iter().any(|own| own == name))?;
    Some((unknown, names))
}

/// Returns the names of the columns for the parameters of the estimator; empty for polynomials, whose columns follow
/// from their orders.
pub(crate) fn parameters(asked: &ResolvedRequest) -> Vec<String> {
    match asked {
        ResolvedRequest::Operator(how) => {
            let of = |form: &Form| form.parameters(how.estimator.neuromuscular);
            how.estimator.forms.iter().flat_map(of).map(str::to_owned).collect()
        }
        ResolvedRequest::Change(how) => {
            let mut names = how.estimator.possible_names();
            // K and K_e_dot are not parameters of the fit, but products of parameters that change.
            let all = how.estimator.form.parameters(how.estimator.neuromuscular).into_iter();
            let products = all.filter(|name| matches!(*name, "K" | "K_e_dot"));
            names.extend(products.flat_map(|name| [1, 2].map(|end| format!("{name}{end}"))));
            names
        }
        ResolvedRequest::Remnant(_) | ResolvedRequest::Polynomials(_) => Vec::new(),
    }
}
