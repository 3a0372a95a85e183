//! Report of a tracker.
//!
//! A list is requested with its room and the place for its count; with NULL and no room only the
//! count is reported.

use std::ffi::c_char;

use hoid_model::VerdictLevel;

use crate::{
    boundary::{HoidTracker, put, put_all, with_tracker},
    session::Session,
    status::{Failure, HoidStatus},
    types::{HoidChange, HoidCounts, HoidEstimate},
};

/// No check found a problem with the estimate.
pub const HOID_TRUSTWORTHY: i32 = 0;
/// A check found a problem with the estimate.
pub const HOID_DOUBTFUL: i32 = 1;
/// The data do not determine the estimate, or there is none.
pub const HOID_NOT_DETERMINED: i32 = 2;

/// Hands a list over.
///
/// # Safety
/// As [`with_tracker`] and [`put_all`].
unsafe fn list<T: Copy>(
    tracker: *const HoidTracker,
    of: impl FnOnce(&Session) -> Result<Vec<T>, Failure>,
    list: *mut T,
    room: usize,
    count: *mut usize,
) -> HoidStatus {
    let hand = |session: &Session| {
        // SAFETY: by the contract of this function.
        unsafe { put_all(&of(session)?, list, room, count, "the list") }
    };
    // SAFETY: by the contract of this function.
    unsafe { with_tracker(tracker, hand) }
}

/// HOID_OK after the warm-up, and always for a method without one; HOID_NOTHING during it:
/// hoid_last_error then reports how far it is.
///
/// # Safety
/// `tracker` was made here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_ready(tracker: *const HoidTracker) -> HoidStatus {
    // SAFETY: by the contract of this function.
    unsafe { with_tracker(tracker, |session| session.tracker().map(|_| ())) }
}

/// The operator: K_e, T_L, K_e_dot, omega_nm, zeta_nm, tau_e with standard errors.
///
/// # Safety
/// `tracker` was made here; `estimates` has room for `room`, `count` for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_operator(
    tracker: *const HoidTracker,
    estimates: *mut HoidEstimate,
    room: usize,
    count: *mut usize,
) -> HoidStatus {
    // SAFETY: by the contract of this function.
    unsafe { list(tracker, Session::operator, estimates, room, count) }
}

/// The coefficients in the order of theta, with standard errors.
///
/// # Safety
/// As hoid_tracker_operator.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_parameters(
    tracker: *const HoidTracker,
    estimates: *mut HoidEstimate,
    room: usize,
    count: *mut usize,
) -> HoidStatus {
    // SAFETY: by the contract of this function.
    unsafe { list(tracker, Session::parameters, estimates, room, count) }
}

/// The covariance of the coefficients, row by row.
///
/// # Safety
/// As hoid_tracker_operator.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_covariance(
    tracker: *const HoidTracker,
    covariance: *mut f64,
    room: usize,
    count: *mut usize,
) -> HoidStatus {
    // SAFETY: by the contract of this function.
    unsafe { list(tracker, Session::covariance, covariance, room, count) }
}

/// Crossover frequency (crossover_rad_s) and phase margin (phase_margin_deg) with the controlled
/// element of the options.
///
/// # Safety
/// As hoid_tracker_operator.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_open_loop(
    tracker: *const HoidTracker,
    estimates: *mut HoidEstimate,
    room: usize,
    count: *mut usize,
) -> HoidStatus {
    // SAFETY: by the contract of this function.
    unsafe { list(tracker, Session::open_loop, estimates, room, count) }
}

/// Gain (gain_db) and phase (phase_deg) at a frequency in rad/s.
///
/// # Safety
/// As hoid_tracker_operator.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_response(
    tracker: *const HoidTracker,
    omega: f64,
    estimates: *mut HoidEstimate,
    room: usize,
    count: *mut usize,
) -> HoidStatus {
    // SAFETY: by the contract of this function.
    unsafe { list(tracker, |session| session.response(omega), estimates, room, count) }
}

/// The change that was declared at the last sample; HOID_NOTHING if there was none.
///
/// # Safety
/// `tracker` was made here; `change` has room for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_change(tracker: *const HoidTracker, change: *mut HoidChange) -> HoidStatus {
    let tell = |session: &Session| {
        // SAFETY: by the contract of this function.
        unsafe { put(change, session.change()?, "the change") }
    };
    // SAFETY: by the contract of this function.
    unsafe { with_tracker(tracker, tell) }
}

/// Evidence of a change now, as log_odds of hoid_change; before the first estimate 0 (`adaptive`) or
/// -inf (`multiple-model`). HOID_NOTHING for a method that does not report changes.
///
/// # Safety
/// `tracker` was made here; `log_odds` has room for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_change_log_odds(tracker: *const HoidTracker, log_odds: *mut f64) -> HoidStatus {
    let tell = |session: &Session| {
        // SAFETY: by the contract of this function.
        unsafe { put(log_odds, session.change_log_odds()?, "the pointer for the odds") }
    };
    // SAFETY: by the contract of this function.
    unsafe { with_tracker(tracker, tell) }
}

/// Verdict on the current estimate: HOID_TRUSTWORTHY, HOID_DOUBTFUL or HOID_NOT_DETERMINED.
///
/// # Safety
/// `tracker` was made here; `level` has room for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_level(tracker: *const HoidTracker, level: *mut i32) -> HoidStatus {
    let tell = |session: &Session| {
        let told = number_of(session.level());
        // SAFETY: by the contract of this function.
        unsafe { put(level, told, "the pointer for the level") }
    };
    // SAFETY: by the contract of this function.
    unsafe { with_tracker(tracker, tell) }
}

pub(crate) fn number_of(level: VerdictLevel) -> i32 {
    match level {
        VerdictLevel::Trustworthy => HOID_TRUSTWORTHY,
        VerdictLevel::Doubtful => HOID_DOUBTFUL,
        VerdictLevel::NotDetermined => HOID_NOT_DETERMINED,
    }
}

/// A level as text, such as "trustworthy"; empty for any other number.
#[unsafe(no_mangle)]
pub extern "C" fn hoid_level_name(level: i32) -> *const c_char {
    let name = match level {
        HOID_TRUSTWORTHY => c"trustworthy",
        HOID_DOUBTFUL => c"doubtful",
        HOID_NOT_DETERMINED => c"not determined",
        _ => c"",
    };
    name.as_ptr()
}

/// Counts of samples since the start.
///
/// # Safety
/// `tracker` was made here; `counts` has room for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_counts(tracker: *const HoidTracker, counts: *mut HoidCounts) -> HoidStatus {
    let tell = |session: &Session| {
        // SAFETY: by the contract of this function.
        unsafe { put(counts, session.counts(), "the counts") }
    };
    // SAFETY: by the contract of this function.
    unsafe { with_tracker(tracker, tell) }
}

/// Sample time in s.
///
/// # Safety
/// `tracker` was made here; `sample_time` has room for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_sample_time(tracker: *const HoidTracker, sample_time: *mut f64) -> HoidStatus {
    let tell = |session: &Session| {
        // SAFETY: by the contract of this function.
        unsafe { put(sample_time, session.sample_time_s(), "the pointer for the sample time") }
    };
    // SAFETY: by the contract of this function.
    unsafe { with_tracker(tracker, tell) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::ffi::CStr;

    use super::*;

    #[test]
    fn levels_have_the_names_of_the_verdict() {
        for level in VerdictLevel::ALL {
            // SAFETY: a constant text.
            let name = unsafe { CStr::from_ptr(hoid_level_name(number_of(level))) };
            assert_eq!(name.to_str().unwrap(), level.name());
        }
        // SAFETY: a constant text.
        assert!(unsafe { CStr::from_ptr(hoid_level_name(7)) }.is_empty());
    }
}
