//! The people of a design: the typical person, for whom the forcing function is designed, and the others.

use hoid_model::{ContinuousTransferFunction, FamilyState, Finding, Form, family_scenario::Feedforward};

use super::DesignError;

/// A person with a name.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NamedState {
    pub name: String,
    pub state: FamilyState,
}

/// The people of a design.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ChosenPeople {
    pub typical: NamedState,
    pub others: Vec<NamedState>,
    /// Response to a displayed target, if the source of the people specifies it.
    pub feedforward: Option<Feedforward>,
    pub findings: Vec<Finding>,
}

/// Options given in addition to the people.
#[derive(Debug, Clone, Copy)]
pub(super) struct GivenOptions<'a> {
    pub controlled_element: Option<&'a ContinuousTransferFunction>,
    pub form: Option<Form>,
    pub condition: Option<&'a str>,
}

impl GivenOptions<'_> {
    /// Returns the given controlled element, for people whose source does not specify one.
    pub fn element(&self, people: &str) -> Result<ContinuousTransferFunction, DesignError> {
        let missing = || DesignError::NoElement {
            people: people.to_owned(),
        };
        self.controlled_element.cloned().ok_or_else(missing)
    }
}

/// Returns the finding that a person is omitted.
pub(super) fn exclusion_finding(name: &str, reason: &str) -> Finding {
    Finding::warning("person-left-out", format!("{name} is left out: {reason}"))
}
