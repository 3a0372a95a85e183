//! Standard output and standard error. A reader that closes the pipe early (`hoid ... | head`) has
//! what it wanted: the command goes on with its files, and nothing is said. Any other output that
//! cannot be written, such as a full disk, is an error.

use std::{
    io::{self, ErrorKind, Write},
    sync::atomic::{AtomicBool, Ordering},
};

use indicatif::{ProgressBar, ProgressStyle};

use crate::error::CliError;

/// Writes a result to standard output.
///
/// # Errors
/// [`CliError::Output`] for what the system says, but not for a pipe that its reader has closed.
pub fn print(text: &str) -> Result<(), CliError> {
    printed(io::stdout().lock().write_all(text.as_bytes()))
}

/// What became of something that was written to standard output.
///
/// # Errors
/// As [`print`].
pub fn printed(written: io::Result<()>) -> Result<(), CliError> {
    match written.and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => {
            READER_LEFT.store(true, Ordering::Relaxed);
            Ok(())
        }
        Err(error) => Err(CliError::Output(error)),
        Ok(()) => Ok(()),
    }
}

static READER_LEFT: AtomicBool = AtomicBool::new(false);

/// Whether the reader of standard output has closed the pipe.
pub fn reader_left() -> bool {
    READER_LEFT.load(Ordering::Relaxed)
}

/// Writes a warning, a note or an error to standard error.
pub fn message(text: &str) {
    // When even standard error is closed there is no one to tell.
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// A progress bar on standard error with rate and time left; invisible where standard error is no
/// terminal.
pub fn progress(total: usize, what: &str) -> ProgressBar {
    let bar = ProgressBar::new(total as u64);
    // Should the template be wrong, the plain bar does as well.
    if let Ok(style) =
        ProgressStyle::with_template(&format!("{{bar:30}} {{pos}}/{{len}} {what}, {{per_sec}}, {{eta}} left"))
    {
        bar.set_style(style);
    }
    bar
}
