//! Functions that pass samples to a tracker.

use hoid_track::Sample;

use crate::{
    boundary::{HoidTracker, with_tracker_mut, write_value},
    session::Session,
    status::HoidStatus,
    types::HoidOutcome,
};

/// Updates the tracker with one sample: error `e` and control `u`, where NaN marks a missing value. `outcome` may be
/// NULL.
///
/// # Safety
/// `tracker` is a tracker of this library; `outcome` is NULL or points to memory for a hoid_outcome.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_step(
    tracker: *mut HoidTracker,
    e: f64,
    u: f64,
    outcome: *mut HoidOutcome,
) -> HoidStatus {
    // SAFETY: guaranteed by the caller of this function.
    unsafe { hoid_tracker_update(tracker, e, u, f64::NAN, 1, outcome) }
}

/// As hoid_tracker_step, with the external signal `f_t` (NaN if it is unknown). With `moves` 0 the filters are updated,
/// but not the estimate.
///
/// # Safety
/// As for hoid_tracker_step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_update(
    tracker: *mut HoidTracker,
    e: f64,
    u: f64,
    f_t: f64,
    moves: i32,
    outcome: *mut HoidOutcome,
) -> HoidStatus {
    let sample = Sample {
        e,
        u,
        reference: f_t.is_finite().then_some(f_t),
    };
    let take = |session: &mut Session| {
        let result = session.take(sample, moves != 0);
        if outcome.is_null() {
            return Ok(());
        }
        // SAFETY: guaranteed by the caller of this function.
        unsafe { write_value(outcome, result, "the outcome") }
    };
    // SAFETY: guaranteed by the caller of this function.
    unsafe { with_tracker_mut(tracker, take) }
}
