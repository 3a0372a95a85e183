//! A search by reverse communication: it returns the theta at which it needs the linearisation of the criterion, and is
//! updated with it. The caller decides how to linearise: for one record, or for several records in parallel lanes.

use crate::{
    criterion::{Block, Criterion, Workspace},
    optimize::Linearisation,
};

/// A computation that needs the linearisation of a criterion at one theta after the other.
pub(crate) trait LinearisationClient {
    /// The criterion.
    fn criterion(&self) -> &Criterion<'_>;
    /// Returns theta at which the linearisation is needed next; `None` when the computation has ended.
    fn evaluation_point(&self) -> Option<&[f64]>;
    /// Returns the polynomial with respect to which derivatives are needed; `None` for all.
    fn block(&self) -> Option<Block>;
    /// Continues with the linearisation at [`LinearisationClient::evaluation_point`].
    fn update(&mut self, there: Linearisation, workspace: &mut Workspace);
}
