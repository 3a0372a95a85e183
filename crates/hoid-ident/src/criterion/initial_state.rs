//! Assumptions about the time before a record, and the residuals available under them.

use hoid_model::Orders;

/// Assumptions about the time before a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum InitialState {
    /// Input, output and innovations were zero.
    Zero,
    /// No assumption: the initial states of each record are estimated with the parameters.
    #[default]
    Estimate,
    /// The noise was stationary before the record as well (Box and Jenkins's unconditional sum of squares); there is no
    /// assumption about the response to the input.
    Backcast,
}

hoid_model::named_choice!(InitialState, "rule for initial states", 3, {
    Zero => "zero", Estimate => "estimate", Backcast => "backcast",
});

/// Returns the first sample whose residual can be computed with this rule for initial states, for these orders.
pub fn first_residual(orders: &Orders, initial: InitialState) -> usize {
    match initial {
        InitialState::Zero => 0,
        InitialState::Estimate => orders.first_regressed_sample() + orders.nd,
        InitialState::Backcast if orders.nb == 0 => 0,
        InitialState::Backcast => orders.first_regressed_sample(),
    }
}
