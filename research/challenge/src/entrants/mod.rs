//! The participants of the challenge.
//!
//! | file | contents |
//! |---|---|
//! | `methods` | every method of [`hoid_track::Method`] with its default options |
//! | `basis` | estimation of three gains in the basis of a nominal operator, and the whitening filter |
//! | `kalman` | the gains as a random walk |
//! | `chow` | a test of the present response against the past one |
//! | `threshold` | the published baseline: a threshold on the size of the error |

mod basis;
mod chow;
mod kalman;
mod methods;
mod threshold;

use super::entrant::Entrant;

/// All participants: the methods in the order of their registry, then the simple ones.
pub fn entrants() -> Vec<Box<dyn Entrant>> {
    let mut all: Vec<Box<dyn Entrant>> = Vec::new();
    for method in hoid_survey::methods() {
        all.push(Box::new(methods::MethodEntrant(method)));
    }
    all.push(Box::new(kalman::Kalman));
    all.push(Box::new(chow::Chow));
    all.push(Box::new(threshold::Threshold));
    all
}
