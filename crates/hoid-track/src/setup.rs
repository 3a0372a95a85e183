//! Components of a recursion and its start: structure, orders, and the options that all methods share.

use std::collections::BTreeMap;

use hoid_core::recursion::StablePolynomials;
use hoid_ident::{Constraint, Estimator, SearchOptions};
use hoid_model::{Orders, Structure};

use crate::{forgetting::ForgettingRule, further_input::TrackedInput, memory::Memory, shared_options::WindupGuard};

/// Names of the operator's parameters in a physical recursion.
pub(crate) const PHYSICAL_NAMES: [&str; 5] = ["K_e", "K_e_dot", "omega_nm", "zeta_nm", "tau_e"];

/// Start of the recursion.
#[derive(Debug, Clone, PartialEq)]
pub enum StartSource {
    /// From a batch fit of this span of the record (in s); `None` for the first third.
    Span(Option<(f64, f64)>),
    /// From this theta, in the order of [`Orders::parameter_names`].
    Theta(Vec<f64>),
    /// Without a fit: coefficients of zero, or a typical operator for physical parameters.
    Nothing,
}

/// Components of a recursion.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The structure.
    pub structure: Structure,
    /// The orders.
    pub orders: Orders,
    /// The further input, if the model has one.
    pub further: Option<TrackedInput>,
    /// Start of the recursion.
    pub start: StartSource,
    /// Limits of the search in start fits and in fits of windows.
    pub search: SearchOptions,
    /// Names of the estimated parameters, each with its memory.
    pub memories: Vec<(String, Memory)>,
    /// Forgetting rule.
    pub forgetting: ForgettingRule,
    /// P at the start as a multiple of the unit matrix; `None` for the covariance of the start fit.
    pub covariance: Option<f64>,
    /// Limit of P for unexcited parameters; `None` if the limit follows from the start.
    pub windup_guard: Option<WindupGuard>,
    /// Limit on an innovation in the update, in standard deviations of the innovation.
    pub limit: f64,
    /// Polynomials that are kept stable.
    pub stable: StablePolynomials,
    /// True for a method that needs no start fit.
    pub starts_itself: bool,
    /// True if the parameters of the operator are estimated.
    pub is_physical: bool,
    /// Bounds of physical parameters.
    pub bounds: BTreeMap<String, Constraint>,
    /// Range of the tracked delay tau_e, s.
    pub track_delay_s: Option<(f64, f64)>,
    /// Range of tau_e in s; `None` unless tau_e is one of the estimated parameters.
    pub delay_parameter_s: Option<(f64, f64)>,
}

impl Setup {
    /// Returns the names of the estimated parameters.
    pub fn parameter_names(&self) -> Vec<String> {
        self.memories.iter().map(|(name, _)| name.clone()).collect()
    }

    /// Returns the batch estimator of the start fit.
    pub fn start_estimator(&self) -> Estimator {
        Estimator {
            search: self.search,
            ..Estimator::new(self.structure, self.orders)
        }
    }

    /// Returns the orders of the reported polynomials: if the delay is a parameter, it may lie between two samples, and
    /// B has one more coefficient.
    pub fn polynomial_orders(&self) -> Orders {
        polynomial_orders(self.orders, self.delay_parameter_s.is_some())
    }
}

/// Returns the orders of the polynomials: if the delay is a parameter, it may lie between two samples, and B has one
/// more coefficient.
pub(crate) fn polynomial_orders(orders: Orders, with_delay: bool) -> Orders {
    match with_delay {
        true => Orders { nb: 3, ..orders },
        false => orders,
    }
}

/// Returns the names of the estimated parameters.
pub(crate) fn parameter_names(orders: &Orders, is_physical: bool, with_delay: bool) -> Vec<String> {
    if !is_physical {
        return orders.parameter_names();
    }
    let physical = if with_delay { 5 } else { 4 };
    let mut names: Vec<String> = PHYSICAL_NAMES[..physical].iter().map(|n| (*n).to_owned()).collect();
    names.extend((1..=orders.nc).map(|i| format!("c{i}")));
    names.extend((1..=orders.nd).map(|i| format!("d{i}")));
    names
}
