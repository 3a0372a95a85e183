//! The participants.
//!
//! | file | contents |
//! |---|---|
//! | `methods` | every method of [`hoid_track::Method`], as it is by default |
//! | `basis` | three gains in the basis of a nominal person, and what whitens a remnant |
//! | `kalman` | a random walk of these gains |
//! | `chow` | a test of the present against the past |
//! | `threshold` | the published baseline: the size of the error |

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
        all.push(Box::new(methods::OfMethod(method)));
    }
    all.push(Box::new(kalman::Kalman));
    all.push(Box::new(chow::Chow));
    all.push(Box::new(threshold::Threshold));
    all
}
