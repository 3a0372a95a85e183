//! Requests of users for a model: structure, method, and options by name.
//!
//! | structure | estimator |
//! |---|---|
//! | none, `operator` | operator of a person; with `noise=remnant` an operator with a gain, a lead and a remnant of order m; with `change=sigmoid` an operator whose gains change once |
//! | `arx` ... `general` | polynomials, fitted by the `method` pem or by instrumental variables |
//!
//! If no structure is given, an option that only polynomials have, such as nk, selects `bj`.

use std::collections::BTreeMap;

use hoid_ident::{GreyBox, IvMethod, SigmoidChange, family::FamilyEstimator, settings::MethodSpec};
use hoid_model::{Decimation, FaultHandling, Structure};

use crate::{
    AnalysisError,
    estimators::{BatchEstimator, Polynomials},
    identification::Identification,
    registry::{CHANGE, OPERATOR, PEM, REMNANT, estimators},
};

/// Request for a model, in the form of names and strings.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// Name of the structure.
    pub structure: Option<String>,
    /// Name of the method: `pem`, or an instrumental-variable method.
    pub method: Option<String>,
    /// Options by their names in the registry.
    pub options: BTreeMap<String, String>,
    /// Treatment of faults of the recordings.
    pub faults: FaultHandling,
    /// Decimation of recordings at a high sampling rate.
    pub rate: Decimation,
}

/// An identification that is ready to run.
#[derive(Debug, Clone, PartialEq)]
pub enum ResolvedRequest {
    /// Operator of a person, whose form the evidence determines.
    Operator(Identification),
    /// Operator with a gain and a lead, and a remnant of order m.
    Remnant(Identification<GreyBox>),
    /// An operator whose gains change once.
    Change(Identification<SigmoidChange>),
    /// A polynomial structure.
    Polynomials(Identification<Polynomials>),
}

/// Evaluates an expression with the identification that a resolved request contains, for each kind of model.
macro_rules! each {
    ($asked:expr, $how:ident => $what:expr) => {
        match $asked {
            ResolvedRequest::Operator($how) => $what,
            ResolvedRequest::Remnant($how) => $what,
            ResolvedRequest::Change($how) => $what,
            ResolvedRequest::Polynomials($how) => $what,
        }
    };
}

impl ResolvedRequest {
    /// Returns the estimator with this name in the registry, with default options; `None` if there is none.
    pub fn from_estimator(name: &str, structure: Structure) -> Option<Self> {
        let polynomials = |structure: Structure, method: Option<IvMethod>| {
            Self::Polynomials(Identification::of(Polynomials {
                method,
                ..Polynomials::new(structure)
            }))
        };
        Some(match name {
            OPERATOR => Self::Operator(Identification::of(FamilyEstimator::default())),
            REMNANT => Self::Remnant(Identification::of(GreyBox::default())),
            CHANGE => Self::Change(Identification::of(SigmoidChange::default())),
            PEM => polynomials(structure, None),
            name => {
                let method = IvMethod::ALL.into_iter().find(|method| method.name() == name)?;
                polynomials(method.structure(), Some(method))
            }
        })
    }

    /// Returns the name of the estimator in the registry.
    pub fn estimator(&self) -> &'static str {
        match self {
            Self::Operator(_) => OPERATOR,
            Self::Remnant(_) => REMNANT,
            Self::Change(_) => CHANGE,
            Self::Polynomials(how) => how.estimator.method.map_or(PEM, IvMethod::name),
        }
    }

    /// Returns the structure of a polynomial model.
    pub fn structure(&self) -> Option<Structure> {
        match self {
            Self::Polynomials(how) => Some(how.estimator.template.structure),
            _ => None,
        }
    }

    /// True if orders and delay are numbers of samples.
    pub fn counts_samples(&self) -> bool {
        each!(self, how => how.estimator.counts_samples())
    }

    /// True if the estimator estimates the response to an input.
    pub fn has_input(&self) -> bool {
        self.structure().is_none_or(Structure::has_input)
    }

    /// Sets an option by its name; returns false if the estimator does not have the option.
    ///
    /// # Errors
    /// [`AnalysisError`] if the text is not a valid value.
    pub fn set(&mut self, name: &str, text: &str) -> Result<bool, AnalysisError> {
        each!(self, how => how.set(name, text))
    }
}

impl Request {
    /// Resolves the request; also returns notes on earlier names and on consequences of an option.
    ///
    /// # Errors
    /// [`AnalysisError`] for contradictory options or unknown values.
    pub fn resolve(&self) -> Result<(ResolvedRequest, Vec<String>), AnalysisError> {
        let mut notes = Vec::new();
        let mut asked = self.kind(&mut notes)?;
        let all = estimators();
        let own = all.iter().find(|spec| spec.name == asked.estimator());
        let own = own.map(|spec| spec.settings.as_slice()).unwrap_or_default();
        for name in self.options.keys() {
            if !own.iter().any(|setting| setting.name == name) {
                return Err(misplaced_option_error(name, &all));
            }
        }
        // Options are set in the order of the registry, in which an option that affects others precedes them.
        for setting in own {
            if let Some(text) = self.options.get(setting.name) {
                asked.set(setting.name, text)?;
            }
        }
        if !asked.has_input()
            && let Some(setting) = own.iter().find(|setting| setting.name == "controlled_element")
            && self.options.contains_key(setting.name)
        {
            return Err(AnalysisError::Option {
                name: setting.name,
                reason: "it applies only to a structure with an input".to_owned(),
            });
        }
        each!(&mut asked, how => {
            how.faults = self.faults;
            how.rate = self.rate;
        });
        Ok((asked, notes))
    }

    fn has(&self, names: &[&str]) -> bool {
        names.iter().any(|name| self.options.contains_key(*name))
    }

    /// Returns the requested kind of model with default options.
    fn kind(&self, notes: &mut Vec<String>) -> Result<ResolvedRequest, AnalysisError> {
        let options = |reason: String| AnalysisError::Options { reason };
        let typed = self
            .structure
            .as_ref()
            .map(|name| name.trim().to_ascii_lowercase().replace('_', "-"));
        let method = self.method.as_ref().map(|name| name.trim().to_ascii_lowercase());
        let polynomial = match typed.as_deref() {
            None | Some("operator" | "family" | "grey-box" | "time-varying") => None,
            Some(name) => {
                let known = name.parse::<Structure>();
                let all = Structure::ALL.map(Structure::name).join(", ");
                Some(known.map_err(|_| options(format!("structure is {name:?}, expected one of {OPERATOR}, {all}")))?)
            }
        };
        let method = match method.as_deref() {
            None | Some(PEM) => None,
            Some(name) => {
                let known = IvMethod::ALL.into_iter().find(|method| method.name() == name);
                Some(known.ok_or_else(|| options(unknown_method_message(name)))?)
            }
        };
        let estimator = if let Some(method) = method {
            let own = method.structure();
            if typed.is_some() && polynomial != Some(own) {
                return Err(options(format!(
                    "method {method} fits only the structure {}; drop the structure, or use method pem",
                    own.name()
                )));
            }
            method.name()
        } else if polynomial.is_some() || (typed.is_none() && self.is_polynomial()) {
            PEM
        } else {
            self.operator(typed.as_deref(), notes)?
        };
        ResolvedRequest::from_estimator(estimator, polynomial.unwrap_or(Structure::BoxJenkins))
            .ok_or_else(|| options(unknown_method_message(estimator)))
    }

    /// True if an option in the request selects a polynomial model.
    fn is_polynomial(&self) -> bool {
        let asks_for_operator = self.has(&["noise", "change", "remnant_order"]);
        let of_polynomials = |text: &String| {
            let names = text.split(',').filter_map(|part| part.split('=').next());
            names.map(str::trim).any(|name| !matches!(name, "nc" | "nd"))
        };
        !asks_for_operator
            && (self.options.get("orders").is_some_and(of_polynomials)
                || self.has(&[
                    "nk",
                    "start",
                    "fix",
                    "bound",
                    "coefficient_prior",
                    "robust",
                    "focus",
                    "stable",
                    "criterion",
                ]))
    }

    /// Returns the name of the requested operator estimator.
    fn operator(&self, typed: Option<&str>, notes: &mut Vec<String>) -> Result<&'static str, AnalysisError> {
        let option = |name: &str| self.options.get(name).map(String::as_str);
        let was = match typed {
            Some(name @ ("family" | "grey-box")) => Some((name, "")),
            Some(name @ "time-varying") => Some((name, " with change sigmoid")),
            _ => None,
        };
        if let Some((name, with)) = was {
            notes.push(format!("structure {name} is now called operator{with}"));
        }
        let changes = typed == Some("time-varying") || option("change") == Some("sigmoid");
        let individual = self.options.get("individual").map(String::as_str).unwrap_or_default();
        let of_remnant = self.options.contains_key("remnant_order")
            || individual
                .split(',')
                .any(|name| matches!(name.trim(), "K_e_dot" | "T_n"))
            || (self.has(&["fix", "bound"]) && !changes);
        let noise = option("noise");
        match (changes, noise) {
            (true, Some("arma" | "remnant")) => Err(AnalysisError::Option {
                name: "noise",
                reason: format!(
                    "found {}; for an operator that changes, only ar is possible",
                    noise.unwrap_or_default()
                ),
            }),
            (true, _) => Ok(CHANGE),
            (false, Some("remnant")) => Ok(REMNANT),
            (false, None) if of_remnant => {
                notes.push("the options require an operator with noise remnant, so this model is used".to_owned());
                Ok(REMNANT)
            }
            _ => Ok(OPERATOR),
        }
    }
}

/// Creates the error for an option of other estimators, with the names of these estimators and the option to use
/// instead.
fn misplaced_option_error(name: &str, all: &[MethodSpec]) -> AnalysisError {
    let has = |spec: &&MethodSpec| spec.settings.iter().any(|setting| setting.name == name);
    let of: Vec<&'static str> = all.iter().filter(has).map(|spec| spec.name).collect();
    let setting = all
        .iter()
        .flat_map(|spec| &spec.settings)
        .find(|setting| setting.name == name);
    let Some(setting) = setting else {
        let known: Vec<&str> = all
            .iter()
            .flat_map(|spec| &spec.settings)
            .map(|setting| setting.name)
            .collect();
        return AnalysisError::Options {
            reason: format!("there is no option {name}; expected one of {}", known.join(", ")),
        };
    };
    AnalysisError::Misplaced {
        name: setting.name,
        estimators: of,
        alternative: match name {
            "nk" => "; for other estimators, give delay in s",
            _ => "",
        },
    }
}

fn unknown_method_message(found: &str) -> String {
    let known = IvMethod::ALL.map(IvMethod::name).join(", ");
    format!("method is {found}, expected one of {PEM}, {known}")
}
