//! Isolation of third-party crates that read untrusted bytes, so that a panic in them does not abort a study.
//!
//! These crates report most damage as an error, but some damage makes them panic, such as an index or a sum out of
//! range. Only this module catches panics. The partial results of the crate are dropped. With `panic = "abort"` no
//! panic can be caught.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;
use std::thread;

use crate::IoError;
use crate::wording::short_error;

thread_local! {
    static READING: Cell<bool> = const { Cell::new(false) };
}

/// Returns the result of a third-party reader; a panic becomes [`IoError::Damaged`].
pub(super) fn guard_read<T>(file: &str, read: impl FnOnce() -> Result<T, IoError>) -> Result<T, IoError> {
    catch_panic(read).unwrap_or_else(|what| {
        Err(IoError::Damaged {
            file: file.to_owned(),
            found: format!("it could not be read to the end ({})", short_error(&what)),
        })
    })
}

/// Returns the result of `read`, or the message with which it panicked.
///
/// The panic hook is replaced once per process. The new hook prints nothing on a thread that is reading, and reports
/// all other panics as before.
fn catch_panic<T>(read: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    // The hook cannot be replaced while the thread is panicking.
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
    fn panic_becomes_an_error_message() {
        assert_eq!(catch_panic(|| 1), Ok(1));
        let nested = catch_panic(|| {
            assert_eq!(
                catch_panic(|| -> u8 { panic!("of {}", "two parts") }),
                Err("of two parts".into())
            );
            assert!(READING.get());
            panic!("of one")
        });
        assert_eq!(nested, Err::<u8, _>("of one".into()));
        assert!(!READING.get());
        assert_eq!(short_error("a\u{1b}[31m\nb"), "a\\u{1b}[31m");
    }
}
