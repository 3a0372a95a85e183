//! Named plans: the reference text's studies, what it leaves for later, and an example.

use crate::{Plan, StudyError};

/// A plan that comes with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NamedPlan {
    /// Its name.
    pub name: &'static str,
    /// Its text, to be read, copied and changed.
    pub text: &'static str,
}

macro_rules! named {
    ($(#[$doc:meta])* $list:ident: $($name:literal),+ $(,)?) => {
        $(#[$doc])*
        pub const $list: &[NamedPlan] = &[$(NamedPlan {
            name: $name,
            text: include_str!(concat!("../plans/", $name, ".toml")),
        }),+];
    };
}

named![
    /// The named plans of the reproduction, in the order in which they are run.
    NAMED_PLANS:
    "noise-level",
    "bias",
    "initial-conditions",
    "recursive",
    "recursive-arx",
    "decimation",
    "remnant-time-constant",
    "noise-definition",
    "memory",
    "forgetting",
    "lead-change",
];
named![
    /// Named plans of what goes beyond the reference text.
    FURTHER_PLANS:
    "adaptation",
];

impl NamedPlan {
    /// Replications of each named plan, those of the reference text.
    pub const REPLICATIONS: u64 = 100;

    /// The plan of a name.
    pub fn find(name: &str) -> Option<Self> {
        let all = NAMED_PLANS.iter().chain(FURTHER_PLANS);
        all.copied().find(|plan| plan.name == name)
    }

    /// The plan, read.
    ///
    /// # Errors
    /// As [`Plan::parse`].
    pub fn plan(&self) -> Result<Plan, StudyError> {
        Plan::parse(self.text, self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn named_plans_are_right_and_called_as_their_files() {
        for named in NAMED_PLANS.iter().chain(FURTHER_PLANS) {
            let plan = named.plan().unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(plan.name, named.name);
            assert!(!plan.title.is_empty() && !plan.description.is_empty(), "{}", plan.name);
            assert_eq!(plan.replications, NamedPlan::REPLICATIONS, "{}", plan.name);
        }
    }
}
