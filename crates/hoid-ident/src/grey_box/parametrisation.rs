//! What the criterion needs to know of physical parameters: which polynomials they give.

use std::ops::Range;

use hoid_model::{ModelError, Orders, SampleTime};

/// Orders and theta of one record at one eta, and the derivatives of theta: a column for each slot
/// of the record.
#[derive(Debug, Clone)]
pub(crate) struct Mapped {
    pub orders: Orders,
    pub theta: Vec<f64>,
    pub columns: Vec<Vec<f64>>,
}

/// Physical parameters eta of one or several records.
pub(crate) trait Parametrisation: Clone {
    /// Place in eta of each slot of a record.
    fn positions(&self, record: usize) -> &[usize];
    /// Lower and upper bound of each element of eta.
    fn limits(&self) -> &[(f64, f64)];
    /// Places of the delays in eta.
    fn delays(&self) -> Vec<usize>;
    /// Place in eta of the delay of a record.
    fn delay_of(&self, record: usize) -> usize;
    /// Time between two samples.
    fn sample_time(&self) -> SampleTime;
    /// Orders of the polynomials at this delay of the first coefficient of B.
    fn orders(&self, nk: usize) -> Orders;
    /// Places in eta of the polynomials C that must be stable and have no limits of their own.
    fn stable_blocks(&self) -> Vec<Range<usize>>;
    /// The polynomials of one record; `sample` is the sample in which its delay lies, where the
    /// caller has chosen one.
    ///
    /// # Errors
    /// [`ModelError`] for an eta without a model.
    fn map(&self, eta: &[f64], record: usize, sample: Option<usize>) -> Result<Mapped, ModelError>;
}
