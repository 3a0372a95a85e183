//! Pointers from the caller, and all assumptions of this crate about them.
//!
//! A pointer that is null or not aligned is rejected. Two conditions cannot be checked and must be guaranteed by the
//! caller of every function: the pointer refers to an object as described in the C header, and no other thread uses the
//! object at the same time.

use std::{
    ffi::{CStr, c_char},
    slice,
};

use crate::{
    session::Session,
    status::{
        Failure, HOID_BAD_POINTER, HOID_BAD_TEXT, HOID_BROKEN, HOID_PANIC, HOID_TOO_SMALL, HoidStatus, catch_failures,
        panic_message,
    },
};

/// Handle of a tracker. Create it with hoid_tracker_new, hoid_tracker_from_fit or hoid_tracker_restore, and free it
/// with hoid_tracker_free. Only one thread at a time may use a tracker.
pub struct HoidTracker {
    session: Session,
    is_broken: bool,
}

fn check<T>(pointer: *const T, what: &str) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure::new(HOID_BAD_POINTER, format!("{what} is null")));
    }
    if !pointer.is_aligned() {
        return Err(Failure::new(
            HOID_BAD_POINTER,
            format!("{what} is not aligned for its type"),
        ));
    }
    Ok(())
}

/// Returns a string passed by the caller; `None` for a null pointer.
///
/// # Safety
/// `pointer` is null or points to a null-terminated string that does not change during the call.
pub(crate) unsafe fn text<'a>(pointer: *const c_char, what: &str) -> Result<Option<&'a str>, Failure> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: the pointer is not null; the caller guarantees a null-terminated string that does not change.
    let text = unsafe { CStr::from_ptr(pointer) };
    let wrong = |_| Failure::new(HOID_BAD_TEXT, format!("{what} is not valid UTF-8"));
    text.to_str().map(Some).map_err(wrong)
}

/// Returns bytes passed by the caller.
///
/// # Safety
/// `pointer` is null or points to `length` bytes that do not change during the call.
pub(crate) unsafe fn bytes<'a>(pointer: *const u8, length: usize, what: &str) -> Result<&'a [u8], Failure> {
    check(pointer, what)?;
    if length > isize::MAX as usize {
        return Err(Failure::new(
            HOID_TOO_SMALL,
            format!("{what} has a length of {length} bytes, expected at most {}", isize::MAX),
        ));
    }
    // SAFETY: the pointer is not null and the length is valid for a slice; the caller guarantees that `length` bytes
    // are readable.
    Ok(unsafe { slice::from_raw_parts(pointer, length) })
}

/// Writes a value to the memory that the caller provides.
///
/// # Safety
/// `pointer` is null or points to memory for one value.
pub(crate) unsafe fn write_value<T>(pointer: *mut T, value: T, what: &str) -> Result<(), Failure> {
    check(pointer, what)?;
    // SAFETY: the pointer is not null and is aligned; the caller guarantees memory for the value. The previous content
    // needs no drop.
    unsafe { pointer.write(value) };
    Ok(())
}

/// Writes an array of values, and the number of values, to the memory that the caller provides. If `list` is null and
/// `room` is zero, only the number is written.
///
/// # Safety
/// `list` is null or points to memory for `room` values, and `count` is null or points to memory for a number.
pub(crate) unsafe fn write_array<T: Copy>(
    values: &[T],
    list: *mut T,
    room: usize,
    count: *mut usize,
    what: &str,
) -> Result<(), Failure> {
    // SAFETY: guaranteed by the caller of this function.
    unsafe { write_value(count, values.len(), "the pointer for the count") }?;
    if list.is_null() && room == 0 {
        return Ok(());
    }
    check(list, what)?;
    if room < values.len() {
        return Err(Failure::new(
            HOID_TOO_SMALL,
            format!("{what} has room for {room} values, but there are {}", values.len()),
        ));
    }
    // SAFETY: the pointer is not null and is aligned, and the caller guarantees memory for `room` values, which is
    // enough. The memory of the caller does not overlap with `values`.
    unsafe { list.copy_from_nonoverlapping(values.as_ptr(), values.len()) };
    Ok(())
}

/// Passes ownership of a tracker to the caller.
///
/// # Safety
/// `place` is null or points to memory for a pointer.
pub(crate) unsafe fn into_handle(session: Session, place: *mut *mut HoidTracker) -> Result<(), Failure> {
    check(place, "the pointer for the tracker")?;
    let tracker = Box::into_raw(Box::new(HoidTracker {
        session,
        is_broken: false,
    }));
    // SAFETY: guaranteed by the caller of this function.
    unsafe { write_value(place, tracker, "the pointer for the tracker") }
}

/// Takes a tracker back from the caller and frees it.
///
/// # Safety
/// `tracker` is null, or came from [`into_handle`] and has not been taken back.
pub(crate) unsafe fn free_handle(tracker: *mut HoidTracker) {
    if tracker.is_null() {
        return;
    }
    // SAFETY: the pointer came from `into_handle`; the caller guarantees that it is taken back only once.
    drop(unsafe { Box::from_raw(tracker) });
}

/// Calls a function with shared access to a tracker.
///
/// # Safety
/// `tracker` is null or came from [`into_handle`], and no other thread uses it.
pub(crate) unsafe fn with_tracker(
    tracker: *const HoidTracker,
    call: impl FnOnce(&Session) -> Result<(), Failure>,
) -> HoidStatus {
    catch_failures(|| {
        check(tracker, "the tracker")?;
        // SAFETY: the pointer is not null and is aligned; the caller guarantees a tracker that no other code changes.
        let tracker = unsafe { &*tracker };
        tracker.check()?;
        call(&tracker.session)
    })
}

/// Calls a function that may change a tracker. If the function panics, the tracker cannot be used any more.
///
/// # Safety
/// As [`with_tracker`].
pub(crate) unsafe fn with_tracker_mut(
    tracker: *mut HoidTracker,
    call: impl FnOnce(&mut Session) -> Result<(), Failure>,
) -> HoidStatus {
    catch_failures(|| {
        check(tracker, "the tracker")?;
        // SAFETY: the pointer is not null and is aligned; the caller guarantees a tracker that no other code uses.
        let tracker = unsafe { &mut *tracker };
        tracker.check()?;
        let session = &mut tracker.session;
        let moved = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| call(session)));
        moved.unwrap_or_else(|panic| {
            tracker.is_broken = true;
            Err(Failure::new(HOID_PANIC, panic_message(&*panic)))
        })
    })
}

impl HoidTracker {
    fn check(&self) -> Result<(), Failure> {
        if self.is_broken {
            return Err(Failure::new(
                HOID_BROKEN,
                "an earlier call of this tracker failed internally; free the tracker and create another",
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::ptr;

    use super::*;
    use crate::{HOID_OK, hoid_last_error, session::Session};

    fn last_error_text() -> String {
        // SAFETY: the text belongs to this thread, and no call follows before it is read.
        let text = unsafe { CStr::from_ptr(hoid_last_error()) };
        text.to_str().unwrap().to_owned()
    }

    #[test]
    fn panic_becomes_a_status_and_breaks_only_its_tracker() {
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let mut trackers = [ptr::null_mut(), ptr::null_mut()];
        for place in &mut trackers {
            let session = Session::new(Some("rpem"), 0.01, Some("{\"nk\": 9}"), None).unwrap();
            // SAFETY: the pointer refers to the stack.
            unsafe { into_handle(session, place) }.unwrap();
        }
        // SAFETY: the tracker was created above.
        let status = unsafe { with_tracker_mut(trackers[0], |_| panic!("as planned")) };
        assert_eq!(status, HOID_PANIC);
        assert!(last_error_text().contains("as planned"), "{}", last_error_text());
        // SAFETY: the tracker was created above.
        let status = unsafe { with_tracker_mut(trackers[0], |_| Ok(())) };
        assert_eq!(status, HOID_BROKEN);
        // SAFETY: the tracker was created above.
        let status = unsafe { with_tracker(trackers[1], |_| Ok(())) };
        assert_eq!(status, HOID_OK);
        assert_eq!(catch_failures(|| panic!("{}", 7)), HOID_PANIC);
        assert!(last_error_text().ends_with('7'));
        for tracker in trackers {
            // SAFETY: the tracker was created above and is taken back once.
            unsafe { free_handle(tracker) };
        }
        std::panic::set_hook(hook);
    }

    #[test]
    fn invalid_pointers_are_refused() {
        // SAFETY: null is allowed.
        assert_eq!(unsafe { text(ptr::null(), "a") }, Ok(None));
        // SAFETY: null is allowed.
        let refused = unsafe { write_value(ptr::null_mut(), 1.0, "the pointer") }.unwrap_err();
        assert_eq!(refused.status, HOID_BAD_POINTER);
        let mut room = [0.0_f64; 2];
        // SAFETY: the pointer is misaligned, so nothing is written.
        let refused = unsafe { write_value(room.as_mut_ptr().wrapping_byte_add(1), 1.0, "the pointer") }.unwrap_err();
        assert!(refused.text.contains("aligned"));
        let mut count = 0;
        // SAFETY: the memory has room for two values.
        let refused = unsafe { write_array(&[1.0, 2.0, 3.0], room.as_mut_ptr(), 2, &mut count, "the list") };
        assert_eq!(
            (refused.unwrap_err().status, count, room),
            (HOID_TOO_SMALL, 3, [0.0; 2])
        );
        // SAFETY: no values are written; the pointer for the count is valid.
        let status = unsafe { write_array(&[1.0], ptr::null_mut(), 0, &mut count, "the list") };
        assert_eq!((status, count), (Ok(()), 1));
        // SAFETY: the string is null-terminated.
        let refused = unsafe { text(c"\xff".as_ptr(), "a") }.unwrap_err();
        assert_eq!(refused.status, HOID_BAD_TEXT);
        // SAFETY: the length is rejected, so no bytes are read.
        let refused = unsafe { bytes(room.as_ptr().cast(), usize::MAX, "bytes") }.unwrap_err();
        assert_eq!(refused.status, HOID_TOO_SMALL);
    }
}
