//! A search by reverse communication: it names the theta at which it needs the linearisation of the
//! criterion, and is updated with it. Code that drives it decides how to linearise: alone, or for
//! several records side by side.

use crate::{
    criterion::{Block, Criterion, Workspace},
    optimize::Linearisation,
};

/// A computation that needs the linearisation of a criterion at one theta after the other.
pub(crate) trait LinearisationClient {
    /// The criterion.
    fn criterion(&self) -> &Criterion<'_>;
    /// Theta at which the linearisation is needed next; `None` when the computation has ended.
    fn evaluation_point(&self) -> Option<&[f64]>;
    /// The polynomial with respect to which derivatives are needed; `None` for all.
    fn block(&self) -> Option<Block>;
    /// Continues with the linearisation at [`LinearisationClient::evaluation_point`].
    fn update(&mut self, there: Linearisation, workspace: &mut Workspace);
}
