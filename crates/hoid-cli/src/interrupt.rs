//! Interrupts: Ctrl-C and, where the system has them, SIGTERM and SIGHUP end a command without leaving truncated files.
//! SIGXFSZ (the limit on file size) becomes a write error.
//!
//! By default, files in progress are removed, and the program ends with 128 plus the number of the signal. A command
//! that can be stopped, or that prints a report at its end, sets its own handler.

use std::sync::{
    Mutex, MutexGuard, PoisonError,
    atomic::{AtomicI32, Ordering},
};

type Handler = Box<dyn FnMut(i32) + Send>;

static HANDLER: Mutex<Option<Handler>> = Mutex::new(None);
/// The last signal, for the exit code of the interrupted command.
static LAST_SIGNAL: AtomicI32 = AtomicI32::new(SIGINT);
const SIGINT: i32 = 2;

/// From this call on, an interrupt removes partial output before it ends the program. Without this call the system ends
/// the program, and the next run removes the partial output.
pub fn catch() {
    // If interrupts cannot be caught, the command runs without this handling.
    let _ = listen(|signal| {
        LAST_SIGNAL.store(signal, Ordering::Relaxed);
        match handler().as_mut() {
            Some(answer) => answer(signal),
            None => exit(exit_code()),
        }
    });
}

/// Replaces the default handling of interrupts by a function, which is called on a separate thread.
pub fn on_interrupt(new: impl FnMut(i32) + Send + 'static) {
    *handler() = Some(Box::new(new));
}

/// Ends the program and removes files that are still being written.
pub fn exit(code: i32) -> ! {
    hoid::io::remove_unfinished_files();
    std::process::exit(code)
}

/// Returns the exit code after an interrupt, by the convention of shells.
pub fn exit_code() -> i32 {
    128 + LAST_SIGNAL.load(Ordering::Relaxed)
}

fn handler() -> MutexGuard<'static, Option<Handler>> {
    HANDLER.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(unix)]
fn listen(heard: impl Fn(i32) + Send + 'static) -> std::io::Result<()> {
    use signal_hook::{
        consts::{SIGHUP, SIGTERM, SIGXFSZ},
        flag,
        iterator::Signals,
    };
    // With a handler, the signal does not end the program: the write returns EFBIG.
    flag::register(SIGXFSZ, std::sync::Arc::default())?;
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    // `nohup` requires that an ignored SIGHUP stays ignored.
    if !is_ignored(SIGHUP) {
        signals.add_signal(SIGHUP)?;
    }
    std::thread::Builder::new()
        .name("interrupts".to_owned())
        .spawn(move || signals.forever().for_each(heard))?;
    Ok(())
}

#[cfg(not(unix))]
fn listen(heard: impl Fn(i32) + Send + 'static) -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(move || heard(SIGINT))
}

/// True if Linux reports that the signal was ignored when the program started; false on other systems.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
