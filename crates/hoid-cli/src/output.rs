//! Standard output and standard error. A reader that closes the pipe early (`hoid ... | head`) ends
//! the program quietly.

use std::io::{self, Write};

use indicatif::{ProgressBar, ProgressStyle};

/// Writes a result to standard output.
pub fn print(text: &str) {
    let mut out = io::stdout().lock();
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    if written.is_err() {
        // The reader has closed the pipe.
        std::process::exit(0);
    }
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
