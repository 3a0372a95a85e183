//! Memory for the signals of a record for one theta, reused by the next fit.

use std::{
    cell::Cell,
    ops::{Deref, DerefMut},
};

use hoid_model::Orders;

use super::{
    further_input::{FurtherInput, FurtherSignals},
    initial_state_responses::LastResponses,
};

/// Signals of one record for one theta. Each signal is preceded by `pad` zeros, so shifts need no special case at the
/// start.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    pub(super) pad: usize,
    pub(super) s: Vec<f64>,
    pub(super) w: Vec<f64>,
    pub(super) v: Vec<f64>,
    pub(super) eps: Vec<f64>,
    pub(super) filtered: [Vec<f64>; 5],
    pub(super) scratch: Vec<f64>,
    /// Signals of the further inputs.
    pub(super) further: Vec<FurtherSignals>,
    pub(super) responses: LastResponses,
}

thread_local! {
    /// Workspace of the last fit on this thread.
    static LAST_WORKSPACE: Cell<Option<Workspace>> = const { Cell::new(None) };
}

/// Workspace for one fit, reused by the next fit on the same thread: allocating new memory pages for each fit would
/// take a quarter of the time of a study. The contents are overwritten before they are read.
#[derive(Debug, Default)]
pub(crate) struct BorrowedWorkspace(Workspace);

impl Workspace {
    /// Returns the workspace of this thread, or a new one if it is in use.
    pub fn borrow_from_thread() -> BorrowedWorkspace {
        BorrowedWorkspace(LAST_WORKSPACE.take().unwrap_or_default())
    }
}

impl Deref for BorrowedWorkspace {
    type Target = Workspace;

    fn deref(&self) -> &Workspace {
        &self.0
    }
}

impl DerefMut for BorrowedWorkspace {
    fn deref_mut(&mut self) -> &mut Workspace {
        &mut self.0
    }
}

impl Drop for BorrowedWorkspace {
    fn drop(&mut self) {
        if self.0.eps.capacity() <= MAX_KEPT_SAMPLES {
            LAST_WORKSPACE.set(Some(std::mem::take(&mut self.0)));
        }
    }
}

/// Maximum length in samples of signals that are kept between fits: otherwise an hour at 100 Hz would permanently
/// occupy the memory of the thread.
const MAX_KEPT_SAMPLES: usize = 1 << 17;

impl Workspace {
    /// Allocates memory for the signals that these orders need for a record of n samples. Every pass writes each
    /// signal, including its leading zeros, before it reads the signal.
    pub(super) fn allocate(&mut self, o: &Orders, further: &[FurtherInput<'_>], n: usize) {
        let lags = |input: &FurtherInput<'_>| input.orders.nb.max(o.nc + input.orders.nf);
        let own = o.na.max(o.nb).max(o.nd).max(o.nc + o.nf);
        let pad = further.iter().map(lags).fold(own, usize::max);
        self.pad = pad;
        let [a, b, c, d, f] = &mut self.filtered;
        for (signal, needed) in [
            (&mut self.s, o.nb > 0),
            (&mut self.w, true),
            (&mut self.v, true),
            (&mut self.eps, true),
            (&mut self.scratch, o.na > 0 || (o.nf > 0 && !uses_single_pass(o))),
            (a, o.na > 0),
            (b, o.nb > 0),
            (c, o.nc > 0),
            (d, o.nd > 0 && o.nc > 0),
            (f, o.nf > 0),
        ] {
            signal.resize(if needed { pad + n } else { 0 }, 0.0);
        }
    }
}

/// True if nf = 2, nc = 0 and nd <= 1, as for an operator with first-order noise: the signal for F is then computed in
/// one pass.
pub(super) fn uses_single_pass(o: &Orders) -> bool {
    (o.nc, o.nf) == (0, 2) && o.nd <= 1
}
