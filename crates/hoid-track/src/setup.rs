//! Components of a recursion, next to its start: structure, orders, and the options that all
//! methods read alike.

use std::collections::BTreeMap;

use hoid_core::recursion::Stable;
use hoid_ident::{Constraint, Estimator, SearchOptions};
use hoid_model::{Orders, Structure};

use crate::{forgetting::ForgettingRule, memory::Memory, shared_options::WindupGuard};

/// Delay of people who track, s: the prior where none is given.
pub(crate) const DEFAULT_DELAY_S: f64 = 0.2;

/// Names of the operator's parameters in a physical recursion.
pub(crate) const PHYSICAL_NAMES: [&str; 5] = ["K_e", "K_e_dot", "omega_nm", "zeta_nm", "tau_e"];

/// Where the recursion starts.
#[derive(Debug, Clone, PartialEq)]
pub enum StartAt {
    /// From a batch fit of this span of the record, s; `None` is the first third.
    Span(Option<(f64, f64)>),
    /// From this theta, in the order of [`Orders::parameter_names`].
    Theta(Vec<f64>),
    /// From nothing: coefficients of zero, or a typical operator for physical parameters.
    Nothing,
}

/// Components of a recursion.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The structure.
    pub structure: Structure,
    /// The orders.
    pub orders: Orders,
    /// Where it starts.
    pub start: StartAt,
    /// Limits of the search of start fits and windows.
    pub search: SearchOptions,
    /// Names of the parameters that move, each with its memory.
    pub memories: Vec<(String, Memory)>,
    /// How it forgets.
    pub forgetting: ForgettingRule,
    /// P at the start as a multiple of the unit matrix; none for that of the start fit.
    pub covariance: Option<f64>,
    /// How far P may grow where nothing excites a parameter; none if that follows from the start.
    pub windup_guard: Option<WindupGuard>,
    /// Multiple of the innovation's standard deviation beyond which an innovation moves the
    /// estimate no further.
    pub limit: f64,
    /// Polynomials that are kept stable.
    pub stable: Stable,
    /// True for a method that needs no start fit.
    pub starts_itself: bool,
    /// True if the operator's parameters move.
    pub is_physical: bool,
    /// Bounds of physical parameters.
    pub bounds: BTreeMap<String, Constraint>,
    /// Range of tau_e in s that is followed.
    pub track_delay_s: Option<(f64, f64)>,
    /// Range of tau_e in s where it is one of the parameters that move.
    pub delay_parameter_s: Option<(f64, f64)>,
}

impl Setup {
    /// Names of the parameters that move.
    pub fn names(&self) -> Vec<String> {
        self.memories.iter().map(|(name, _)| name.clone()).collect()
    }

    /// The batch fit from which a recursion starts.
    pub fn start_estimator(&self) -> Estimator {
        Estimator {
            search: self.search,
            ..Estimator::new(self.structure, self.orders)
        }
    }

    /// Orders of the polynomials that the method reports: a delay between two samples takes one
    /// coefficient of B more.
    pub fn polynomial_orders(&self) -> Orders {
        polynomial_orders(self.orders, self.delay_parameter_s.is_some())
    }
}

/// Orders of the polynomials: a delay between two samples takes one coefficient of B more.
pub(crate) fn polynomial_orders(orders: Orders, with_delay: bool) -> Orders {
    match with_delay {
        true => Orders { nb: 3, ..orders },
        false => orders,
    }
}

/// Names of the parameters that move.
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
