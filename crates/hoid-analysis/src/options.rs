//! Options of an estimator by their names in the registry ([`hoid_ident::registry`]), from texts as users
//! write them: the command line, plans and Python bring what they have into that form, and none of them has a
//! list of its own.

use std::collections::BTreeMap;

use hoid_ident::{
    Constraint, GreyBox, IdentError, InitialState, Instruments, Loss, NamedOrders, Prior, SearchOptions, SigmoidChange,
    family::FamilyEstimator,
    order_selection::check_order,
    settings::{DelayRange, OneOrSpan, Setting},
};
use hoid_model::{Form, NamedChoice, operator_family::Coordinate};

use crate::{
    AnalysisError, answers::asked_for, description::Excitation, estimators::Polynomials,
    identification::Identification, prior::prior_of_text,
};

/// Standard deviations from which a robust loss is linear where no number is given: 95 % efficient for normal
/// noise (Huber 1981).
const HUBER: f64 = 1.345;

/// Options that are set by their names.
pub trait Options {
    /// Sets an option of the registry; false for one of another estimator.
    ///
    /// # Errors
    /// [`AnalysisError`] for a text that is no value of it, or out of its bounds.
    fn set(&mut self, option: &Setting, text: &str) -> Result<bool, AnalysisError>;
}

impl Options for Identification<FamilyEstimator> {
    fn set(&mut self, option: &Setting, text: &str) -> Result<bool, AnalysisError> {
        let how = &mut self.estimator;
        match option.name {
            "noise" if text == "arma" => {
                let orders = NamedOrders::from([("nc".to_owned(), 1..=2)]);
                *how = how.clone().with_noise_orders(&orders)?;
            }
            "noise" => {}
            "change" => {}
            "orders" => {
                let mut named: NamedOrders = option.read(text)?;
                if *how.nc.end() > 0 {
                    named.entry("nc".to_owned()).or_insert_with(|| how.nc.clone());
                }
                *how = how.clone().with_noise_orders(&named)?;
            }
            "form" if text == "auto" => how.forms = Form::ALL.to_vec(),
            "form" => how.forms = vec![word(option, text)?],
            "neuromuscular" => how.neuromuscular = yes(option, text)?,
            "prior" => how.prior = prior_of_text(text)?,
            "delay" => how.delay_range_s = span(option, text)?,
            "intersample" => how.intersample = word(option, text)?,
            "individual" => {
                let coordinate = |name: &String| {
                    Coordinate::of_parameter(name)
                        .ok_or_else(|| refused(option, name, "K, T_L, T_I, omega_nm, zeta_nm or tau_e".to_owned()))
                };
                let names: Vec<String> = option.read(text)?;
                how.individual = names.iter().map(coordinate).collect::<Result<_, _>>()?;
            }
            "run_to_run" => how.run_to_run = option.read(text)?,
            "initial_state" => how.initial_state = rule(option, text)?.unwrap_or_default(),
            _ if set_search(&mut how.search, option, text)? => {}
            _ => return self.set_shared(option, text),
        }
        Ok(true)
    }
}

impl Options for Identification<GreyBox> {
    fn set(&mut self, option: &Setting, text: &str) -> Result<bool, AnalysisError> {
        let how = &mut self.estimator;
        match option.name {
            "noise" | "change" => {}
            "remnant_order" => how.order = option.read(text)?,
            "delay" => how.delay_range_s = span(option, text)?,
            "individual" => how.individual = option.read(text)?,
            "initial_state" => how.initial_state = rule(option, text)?.unwrap_or_default(),
            "fix" | "bound" => constrain(&mut how.constraints, option, text)?,
            _ if set_search(&mut how.search, option, text)? => {}
            _ => return self.set_shared(option, text),
        }
        Ok(true)
    }
}

impl Options for Identification<SigmoidChange> {
    fn set(&mut self, option: &Setting, text: &str) -> Result<bool, AnalysisError> {
        let how = &mut self.estimator;
        match option.name {
            "noise" | "change" => {}
            "orders" => *how = how.clone().with_noise_orders(&option.read(text)?)?,
            "form" if text == "auto" => how.form = SigmoidChange::default().form,
            "form" => how.form = word(option, text)?,
            "neuromuscular" => how.neuromuscular = yes(option, text)?,
            "prior" => how.prior = prior_of_text(text)?,
            "delay" => how.delay_range_s = span(option, text)?,
            "fix" | "bound" => constrain(&mut how.constraints, option, text)?,
            "initial_state" => match rule(option, text)? {
                None | Some(InitialState::Estimate) => {}
                Some(_) => {
                    let expected = "auto or estimate: a fit with a change estimates the initial states";
                    return Err(refused(option, text, expected.to_owned()));
                }
            },
            _ if set_search(&mut how.search, option, text)? => {}
            _ => return self.set_shared(option, text),
        }
        Ok(true)
    }
}

impl Options for Identification<Polynomials> {
    fn set(&mut self, option: &Setting, text: &str) -> Result<bool, AnalysisError> {
        let how = &mut self.estimator;
        match option.name {
            "orders" => {
                for (name, range) in option.read::<NamedOrders>(text)? {
                    order(how, option, name, range)?;
                }
            }
            "nk" => match option.read(text)? {
                DelayRange::Samples(range) => order(how, option, "nk".to_owned(), range)?,
                DelayRange::Seconds(low, high) => how.delay_s = Some((low, high)),
            },
            "delay" if how.delay_s.is_some() || how.orders.contains_key("nk") => {
                return Err(AnalysisError::Options {
                    reason: "nk and delay are one thing in samples and in s; give one of them".to_owned(),
                });
            }
            "delay" => how.delay_s = Some(span(option, text)?),
            "criterion" => how.criterion = word(option, text)?,
            "initial_state" => how.template.initial_state = rule(option, text)?,
            "start" => how.start = Some(option.read(text)?),
            "fix" | "bound" => constrain(&mut how.template.constraints, option, text)?,
            "coefficient_prior" => how.template.priors = option.read::<BTreeMap<String, Prior>>(text)?,
            "robust" => {
                let threshold = match text {
                    "true" => HUBER,
                    _ => option.read(text)?,
                };
                how.template.loss = Loss::Huber { threshold };
            }
            "focus" => how.template.focus = word(option, text)?,
            "stable" => how.template.stable = option.read(text)?,
            "instruments" => how.instruments = Some(Instruments::of_text(text)),
            _ if set_search(&mut how.template.search, option, text)? => {}
            _ => return self.set_shared(option, text),
        }
        Ok(true)
    }
}

impl<E> Identification<E> {
    /// What is not the estimator's.
    fn set_shared(&mut self, option: &Setting, text: &str) -> Result<bool, AnalysisError> {
        match option.name {
            "excitation" => self.excitation = Excitation::of_text(Some(text)),
            "answers" => self.answers = asked_for(&option.read::<Vec<String>>(text)?)?,
            "period" => self.period_s = Some(option.read(text)?),
            "controlled_element" => {
                let element = text
                    .parse()
                    .map_err(|error: hoid_model::ModelError| option_error(option, error.to_string()))?;
                self.controlled_element = Some(element);
            }
            _ => return Ok(false),
        }
        Ok(true)
    }
}

fn set_search(search: &mut SearchOptions, option: &Setting, text: &str) -> Result<bool, AnalysisError> {
    match option.name {
        "search_method" => search.method = word(option, text)?,
        "max_iterations" => search.max_iterations = option.read(text)?,
        "tolerance" => search.tolerance = option.read(text)?,
        _ => return Ok(false),
    }
    Ok(true)
}

/// An order that is given or searched, each once.
fn order(
    how: &mut Polynomials,
    option: &Setting,
    name: String,
    range: std::ops::RangeInclusive<usize>,
) -> Result<(), AnalysisError> {
    check_order(&name, &range)?;
    if how.orders.contains_key(&name) {
        return Err(option_error(option, format!("{name} is given twice; drop one")));
    }
    how.orders.insert(name, range);
    Ok(())
}

/// What is held at a value, or within bounds; each parameter once.
fn constrain(all: &mut BTreeMap<String, Constraint>, option: &Setting, text: &str) -> Result<(), AnalysisError> {
    let given: BTreeMap<String, Constraint> = match option.name {
        "fix" => {
            let fixed: BTreeMap<String, f64> = option.read(text)?;
            let fixed = fixed.into_iter().map(|(name, value)| (name, Constraint::Fixed(value)));
            fixed.collect()
        }
        _ => option.read(text)?,
    };
    for (name, constraint) in given {
        if all.contains_key(&name) {
            return Err(option_error(
                option,
                format!("{name} is both fixed and bounded; drop one"),
            ));
        }
        all.insert(name, constraint);
    }
    Ok(())
}

fn span(option: &Setting, text: &str) -> Result<(f64, f64), AnalysisError> {
    let OneOrSpan(low, high) = option.read(text)?;
    Ok((low, high))
}

/// A rule for initial states; none is automatic.
fn rule(option: &Setting, text: &str) -> Result<Option<InitialState>, AnalysisError> {
    match text {
        "auto" => Ok(None),
        name => word(option, name).map(Some),
    }
}

/// One of the words of a choice.
fn word<T: NamedChoice>(option: &Setting, text: &str) -> Result<T, AnalysisError> {
    T::of_name(&text.replace('_', "-")).map_err(|_| {
        let words: Vec<&str> = T::CHOICES.iter().map(|choice| choice.choice_name()).collect();
        refused(option, text, format!("one of {}", words.join(", ")))
    })
}

fn yes(option: &Setting, text: &str) -> Result<bool, AnalysisError> {
    match text {
        "yes" | "true" => Ok(true),
        "no" | "false" => Ok(false),
        _ => Err(refused(option, text, "yes or no".to_owned())),
    }
}

fn refused(option: &Setting, text: &str, expected: String) -> AnalysisError {
    IdentError::BadOption {
        option: option.name.to_owned(),
        found: text.to_owned(),
        expected,
    }
    .into()
}

fn option_error(option: &Setting, reason: String) -> AnalysisError {
    AnalysisError::Option {
        name: option.name,
        reason,
    }
}
