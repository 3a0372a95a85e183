//! A recursive method with its options, and those that track people: the default, and the two of the thesis. Those that
//! they are compared with are in `hoid-survey`, and so is the list of all.

mod adaptive;
mod rls;
mod rpem;

use std::{fmt, ops::Deref};

use hoid_ident::{
    IdentError,
    settings::{MethodSpec, Settings},
};
use hoid_model::{FittedOperator, Orders, Structure};

use crate::{
    method::{RecursiveMethod, bad, spec},
    person_prior::PersonPrior,
};

pub use adaptive::AdaptiveOptions;
pub use rls::RlsOptions;
pub use rpem::{DEFAULT_LIMIT, RpemOptions, short_for_b};

/// A recursive method with its options; its self-description is that of [`RecursiveMethod`].
#[derive(Debug)]
pub struct Method(Box<dyn RecursiveMethod>);

impl<M: RecursiveMethod> From<M> for Method {
    fn from(options: M) -> Self {
        Self(Box::new(options))
    }
}

impl Clone for Method {
    fn clone(&self) -> Self {
        Self(self.0.boxed())
    }
}

impl PartialEq for Method {
    fn eq(&self, other: &Self) -> bool {
        self.0.is_same(&*other.0)
    }
}

impl Deref for Method {
    type Target = dyn RecursiveMethod;

    fn deref(&self) -> &Self::Target {
        &*self.0
    }
}

impl Method {
    /// Gains in a basis that people share: Box-Jenkins with nc = 0.
    pub fn adaptive() -> Self {
        AdaptiveOptions::default().into()
    }

    /// Recursive least squares: ARX and FIR.
    pub fn rls() -> Self {
        RlsOptions::default().into()
    }

    /// Recursive prediction-error method for every structure.
    pub fn rpem() -> Self {
        RpemOptions::default().into()
    }

    pub(crate) fn inner_mut(&mut self) -> &mut dyn RecursiveMethod {
        &mut *self.0
    }

    /// Known properties of it.
    pub fn spec(&self) -> MethodSpec {
        spec(&*self.0)
    }

    /// Whether orders, delay or memory are those of a polynomial in samples; else the rate is free, and
    /// a high one is lowered ([`hoid_model::Decimation`]).
    pub fn counts_samples(&self) -> bool {
        !(self.starts_itself() || self.is_model_of_change())
    }

    /// Name as on the command line.
    pub fn name(&self) -> &'static str {
        self.about().name
    }

    /// Its options by name.
    pub fn settings(&self) -> &dyn Settings {
        &*self.0
    }

    /// Sets an option from its text.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for an option that the method does not have, or a text that is not
    /// a value of it.
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), IdentError> {
        if self.0.set(name, text)? {
            return Ok(());
        }
        let own: Vec<&str> = self.list().iter().map(|setting| setting.name).collect();
        let expected = format!("one of {}", own.join(", "));
        Err(bad(name, format!("with the method {}", self.name()), &expected))
    }

    /// With an option set from its text.
    ///
    /// # Errors
    /// As [`Method::set`].
    pub fn with(mut self, name: &str, text: &str) -> Result<Self, IdentError> {
        self.set(name, text)?;
        Ok(self)
    }

    /// Starts with an earlier fit of the person.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for a method that starts with the record.
    pub fn start_from(&mut self, fit: FittedOperator) -> Result<(), IdentError> {
        let source = fit.source.clone();
        match self.0.set_person_prior(PersonPrior::Fit(Box::new(fit))) {
            true => Ok(()),
            false => Err(bad(
                "prior",
                source,
                "the method adaptive, which alone starts with a fit",
            )),
        }
    }

    /// The operator's orders with the noise model that the method takes when none is named: that of the
    /// structure, or of the order that the method names.
    pub fn default_orders(&self, nk: usize) -> Orders {
        let orders = self.default_structure().operator_orders(nk);
        match self.default_nd() {
            Some(nd) => Orders { nd, ..orders },
            None => orders,
        }
    }

    /// The structure that the method takes when none is named: Box-Jenkins, or the first that it
    /// serves.
    pub fn default_structure(&self) -> Structure {
        let served = self.about().structures;
        match served.first() {
            Some(first) if !served.contains(&Structure::BoxJenkins) => *first,
            _ => Structure::BoxJenkins,
        }
    }
}

/// [`Method::adaptive`]: it needs no start, and works for recorded people.
impl Default for Method {
    fn default() -> Self {
        Self::adaptive()
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
