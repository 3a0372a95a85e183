//! Plans included with the program.

use crate::{Plan, StudyError};

/// A plan included with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NamedPlan {
    /// Name of the plan.
    pub name: &'static str,
    /// TOML text of the plan, which users may copy and change.
    pub text: &'static str,
}

/// The plans included in this crate.
pub const PLANS: &[NamedPlan] = &[NamedPlan {
    name: "adaptation",
    text: include_str!("../plans/adaptation.toml"),
}];

impl NamedPlan {
    /// Number of replications in each of the included plans.
    pub const DEFAULT_REPLICATIONS: u64 = 100;

    /// Parses the plan.
    ///
    /// # Errors
    /// Same as [`Plan::parse`].
    pub fn plan(&self) -> Result<Plan, StudyError> {
        Plan::parse(self.text, self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn named_plans_are_valid_and_match_their_file_names() {
        for named in PLANS {
            let plan = named.plan().unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(plan.name, named.name);
            assert!(!plan.title.is_empty() && !plan.description.is_empty(), "{}", plan.name);
            assert_eq!(plan.replications, NamedPlan::DEFAULT_REPLICATIONS, "{}", plan.name);
        }
    }
}
