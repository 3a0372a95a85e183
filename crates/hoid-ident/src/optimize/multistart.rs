//! Searches from several starts of one criterion, one linearisation after the other.
//!
//! First what is left to find of each start, then the search from the best of them, and from the next ones. A start that turns out to lie in the
//! basin of a minimum that is known is left out, and a search that comes close to one without a promise to end lower is stopped.
//!
//! All of it asks for the criterion at one theta and is told, so that those of several records can go on side by side ([`crate::pem::batched`]).

use hoid_model::Orders;

use crate::{
    SearchOptions,
    initial_guess::start::Start,
    optimize::{
        basin::lies_in_basin,
        gauss_newton::{GaussNewton, Progress},
        objective::{Linearisation, Minimum, Objective},
    },
    pem::criterion::Block,
};

/// The searches.
pub(crate) struct MultiStart<'s, O> {
    objective: &'s O,
    orders: Orders,
    options: &'s SearchOptions,
    /// Starts from which there is a search at most.
    most: usize,
    /// The starts; once nothing is left to find of them, those whose turn is still to come, the best last.
    starts: Vec<Start>,
    /// The start of the search that is under way, and the search.
    searching: Option<(String, GaussNewton<'s, O>)>,
    /// The minima, each with its start.
    pub minima: Vec<(String, Minimum)>,
}

impl<'s, O: Objective> MultiStart<'s, O> {
    /// From these starts, the best of which are searched from.
    pub fn new(objective: &'s O, orders: Orders, options: &'s SearchOptions, most: usize, starts: Vec<Start>) -> Self {
        let mut searches = Self {
            objective,
            orders,
            options,
            most,
            starts,
            searching: None,
            minima: Vec::new(),
        };
        if searches.incomplete().is_none() {
            searches.rank();
        }
        searches
    }

    /// Where the criterion is wanted next; nowhere when all has been found.
    pub fn asked(&self) -> Option<&[f64]> {
        match &self.searching {
            Some((_, descent)) => Some(descent.asked()),
            None => self.incomplete().map(|at| self.starts[at].theta.as_slice()),
        }
    }

    /// The polynomial to which derivatives are wanted; all where none is named.
    pub fn block(&self) -> Option<Block> {
        self.incomplete().and_then(|at| self.starts[at].wanted())
    }

    /// Takes what was found there.
    pub fn take(&mut self, there: Linearisation, workspace: &mut O::Workspace) {
        if let Some((label, mut descent)) = self.searching.take() {
            let known = self.best().filter(|_| descent.is_at_its_start());
            if known.is_some_and(|known| lies_in_basin(known, descent.asked(), there.sum_of_squares)) {
                return self.begin();
            }
            match descent.take(there) {
                Progress::GoesOn => self.searching = Some((label, descent)),
                Progress::Ended(reason) => {
                    let minimum = reason.and_then(|reason| descent.finish(reason, workspace));
                    self.minima.extend(minimum.map(|minimum| (label, minimum)));
                    self.begin();
                }
            }
        } else if let Some(at) = self.incomplete() {
            self.starts[at].take(&self.orders, &there);
            if self.incomplete().is_none() {
                self.rank();
            }
        }
    }

    /// The first start of which something is still to be found.
    fn incomplete(&self) -> Option<usize> {
        self.starts.iter().position(|start| start.wanted().is_some())
    }

    /// Begins the searches, with the best start.
    fn rank(&mut self) {
        self.starts.retain(|start| start.value.is_finite());
        self.starts.sort_by(|a, b| a.value.total_cmp(&b.value));
        self.starts.truncate(self.most);
        self.starts.reverse();
        self.begin();
    }

    /// Begins at the next start.
    fn begin(&mut self) {
        while let (None, Some(Start { label, theta, .. })) = (&self.searching, self.starts.pop()) {
            let known = self.best().map(|minimum| minimum.at.sum_of_squares);
            self.searching =
                GaussNewton::new(self.objective, theta, self.options, known).map(|descent| (label, descent));
        }
    }

    fn best(&self) -> Option<&Minimum> {
        let lowest = |a: &&Minimum, b: &&Minimum| a.at.sum_of_squares.total_cmp(&b.at.sum_of_squares);
        self.minima.iter().map(|(_, minimum)| minimum).min_by(lowest)
    }

    /// The lowest minimum and its start.
    pub fn lowest(self) -> Option<(String, Minimum)> {
        let lowest =
            |a: &(String, Minimum), b: &(String, Minimum)| a.1.at.sum_of_squares.total_cmp(&b.1.at.sum_of_squares);
        self.minima.into_iter().min_by(lowest)
    }
}
