//! Creation, saving and freeing of trackers.

use std::ffi::{CStr, c_char};

use crate::{
    boundary::{HoidTracker, bytes, free_handle, into_handle, text, with_tracker_mut, write_array},
    session::Session,
    status::{Failure, HOID_BAD_POINTER, HoidStatus, catch_failures},
};

/// Version of this interface. Within a version, functions and constants may be added but are never changed.
pub const HOID_ABI_VERSION: u32 = 1;

/// Returns the interface version of the loaded library; compare it with HOID_ABI_VERSION of the header.
#[unsafe(no_mangle)]
pub extern "C" fn hoid_abi_version() -> u32 {
    HOID_ABI_VERSION
}

/// Returns the version of hoid as a string, such as "0.1.0". The string is valid while the library is loaded.
#[unsafe(no_mangle)]
pub extern "C" fn hoid_version() -> *const c_char {
    const VERSION: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
        Ok(version) => version,
        Err(_) => c"",
    };
    VERSION.as_ptr()
}

/// Creates a tracker and writes its handle to `tracker`. `method` is the name of the method (NULL: "adaptive", whose
/// first estimate is available after one second), `sample_time` is in s, and `options` is a JSON object with the
/// keywords of pyhoid.Tracker (NULL: none), such as "{\"controlled_element\": \"90/(s(s+6))\", \"prior\":
/// \"fit.json\"}".
///
/// # Safety
/// `method` and `options` are NULL or null-terminated strings; `tracker` points to memory for a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_new(
    method: *const c_char,
    sample_time: f64,
    options: *const c_char,
    tracker: *mut *mut HoidTracker,
) -> HoidStatus {
    catch_failures(|| {
        // SAFETY: guaranteed by the caller of this function.
        let method = unsafe { text(method, "the method") }?;
        // SAFETY: guaranteed by the caller of this function.
        let options = unsafe { text(options, "the options") }?;
        let session = Session::new(method, sample_time, options, None)?;
        // SAFETY: guaranteed by the caller of this function.
        unsafe { into_handle(session, tracker) }
    })
}

/// Creates a tracker that starts from an earlier fit of the person, and writes its handle to `tracker`. `fit` is the
/// JSON text printed by hoid identify --json. `sample_time` (in s) and `options` are as in hoid_tracker_new.
///
/// # Safety
/// `fit` is NULL or a null-terminated string; otherwise as for hoid_tracker_new.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_from_fit(
    fit: *const c_char,
    sample_time: f64,
    options: *const c_char,
    tracker: *mut *mut HoidTracker,
) -> HoidStatus {
    catch_failures(|| {
        // SAFETY: guaranteed by the caller of this function.
        let fit = unsafe { text(fit, "the fit") }?;
        let fit = fit.ok_or_else(|| Failure::new(HOID_BAD_POINTER, "the fit is null"))?;
        // SAFETY: guaranteed by the caller of this function.
        let options = unsafe { text(options, "the options") }?;
        let session = Session::new(None, sample_time, options, Some(fit))?;
        // SAFETY: guaranteed by the caller of this function.
        unsafe { into_handle(session, tracker) }
    })
}

/// Frees a tracker. Does nothing if `tracker` is NULL.
///
/// # Safety
/// `tracker` is NULL or a tracker of this library that has not been freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_free(tracker: *mut HoidTracker) {
    catch_failures(|| {
        // SAFETY: guaranteed by the caller of this function.
        unsafe { free_handle(tracker) };
        Ok(())
    });
}

/// Saves the state of a tracker as bytes, so that another process can continue with bit-identical results. Writes the
/// number of bytes to `length`, and the bytes to `buffer`, which has room for `room` bytes. With `buffer` NULL and
/// `room` 0, only the number of bytes is written.
///
/// # Safety
/// `tracker` is a tracker of this library; `buffer` points to memory for `room` bytes, and `length` to memory for a
/// number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_save(
    tracker: *mut HoidTracker,
    buffer: *mut u8,
    room: usize,
    length: *mut usize,
) -> HoidStatus {
    let save = |session: &mut Session| {
        // SAFETY: guaranteed by the caller of this function.
        unsafe { write_array(&session.save(), buffer, room, length, "the buffer") }
    };
    // SAFETY: guaranteed by the caller of this function.
    unsafe { with_tracker_mut(tracker, save) }
}

/// Creates a tracker from the `length` bytes that hoid_tracker_save wrote to a buffer, and writes its handle to
/// `tracker`.
///
/// # Safety
/// `buffer` points to `length` bytes; `tracker` points to memory for a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hoid_tracker_restore(
    buffer: *const u8,
    length: usize,
    tracker: *mut *mut HoidTracker,
) -> HoidStatus {
    catch_failures(|| {
        // SAFETY: guaranteed by the caller of this function.
        let saved = unsafe { bytes(buffer, length, "the buffer") }?;
        let session = Session::from_bytes(saved)?;
        // SAFETY: guaranteed by the caller of this function.
        unsafe { into_handle(session, tracker) }
    })
}
