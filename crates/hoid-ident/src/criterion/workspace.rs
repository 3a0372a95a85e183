//! The signals of a record at one theta, in memory that is reused by the next fit.

use std::{
    cell::Cell,
    ops::{Deref, DerefMut},
};

use hoid_model::Orders;

use super::further_input::{FurtherInput, FurtherSignals};

/// Signals of one record at one theta. Each is preceded by `pad` zeros, so that a shift needs no case distinction.
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
}

thread_local! {
    /// The workspace of the last fit on this thread.
    static LEFT: Cell<Option<Workspace>> = const { Cell::new(None) };
}

/// A workspace for one fit, reused by the next on the same thread: allocating new pages for each fit costs a quarter of
/// a study's time. Its contents are written before they are read.
#[derive(Debug, Default)]
pub(crate) struct Borrowed(Workspace);

impl Workspace {
    /// Returns the workspace of this thread, or a new one if it is in use.
    pub fn of_thread() -> Borrowed {
        Borrowed(LEFT.take().unwrap_or_default())
    }
}

impl Deref for Borrowed {
    type Target = Workspace;

    fn deref(&self) -> &Workspace {
        &self.0
    }
}

impl DerefMut for Borrowed {
    fn deref_mut(&mut self) -> &mut Workspace {
        &mut self.0
    }
}

impl Drop for Borrowed {
    fn drop(&mut self) {
        if self.0.eps.capacity() <= KEPT {
            LEFT.set(Some(std::mem::take(&mut self.0)));
        }
    }
}

/// Length in samples of the longest signals that are kept between fits: a record of an hour at 100 Hz would occupy the
/// memory of the thread permanently.
const KEPT: usize = 1 << 17;

impl Workspace {
    /// Allocates memory for a record, for the signals that these orders have; every pass writes a whole signal, its
    /// leading zeros included, before it reads the signal.
    pub(super) fn make_room(&mut self, o: &Orders, further: &[FurtherInput<'_>], n: usize) {
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
            (&mut self.scratch, o.na > 0 || (o.nf > 0 && !passes_once(o))),
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

/// True for the poles of the operator with a noise model of first order or none, whose signal of F is computed in one
/// pass.
pub(super) fn passes_once(o: &Orders) -> bool {
    (o.nc, o.nf) == (0, 2) && o.nd <= 1
}
