//! What asks for the criterion at one theta after the other and is told, so that the searches of several records go on side by side.

use crate::{
    optimize::Linearisation,
    pem::criterion::{Block, Criterion, Workspace},
};

/// What asks for a criterion at one theta after the other.
pub(crate) trait LinearisationClient {
    /// The criterion.
    fn criterion(&self) -> &Criterion<'_>;
    /// Where it is wanted next; nowhere when all has been found.
    fn asked(&self) -> Option<&[f64]>;
    /// The polynomial to which derivatives are wanted; all where none is named.
    fn block(&self) -> Option<Block>;
    /// Takes what was found there.
    fn take(&mut self, there: Linearisation, workspace: &mut Workspace);
}
