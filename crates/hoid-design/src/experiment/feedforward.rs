//! The typical response of people to a displayed target ([`typical_feedforward`]), which a design requires.

use hoid_model::{
    FamilyState, Feedforward,
    family_scenario::{Display, FOLLOWED_FRACTION, PREVIEW_S, typical_feedforward},
};

use super::DesignError;

/// Returns the typical response to the target for a person with this response to the error; with a preview, 1 s of the
/// future target is displayed, the default of a condition of `hoid lab`.
pub(super) fn typical_target_response(state: &FamilyState, display: Display) -> Result<Feedforward, DesignError> {
    let found = typical_feedforward(state, display, FOLLOWED_FRACTION, PREVIEW_S)?;
    found.ok_or_else(|| DesignError::NoFeedforward {
        element: state.controlled_element.to_string(),
    })
}
