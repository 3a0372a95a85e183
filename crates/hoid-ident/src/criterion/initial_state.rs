//! Assumptions about the time before a record, and which residuals can be had under it.

use hoid_model::Orders;

/// Assumptions about the time before a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum InitialState {
    /// Input, output and innovations were zero.
    Zero,
    /// Nothing is assumed: the initial states of each record are estimated with the parameters.
    #[default]
    Estimate,
    /// The noise was stationary before the record as well (Box and Jenkins's unconditional sum of
    /// squares); of the response to the input nothing is assumed.
    Backcast,
}

hoid_model::named_choice!(InitialState, "rule for initial states", 3, {
    Zero => "zero", Estimate => "estimate", Backcast => "backcast",
});

/// First sample whose residual can be had under the rule for initial states, for these orders.
pub fn first_residual(orders: &Orders, initial: InitialState) -> usize {
    match initial {
        InitialState::Zero => 0,
        InitialState::Estimate => orders.first_regressed_sample() + orders.nd,
        InitialState::Backcast if orders.nb == 0 => 0,
        InitialState::Backcast => orders.first_regressed_sample(),
    }
}
