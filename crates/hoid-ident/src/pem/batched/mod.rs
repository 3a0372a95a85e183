//! Fits of one model to each of many records, side by side.
//!
//! A search is a chain of passes over its record, each a chain of filters that wait for their own last value ([`crate::pem::criterion`]).
//! Searches of different records wait for nothing of each other: each takes a lane of [`pass`], and when it has come to rest the next
//! record takes its place; the search on the averaged records ([`crate::initial_guess::continuation`]) goes first in the same way. What needs more than the
//! criterion (the border of stability, starts where the averages do not say enough, free responses that are not independent) goes there alone.

mod columns;
mod filters;
mod initial_state_responses;
mod pass;
mod rows;

use std::cell::Cell;

use hoid_lanes::InstructionSet;
use hoid_model::{Orders, Record, SampleTime, Structure};

use self::{
    pass::{Pass, Room, Sums},
    rows::Rows,
};
use crate::{
    Estimator, Fit, Focus, IdentError, InitialState,
    initial_guess::continuation::{Averaged, Continuation, Slow},
    initial_guess::guesses::initial_guesses_beside,
    optimize::Linearisation,
    optimize::Objective,
    pem::constraints::ConstrainedCriterion,
    pem::criterion::{Criterion, Data, Workspace},
    pem::fit_problem::FitProblem,
    pem::linearisation_client::LinearisationClient,
};

/// A fit to each record; `None` for what is not searched side by side: anything but Box-Jenkins models without C, with their initial
/// states estimated and nothing known beforehand, records of different lengths, registers that this processor has not.
pub(crate) fn fit_each(
    estimator: &Estimator,
    records: &[&Record],
    path: InstructionSet,
) -> Option<Vec<Result<Fit, IdentError>>> {
    let o = &estimator.orders;
    let plain = estimator.structure == Structure::BoxJenkins
        && (o.nb > 0 && o.nc == 0 && o.nf > 0)
        && estimator.initial_state_in_use() == InitialState::Estimate
        && estimator.focus == Focus::Prediction
        && estimator.knows_nothing_beforehand();
    let n = records.first()?.len();
    if !plain || records.iter().any(|record| record.len() != n) {
        return None;
    }
    path.lanes()?;
    let mut workspace = Workspace::of_thread();
    let criteria: Vec<_> = (records.iter())
        .map(|record| estimator.criterion(std::slice::from_ref(*record), 0))
        .collect();
    let informed: Vec<_> = (criteria.iter())
        .map(|found| found.as_ref().map(|(criterion, ts)| (estimator.inform(criterion), *ts)))
        .collect();
    let mut slow = if estimator.start.is_none() {
        averages_say(&informed, path, &mut workspace)
    } else {
        Vec::new()
    }
    .into_iter();
    let mut quests: Vec<Result<FitProblem<'_, '_>, IdentError>> = (informed.iter())
        .map(|found| {
            let slow = slow.next().unwrap_or_default();
            let (informed, sample_time) = found.as_ref().map_err(|error| (*error).clone())?;
            let own = || initial_guesses_beside(slow, informed.criterion, *sample_time, &mut workspace);
            FitProblem::new(estimator, informed, *sample_time, own)
        })
        .collect();
    search(quests.iter_mut().flatten().collect(), path, &mut workspace);
    Some(quests.into_iter().map(|quest| quest?.fit(&mut workspace)).collect())
}

/// What the averages of each record propose.
fn averages_say(
    informed: &[Result<(ConstrainedCriterion<'_, '_>, SampleTime), &IdentError>],
    path: InstructionSet,
    workspace: &mut Workspace,
) -> Vec<Slow> {
    let averaged: Vec<Option<Averaged>> = (informed.iter())
        .map(|found| (found.as_ref().ok()).and_then(|(informed, ts)| Averaged::of(informed.criterion, *ts)))
        .collect();
    let low: Vec<Option<Criterion<'_>>> = (averaged.iter())
        .map(|averaged| averaged.as_ref().map(Averaged::criterion))
        .collect();
    let mut all: Vec<Option<Continuation<'_>>> = (averaged.iter().zip(&low))
        .map(|(averaged, low)| Some(Continuation::new(averaged.as_ref()?, low.as_ref()?)))
        .collect();
    search(all.iter_mut().flatten().collect(), path, workspace);
    (all.into_iter())
        .map(|continuation| continuation.map(Continuation::slow).unwrap_or_default())
        .collect()
}

/// Answers all that is asked for, side by side; the records are of one length and the orders the same.
fn search(open: Vec<&mut impl LinearisationClient>, path: InstructionSet, workspace: &mut Workspace) {
    let first = open.first().map(|asks| asks.criterion());
    let lanes = first.and_then(|c| Some(Lanes::new(c.orders, c.first, c.data.first()?.u.len(), path.lanes()?)));
    if let Some(mut lanes) = lanes {
        lanes.search(open, path, workspace);
    }
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
    fn search<A: LinearisationClient>(&mut self, open: Vec<&mut A>, path: InstructionSet, workspace: &mut Workspace) {
        let mut open = open.into_iter();
        let mut searching: Vec<Option<&mut A>> = (0..self.width).map(|_| None).collect();
        loop {
            for lane in 0..self.width {
                while searching[lane].as_ref().is_none_or(|asks| asks.asked().is_none()) {
                    let Some(next) = open.next() else {
                        searching[lane] = None;
                        break;
                    };
                    self.put(lane, next.criterion().data[0]);
                    searching[lane] = Some(next);
                }
                // A lane that is left over goes on with what it has.
                let asked = searching[lane].iter().filter_map(|asks| asks.asked()).flatten();
                for (i, value) in asked.enumerate() {
                    self.memory.theta[i * self.width + lane] = *value;
                }
            }
            if searching.iter().all(Option::is_none) {
                return;
            }
            self.pass(path);
            for (lane, place) in searching.iter_mut().enumerate() {
                let Some(asks) = place else { continue };
                let there = match asks.asked() {
                    Some(theta) if self.memory.sums.dependent[lane] => asks.criterion().linearise(theta, workspace),
                    _ => self.linearisation(lane),
                };
                asks.take(there, workspace);
            }
        }
    }

    /// The criterion of all lanes.
    fn pass(&mut self, path: InstructionSet) {
        path.with_lanes(Pass {
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
    fn put(&mut self, lane: usize, record: Data<'_>) {
        for (lanes, values) in [(&mut self.memory.e, record.e), (&mut self.memory.u, record.u)] {
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
