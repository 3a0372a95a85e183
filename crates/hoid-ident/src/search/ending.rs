//! Where a search comes to rest, and how it goes on along the border of stability.

use super::{Descent, Minimum, Objective, Reason, SearchMethod, Termination};
use crate::{prediction_error::Workspace, stable_coordinates::StableCoordinates};

impl<O: Objective> Descent<'_, O> {
    /// Where it came to rest, once it has ended for this reason; the automatic search may go on along the border of stability.
    pub fn finish(mut self, reason: Reason, workspace: &mut Workspace) -> Option<Minimum> {
        let reason = if self.options.method == SearchMethod::Automatic && reason == Reason::NoDescent {
            self.follow_the_border(workspace)?
        } else {
            reason
        };
        Some(Minimum {
            theta: self.theta,
            at: self.at,
            termination: Termination {
                reason,
                iterations: self.iterations,
            },
        })
    }

    /// Goes on in coordinates in which the border of stability is a bound. `None` where the loss is not finite or the rival will
    /// not be beaten.
    fn follow_the_border(&mut self, workspace: &mut Workspace) -> Option<Reason> {
        let Some((coordinates, kappa)) = StableCoordinates::of(self.objective, &self.theta) else {
            return Some(Reason::NoDescent);
        };
        let Some(mut along) = Descent::new(&coordinates, kappa, self.options, self.rival) else {
            return Some(Reason::NoDescent);
        };
        along.iterations = self.iterations;
        let reason = along.run(workspace)?;
        let (kappa, iterations) = (along.theta, along.iterations);
        let theta = coordinates.theta(&kappa);
        let there = self.objective.linearise(&theta, workspace);
        self.iterations = iterations;
        if there.sum_of_squares <= self.at.sum_of_squares {
            (self.theta, self.at) = (theta, there);
        }
        Some(match reason {
            Reason::SmallDecrease if coordinates.is_on_border(&kappa) => Reason::Border,
            reason => reason,
        })
    }
}
