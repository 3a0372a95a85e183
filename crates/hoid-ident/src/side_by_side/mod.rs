//! Fits of one model to each of many records, side by side.
//!
//! A search is a chain of passes over its record, each a chain of filters that wait for their own last value ([`crate::prediction_error`]).
//! Searches of different records wait for nothing of each other: each takes a lane of [`pass`], and when it has come to rest the next
//! record takes its place. A search that needs more than the criterion (the border of stability, a start that is weighed against a
//! minimum, free responses that are not independent) goes there alone.

mod columns;
mod pass;
mod rows;

use std::cell::Cell;

use hoid_lanes::Path;
use hoid_model::{Orders, Record, Structure};

use self::{
    pass::{Pass, Room, Sums},
    rows::Rows,
};
use crate::{
    Estimator, Fit, Focus, IdentError, InitialState,
    prediction_error::{Linearisation, Workspace},
    quest::Quest,
    search::Objective,
};

/// A fit to each record; `None` for what is not searched side by side: anything but Box-Jenkins models with their initial states
/// estimated and nothing known beforehand, records of different lengths, registers that this processor has not.
pub(crate) fn fit_each(estimator: &Estimator, records: &[&Record], path: Path) -> Option<Vec<Result<Fit, IdentError>>> {
    let o = &estimator.orders;
    let plain = estimator.structure == Structure::BoxJenkins
        && (o.nb > 0 && o.nf > 0)
        && estimator.initial_state_in_use() == InitialState::Estimate
        && estimator.focus == Focus::Prediction
        && estimator.knows_nothing_beforehand();
    let n = records.first()?.len();
    if !plain || records.iter().any(|record| record.len() != n) {
        return None;
    }
    let width = path.lanes()?;
    let mut workspace = Workspace::of_thread();
    let criteria: Vec<_> = (records.iter())
        .map(|record| estimator.criterion(std::slice::from_ref(*record), 0))
        .collect();
    let informed: Vec<_> = (criteria.iter())
        .map(|found| found.as_ref().map(|(criterion, ts)| (estimator.inform(criterion), *ts)))
        .collect();
    let mut quests: Vec<Result<Quest<'_, '_>, IdentError>> = (informed.iter())
        .map(|found| match found {
            Ok((informed, sample_time)) => Quest::new(estimator, informed, *sample_time, &mut workspace),
            Err(error) => Err((*error).clone()),
        })
        .collect();
    let open: Vec<(&Record, &mut Quest<'_, '_>)> = (records.iter().zip(&mut quests))
        .filter_map(|(record, quest)| Some((*record, quest.as_mut().ok()?)))
        .collect();
    if let Some((_, quest)) = open.first() {
        Lanes::new(estimator.orders, quest.criterion().first, n, width).search(open, path, &mut workspace);
    }
    Some(quests.into_iter().map(|quest| quest?.fit(&mut workspace)).collect())
}

/// The records in the lanes, and what a pass over them needs.
struct Lanes {
    orders: Orders,
    first: usize,
    n: usize,
    width: usize,
    memory: Memory,
}

/// Numbers of all lanes.
#[derive(Debug, Default)]
struct Memory {
    e: Rows,
    u: Rows,
    theta: Rows,
    room: Room,
    sums: Sums,
}

thread_local! {
    /// The memory that the last fits on this thread have left: fresh pages cost as much as a fit.
    static LEFT: Cell<Option<Memory>> = const { Cell::new(None) };
}

/// Most numbers of a signal that are kept.
const KEPT: usize = 1 << 18;

impl Drop for Lanes {
    fn drop(&mut self) {
        if self.memory.e.len() <= KEPT {
            LEFT.set(Some(std::mem::take(&mut self.memory)));
        }
    }
}

impl Lanes {
    fn new(orders: Orders, first: usize, n: usize, width: usize) -> Self {
        let mut memory = LEFT.take().unwrap_or_default();
        for (values, rows) in [
            (&mut memory.e, n),
            (&mut memory.u, n),
            (&mut memory.theta, orders.parameters()),
        ] {
            values.make_room(rows * width);
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

    /// Runs all searches to their end, as many at a time as there are lanes.
    fn search(&mut self, open: Vec<(&Record, &mut Quest<'_, '_>)>, path: Path, workspace: &mut Workspace) {
        let mut open = open.into_iter();
        let mut searching: Vec<Option<&mut Quest<'_, '_>>> = (0..self.width).map(|_| None).collect();
        loop {
            for lane in 0..self.width {
                while searching[lane].as_ref().is_none_or(|quest| quest.asked().is_none()) {
                    let Some((record, quest)) = open.next() else {
                        searching[lane] = None;
                        break;
                    };
                    self.put(lane, record);
                    searching[lane] = Some(quest);
                }
                // A lane that is left over goes on with what it has.
                let asked = searching[lane].iter().filter_map(|quest| quest.asked()).flatten();
                for (i, value) in asked.enumerate() {
                    self.memory.theta[i * self.width + lane] = *value;
                }
            }
            if searching.iter().all(Option::is_none) {
                return;
            }
            self.pass(path);
            for (lane, place) in searching.iter_mut().enumerate() {
                let Some(quest) = place else { continue };
                let there = match quest.asked() {
                    Some(theta) if self.memory.sums.dependent[lane] => quest.criterion().linearise(theta, workspace),
                    _ => self.linearisation(lane),
                };
                quest.take(there, workspace);
            }
        }
    }

    /// The criterion of all lanes.
    fn pass(&mut self, path: Path) {
        path.do_with(Pass {
            orders: self.orders,
            first: self.first,
            n: self.n,
            e: &self.memory.e,
            u: &self.memory.u,
            theta: &self.memory.theta,
            room: &mut self.memory.room,
            sums: &mut self.memory.sums,
        });
    }

    /// Puts a record into a lane.
    fn put(&mut self, lane: usize, record: &Record) {
        for (lanes, values) in [
            (&mut self.memory.e, record.input()),
            (&mut self.memory.u, record.output()),
        ] {
            for (row, value) in lanes.chunks_exact_mut(self.width).zip(values) {
                row[lane] = *value;
            }
        }
    }

    /// What a pass has found in a lane.
    fn linearisation(&self, lane: usize) -> Linearisation {
        let o = &self.orders;
        let p = o.parameters();
        let product = |i: usize, j: usize| self.memory.sums.products[(i * (p + 1) + j) * self.width + lane];
        // psi holds x_b, -v and -x_f.
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

#[cfg(test)]
mod tests;
