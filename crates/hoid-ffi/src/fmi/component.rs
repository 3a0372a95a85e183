//! Handles, status codes and messages shared by FMI 2.0 and FMI 3.0.

use std::{
    ffi::{CStr, CString, c_char, c_int, c_void},
    panic::{AssertUnwindSafe, catch_unwind},
    path::PathBuf,
    slice,
};

use super::{instance::Instance, values::FmiResult};
use crate::status::panic_message;

/// Status codes that FMI 2.0 and FMI 3.0 have in common.
pub(super) const OK: i32 = 0;
pub(super) const ERROR: i32 = 3;
pub(super) const FATAL: i32 = 4;

/// Type `fmi2CallbackLogger`.
pub type Fmi2Logger = unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...);
/// Type `fmi3LogMessageCallback`.
pub type Fmi3Logger = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);

/// Logging callback of the importer.
#[derive(Clone, Copy)]
pub(super) enum Logger {
    Unset,
    Two {
        function: Fmi2Logger,
        environment: *mut c_void,
    },
    Three {
        function: Fmi3Logger,
        environment: *mut c_void,
    },
}

const CATEGORY: &CStr = c"logStatusError";

impl Logger {
    /// Passes a message with its status to the logging callback.
    ///
    /// # Safety
    /// The callback was supplied by the importer, and its environment still exists.
    unsafe fn log(self, name: &CString, status: i32, message: &str) {
        let message = CString::new(message.replace('\0', " ")).unwrap_or_default();
        match self {
            Self::Unset => {}
            Self::Two { function, environment } => {
                // SAFETY: the strings are null-terminated and exist during the call; the format consumes exactly one
                // string, the message.
                unsafe {
                    function(
                        environment,
                        name.as_ptr(),
                        status,
                        CATEGORY.as_ptr(),
                        c"%s".as_ptr(),
                        message.as_ptr(),
                    );
                }
            }
            Self::Three { function, environment } => {
                // SAFETY: the strings are null-terminated and exist during the call.
                unsafe { function(environment, status, CATEGORY.as_ptr(), message.as_ptr()) };
            }
        }
    }
}

/// Instance of a unit; the importer holds a pointer to it.
pub struct Component {
    instance: Instance,
    name: CString,
    logger: Logger,
    is_broken: bool,
}

/// Creates an instance; returns null on failure.
///
/// # Safety
/// `logger` was supplied by the importer.
pub(super) unsafe fn create(
    name: &str,
    logger: Logger,
    instance: impl FnOnce() -> FmiResult<Instance>,
) -> *mut Component {
    let name = CString::new(name.replace('\0', " ")).unwrap_or_default();
    let made = catch_unwind(AssertUnwindSafe(instance)).unwrap_or_else(|panic| Err(panic_message(&*panic)));
    match made {
        Ok(instance) => Box::into_raw(Box::new(Component {
            instance,
            name,
            logger,
            is_broken: false,
        })),
        Err(message) => {
            // SAFETY: guaranteed by the caller of this function.
            unsafe { logger.log(&name, ERROR, &message) };
            std::ptr::null_mut()
        }
    }
}

/// Frees an instance.
///
/// # Safety
/// `component` is null, or came from [`create`] and has not been freed.
pub(super) unsafe fn free(component: *mut Component) {
    if component.is_null() {
        return;
    }
    // SAFETY: the pointer came from `create`; the caller guarantees that it is freed only once.
    drop(unsafe { Box::from_raw(component) });
}

/// Calls a function with an instance and returns the status; the message of an error is passed to the logger.
///
/// # Safety
/// `component` is null or came from [`create`], and no other thread uses it.
pub(super) unsafe fn with_instance(component: *mut Component, call: impl FnOnce(&mut Instance) -> FmiResult) -> i32 {
    if component.is_null() || !component.is_aligned() {
        return ERROR;
    }
    // SAFETY: the pointer is not null and is aligned; the caller guarantees exclusive access.
    let component = unsafe { &mut *component };
    if component.is_broken {
        return FATAL;
    }
    let instance = &mut component.instance;
    let (status, message) = match catch_unwind(AssertUnwindSafe(|| call(instance))) {
        Ok(Ok(())) => return OK,
        Ok(Err(message)) => (ERROR, message),
        Err(panic) => {
            component.is_broken = true;
            (FATAL, panic_message(&*panic))
        }
    };
    // SAFETY: the logger was supplied by the importer.
    unsafe { component.logger.log(&component.name, status, &message) };
    status
}

/// Returns an array passed by the importer; if the count is zero, the array is empty, regardless of the pointer.
///
/// # Safety
/// `pointer` points to `count` elements that do not change during the call.
pub(super) unsafe fn slice_from_raw<'a, T>(pointer: *const T, count: usize) -> FmiResult<&'a [T]> {
    if count == 0 {
        return Ok(&[]);
    }
    if pointer.is_null() || !pointer.is_aligned() {
        return Err("a list is null or not aligned".to_owned());
    }
    // SAFETY: the pointer is not null and is aligned; the caller guarantees `count` elements.
    Ok(unsafe { slice::from_raw_parts(pointer, count) })
}

/// Returns an output array supplied by the importer.
///
/// # Safety
/// `pointer` points to `count` initialised elements that no other code uses during the call.
pub(super) unsafe fn slice_from_raw_mut<'a, T>(pointer: *mut T, count: usize) -> FmiResult<&'a mut [T]> {
    if count == 0 {
        return Ok(&mut []);
    }
    if pointer.is_null() || !pointer.is_aligned() {
        return Err("a list is null or not aligned".to_owned());
    }
    // SAFETY: the pointer is not null and is aligned; the caller guarantees `count` elements.
    Ok(unsafe { slice::from_raw_parts_mut(pointer, count) })
}

/// Returns a string passed by the importer; an empty string if the pointer is null or the text is not valid UTF-8.
///
/// # Safety
/// `pointer` is null or a null-terminated string that does not change during the call.
pub(super) unsafe fn str_from_raw<'a>(pointer: *const c_char) -> &'a str {
    // SAFETY: guaranteed by the caller of this function.
    let text = unsafe { crate::boundary::text(pointer, "the text") };
    text.ok().flatten().unwrap_or_default()
}

/// Returns the folder given by a URI, such as `file:///tmp/a%20b/resources`, or by a path; `None` for an empty string.
pub(super) fn folder_from_uri(uri: &str) -> Option<PathBuf> {
    if uri.is_empty() {
        return None;
    }
    let Some(rest) = uri.strip_prefix("file:") else {
        return Some(PathBuf::from(uri));
    };
    let path = match rest.strip_prefix("//") {
        // The path follows the host, which is empty or refers to this computer.
        Some(rest) => rest.find('/').map_or("", |slash| &rest[slash..]),
        None => rest,
    };
    let mut bytes = Vec::with_capacity(path.len());
    let mut left = path.bytes();
    while let Some(byte) = left.next() {
        let mut ahead = left.clone();
        let digit = |byte: Option<u8>| char::from(byte?).to_digit(16);
        match (byte, digit(ahead.next()), digit(ahead.next())) {
            (b'%', Some(high), Some(low)) => {
                bytes.push((16 * high + low) as u8);
                left = ahead;
            }
            _ => bytes.push(byte),
        }
    }
    let path = String::from_utf8_lossy(&bytes).into_owned();
    // A Windows path starts with a drive: /C:/a.
    let is_drive = path.as_bytes().get(2) == Some(&b':');
    Some(PathBuf::from(if is_drive { &path[1..] } else { &path }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_converted_to_paths() {
        for (uri, expected) in [
            ("file:///tmp/a%20b/resources", "/tmp/a b/resources"),
            ("file:/tmp/a", "/tmp/a"),
            ("file://localhost/tmp/a%", "/tmp/a%"),
            ("file:///C:/a/b", "C:/a/b"),
            ("file:///tmp/%c3%a4", "/tmp/\u{e4}"),
            ("/tmp/a%20b", "/tmp/a%20b"),
        ] {
            assert_eq!(folder_from_uri(uri), Some(PathBuf::from(expected)), "{uri}");
        }
        assert_eq!(folder_from_uri(""), None);
    }
}
