//! Crates that read untrusted bytes, kept from ending a study.
//!
//! They answer most damage by an error, but some by a panic: an index or a sum out of range. This
//! is the one place where a panic is caught. What it may leave half done is the crate's and is
//! dropped here. With `panic = "abort"` nothing can be caught.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;
use std::thread;

use crate::IoError;
use crate::wording::told;

thread_local! {
    static READING: Cell<bool> = const { Cell::new(false) };
}

/// Result of a foreign reader, its panic as [`IoError::Damaged`].
pub(super) fn guarded<T>(file: &str, read: impl FnOnce() -> Result<T, IoError>) -> Result<T, IoError> {
    without_panic(read).unwrap_or_else(|what| {
        Err(IoError::Damaged {
            file: file.to_owned(),
            found: format!("it could not be read to its end ({})", told(&what)),
        })
    })
}

/// The result, or the message of a panic.
///
/// The hook is passed through, once for the process, and keeps silent on a thread that is reading;
/// any other panic is reported as before.
fn without_panic<T>(read: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    // A hook cannot be set while the thread is falling.
    if !thread::panicking() {
        HOOK.call_once(|| {
            let before = panic::take_hook();
            panic::set_hook(Box::new(move |info| {
                if !READING.get() {
                    before(info);
                }
            }));
        });
    }
    let outer = READING.replace(true);
    let result = panic::catch_unwind(AssertUnwindSafe(read));
    READING.set(outer);
    result.map_err(|panic| match panic.downcast::<String>() {
        Ok(text) => *text,
        Err(panic) => panic.downcast_ref::<&str>().copied().unwrap_or_default().to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_message_and_the_next_is_reported_again() {
        assert_eq!(without_panic(|| 1), Ok(1));
        let nested = without_panic(|| {
            assert_eq!(
                without_panic(|| -> u8 { panic!("of {}", "two parts") }),
                Err("of two parts".into())
            );
            assert!(READING.get());
            panic!("of one")
        });
        assert_eq!(nested, Err::<u8, _>("of one".into()));
        assert!(!READING.get());
        assert_eq!(told("a\u{1b}[31m\nb"), "a\\u{1b}[31m");
    }
}
