//! The recursive methods. A new one is a file beside these and a line in the list below.

mod adaptive;
mod fused;
mod joint_filter;
mod multiple_model;
mod physical;
mod rls;
mod rpem;
mod rriv;
mod window;

use std::{fmt, str::FromStr};

use hoid_ident::{
    IdentError,
    settings::{MethodSpec, Settings},
};
use hoid_model::{FittedOperator, Orders, Structure};

use crate::{
    memory::{Memory, MemoryOptions},
    method::{RecursiveMethod, bad, spec},
    person_prior::PersonPrior,
};

pub use adaptive::AdaptiveOptions;
pub use fused::FusedOptions;
pub use joint_filter::{EkfOptions, UkfOptions};
pub use multiple_model::MultipleModelOptions;
pub use physical::PhysicalOptions;
pub use rls::RlsOptions;
pub use rpem::RpemOptions;
pub use rriv::RrivOptions;
pub use window::WindowOptions;

pub(crate) use multiple_model::{change_prior, first_hypothesis, outside};

macro_rules! methods {
    ($($(#[doc = $doc:literal])+ $variant:ident($options:ident) = $name:ident),+ $(,)?) => {
        /// A recursive method with its options.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Method {
            $($(#[doc = $doc])+ $variant($options)),+
        }

        impl Method {
            /// All methods with their defaults.
            pub fn all() -> Vec<Self> {
                vec![$(Self::$name()),+]
            }

            $(
                $(#[doc = $doc])+
                pub fn $name() -> Self {
                    Self::$variant($options::default())
                }
            )+

            pub(crate) fn inner(&self) -> &dyn RecursiveMethod {
                match self {
                    $(Self::$variant(options) => options),+
                }
            }

            pub(crate) fn inner_mut(&mut self) -> &mut dyn RecursiveMethod {
                match self {
                    $(Self::$variant(options) => options),+
                }
            }
        }

        $(impl From<$options> for Method {
            fn from(options: $options) -> Self {
                Self::$variant(options)
            }
        })+
    };
}

methods! {
    /// Recursive least squares: ARX and FIR.
    Rls(RlsOptions) = rls,
    /// Recursive prediction-error method for every structure.
    Rpem(RpemOptions) = rpem,
    /// Recursive prediction-error method in physical parameters.
    Physical(PhysicalOptions) = physical,
    /// Batch fit of the last seconds, again and again.
    Window(WindowOptions) = window,
    /// Recursive refined instrumental variable: Box-Jenkins with nc = 0.
    Rriv(RrivOptions) = rriv,
    /// A bank of hypotheses of when the person changed, in physical parameters: Box-Jenkins with nc
    /// = 0.
    MultipleModel(MultipleModelOptions) = multiple_model,
    /// Gains in a basis that people share: Box-Jenkins with nc = 0.
    Adaptive(AdaptiveOptions) = adaptive,
    /// Recursive least squares for B with the poles of the recursive prediction-error method:
    /// Box-Jenkins.
    Fused(FusedOptions) = fused,
    /// Extended Kalman filter of state and physical parameters: Box-Jenkins with nc = 0.
    Ekf(EkfOptions) = ekf,
    /// Unscented Kalman filter of state and physical parameters: Box-Jenkins with nc = 0.
    Ukf(UkfOptions) = ukf,
}

impl Method {
    /// What is known of each method: the registry that command line, plans, Python and the book
    /// read.
    pub fn registry() -> Vec<MethodSpec> {
        Self::all().iter().map(Self::spec).collect()
    }

    /// What is known of it.
    pub fn spec(&self) -> MethodSpec {
        spec(self.inner())
    }

    /// Whether orders, delay or memory are those of a polynomial in samples; else the rate is free, and
    /// a high one is lowered ([`hoid_model::Decimation`]).
    pub fn counts_samples(&self) -> bool {
        let inner = self.inner();
        !(inner.starts_itself() || inner.is_model_of_change())
    }

    /// Name as on the command line.
    pub fn name(&self) -> &'static str {
        self.inner().about().name
    }

    /// What it was called before; that is still read.
    pub fn earlier_name(&self) -> Option<&'static str> {
        self.inner().earlier_name()
    }

    /// Of an earlier name of a method that of now, and the sentence that says so.
    pub fn renamed(text: &str) -> Option<(&'static str, String)> {
        let earlier = plain(text);
        let found = Self::all()
            .into_iter()
            .find(|method| method.earlier_name() == Some(earlier.as_str()))?;
        let name = found.name();
        Some((name, format!("the method `{earlier}` is now called `{name}`")))
    }

    /// Its options by name.
    pub fn settings(&self) -> &dyn Settings {
        self.inner()
    }

    /// Sets an option from its text.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for an option that the method does not have, or a text that is no
    /// value of it.
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), IdentError> {
        if self.inner_mut().set(name, text)? {
            return Ok(());
        }
        let of: Vec<&str> = Self::registry()
            .into_iter()
            .filter(|spec| spec.settings.iter().any(|setting| setting.name == name))
            .map(|spec| spec.name)
            .collect();
        let expected = match of.as_slice() {
            [] => format!(
                "one of {}",
                self.settings()
                    .list()
                    .iter()
                    .map(|s| s.name)
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
            of => format!("the method {}, to which it belongs", of.join(" or ")),
        };
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

    /// Begins with an earlier fit of the person.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for a method that begins with the record.
    pub fn start_from(&mut self, fit: FittedOperator) -> Result<(), IdentError> {
        let source = fit.source.clone();
        match self.inner_mut().set_person_prior(PersonPrior::Fit(Box::new(fit))) {
            true => Ok(()),
            false => Err(bad(
                "prior",
                source,
                "the method adaptive, which alone begins with a fit",
            )),
        }
    }

    /// What is known of the person before the first sample, where that is an option.
    pub fn person_prior(&self) -> Option<&PersonPrior> {
        self.inner().person_prior()
    }

    /// True for a method that estimates physical parameters.
    pub fn is_physical(&self) -> bool {
        self.inner().is_physical()
    }

    /// True for a method that has a model of how the person changes, and no memory: physical
    /// parameters behind the noise model of a batch fit, which stays.
    pub fn is_model_of_change(&self) -> bool {
        self.inner().is_model_of_change()
    }

    /// True for a method that needs no start fit and learns from the first sample on.
    pub fn starts_itself(&self) -> bool {
        self.inner().starts_itself()
    }

    /// Lag of the basis in which it estimates gains, s; `None` for a method without one.
    pub fn lag_of_basis_s(&self) -> Option<f64> {
        self.inner().lag_of_basis_s()
    }

    /// Its memories, where it has some.
    pub fn memories(&self) -> Option<&MemoryOptions> {
        self.inner().memories()
    }

    /// True where it gives the two-sided estimate of a recorded run.
    pub fn smooths(&self) -> bool {
        self.inner().smooths()
    }

    /// P at the start as a multiple of the unit matrix; none for that of the start fit.
    pub fn covariance(&self) -> Option<f64> {
        self.inner().covariance()
    }

    /// Range of tau_e in s that is followed.
    pub fn track_delay_s(&self) -> Option<(f64, f64)> {
        self.inner().track_delay_s()
    }

    /// The limit of innovations in use, in standard deviations.
    pub fn limit(&self) -> f64 {
        self.inner().limit()
    }

    /// The operator's orders with the noise model that the method takes when none is named: of
    /// order 1, for multiple-model of order 6, for its odds need innovations that are white.
    pub fn usual_orders(&self, nk: usize) -> Orders {
        let orders = self.usual_structure().operator_orders(nk);
        match self.usual_nd() {
            Some(nd) => Orders { nd, ..orders },
            None => orders,
        }
    }

    /// Order of the noise model when none is named and the method does not leave it to the
    /// structure.
    pub fn usual_nd(&self) -> Option<usize> {
        self.inner().usual_nd()
    }

    /// The structure that the method takes when none is named: Box-Jenkins, or the first that it
    /// serves.
    pub fn usual_structure(&self) -> Structure {
        let served = self.inner().about().structures;
        match served.first() {
            Some(first) if !served.contains(&Structure::BoxJenkins) => *first,
            _ => Structure::BoxJenkins,
        }
    }

    /// Memory of a parameter when none is given.
    pub fn usual_memory(&self, parameter: &str) -> Memory {
        self.inner().usual_memory(parameter)
    }
}

/// [`Method::adaptive`]: it needs nothing to begin with, and holds on recorded people.
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

/// A name as it was typed, in the form of the registry.
fn plain(text: &str) -> String {
    text.trim().to_ascii_lowercase()
}

/// The method of a name, with its defaults. An earlier name stands in plans and in saved trackers, and is read
/// as well; who can tell the user says it ([`Method::renamed`]).
impl FromStr for Method {
    type Err = IdentError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let plain = plain(text);
        let name = Self::renamed(&plain).map_or(plain.as_str(), |(now, _)| now);
        let all = Self::all();
        let names: Vec<&str> = all.iter().map(Self::name).collect();
        let found = all.iter().find(|method| method.name() == name).cloned();
        found.ok_or_else(|| bad("the method", text.to_owned(), &format!("one of {}", names.join(", "))))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::TrackOptions;

    #[test]
    fn names_lead_back_to_methods() {
        for method in Method::all() {
            assert_eq!(method.name().parse::<Method>().unwrap(), method);
            let spec = method.spec();
            assert!(!spec.help.is_empty() && !spec.source.is_empty(), "{method}");
            assert!(spec.settings.iter().all(|s| !s.help.is_empty()), "{method}");
        }
        assert!(
            "kalman"
                .parse::<Method>()
                .unwrap_err()
                .to_string()
                .contains("rpem, physical")
        );
    }

    #[test]
    fn an_earlier_name_is_read_and_said_to_be_one() {
        assert_eq!("population".parse::<Method>().unwrap(), Method::adaptive());
        let (name, note) = Method::renamed(" Population").unwrap();
        assert_eq!(name, "adaptive");
        assert_eq!(note, "the method `population` is now called `adaptive`");
        let refused = "kalman".parse::<Method>().unwrap_err().to_string();
        assert!(!refused.contains("population"), "{refused}");
        for method in Method::all() {
            assert_eq!(Method::renamed(method.name()), None, "a name belongs to one method");
        }
    }

    #[test]
    fn an_option_of_one_name_is_the_same_for_all() {
        let all: Vec<_> = Method::registry().into_iter().flat_map(|spec| spec.settings).collect();
        for a in &all {
            let same = all.iter().filter(|b| a.name == b.name);
            assert!(
                same.clone()
                    .all(|b| (a.kind, a.unit, &a.help) == (b.kind, b.unit, &b.help)),
                "{}",
                a.name
            );
        }
    }

    #[test]
    fn structures_that_are_not_served_are_refused() {
        for method in Method::all() {
            for structure in Structure::ALL {
                let orders = match structure {
                    Structure::BoxJenkins => method.usual_orders(29),
                    _ => structure.operator_orders(if structure.has_input() { 29 } else { 0 }),
                };
                let options = TrackOptions::new(method.clone(), structure, orders);
                let served = method.spec().structures.contains(&structure);
                assert_eq!(
                    options.check().is_ok(),
                    served,
                    "{method} {structure}: {:?}",
                    options.check()
                );
            }
        }
    }

    #[test]
    fn what_belongs_to_another_method_is_refused_by_name() {
        let refused = Method::rls().with("alarm", "3").unwrap_err().to_string();
        assert!(
            refused.contains("alarm") && refused.contains("multiple-model"),
            "{refused}"
        );
        let refused = Method::rls().with("colour", "3").unwrap_err().to_string();
        assert!(refused.contains("memory"), "{refused}");
        let set = Method::multiple_model().with("alarm", "3").unwrap();
        assert_eq!(set.settings().get("alarm").as_deref(), Some("3"));
    }
}
