//! The criterion: records, orders, and the residuals that count.

use hoid_model::{Orders, Record};

use super::{further_input::FurtherInput, initial_state::InitialState, polynomials::Polynomials};
use crate::linalg::products::variance;

/// Input and output of one record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Data<'a> {
    pub e: &'a [f64],
    pub u: &'a [f64],
    /// True if u has a constant that is not a response to e; it is an unknown like the initial states.
    pub level: bool,
}

impl<'a> Data<'a> {
    /// Returns input and output without a level.
    pub fn new(e: &'a [f64], u: &'a [f64]) -> Self {
        Self { e, u, level: false }
    }

    /// Returns input and output of each record.
    pub fn of(records: &'a [Record]) -> Vec<Self> {
        records.iter().map(|r| Self::new(r.input(), r.output())).collect()
    }
}

/// The criterion over one or several records with a common theta.
#[derive(Debug, Clone)]
pub(crate) struct Criterion<'a> {
    pub orders: Orders,
    pub data: Vec<Data<'a>>,
    pub initial: InitialState,
    /// First sample whose residual counts, in each record; at least
    /// [`first_residual`](super::first_residual).
    pub first: usize,
    /// Square roots of the weights of the residuals of each record, from the first residual on; `None` if all weights
    /// are equal.
    pub weights: Option<&'a [Vec<f64>]>,
    /// Inputs in addition to e, each with its own B, F and nk; their coefficients follow those of [`Self::orders`] in
    /// theta.
    pub further: Vec<FurtherInput<'a>>,
}

/// Variance of the output about its mean, from sample `first` of each record on.
pub(crate) fn output_variance(data: &[Data<'_>], first: usize) -> f64 {
    let outputs: Vec<&[f64]> = data.iter().map(|d| &d.u[first..]).collect();
    variance(&outputs)
}

impl<'a> Criterion<'a> {
    /// Returns the criterion over one record with equal weights of all residuals.
    pub fn of_record(orders: Orders, data: Data<'a>, initial: InitialState, first: usize) -> Self {
        Self {
            orders,
            data: vec![data],
            initial,
            first,
            weights: None,
            further: Vec::new(),
        }
    }

    /// Number of residuals over all records.
    pub fn residuals(&self) -> usize {
        self.data.iter().map(|d| d.u.len().saturating_sub(self.first)).sum()
    }

    /// Number of coefficients, those of the further inputs included.
    pub fn parameters(&self) -> usize {
        let of_further: usize = self.further.iter().map(|f| f.orders.nb + f.orders.nf).sum();
        self.orders.parameters() + of_further
    }

    /// Number of initial states and levels over all records.
    pub fn states(&self) -> usize {
        let of_inputs = self.orders.nf + self.further.iter().map(|input| input.orders.nf).sum::<usize>();
        let of_record = match self.initial {
            InitialState::Zero => return 0,
            InitialState::Estimate => of_inputs + self.orders.nc,
            // The states of the noise are random numbers with a known variance, not parameters.
            InitialState::Backcast => of_inputs,
        };
        self.data.len() * of_record + self.data.iter().filter(|d| d.level).count()
    }

    /// First sample at which w and v are computed.
    pub(super) fn first_regressed(&self) -> usize {
        match self.initial {
            InitialState::Zero => 0,
            InitialState::Estimate => self.first - self.orders.nd,
            InitialState::Backcast => self.first,
        }
    }

    /// Returns the polynomial whose past is that of the noise: D, or A without an input.
    pub(super) fn noise_poles<'t>(&self, parts: &Polynomials<'t>) -> &'t [f64] {
        if self.orders.nb == 0 && self.orders.nd == 0 {
            parts.a
        } else {
            parts.d
        }
    }
}
