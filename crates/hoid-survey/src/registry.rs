//! All recursive methods by name: the methods of [`hoid_track`] and of this crate. A new method needs an entry in this
//! list.

use std::collections::BTreeSet;

use hoid_ident::{IdentError, settings::MethodSpec};
use hoid_track::{AdaptiveOptions, Method, RlsOptions, RpemOptions, building::invalid_option};

use crate::{
    DualEkfOptions, EkfOptions, FusedOptions, LinearNetworkOptions, MultipleModelOptions, PhysicalOptions, RrivOptions,
    UkfOptions, WindowOptions,
};

macro_rules! methods {
    ($($(#[doc = $doc:literal])+ $name:ident = $options:ty),+ $(,)?) => {
        $(
            $(#[doc = $doc])+
            pub fn $name() -> Method {
                <$options>::default().into()
            }
        )+
    };
}

methods! {
    /// Recursive prediction-error method in physical parameters.
    physical = PhysicalOptions,
    /// Repeated batch fit of the last few seconds.
    window = WindowOptions,
    /// Recursive refined instrumental variable: Box-Jenkins with nc = 0.
    rriv = RrivOptions,
    /// A bank of hypotheses about when the person changed, in physical parameters: Box-Jenkins with nc = 0.
    multiple_model = MultipleModelOptions,
    /// Recursive least squares for B with the poles of the recursive prediction-error method:
    /// Box-Jenkins.
    fused = FusedOptions,
    /// Extended Kalman filter for state and physical parameters: Box-Jenkins with nc = 0.
    ekf = EkfOptions,
    /// Unscented Kalman filter for state and physical parameters: Box-Jenkins with nc = 0.
    ukf = UkfOptions,
    /// Two alternating extended Kalman filters, one for the state and one for the physical parameters: Box-Jenkins with
    /// nc = 0 and nd = 1.
    dual_ekf = DualEkfOptions,
    /// A single linear layer that learns K_e and K_e_dot: Box-Jenkins with nc = 0 and nd = 1.
    linear_network = LinearNetworkOptions,
}

/// Returns all methods with their default options, in the order of the help text.
pub fn methods() -> Vec<Method> {
    vec![
        RlsOptions::default().into(),
        RpemOptions::default().into(),
        physical(),
        window(),
        rriv(),
        multiple_model(),
        AdaptiveOptions::default().into(),
        fused(),
        ekf(),
        ukf(),
        dual_ekf(),
        linear_network(),
    ]
}

/// True for a method of this crate; the short help text omits such methods.
pub fn is_for_comparison(method: &Method) -> bool {
    ![Method::rls(), Method::rpem(), Method::default()]
        .iter()
        .any(|own| own.name() == method.name())
}

/// Returns the options that only methods of this crate have; the help text of the command line omits them.
pub fn options_for_comparison() -> BTreeSet<&'static str> {
    let (of_survey, others): (Vec<Method>, Vec<Method>) = methods().into_iter().partition(is_for_comparison);
    let names = |all: Vec<Method>| -> BTreeSet<&'static str> {
        let settings = all.iter().flat_map(|method| method.spec().settings);
        settings.map(|setting| setting.name).collect()
    };
    &names(of_survey) - &names(others)
}

/// Returns the properties of each method, for the command line, plans, Python and the book.
pub fn registry() -> Vec<MethodSpec> {
    methods().iter().map(Method::spec).collect()
}

/// Entry of a recursive method in the list for users.
#[derive(Debug, Clone)]
pub struct ListedMethod {
    /// Description of the method.
    pub spec: MethodSpec,
    /// True for the method that is used if no method is named.
    pub is_default: bool,
    /// True for a method of this crate, which is listed only for comparison.
    pub is_for_comparison: bool,
}

/// Returns all methods as a list for users, with the default first and the methods of this crate last.
pub fn list_methods() -> Vec<ListedMethod> {
    let default = Method::default();
    let of = |method: &Method| ListedMethod {
        spec: method.spec(),
        is_default: method.name() == default.name(),
        is_for_comparison: is_for_comparison(method),
    };
    let mut all: Vec<ListedMethod> = methods().iter().map(of).collect();
    all.sort_by_key(|one| (!one.is_default, one.is_for_comparison));
    all
}

/// Converts a name as typed by the user to the form used in the list.
fn normalise_name(text: &str) -> String {
    text.trim().to_ascii_lowercase()
}

/// Returns the method with this name and its default options. Earlier names, which occur in plans and saved trackers,
/// are accepted as well; callers that can show messages to the user report them ([`renamed_method`]).
///
/// # Errors
/// [`IdentError::BadOption`] if no method has this name.
pub fn method(text: &str) -> Result<Method, IdentError> {
    let plain = normalise_name(text);
    let name = renamed_method(&plain).map_or(plain.as_str(), |(now, _)| now);
    let all = methods();
    let names: Vec<&str> = all.iter().map(Method::name).collect();
    let found = all.iter().find(|method| method.name() == name).cloned();
    found.ok_or_else(|| invalid_option("the method", text.to_owned(), &format!("one of {}", names.join(", "))))
}

/// Returns the current name for an earlier name of a method, and the message that reports it; `None` if it is not an
/// earlier name.
pub fn renamed_method(text: &str) -> Option<(&'static str, String)> {
    let earlier = normalise_name(text);
    let found = methods()
        .into_iter()
        .find(|method| method.earlier_name() == Some(earlier.as_str()))?;
    let name = found.name();
    Some((name, format!("the method `{earlier}` is now called `{name}`")))
}

/// Sets an option of a method from its text.
///
/// # Errors
/// The errors of [`Method::set`]; if only other methods have the option, the error lists these methods.
pub fn set(method: &mut Method, name: &str, text: &str) -> Result<(), IdentError> {
    let has = |spec: &MethodSpec| spec.settings.iter().any(|setting| setting.name == name);
    if has(&method.spec()) {
        return method.set(name, text);
    }
    let of: Vec<&str> = registry()
        .iter()
        .filter(|spec| has(spec))
        .map(|spec| spec.name)
        .collect();
    match of.as_slice() {
        [] => method.set(name, text),
        of => Err(invalid_option(
            name,
            format!("the method {}", method.name()),
            &format!("the method {}, which has this option", of.join(" or ")),
        )),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::Structure;
    use hoid_track::TrackOptions;

    use super::*;

    #[test]
    fn method_names_round_trip() {
        for method in methods() {
            assert_eq!(self::method(method.name()).unwrap(), method);
            let spec = method.spec();
            assert!(!spec.help.is_empty() && !spec.source.is_empty(), "{method}");
            assert!(spec.settings.iter().all(|s| !s.help.is_empty()), "{method}");
        }
        assert!(method("kalman").unwrap_err().to_string().contains("rpem, physical"));
    }

    #[test]
    fn list_starts_with_the_default_and_ends_with_the_survey() {
        let all = list_methods();
        let names: Vec<&str> = all.iter().map(|one| one.spec.name).collect();
        assert_eq!(names[..4], ["adaptive", "rls", "rpem", "physical"]);
        assert_eq!(all.len(), methods().len());
        assert_eq!(all.iter().filter(|one| one.is_default).count(), 1);
        assert_eq!(all.iter().position(|one| one.is_for_comparison), Some(3));
        assert!(all[3..].iter().all(|one| one.is_for_comparison));
    }

    #[test]
    fn former_name_is_accepted_with_a_message() {
        assert_eq!(method("population").unwrap(), Method::adaptive());
        let (name, note) = renamed_method(" Population").unwrap();
        assert_eq!(name, "adaptive");
        assert_eq!(note, "the method `population` is now called `adaptive`");
        let refused = method("kalman").unwrap_err().to_string();
        assert!(!refused.contains("population"), "{refused}");
        for method in methods() {
            assert_eq!(renamed_method(method.name()), None, "a name belongs to one method");
        }
    }

    #[test]
    fn options_with_the_same_name_are_identical() {
        let all: Vec<_> = registry().into_iter().flat_map(|spec| spec.settings).collect();
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
    fn unsupported_structures_are_refused() {
        for method in methods() {
            for structure in Structure::ALL {
                let orders = match structure {
                    Structure::BoxJenkins => method.default_orders(29),
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
    fn options_of_other_methods_are_refused_by_name() {
        let refused = set(&mut Method::rls(), "alarm", "3").unwrap_err().to_string();
        assert!(
            refused.contains("alarm") && refused.contains("multiple-model"),
            "{refused}"
        );
        let refused = set(&mut window(), "windup_guard", "off").unwrap_err().to_string();
        assert!(refused.contains("rls or rpem"), "{refused}");
        let refused = set(&mut Method::rls(), "colour", "3").unwrap_err().to_string();
        assert!(refused.contains("memory"), "{refused}");
        let set = multiple_model().with("alarm", "3").unwrap();
        assert_eq!(set.settings().get("alarm").as_deref(), Some("3"));
    }
}
