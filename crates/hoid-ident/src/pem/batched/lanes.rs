//! Searches in lanes: a record occupies a lane until its search has ended; the next record then takes over the lane.

use std::cell::Cell;

use hoid_lanes::InstructionSet;
use hoid_model::Orders;

use super::{normal_equations::NormalEquations, pass::Pass, rows::Rows, signal_buffers::SignalBuffers};
use crate::{
    criterion::{Data, Workspace},
    multistart::LinearisationClient,
    optimize::{Linearisation, Objective},
};

/// Completes all searches in parallel lanes; all records have the same length and the same orders.
pub(super) fn search(open: Vec<&mut impl LinearisationClient>, path: InstructionSet, workspace: &mut Workspace) {
    let first = open.first().map(|client| client.criterion());
    let lanes = first.and_then(|c| {
        Some(Lanes::new(
            c.orders,
            c.first,
            c.data.first()?.u.len(),
            path.lane_count()?,
        ))
    });
    if let Some(mut lanes) = lanes {
        lanes.search(open, path, workspace);
    }
}

/// The records in the lanes, and the memory for a pass over them.
pub(super) struct Lanes {
    orders: Orders,
    first: usize,
    n: usize,
    pub width: usize,
    pub memory: Memory,
}

/// Memory for the signals and results of all lanes.
#[derive(Debug, Default)]
pub(super) struct Memory {
    e: Rows,
    u: Rows,
    pub theta: Rows,
    signals: SignalBuffers,
    pub sums: NormalEquations,
}

thread_local! {
    /// The memory of the last fits on this thread. It is reused, because allocating new pages takes as long as a fit.
    static LAST_MEMORY: Cell<Option<Memory>> = const { Cell::new(None) };
}

/// Largest number of values of a signal for which the memory is kept.
const MAX_KEPT_SAMPLES: usize = 1 << 18;

impl Drop for Lanes {
    fn drop(&mut self) {
        if self.memory.e.len() <= MAX_KEPT_SAMPLES {
            LAST_MEMORY.set(Some(std::mem::take(&mut self.memory)));
        }
    }
}

impl Lanes {
    pub fn new(orders: Orders, first: usize, n: usize, width: usize) -> Self {
        let mut memory = LAST_MEMORY.take().unwrap_or_default();
        for (values, rows) in [
            (&mut memory.e, n),
            (&mut memory.u, n),
            (&mut memory.theta, orders.parameter_count()),
        ] {
            values.allocate(rows * width);
            values.fill(0.0);
        }
        Self {
            orders,
            first,
            n,
            width,
            memory,
        }
    }

    /// Completes all searches; one search runs in each lane at a time.
    fn search<A: LinearisationClient>(&mut self, open: Vec<&mut A>, path: InstructionSet, workspace: &mut Workspace) {
        let mut open = open.into_iter();
        let mut searching: Vec<Option<&mut A>> = (0..self.width).map(|_| None).collect();
        loop {
            for lane in 0..self.width {
                while searching[lane]
                    .as_ref()
                    .is_none_or(|client| client.evaluation_point().is_none())
                {
                    let Some(next) = open.next() else {
                        searching[lane] = None;
                        break;
                    };
                    self.load_record(lane, next.criterion().data[0]);
                    searching[lane] = Some(next);
                }
                // A lane without a record keeps its previous theta.
                let theta = searching[lane]
                    .iter()
                    .filter_map(|client| client.evaluation_point())
                    .flatten();
                for (i, value) in theta.enumerate() {
                    self.memory.theta[i * self.width + lane] = *value;
                }
            }
            if searching.iter().all(Option::is_none) {
                return;
            }
            self.pass(path);
            for (lane, place) in searching.iter_mut().enumerate() {
                let Some(client) = place else { continue };
                let there = match client.evaluation_point() {
                    Some(theta) if self.memory.sums.dependent[lane] => client.criterion().linearise(theta, workspace),
                    _ => self.linearisation(lane),
                };
                client.update(there, workspace);
            }
        }
    }

    /// Evaluates the criterion of all lanes.
    pub fn pass(&mut self, path: InstructionSet) {
        path.with_lanes(Pass {
            orders: self.orders,
            first: self.first,
            n: self.n,
            e: &self.memory.e,
            u: &self.memory.u,
            theta: &self.memory.theta,
            signals: &mut self.memory.signals,
            sums: &mut self.memory.sums,
        });
    }

    /// Puts a record into a lane.
    pub fn load_record(&mut self, lane: usize, record: Data<'_>) {
        for (lanes, values) in [(&mut self.memory.e, record.e), (&mut self.memory.u, record.u)] {
            for (row, value) in lanes.chunks_exact_mut(self.width).zip(values) {
                row[lane] = *value;
            }
        }
    }

    /// Returns the linearisation in a lane after a pass.
    pub fn linearisation(&self, lane: usize) -> Linearisation {
        let o = &self.orders;
        let p = o.parameter_count();
        let product = |i: usize, j: usize| self.memory.sums.products[(i * (p + 1) + j) * self.width + lane];
        // The columns of psi are x_b, -v and -x_f.
        let sign = |i: usize| if i < o.nb { 1.0 } else { -1.0 };
        Linearisation {
            sum_of_squares: product(0, 0),
            descent: (0..p).map(|i| sign(i) * product(0, i + 1)).collect(),
            gram: (0..p * p)
                .map(|place| (place / p, place % p))
                .map(|(i, j)| sign(i) * sign(j) * product(i + 1, j + 1))
                .collect(),
        }
    }
}
