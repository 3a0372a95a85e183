//! Making, saving and freeing trackers.

use std::ffi::{CStr, c_char};

use crate::{
    boundary::{HoidTracker, bytes, hand_over, move_tracker, put_all, take_back, text},
    session::Session,
    status::{Failure, HOID_BAD_POINTER, HoidStatus, guarded},
};

/// Version of this interface. Functions and constants are added within a version, and never changed.
pub const HOID_ABI_VERSION: u32 = 1;

/// Version of the interface of the loaded library: compare it with HOID_ABI_VERSION of the header.
#[unsafe(no_mangle)]
pub extern "C" fn hoid_abi_version() -> u32 {
    HOID_ABI_VERSION
}

/// The version of hoid, such as "0.1.0".
#[unsafe(no_mangle)]
pub extern "C" fn hoid_version() -> *const c_char {
    const VERSION: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
        Ok(version) => version,
        Err(_) => c"",
    };
    VERSION.as_ptr()
}

/// Makes a tracker from the name of the method (NULL: "adaptive", whose first estimate comes after one
/// second), the sample time in s, and options as one JSON object with the keywords of pyhoid.Tracker
/// (NULL: none), such as "{\"controlled_element\": \"90/(s(s+6))\", \"prior\": \"fit.json\"}".
///
/// # Safety
/// Texts are NULL or end with a zero; `tracker` points to room for a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_new(
    method: *const c_char,
    sample_time: f64,
    options: *const c_char,
    tracker: *mut *mut HoidTracker,
) -> HoidStatus {
    guarded(|| {
        // SAFETY: by the contract of this function.
        let method = unsafe { text(method, "the method") }?;
        // SAFETY: by the contract of this function.
        let options = unsafe { text(options, "the options") }?;
        let session = Session::new(method, sample_time, options, None)?;
        // SAFETY: by the contract of this function.
        unsafe { hand_over(session, tracker) }
    })
}

/// Makes a tracker that starts with an earlier fit of the person, the text that hoid identify --json
/// prints. Sample time in s and options as in hoid_tracker_new.
///
/// # Safety
/// As hoid_tracker_new.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_from_fit(
    fit: *const c_char,
    sample_time: f64,
    options: *const c_char,
    tracker: *mut *mut HoidTracker,
) -> HoidStatus {
    guarded(|| {
        // SAFETY: by the contract of this function.
        let fit = unsafe { text(fit, "the fit") }?;
        let fit = fit.ok_or_else(|| Failure::new(HOID_BAD_POINTER, "the fit is null"))?;
        // SAFETY: by the contract of this function.
        let options = unsafe { text(options, "the options") }?;
        let session = Session::new(None, sample_time, options, Some(fit))?;
        // SAFETY: by the contract of this function.
        unsafe { hand_over(session, tracker) }
    })
}

/// Frees a tracker; does nothing for NULL.
///
/// # Safety
/// `tracker` is NULL or was made here and not freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_free(tracker: *mut HoidTracker) {
    guarded(|| {
        // SAFETY: by the contract of this function.
        unsafe { take_back(tracker) };
        Ok(())
    });
}

/// Saves a tracker as bytes, to continue in another process with the same digits. With `buffer` NULL and `room` 0 only
/// the length is reported.
///
/// # Safety
/// `tracker` was made here; `buffer` has room for `room` bytes, `length` for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_save(
    tracker: *mut HoidTracker,
    buffer: *mut u8,
    room: usize,
    length: *mut usize,
) -> HoidStatus {
    let save = |session: &mut Session| {
        // SAFETY: by the contract of this function.
        unsafe { put_all(&session.saved(), buffer, room, length, "the buffer") }
    };
    // SAFETY: by the contract of this function.
    unsafe { move_tracker(tracker, save) }
}

/// Restores a saved tracker.
///
/// # Safety
/// `buffer` has `length` bytes; `tracker` points to room for a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_restore(
    buffer: *const u8,
    length: usize,
    tracker: *mut *mut HoidTracker,
) -> HoidStatus {
    guarded(|| {
        // SAFETY: by the contract of this function.
        let saved = unsafe { bytes(buffer, length, "the buffer") }?;
        let session = Session::restored(saved)?;
        // SAFETY: by the contract of this function.
        unsafe { hand_over(session, tracker) }
    })
}
