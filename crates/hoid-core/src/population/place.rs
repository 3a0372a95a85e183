//! The basis with its past, and its moves.
//!
//! The corrections of what is held are of first order. Where they have grown, the basis moves to
//! where they point. A filter whose poles jump would have a kink in its past, which the whitening
//! filter makes larger than the noise; so the new one runs beside the old one for some seconds, and
//! takes its place with a past of its own.

use super::{
    basis::{Basis, Point, Signals},
    past::{Paired, PastSignals},
    sizes::{HELD, SIGNALS},
};
use crate::state::{State, visit_all};

/// A filter with its last signals, the newest first.
#[derive(Debug, Clone, PartialEq)]
struct Run {
    basis: Basis,
    now: Signals,
    past: PastSignals,
}

crate::state!([] Run { basis, now, past });

impl Run {
    fn remember(&mut self) {
        self.past.push(&self.now);
    }
}

/// The basis of now, and the one that is to follow.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Place {
    now: Run,
    next: Run,
    /// Samples until the next takes over; zero: there is none.
    left: u64,
}

impl State for Place {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(&mut [&mut self.now, &mut self.next, &mut self.left], each);
    }
}

impl Place {
    pub fn new(basis: Basis) -> Self {
        let run = Run {
            basis,
            now: [0.0; SIGNALS],
            past: PastSignals::ZERO,
        };
        Self {
            now: run.clone(),
            next: run,
            left: 0,
        }
    }

    pub fn basis(&self) -> &Basis {
        &self.now.basis
    }

    /// The signals of this sample.
    pub fn signals(&self) -> &Signals {
        &self.now.now
    }

    /// Those before it, the newest first.
    #[inline(always)]
    pub fn past(&self) -> &[Paired] {
        self.now.past.newest_first()
    }

    /// Moves on by a sample; `error` is that of so many samples ago.
    #[inline(always)]
    pub fn step(&mut self, error: impl Fn(usize) -> f64) {
        let step = |run: &mut Run| {
            let l = run.basis.delay();
            run.now = run.basis.step([error(l), error(l + 1), error(l + 2)]);
        };
        step(&mut self.now);
        if self.left > 0 {
            step(&mut self.next);
        }
    }

    /// Ends a sample. Where the next basis takes over, by how much omega, zeta and tau moved.
    #[inline(always)]
    pub fn remember(&mut self) -> Option<[f64; HELD]> {
        self.now.remember();
        if self.left == 0 {
            return None;
        }
        self.next.remember();
        self.left -= 1;
        if self.left > 0 {
            return None;
        }
        let (from, to) = (self.now.basis.point(), self.next.basis.point());
        self.now = self.next.clone();
        Some([to.omega - from.omega, to.zeta - from.zeta, to.tau - from.tau])
    }

    /// Begins to move, unless it does already. `delayed` is the delayed error of now, `after` the
    /// samples until it has moved.
    pub fn begin_to_move(&mut self, to: Point, delayed: f64, after: u64) {
        if self.left > 0 {
            return;
        }
        if let Some(basis) = self.now.basis.moved(to, delayed) {
            self.next = Run {
                basis,
                ..self.now.clone()
            };
            self.left = after;
        }
    }

    /// True while it is moving.
    pub fn is_moving(&self) -> bool {
        self.left > 0
    }

    /// Brings the filters to rest.
    pub fn rest(&mut self) {
        for run in [&mut self.now, &mut self.next] {
            run.basis.reset();
            run.now = [0.0; SIGNALS];
            run.past = PastSignals::ZERO;
        }
        self.left = 0;
    }
}
