//! Estimators of a plan that are run as `hoid identify` runs them, their verdict included: the operator of a
//! person, one whose gains change, instrumental variables.
//!
//! Their options are those of the registry of estimators.

use hoid_analysis::{AnalysisError, Identification, Options, Polynomials};
use hoid_ident::{
    IdentError, IvMethod, NamedOrders, SigmoidChange, estimators,
    family::{FamilyEstimator, OperatorPrior},
    settings::{MethodSpec, Setting},
};
use hoid_model::{Form, Orders, Structure};

/// Words for `method`.
pub(super) const OPERATOR: &str = "operator";
pub(super) const TIME_VARYING: &str = "time-varying";
/// Another word for `operator`, and its name in the registry.
const FAMILY: &str = "family";

/// Options of the registry that are no keys of a plan's own table: they have types there, or no meaning for
/// single runs.
const ELSEWHERE: [&str; 6] = ["orders", "nk", "delay", "individual", "initial_state", "max_iterations"];

/// What is fitted, and how.
#[derive(Debug, Clone, PartialEq)]
pub enum Analysis {
    /// The operator of a person, its form by evidence.
    Operator(Identification),
    /// An operator whose gains change once.
    Change(Identification<SigmoidChange>),
    /// A polynomial structure by instrumental variables.
    Instrumental(Identification<Polynomials>),
}

/// The methods with their options as plans have them.
pub(super) fn methods() -> Vec<MethodSpec> {
    let in_plan = |spec: MethodSpec| {
        let name = match spec.name {
            FAMILY => OPERATOR,
            name => name,
        };
        Analysis::of_method(name, false)?;
        let mut settings = spec.settings;
        settings.retain(|setting| !ELSEWHERE.contains(&setting.name));
        Some(MethodSpec { name, settings, ..spec })
    };
    estimators().into_iter().filter_map(in_plan).collect()
}

impl Analysis {
    /// The estimator of a method with its defaults, without a prior; `None` for another method.
    pub(super) fn of_method(method: &str, changes: bool) -> Option<Self> {
        Some(match method {
            TIME_VARYING => Self::Change(Identification::of(SigmoidChange::default())),
            OPERATOR | FAMILY if changes => Self::Change(Identification::of(SigmoidChange::default())),
            OPERATOR | FAMILY => Self::Operator(Identification::of(FamilyEstimator {
                prior: OperatorPrior::none(),
                ..FamilyEstimator::default()
            })),
            name => {
                let method = IvMethod::ALL.into_iter().find(|method| method.name() == name)?;
                Self::Instrumental(Identification::of(Polynomials {
                    method: Some(method),
                    ..Polynomials::new(method.structure())
                }))
            }
        })
    }

    /// Name of the method.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Operator(_) => OPERATOR,
            Self::Change(_) => TIME_VARYING,
            Self::Instrumental(how) => how.estimator.method.map_or("", IvMethod::name),
        }
    }

    /// The structure of a polynomial model.
    pub fn structure(&self) -> Option<Structure> {
        match self {
            Self::Operator(_) | Self::Change(_) => None,
            Self::Instrumental(how) => Some(how.estimator.template.structure),
        }
    }

    /// Sets an option; false where it is none of its own.
    pub(super) fn set(&mut self, option: &Setting, text: &str) -> Result<bool, AnalysisError> {
        match self {
            Self::Operator(how) => how.set(option, text),
            Self::Change(how) => how.set(option, text),
            Self::Instrumental(how) => how.set(option, text),
        }
    }

    /// With the orders of its noise, or of its polynomials.
    pub(super) fn with_orders(self, noise: &NamedOrders, polynomials: &Orders) -> Result<Self, IdentError> {
        Ok(match self {
            Self::Operator(how) => Self::Operator(Identification {
                estimator: how.estimator.with_noise_orders(noise)?,
                ..how
            }),
            Self::Change(how) => Self::Change(Identification {
                estimator: how.estimator.with_noise_orders(noise)?,
                ..how
            }),
            Self::Instrumental(mut how) => {
                let all = polynomials.named().map(|(name, n)| (name.to_owned(), n..=n));
                how.estimator.orders = all.into_iter().collect();
                Self::Instrumental(how)
            }
        })
    }

    /// A parameter that is held or bounded and that the model does not have, with those that it has.
    pub(super) fn unknown_parameter(&self) -> Option<(&str, Vec<String>)> {
        let Self::Change(how) = self else { return None };
        let names = how.estimator.names();
        let held = how.estimator.constraints.keys();
        let unknown = held
            .map(String::as_str)
            .find(|name| !names.iter().any(|own| own == name))?;
        Some((unknown, names))
    }

    /// Columns of its own parameters; those of polynomials are known by their orders.
    pub(crate) fn parameters(&self) -> Vec<String> {
        match self {
            Self::Operator(how) => {
                let of = |form: &Form| form.parameters(how.estimator.neuromuscular);
                how.estimator.forms.iter().flat_map(of).map(str::to_owned).collect()
            }
            Self::Change(how) => {
                let mut names = how.estimator.names();
                // What is no parameter of the fit, but a product of some that change.
                let all = how.estimator.form.parameters(how.estimator.neuromuscular).into_iter();
                let products = all.filter(|name| matches!(*name, "K" | "K_e_dot"));
                names.extend(products.flat_map(|name| [1, 2].map(|end| format!("{name}{end}"))));
                names
            }
            Self::Instrumental(_) => Vec::new(),
        }
    }
}
