//! Searches of one criterion, one after the other, beside a minimum that is known.

use super::LinearisationClient;
use crate::{
    SearchOptions,
    criterion::{Block, Criterion, Workspace},
    optimize::{
        Linearisation, Minimum, Objective,
        gauss_newton::{GaussNewton, Progress},
    },
};

/// The searches, and what they have found.
pub(crate) struct Descents<'s> {
    criterion: &'s Criterion<'s>,
    objective: &'s dyn Objective,
    options: &'s SearchOptions,
    /// Sum of squares of a minimum that is known: a search that comes close to it without a promise
    /// to end lower is given up.
    rival: Option<f64>,
    /// Relative decrease from which on a minimum is kept, and is the next rival; none where every
    /// one is kept and the rival stays.
    lower_by: Option<f64>,
    /// Where searches are still to begin, the next one last: the name, theta, and steps that were
    /// made before.
    left: Vec<(String, Vec<f64>, usize)>,
    searching: Option<(String, usize, GaussNewton<'s>)>,
    /// What was kept, in the order of the starts.
    pub found: Vec<(String, Minimum)>,
}

impl<'s> Descents<'s> {
    /// From these starts, in their order. `objective` is the criterion with what constrains it.
    pub fn new(
        criterion: &'s Criterion<'s>,
        objective: &'s dyn Objective,
        options: &'s SearchOptions,
        rival: Option<f64>,
        lower_by: Option<f64>,
        mut starts: Vec<(String, Vec<f64>, usize)>,
    ) -> Self {
        starts.reverse();
        let mut descents = Self {
            criterion,
            objective,
            options,
            rival,
            lower_by,
            left: starts,
            searching: None,
            found: Vec::new(),
        };
        descents.begin();
        descents
    }

    /// Begins at the next start.
    fn begin(&mut self) {
        while self.searching.is_none()
            && let Some((label, theta, steps)) = self.left.pop()
        {
            self.searching = GaussNewton::new(self.objective, theta, self.options, self.rival)
                .map(|descent| (label, steps, descent));
        }
    }

    /// Takes the end of a search.
    fn take(&mut self, label: String, minimum: Minimum) {
        let value = minimum.at.sum_of_squares;
        if let Some(by) = self.lower_by {
            if self
                .rival
                .is_some_and(|rival| value.is_nan() || value >= rival * (1.0 - by))
            {
                return;
            }
            self.rival = Some(value);
        }
        self.found.push((label, minimum));
    }

    /// Runs all searches to their end, alone.
    pub fn run(&mut self, workspace: &mut Workspace) {
        while let Some(theta) = self.evaluation_point() {
            let there = self.objective.linearise(theta, workspace);
            self.update(there, workspace);
        }
    }
}

impl LinearisationClient for Descents<'_> {
    fn criterion(&self) -> &Criterion<'_> {
        self.criterion
    }

    fn evaluation_point(&self) -> Option<&[f64]> {
        self.searching
            .as_ref()
            .map(|(_, _, descent)| descent.evaluation_point())
    }

    fn block(&self) -> Option<Block> {
        None
    }

    fn update(&mut self, there: Linearisation, workspace: &mut Workspace) {
        let Some((label, steps, mut descent)) = self.searching.take() else {
            return;
        };
        match descent.update(there) {
            Progress::Continues => self.searching = Some((label, steps, descent)),
            Progress::Ended(reason) => {
                if let Some(mut minimum) = reason.and_then(|reason| descent.finish(reason, workspace)) {
                    minimum.termination.iterations += steps;
                    self.take(label, minimum);
                }
                self.begin();
            }
        }
    }
}
