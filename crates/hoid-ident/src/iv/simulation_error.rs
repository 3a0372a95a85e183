//! The part of the output that a system does not explain. This disturbance is used to estimate the noise model.

use hoid_model::Orders;

use crate::{
    InitialState,
    criterion::{Criterion, Workspace, first_residual},
};

/// Returns `u - (B/F) q^-nk e` of each record, with the initial states of 1/F eliminated.
pub(super) fn simulation_error(theta: &[f64], criterion: &Criterion<'_>) -> Vec<Vec<f64>> {
    let orders = Orders {
        nc: 0,
        nd: 0,
        ..criterion.orders
    };
    let simulating = Criterion {
        orders,
        first: first_residual(&orders, InitialState::Estimate),
        ..criterion.clone()
    };
    let mut workspace = Workspace::borrow_from_thread();
    (0..criterion.data.len())
        .map(|record| simulating.residuals_of(theta, record, &mut workspace))
        .collect()
}
