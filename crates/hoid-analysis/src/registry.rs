//! The registry of batch estimators: name, description and options of each estimator.
//!
//! Flags and help texts of the command line, keys of plans, keyword arguments in Python, the page of options and the
//! names of printed settings are generated from this list. An option is defined in the file of its estimator
//! ([`BatchOptions`](hoid_ident::settings::BatchOptions)) and an estimator in a file of `estimators/`; a new
//! instrumental-variable method is listed here once it is in [`IvMethod::ALL`](hoid_ident::IvMethod::ALL).

use hoid_ident::{
    GreyBox, SigmoidChange,
    family::FamilyEstimator,
    settings::{MethodSpec, Setting},
};

pub use crate::names::{CHANGE, OPERATOR, PEM, REMNANT};

use crate::estimators::{BatchEstimator, Polynomials};

/// Returns the specification of each batch estimator.
pub fn estimators() -> Vec<MethodSpec> {
    [
        FamilyEstimator::specs(),
        GreyBox::specs(),
        SigmoidChange::specs(),
        Polynomials::specs(),
    ]
    .concat()
}

/// Returns the option with this name from the registry.
pub fn estimator_setting(name: &str) -> Option<Setting> {
    estimators()
        .into_iter()
        .flat_map(|spec| spec.settings)
        .find(|setting| setting.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_estimator_is_documented_with_unique_options() {
        let all = estimators();
        for spec in &all {
            assert!(
                !spec.help.is_empty() && !spec.source.is_empty() && !spec.structures.is_empty(),
                "{}",
                spec.name
            );
            for setting in &spec.settings {
                let same = spec.settings.iter().filter(|other| other.name == setting.name).count();
                assert!(same == 1 && !setting.help.is_empty(), "{} {}", spec.name, setting.name);
            }
        }
        let names: Vec<&str> = all.iter().map(|spec| spec.name).collect();
        assert_eq!(names, [OPERATOR, REMNANT, CHANGE, PEM, "iv4", "sriv", "rivbj"]);
    }
}
