//! The studies of the thesis as named plans, in addition to the built-in plans.

use hoid_study::{NamedPlan, PLANS};

macro_rules! named {
    ($($name:literal),+ $(,)?) => {
        &[$(NamedPlan {
            name: $name,
            text: include_str!(concat!("../plans/", $name, ".toml")),
        }),+]
    };
}

/// The named plans of the reproduction, in the order of execution.
pub const TEXT_PLANS: &[NamedPlan] = named![
    "noise-level",
    "bias",
    "initial-conditions",
    "recursive",
    "recursive-arx",
    "recursive-starts",
    "decimation",
    "remnant-time-constant",
    "noise-definition",
    "memory",
    "forgetting",
    "lead-change",
];

/// Plan that applies the recursive methods of the survey to the same runs.
pub const SURVEY: &NamedPlan = &NamedPlan {
    name: "survey",
    text: include_str!("../plans/survey.toml"),
};

/// All listed plans: the plans of the thesis and the built-in plans.
pub fn named_plans() -> impl Iterator<Item = &'static NamedPlan> {
    TEXT_PLANS.iter().chain(PLANS)
}

/// Finds the plan with this name: a listed plan, or [`SURVEY`], which is not listed.
pub fn find(name: &str) -> Option<&'static NamedPlan> {
    named_plans().chain([SURVEY]).find(|plan| plan.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn named_plans_are_valid_and_match_their_file_names() {
        for named in TEXT_PLANS {
            let plan = named.plan().unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(plan.name, named.name);
            assert!(!plan.title.is_empty() && !plan.description.is_empty(), "{}", plan.name);
            assert_eq!(plan.replications, NamedPlan::DEFAULT_REPLICATIONS, "{}", plan.name);
        }
        assert!(find("adaptation").is_some() && find("none").is_none());
        let survey = find("survey").map(|named| named.plan().unwrap_or_else(|error| panic!("{error}")));
        assert_eq!(survey.map(|plan| plan.name), Some("survey".to_owned()));
    }
}
