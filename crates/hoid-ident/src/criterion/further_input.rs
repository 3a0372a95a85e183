//! A further input: its orders, values and signals.

/// Numbers of coefficients of B and F of one input, and its delay in samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub struct InputOrders {
    /// Number of coefficients `b0 ... b_{nb-1}` of B.
    pub nb: usize,
    /// Number of coefficients `f1 ... f_nf` of F.
    pub nf: usize,
    /// Delay of b0 in samples.
    pub nk: usize,
}

impl InputOrders {
    /// Returns the first sample at which `B q^-nk` needs no input from before the record: `nk + nb - 1`.
    pub fn first_regressed_sample(&self) -> usize {
        self.nk.saturating_add(self.nb.saturating_sub(1))
    }
}

/// A further input: its orders, and its values in each record.
#[derive(Debug, Clone)]
pub(crate) struct FurtherInput<'a> {
    pub orders: InputOrders,
    pub values: Vec<&'a [f64]>,
}

/// The signals of a further input for one theta, each preceded by the padding zeros of the workspace.
#[derive(Debug, Default)]
pub(super) struct FurtherSignals {
    pub s: Vec<f64>,
    pub w: Vec<f64>,
    pub b_columns: Vec<f64>,
    pub f_columns: Vec<f64>,
}
