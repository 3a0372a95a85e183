//! The end of a search, and its continuation along the border of stability.

use super::{
    gauss_newton::GaussNewton,
    objective::{Minimum, Objective},
    reflection_coefficients::StableCoordinates,
    search_options::{SearchMethod, SearchOptions},
    termination::{Reason, Termination},
};
use crate::criterion::Workspace;

/// Searches for a minimum from `theta`. `None` if the start is unstable or its loss is not finite, or if the search
/// comes close to `rival`, the sum of squares of a known minimum, and is not predicted to end lower.
pub(crate) fn minimise(
    objective: &dyn Objective,
    theta: Vec<f64>,
    options: &SearchOptions,
    rival: Option<f64>,
    workspace: &mut Workspace,
) -> Option<Minimum> {
    let mut descent = GaussNewton::new(objective, theta, options, rival)?;
    let reason = descent.run(workspace)?;
    descent.finish(reason, workspace)
}

impl GaussNewton<'_> {
    /// Returns the minimum after a search that ended for this reason. The automatic search may first continue along the
    /// border of stability; `None` if this continuation fails or is not predicted to end below the rival.
    pub fn finish(mut self, reason: Reason, workspace: &mut Workspace) -> Option<Minimum> {
        let reason = if self.options.method == SearchMethod::Automatic && reason == Reason::NoDescent {
            self.follow_border(workspace)?
        } else {
            reason
        };
        Some(Minimum {
            theta: self.theta,
            linearisation: self.linearisation,
            termination: Termination {
                reason,
                iterations: self.iterations,
            },
        })
    }

    /// Continues in coordinates in which the border of stability is a bound, and returns the reason for the end. `None`
    /// if the loss is not finite, or if the search is not predicted to end below the rival.
    fn follow_border(&mut self, workspace: &mut Workspace) -> Option<Reason> {
        let Some((coordinates, kappa)) = StableCoordinates::of(self.objective, &self.theta) else {
            return Some(Reason::NoDescent);
        };
        let Some(mut along) = GaussNewton::new(&coordinates, kappa, self.options, self.loss_to_beat) else {
            return Some(Reason::NoDescent);
        };
        along.iterations = self.iterations;
        let reason = along.run(workspace)?;
        let (kappa, iterations) = (along.theta, along.iterations);
        let theta = coordinates.theta(&kappa);
        let there = self.objective.linearise(&theta, workspace);
        self.iterations = iterations;
        if there.sum_of_squares <= self.linearisation.sum_of_squares {
            (self.theta, self.linearisation) = (theta, there);
        }
        Some(match reason {
            Reason::SmallDecrease if coordinates.is_on_border(&kappa) => Reason::Border,
            reason => reason,
        })
    }
}
