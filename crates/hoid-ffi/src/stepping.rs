//! Samples.

use hoid_track::Sample;

use crate::{
    boundary::{HoidTracker, move_tracker, put},
    session::Session,
    status::HoidStatus,
    types::HoidOutcome,
};

/// Takes a sample: error e and control u. NaN represents missing values. `outcome` may be NULL.
///
/// # Safety
/// `tracker` was made here; `outcome` is NULL or has room for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_step(
    tracker: *mut HoidTracker,
    e: f64,
    u: f64,
    outcome: *mut HoidOutcome,
) -> HoidStatus {
    // SAFETY: by the contract of this function.
    unsafe { hoid_tracker_update(tracker, e, u, f64::NAN, 1, outcome) }
}

/// As hoid_tracker_step, with the external signal f_t (NaN: not known). With `moves` 0 the filters
/// are updated, but not the estimate.
///
/// # Safety
/// As hoid_tracker_step.
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
        let told = session.take(sample, moves != 0);
        if outcome.is_null() {
            return Ok(());
        }
        // SAFETY: by the contract of this function.
        unsafe { put(outcome, told, "the outcome") }
    };
    // SAFETY: by the contract of this function.
    unsafe { move_tracker(tracker, take) }
}
