//! Assumptions about the time before a record, and the first residual that can be computed under each assumption.

use hoid_model::Orders;

/// Assumptions about the time before a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum InitialState {
    /// Input, output and innovations were zero before the record.
    Zero,
    /// No assumption: the initial states of each record are estimated together with the parameters.
    #[default]
    Estimate,
    /// The noise was stationary before the record as well as in it (the unconditional sum of squares of Box and
    /// Jenkins); nothing is assumed about the response to the input.
    Backcast,
}

hoid_model::named_choice!(InitialState, "choice of initial states", 3, {
    Zero => "zero", Estimate => "estimate", Backcast => "backcast",
});

/// Returns the first sample whose residual can be computed for these orders and this assumption about the initial
/// states.
pub fn first_residual(orders: &Orders, initial: InitialState) -> usize {
    match initial {
        InitialState::Zero => 0,
        InitialState::Estimate => orders.first_regressed_sample() + orders.nd,
        InitialState::Backcast if orders.nb == 0 => 0,
        InitialState::Backcast => orders.first_regressed_sample(),
    }
}
