//! Functions that read results from a tracker.
//!
//! The caller provides memory for an array, its capacity, and a pointer for the count. With a null array and a capacity
//! of zero, only the count is written.

use std::ffi::c_char;

use hoid_model::VerdictLevel;

use crate::{
    boundary::{HoidTracker, with_tracker, write_array, write_value},
    session::Session,
    status::{Failure, HoidStatus},
    types::{HoidChange, HoidCounts, HoidEstimate},
};

/// No check found a problem with the estimate.
pub const HOID_TRUSTWORTHY: i32 = 0;
/// A check found a problem with the estimate.
pub const HOID_DOUBTFUL: i32 = 1;
/// The data do not determine the estimate, or there is no estimate.
pub const HOID_NOT_DETERMINED: i32 = 2;

/// Writes an array of results of a tracker.
///
/// # Safety
/// As for [`with_tracker`] and [`write_array`].
unsafe fn write_list<T: Copy>(
    tracker: *const HoidTracker,
    of: impl FnOnce(&Session) -> Result<Vec<T>, Failure>,
    list: *mut T,
    room: usize,
    count: *mut usize,
) -> HoidStatus {
    let write = |session: &Session| {
        // SAFETY: guaranteed by the caller of this function.
        unsafe { write_array(&of(session)?, list, room, count, "the list") }
    };
    // SAFETY: guaranteed by the caller of this function.
    unsafe { with_tracker(tracker, write) }
}

/// Returns HOID_OK after the warm-up, and always for a method without a warm-up. Returns HOID_NOTHING during the
/// warm-up; hoid_last_error then reports the progress.
///
/// # Safety
/// `tracker` is a tracker of this library.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_ready(tracker: *const HoidTracker) -> HoidStatus {
    // SAFETY: guaranteed by the caller of this function.
    unsafe { with_tracker(tracker, |session| session.tracker().map(|_| ())) }
}

/// Writes the parameters of the operator (K_e, T_L, K_e_dot, omega_nm, zeta_nm, tau_e) with their standard errors to
/// `estimates`, which has room for `room` elements, and their number to `count`. With `estimates` NULL and `room` 0,
/// only the number is written; if `room` is too small, the function returns HOID_TOO_SMALL.
///
/// # Safety
/// `tracker` is a tracker of this library; `estimates` points to memory for `room` elements, and `count` to memory for
/// a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_operator(
    tracker: *const HoidTracker,
    estimates: *mut HoidEstimate,
    room: usize,
    count: *mut usize,
) -> HoidStatus {
    // SAFETY: guaranteed by the caller of this function.
    unsafe { write_list(tracker, Session::operator, estimates, room, count) }
}

/// Writes the coefficients of the polynomials, in the order of theta, with their standard errors. The array is used as
/// in hoid_tracker_operator.
///
/// # Safety
/// As for hoid_tracker_operator.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_parameters(
    tracker: *const HoidTracker,
    estimates: *mut HoidEstimate,
    room: usize,
    count: *mut usize,
) -> HoidStatus {
    // SAFETY: guaranteed by the caller of this function.
    unsafe { write_list(tracker, Session::parameters, estimates, room, count) }
}

/// Writes the covariance matrix of the coefficients, row by row. The array is used as in hoid_tracker_operator.
///
/// # Safety
/// As for hoid_tracker_operator.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_covariance(
    tracker: *const HoidTracker,
    covariance: *mut f64,
    room: usize,
    count: *mut usize,
) -> HoidStatus {
    // SAFETY: guaranteed by the caller of this function.
    unsafe { write_list(tracker, Session::covariance, covariance, room, count) }
}

/// Writes the crossover frequency (crossover_rad_s) and the phase margin (phase_margin_deg) of the open loop with the
/// controlled element given in the options. The array is used as in hoid_tracker_operator.
///
/// # Safety
/// As for hoid_tracker_operator.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_open_loop(
    tracker: *const HoidTracker,
    estimates: *mut HoidEstimate,
    room: usize,
    count: *mut usize,
) -> HoidStatus {
    // SAFETY: guaranteed by the caller of this function.
    unsafe { write_list(tracker, Session::open_loop, estimates, room, count) }
}

/// Writes the gain (gain_db) and the phase (phase_deg) of the operator at the frequency `omega` in rad/s. The array is
/// used as in hoid_tracker_operator.
///
/// # Safety
/// As for hoid_tracker_operator.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_response(
    tracker: *const HoidTracker,
    omega: f64,
    estimates: *mut HoidEstimate,
    room: usize,
    count: *mut usize,
) -> HoidStatus {
    // SAFETY: guaranteed by the caller of this function.
    unsafe { write_list(tracker, |session| session.response(omega), estimates, room, count) }
}

/// Writes the change that was declared at the last sample; returns HOID_NOTHING if none was declared.
///
/// # Safety
/// `tracker` is a tracker of this library; `change` points to memory for a hoid_change.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_change(tracker: *const HoidTracker, change: *mut HoidChange) -> HoidStatus {
    let write = |session: &Session| {
        // SAFETY: guaranteed by the caller of this function.
        unsafe { write_value(change, session.change()?, "the change") }
    };
    // SAFETY: guaranteed by the caller of this function.
    unsafe { with_tracker(tracker, write) }
}

/// Writes the current evidence of a change, defined as log_odds of hoid_change. Before the first estimate it is 0
/// (`adaptive`) or -inf (`multiple-model`). Returns HOID_NOTHING for a method that does not report changes.
///
/// # Safety
/// `tracker` is a tracker of this library; `log_odds` points to memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_change_log_odds(tracker: *const HoidTracker, log_odds: *mut f64) -> HoidStatus {
    let write = |session: &Session| {
        // SAFETY: guaranteed by the caller of this function.
        unsafe { write_value(log_odds, session.change_log_odds()?, "the pointer for the odds") }
    };
    // SAFETY: guaranteed by the caller of this function.
    unsafe { with_tracker(tracker, write) }
}

/// Writes the verdict on the current estimate: HOID_TRUSTWORTHY, HOID_DOUBTFUL or HOID_NOT_DETERMINED.
///
/// # Safety
/// `tracker` is a tracker of this library; `level` points to memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_level(tracker: *const HoidTracker, level: *mut i32) -> HoidStatus {
    let write = |session: &Session| {
        let number = level_number(session.level());
        // SAFETY: guaranteed by the caller of this function.
        unsafe { write_value(level, number, "the pointer for the level") }
    };
    // SAFETY: guaranteed by the caller of this function.
    unsafe { with_tracker(tracker, write) }
}

pub(crate) fn level_number(level: VerdictLevel) -> i32 {
    match level {
        VerdictLevel::Trustworthy => HOID_TRUSTWORTHY,
        VerdictLevel::Doubtful => HOID_DOUBTFUL,
        VerdictLevel::NotDetermined => HOID_NOT_DETERMINED,
    }
}

/// Returns the name of a verdict level, such as "trustworthy"; an empty string for any other number. The string is
/// valid while the library is loaded.
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

/// Writes the numbers of samples and events since the start.
///
/// # Safety
/// `tracker` is a tracker of this library; `counts` points to memory for a hoid_counts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_counts(tracker: *const HoidTracker, counts: *mut HoidCounts) -> HoidStatus {
    let write = |session: &Session| {
        // SAFETY: guaranteed by the caller of this function.
        unsafe { write_value(counts, session.counts(), "the counts") }
    };
    // SAFETY: guaranteed by the caller of this function.
    unsafe { with_tracker(tracker, write) }
}

/// Writes the sample time in s.
///
/// # Safety
/// `tracker` is a tracker of this library; `sample_time` points to memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_sample_time(tracker: *const HoidTracker, sample_time: *mut f64) -> HoidStatus {
    let write = |session: &Session| {
        // SAFETY: guaranteed by the caller of this function.
        unsafe { write_value(sample_time, session.sample_time_s(), "the pointer for the sample time") }
    };
    // SAFETY: guaranteed by the caller of this function.
    unsafe { with_tracker(tracker, write) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::ffi::CStr;

    use super::*;

    #[test]
    fn level_names_match_the_verdict() {
        for level in VerdictLevel::ALL {
            // SAFETY: a constant text.
            let name = unsafe { CStr::from_ptr(hoid_level_name(level_number(level))) };
            assert_eq!(name.to_str().unwrap(), level.name());
        }
        // SAFETY: a constant text.
        assert!(unsafe { CStr::from_ptr(hoid_level_name(7)) }.is_empty());
    }
}
