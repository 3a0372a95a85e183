//! Searches from several starts for the minima of one criterion, which request one linearisation after another.
//!
//! The unknown polynomials of each start are computed first; searches then run from the best starts, one after another.
//! A start in the basin of a known minimum is skipped, and a search that comes close to a known minimum is stopped
//! unless it is predicted to end lower.
//!
//! The searches do not evaluate the criterion themselves: they return the theta at which they need its linearisation
//! and continue when they receive it (reverse communication), so the searches for several records can run in parallel
//! lanes ([`crate::pem::batched`]).

use hoid_model::Orders;

use crate::{
    SearchOptions,
    criterion::{Block, Workspace},
    multistart::Start,
    optimize::{
        Linearisation, Minimum, Objective,
        basin::lies_in_basin,
        gauss_newton::{GaussNewton, Progress},
    },
};

/// The searches for the minima of one criterion.
pub(crate) struct MultiStart<'s> {
    objective: &'s dyn Objective,
    orders: Orders,
    options: &'s SearchOptions,
    /// Largest number of starts from which searches are made.
    max_starts: usize,
    /// All starts until each is complete; then the starts that have not been used yet, the best last.
    starts: Vec<Start>,
    /// Current search, with the label of its start.
    searching: Option<(String, GaussNewton<'s>)>,
    /// Minima found, each with the label of its start.
    pub minima: Vec<(String, Minimum)>,
}

impl<'s> MultiStart<'s> {
    /// Creates searches from the best of these starts, at most `most` of them.
    pub fn new(
        objective: &'s dyn Objective,
        orders: Orders,
        options: &'s SearchOptions,
        most: usize,
        starts: Vec<Start>,
    ) -> Self {
        let mut searches = Self {
            objective,
            orders,
            options,
            max_starts: most,
            starts,
            searching: None,
            minima: Vec::new(),
        };
        if searches.first_incomplete().is_none() {
            searches.rank();
        }
        searches
    }

    /// Returns theta at which the linearisation is needed next; `None` when all searches have ended.
    pub fn evaluation_point(&self) -> Option<&[f64]> {
        match &self.searching {
            Some((_, descent)) => Some(descent.evaluation_point()),
            None => self.first_incomplete().map(|at| self.starts[at].theta.as_slice()),
        }
    }

    /// Returns the polynomial for which derivatives are needed; `None` for all polynomials.
    pub fn block(&self) -> Option<Block> {
        self.first_incomplete().and_then(|at| self.starts[at].next_block())
    }

    /// Continues with the linearisation at [`MultiStart::evaluation_point`].
    pub fn update(&mut self, there: Linearisation, workspace: &mut Workspace) {
        if let Some((label, mut descent)) = self.searching.take() {
            let known = self.best().filter(|_| descent.awaits_first_linearisation());
            if known.is_some_and(|known| lies_in_basin(known, descent.evaluation_point(), there.sum_of_squares)) {
                return self.start_next_search();
            }
            match descent.update(there) {
                Progress::Continues => self.searching = Some((label, descent)),
                Progress::Ended(reason) => {
                    let minimum = reason.and_then(|reason| descent.finish(reason, workspace));
                    self.minima.extend(minimum.map(|minimum| (label, minimum)));
                    self.start_next_search();
                }
            }
        } else if let Some(at) = self.first_incomplete() {
            self.starts[at].update(&self.orders, &there);
            if self.first_incomplete().is_none() {
                self.rank();
            }
        }
    }

    /// Returns the index of the first start with unknown polynomials; `None` if all starts are complete.
    fn first_incomplete(&self) -> Option<usize> {
        self.starts.iter().position(|start| start.next_block().is_some())
    }

    /// Ranks the starts, and starts the first search from the best of them.
    fn rank(&mut self) {
        self.starts.retain(|start| start.value.is_finite());
        self.starts.sort_by(|a, b| a.value.total_cmp(&b.value));
        self.starts.truncate(self.max_starts);
        self.starts.reverse();
        self.start_next_search();
    }

    /// Starts the search from the best start that has not been used.
    fn start_next_search(&mut self) {
        while let (None, Some(Start { label, theta, .. })) = (&self.searching, self.starts.pop()) {
            let known = self.best().map(|minimum| minimum.linearisation.sum_of_squares);
            self.searching =
                GaussNewton::new(self.objective, theta, self.options, known).map(|descent| (label, descent));
        }
    }

    fn best(&self) -> Option<&Minimum> {
        let lowest = |a: &&Minimum, b: &&Minimum| {
            a.linearisation
                .sum_of_squares
                .total_cmp(&b.linearisation.sum_of_squares)
        };
        self.minima.iter().map(|(_, minimum)| minimum).min_by(lowest)
    }

    /// Returns the lowest minimum and the label of its start.
    pub fn lowest_minimum(self) -> Option<(String, Minimum)> {
        let lowest = |a: &(String, Minimum), b: &(String, Minimum)| {
            a.1.linearisation
                .sum_of_squares
                .total_cmp(&b.1.linearisation.sum_of_squares)
        };
        self.minima.into_iter().min_by(lowest)
    }
}
