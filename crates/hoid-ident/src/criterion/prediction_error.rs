//! The prediction error criterion: records, orders, and the residuals that count.

use hoid_model::{Orders, Record};

use super::{further_input::FurtherInput, initial_state::InitialState, polynomials::Polynomials};
use crate::linalg::products::variance;

/// Input and output of one record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Data<'a> {
    pub e: &'a [f64],
    pub u: &'a [f64],
    /// True if u contains an unknown constant that is not a response to e; it is estimated like the initial states.
    pub level: bool,
}

impl<'a> Data<'a> {
    /// Creates the data of one record, without a level.
    pub fn new(e: &'a [f64], u: &'a [f64]) -> Self {
        Self { e, u, level: false }
    }

    /// Returns the data of each record, without a level.
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
    /// First sample of each record whose residual counts; at least [`first_residual`](super::first_residual).
    pub first: usize,
    /// Square roots of the residual weights for each record, from the first residual on; `None` if all weights are
    /// equal.
    pub weights: Option<&'a [Vec<f64>]>,
    /// Inputs in addition to e, each with separate B, F and nk. In theta their coefficients follow those of
    /// [`Self::orders`].
    pub further: Vec<FurtherInput<'a>>,
}

/// Returns the variance of the output about its mean, over sample `first` and later samples of each record.
pub(crate) fn output_variance(data: &[Data<'_>], first: usize) -> f64 {
    let outputs: Vec<&[f64]> = data.iter().map(|d| &d.u[first..]).collect();
    variance(&outputs)
}

impl<'a> Criterion<'a> {
    /// Returns the criterion for one record, with equal weights of all residuals.
    pub fn for_record(orders: Orders, data: Data<'a>, initial: InitialState, first: usize) -> Self {
        Self {
            orders,
            data: vec![data],
            initial,
            first,
            weights: None,
            further: Vec::new(),
        }
    }

    /// Returns the number of residuals that count, over all records.
    pub fn residual_count(&self) -> usize {
        self.data.iter().map(|d| d.u.len().saturating_sub(self.first)).sum()
    }

    /// Returns the number of coefficients, including the coefficients of the further inputs.
    pub fn parameter_count(&self) -> usize {
        let of_further: usize = self.further.iter().map(|f| f.orders.nb + f.orders.nf).sum();
        self.orders.parameter_count() + of_further
    }

    /// Returns the number of initial states and levels of all records.
    pub fn state_count(&self) -> usize {
        let of_inputs = self.orders.nf + self.further.iter().map(|input| input.orders.nf).sum::<usize>();
        let of_record = match self.initial {
            InitialState::Zero => return 0,
            InitialState::Estimate => of_inputs + self.orders.nc,
            // The states of the noise model are not parameters but random variables with a known covariance.
            InitialState::Backcast => of_inputs,
        };
        self.data.len() * of_record + self.data.iter().filter(|d| d.level).count()
    }

    /// Returns the first sample at which w and v are computed.
    pub(super) fn first_regressed_sample(&self) -> usize {
        match self.initial {
            InitialState::Zero => 0,
            InitialState::Estimate => self.first - self.orders.nd,
            InitialState::Backcast => self.first,
        }
    }

    /// Returns the polynomial that contains the poles of the noise model: D, or A for a model without an input and
    /// without D.
    pub(super) fn noise_poles<'t>(&self, parts: &Polynomials<'t>) -> &'t [f64] {
        if self.orders.nb == 0 && self.orders.nd == 0 {
            parts.a
        } else {
            parts.d
        }
    }
}
