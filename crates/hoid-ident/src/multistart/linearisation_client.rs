//! A search by reverse communication: it returns the theta at which it needs the linearisation of the criterion, and
//! continues when it receives this linearisation. The caller decides how to linearise: for one record, or for several
//! records in parallel lanes.

use crate::{
    criterion::{Block, Criterion, Workspace},
    optimize::Linearisation,
};

/// A computation that needs the linearisation of a criterion at successive values of theta.
pub(crate) trait LinearisationClient {
    /// Returns the criterion that must be linearised.
    fn criterion(&self) -> &Criterion<'_>;
    /// Returns theta at which the linearisation is needed next; `None` when the computation has ended.
    fn evaluation_point(&self) -> Option<&[f64]>;
    /// Returns the polynomial for which derivatives are needed; `None` for all polynomials.
    fn block(&self) -> Option<Block>;
    /// Continues with the linearisation at [`LinearisationClient::evaluation_point`].
    fn update(&mut self, there: Linearisation, workspace: &mut Workspace);
}
