//! Options of an estimator by their names in the registry ([`hoid_ident::estimators`]), from texts as users
//! write them: who has options as texts, as a plan, needs no list of its own.

use std::collections::BTreeMap;

use hoid_ident::{
    Constraint, IdentError, InitialState, Instruments, SearchOptions, SigmoidChange, family::FamilyEstimator,
    settings::Setting,
};
use hoid_model::{Form, NamedChoice};

use crate::{
    AnalysisError, description::Excitation, estimators::Polynomials, identification::Identification,
    prior::prior_of_text,
};

/// Options that are set by their names.
pub trait Options {
    /// Sets an option of the registry; false for one of another estimator, and for orders, which have types of their own.
    ///
    /// # Errors
    /// [`AnalysisError`] for a text that is no value of it, or out of its bounds.
    fn set(&mut self, option: &Setting, text: &str) -> Result<bool, AnalysisError>;
}

impl Options for Identification<FamilyEstimator> {
    fn set(&mut self, option: &Setting, text: &str) -> Result<bool, AnalysisError> {
        let how = &mut self.estimator;
        match option.name {
            "form" if text == "auto" => how.forms = Form::ALL.to_vec(),
            "form" => how.forms = vec![word(option, text)?],
            "neuromuscular" => how.neuromuscular = yes(option, text)?,
            "prior" => how.prior = prior_of_text(text)?,
            "excitation" => self.excitation = Excitation::of_text(Some(text)),
            "period" => self.period_s = Some(option.read(text)?),
            "delay" => how.delay_range_s = option.read(text)?,
            "run_to_run" => how.run_to_run = option.read(text)?,
            "initial_state" if text == "auto" => how.initial_state = InitialState::default(),
            "initial_state" => how.initial_state = word(option, text)?,
            _ => return set_search(&mut how.search, option, text),
        }
        Ok(true)
    }
}

impl Options for Identification<SigmoidChange> {
    fn set(&mut self, option: &Setting, text: &str) -> Result<bool, AnalysisError> {
        let how = &mut self.estimator;
        match option.name {
            "form" if text == "auto" => how.form = SigmoidChange::default().form,
            "form" => how.form = word(option, text)?,
            "neuromuscular" => how.neuromuscular = yes(option, text)?,
            "prior" => how.prior = prior_of_text(text)?,
            "delay" => how.delay_range_s = option.read(text)?,
            "fix" => {
                let fixed: BTreeMap<String, f64> = option.read(text)?;
                let fixed = fixed.into_iter().map(|(name, value)| (name, Constraint::Fixed(value)));
                how.constraints.extend(fixed);
            }
            "bound" => how
                .constraints
                .extend(option.read::<BTreeMap<String, Constraint>>(text)?),
            "initial_state" if matches!(text, "auto" | "estimate") => {}
            "initial_state" => {
                return Err(refused(
                    option,
                    text,
                    "auto or estimate: this fit estimates them".to_owned(),
                ));
            }
            _ => return set_search(&mut how.search, option, text),
        }
        Ok(true)
    }
}

impl Options for Identification<Polynomials> {
    /// Those of the instrumental-variable methods.
    fn set(&mut self, option: &Setting, text: &str) -> Result<bool, AnalysisError> {
        let how = &mut self.estimator;
        match option.name {
            "instruments" => how.instruments = Some(Instruments::of_text(text)),
            _ => return set_search(&mut how.template.search, option, text),
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

/// One of the words of a choice.
fn word<T: NamedChoice>(option: &Setting, text: &str) -> Result<T, AnalysisError> {
    T::of_name(text).map_err(|_| {
        let words: Vec<&str> = T::CHOICES.iter().map(|choice| choice.choice_name()).collect();
        refused(option, text, format!("one of {}", words.join(", ")))
    })
}

fn yes(option: &Setting, text: &str) -> Result<bool, AnalysisError> {
    match text {
        "yes" => Ok(true),
        "no" => Ok(false),
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
