//! A recursive method with its options, and the methods that track people: the default method, and the two methods of
//! the thesis. The methods for comparison, and the list of all methods, are in `hoid-survey`.

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
    method::{RecursiveMethod, invalid_option, spec},
    person_prior::PersonPrior,
};

pub use adaptive::AdaptiveOptions;
pub use rls::RlsOptions;
pub use rpem::{DEFAULT_LIMIT, RpemOptions, short_memory_for_b};

/// A recursive method with its options, described by [`RecursiveMethod`].
#[derive(Debug)]
pub struct Method(Box<dyn RecursiveMethod>);

impl<M: RecursiveMethod> From<M> for Method {
    fn from(options: M) -> Self {
        Self(Box::new(options))
    }
}

impl Clone for Method {
    fn clone(&self) -> Self {
        Self(self.0.clone_boxed())
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
    /// Returns the method with gains in a basis for people: Box-Jenkins with nc = 0.
    pub fn adaptive() -> Self {
        AdaptiveOptions::default().into()
    }

    /// Returns recursive least squares: ARX and FIR.
    pub fn rls() -> Self {
        RlsOptions::default().into()
    }

    /// Returns the recursive prediction-error method for every structure.
    pub fn rpem() -> Self {
        RpemOptions::default().into()
    }

    pub(crate) fn inner_mut(&mut self) -> &mut dyn RecursiveMethod {
        &mut *self.0
    }

    /// Returns the name, description and options of the method.
    pub fn spec(&self) -> MethodSpec {
        spec(&*self.0)
    }

    /// True if orders, delay or memory are in samples. If they are not, a high sampling rate may be reduced
    /// ([`hoid_model::Decimation`]).
    pub fn counts_samples(&self) -> bool {
        !(self.is_self_starting() || self.models_change())
    }

    /// Returns the name of the method on the command line.
    pub fn name(&self) -> &'static str {
        self.description().name
    }

    /// Returns the options of the method by name.
    pub fn settings(&self) -> &dyn Settings {
        &*self.0
    }

    /// Sets an option from its text.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for an option that the method does not have, or text that is not a valid value.
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), IdentError> {
        if self.0.set(name, text)? {
            return Ok(());
        }
        let own: Vec<&str> = self.list().iter().map(|setting| setting.name).collect();
        let expected = format!("one of {}", own.join(", "));
        Err(invalid_option(
            name,
            format!("an option that the method {} does not have", self.name()),
            &expected,
        ))
    }

    /// Returns the method with an option set from its text.
    ///
    /// # Errors
    /// Same as [`Method::set`].
    pub fn with(mut self, name: &str, text: &str) -> Result<Self, IdentError> {
        self.set(name, text)?;
        Ok(self)
    }

    /// Selects an earlier fit of the person as the start.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for a method that starts from the record.
    pub fn start_from(&mut self, fit: FittedOperator) -> Result<(), IdentError> {
        let source = fit.source.clone();
        match self.0.set_person_prior(PersonPrior::Fit(Box::new(fit))) {
            true => Ok(()),
            false => Err(invalid_option(
                "prior",
                source,
                "the method `adaptive`, the only one that can start from an earlier fit",
            )),
        }
    }

    /// Returns the orders of the operator with the default noise model of the method, which has the order of the
    /// structure or an order that the method specifies.
    pub fn default_orders(&self, nk: usize) -> Orders {
        let orders = self.default_structure().operator_orders(nk);
        match self.default_nd() {
            Some(nd) => Orders { nd, ..orders },
            None => orders,
        }
    }

    /// Returns the default structure of the method: Box-Jenkins, or the first that it supports.
    pub fn default_structure(&self) -> Structure {
        let served = self.description().structures;
        match served.first() {
            Some(first) if !served.contains(&Structure::BoxJenkins) => *first,
            _ => Structure::BoxJenkins,
        }
    }
}

/// [`Method::adaptive`]: it needs no start fit, and is suitable for recorded people.
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
