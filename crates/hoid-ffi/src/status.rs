//! Status codes, and the message of the last error.
//!
//! Each thread has its own message, so two threads with separate trackers do not affect each other.

use std::{
    any::Any,
    cell::RefCell,
    ffi::{CStr, CString, c_char},
    panic::{AssertUnwindSafe, catch_unwind},
};

use hoid_ident::IdentError;
use hoid_io::IoError;
use hoid_model::ModelError;

/// Return code of a function: zero for success, positive if there is no value, negative for an error.
pub type HoidStatus = i32;

/// Success.
pub const HOID_OK: HoidStatus = 0;
/// The requested value is currently not available; hoid_last_error returns the reason.
pub const HOID_NOTHING: HoidStatus = 1;
/// A pointer is null or not aligned.
pub const HOID_BAD_POINTER: HoidStatus = -1;
/// A string is not valid UTF-8.
pub const HOID_BAD_TEXT: HoidStatus = -2;
/// The method, an option, the sample time or the fit cannot be used.
pub const HOID_BAD_OPTION: HoidStatus = -3;
/// An array or buffer is too small.
pub const HOID_TOO_SMALL: HoidStatus = -4;
/// The bytes are not a tracker saved by this version, or were changed.
pub const HOID_BAD_STATE: HoidStatus = -5;
/// An internal error of hoid was caught.
pub const HOID_PANIC: HoidStatus = -6;
/// An earlier call with this tracker failed with an internal error; free the tracker.
pub const HOID_BROKEN: HoidStatus = -7;

/// Status other than [`HOID_OK`], with its message.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Failure {
    pub status: HoidStatus,
    pub text: String,
}

impl Failure {
    pub fn new(status: HoidStatus, text: impl Into<String>) -> Self {
        Self {
            status,
            text: text.into(),
        }
    }

    pub fn bad_option(text: impl Into<String>) -> Self {
        Self::new(HOID_BAD_OPTION, text)
    }

    pub fn no_result(text: impl Into<String>) -> Self {
        Self::new(HOID_NOTHING, text)
    }
}

impl From<IdentError> for Failure {
    fn from(error: IdentError) -> Self {
        Self::bad_option(error.to_string())
    }
}

impl From<ModelError> for Failure {
    fn from(error: ModelError) -> Self {
        Self::bad_option(error.to_string())
    }
}

impl From<IoError> for Failure {
    fn from(error: IoError) -> Self {
        Self::bad_option(error.to_string())
    }
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::new(CString::default());
}

/// Runs a function of the interface and returns its status. Panics are caught, and the message of a failure is stored
/// for [`hoid_last_error`].
pub(crate) fn catch_failures(call: impl FnOnce() -> Result<(), Failure>) -> HoidStatus {
    let failure = match catch_unwind(AssertUnwindSafe(call)) {
        Ok(Ok(())) => return HOID_OK,
        Ok(Err(failure)) => failure,
        Err(panic) => Failure::new(HOID_PANIC, panic_message(&*panic)),
    };
    store_error(&failure.text);
    failure.status
}

/// Returns the error message for a panic.
pub(crate) fn panic_message(panic: &(dyn Any + Send)) -> String {
    let words = (panic.downcast_ref::<&str>().copied())
        .or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("it gave no message");
    format!("internal error in hoid; please report it: {words}")
}

fn store_error(text: &str) {
    let text = CString::new(text.replace('\0', " ")).unwrap_or_default();
    // While a thread is terminating, its thread-local storage may no longer exist.
    let _ = LAST_ERROR.try_with(|last| *last.borrow_mut() = text);
}

/// Returns the message of the last status in this thread that was not HOID_OK, or an empty string if there was none.
/// The pointer stays valid until a function called in this thread again returns a status other than HOID_OK.
#[unsafe(no_mangle)]
pub extern "C" fn hoid_last_error() -> *const c_char {
    const EMPTY: &CStr = c"";
    LAST_ERROR
        .try_with(|last| last.borrow().as_ptr())
        .unwrap_or(EMPTY.as_ptr())
}
