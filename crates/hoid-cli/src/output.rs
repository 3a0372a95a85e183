//! Standard output and standard error. If the reader closes the pipe early (`hoid ... | head`), the command still
//! writes its files, and nothing is reported. Any other write error, such as a full disk, is reported as an error.

use std::{
    io::{self, ErrorKind, IsTerminal, Write},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use anstream::{AutoStream, ColorChoice};
use anstyle::AnsiColor;
use hoid::ident::progress;
use hoid::model::VerdictLevel;
use indicatif::{ProgressBar, ProgressStyle};

use crate::error::CliError;

/// Writes a result to standard output.
///
/// # Errors
/// [`CliError::Output`] for an error reported by the operating system, except for a pipe closed by its reader.
pub fn print(text: &str) -> Result<(), CliError> {
    check_written(io::stdout().lock().write_all(text.as_bytes()))
}

/// Writes a page of text to standard output, with sentences wrapped at the width of the screen.
///
/// # Errors
/// Same as [`print`].
pub fn show(page: &str) -> Result<(), CliError> {
    let page = width().map_or_else(|| page.to_owned(), |width| wrapped(page, width));
    match AutoStream::choice(&io::stdout()) {
        ColorChoice::Never => print(&page),
        _ => print(&coloured(&page)),
    }
}

/// Returns the page with its verdict in colour if the terminal supports colours and `NO_COLOR` is not set.
fn coloured(page: &str) -> String {
    let colour = |level| match level {
        VerdictLevel::Trustworthy => AnsiColor::Green,
        VerdictLevel::Doubtful => AnsiColor::Yellow,
        VerdictLevel::NotDetermined => AnsiColor::Red,
    };
    let in_colour = |level: VerdictLevel| {
        let line = format!("Verdict: {level}");
        let rest = page.strip_prefix(&line).filter(|rest| rest.starts_with('\n'))?;
        let style = colour(level).on_default().bold();
        Some(format!("{style}{line}{style:#}{rest}"))
    };
    VerdictLevel::ALL
        .into_iter()
        .find_map(in_colour)
        .unwrap_or_else(|| page.to_owned())
}

/// Minimum and maximum width of a page: narrower lines would split words, wider lines are hard to read.
const WIDTH_RANGE: (usize, usize) = (60, 110);

/// Returns the width for wrapping in columns, limited to [`WIDTH_RANGE`]: the value of `COLUMNS`, otherwise the width
/// of the terminal. Returns `None` if neither is known, as for output to a file; lines are then not wrapped.
pub fn width() -> Option<usize> {
    let columns = std::env::var("COLUMNS").ok().and_then(|text| text.parse().ok());
    let asked = || {
        let terminal = io::stdout().is_terminal().then(terminal_size::terminal_size)?;
        terminal.map(|(columns, _)| usize::from(columns.0))
    };
    columns
        .or_else(asked)
        .map(|columns| columns.clamp(WIDTH_RANGE.0, WIDTH_RANGE.1))
}

/// Wraps the sentences of a page; tables keep their width. The continuation lines of a list item are indented.
fn wrapped(page: &str, width: usize) -> String {
    let mut text = String::with_capacity(page.len() + page.len() / 16);
    for line in page.split_inclusive('\n') {
        let (body, end) = line.strip_suffix('\n').map_or((line, ""), |body| (body, "\n"));
        let indent = body.len() - body.trim_start_matches([' ', '-']).len();
        if body.chars().count() <= width || body.contains('\u{2500}') || indent > width / 2 {
            text.push_str(line);
            continue;
        }
        let mut column = indent;
        text.push_str(&body[..indent]);
        for (k, word) in body[indent..].split(' ').enumerate() {
            let length = word.chars().count();
            if k > 0 && column + 1 + length > width {
                text.push('\n');
                text.push_str(&" ".repeat(indent));
                column = indent;
            } else if k > 0 {
                text.push(' ');
                column += 1;
            }
            text.push_str(word);
            column += length;
        }
        text.push_str(end);
    }
    text
}

/// Remarks that will be printed after the result, each with the files that it concerns.
static NOTICES: Mutex<Vec<(String, Vec<String>)>> = Mutex::new(Vec::new());

/// Prefix of a warning.
const WARNING_PREFIX: &str = "warning: ";

/// Stores a warning until the result is printed, as [`add_notice`] does for a remark.
pub fn add_warning(of: &str, words: &str) {
    add_notice(of, format!("{WARNING_PREFIX}{words}"));
}

/// Stores a remark until the result is printed. A remark that concerns several files is printed once.
pub fn add_notice(of: &str, words: String) {
    let mut all = NOTICES.lock().unwrap_or_else(PoisonError::into_inner);
    match all.iter_mut().find(|(known, _)| *known == words) {
        Some((_, files)) if files.iter().any(|file| file == of) => {}
        Some((_, files)) => files.push(of.to_owned()),
        None => all.push((words, vec![of.to_owned()])),
    }
}

/// Writes the stored remarks to standard error.
pub fn print_notices() {
    let all = std::mem::take(&mut *NOTICES.lock().unwrap_or_else(PoisonError::into_inner));
    for (words, files) in all {
        let (kind, words) = words
            .strip_prefix(WARNING_PREFIX)
            .map_or(("", words.as_str()), |words| (WARNING_PREFIX, words));
        let of = match files.as_slice() {
            [first, others @ ..] if !others.is_empty() => format!("{first} and {} more: ", others.len()),
            [only] if !only.is_empty() => format!("{only}: "),
            _ => String::new(),
        };
        print_message(&format!("{kind}{of}{words}"));
    }
}

/// Flushes standard output after a write, whose result is `written`. A pipe closed by its reader is not an error, but
/// is remembered.
///
/// # Errors
/// Same as [`print`].
pub fn check_written(written: io::Result<()>) -> Result<(), CliError> {
    match written.and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => {
            OUTPUT_CLOSED.store(true, Ordering::Relaxed);
            Ok(())
        }
        Err(error) => Err(CliError::Output(error)),
        Ok(()) => Ok(()),
    }
}

static OUTPUT_CLOSED: AtomicBool = AtomicBool::new(false);

/// True if the reader of standard output has closed the pipe.
pub fn is_pipe_closed() -> bool {
    OUTPUT_CLOSED.load(Ordering::Relaxed)
}

/// Writes a warning, a note or an error to standard error.
pub fn print_message(text: &str) {
    // If standard error is closed too, the message is lost.
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Returns a progress bar on standard error with the rate and the remaining time; it is hidden if standard error is not
/// a terminal.
pub fn progress_bar(total: usize, what: &str) -> ProgressBar {
    let bar = ProgressBar::new(total as u64);
    // With an invalid template, the plain bar is used.
    if let Ok(style) =
        ProgressStyle::with_template(&format!("{{bar:30}} {{pos}}/{{len}} {what}, {{per_sec}}, {{eta}} left"))
    {
        bar.set_style(style);
    }
    bar
}

/// Runs a long computation and shows the elapsed time on standard error. Once the computation reports progress, a bar
/// and the remaining time are also shown. Nothing is shown if standard error is not a terminal.
pub fn run_with_spinner<T>(what: &'static str, work: impl FnOnce() -> T) -> T {
    let bar = ProgressBar::new_spinner().with_message(what);
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}, {elapsed}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    let bar_handle = bar.clone();
    let done = progress::with_watcher(
        move |step| {
            if bar_handle.length() != Some(step.total as u64)
                && let Ok(style) = ProgressStyle::with_template(&format!(
                    "{{bar:30}} {{pos}}/{{len}} {}, {{elapsed}}, {{eta}} left",
                    step.item_name
                ))
            {
                bar_handle.set_style(style);
                bar_handle.set_length(step.total as u64);
            }
            bar_handle.set_position(step.finished as u64);
        },
        work,
    );
    bar.finish_and_clear();
    done
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_wrapped_with_hanging_indents() {
        let page = "- one two three four\nshort\n\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\nend of it all";
        let expected = "- one two\n  three four\nshort\n\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\u{2500}\nend of it\nall";
        assert_eq!(wrapped(page, 12), expected);
        assert_eq!(wrapped("averylongwordthatstays\n", 12), "averylongwordthatstays\n");
        assert_eq!(wrapped("", 12), "");
    }

    #[test]
    fn only_the_verdict_is_coloured() {
        let page = "Verdict: not determined\n- why\nVerdict: doubtful\n";
        assert_eq!(
            coloured(page),
            "\u{1b}[1m\u{1b}[31mVerdict: not determined\u{1b}[0m\n- why\nVerdict: doubtful\n"
        );
        for plain in ["", "Verdict: unknown\n", "\nVerdict: doubtful\n"] {
            assert_eq!(coloured(plain), plain);
        }
    }
}
