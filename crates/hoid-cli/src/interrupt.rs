//! Interrupts: Ctrl-C, and where the system has them SIGTERM and SIGHUP, which end a command with
//! its files whole. SIGXFSZ (a limit of the size of files) is an error of writing instead of an end.
//!
//! By default output in progress is removed and the program ends with 128 and the number of the
//! signal. A command that can stop, or has something to report at its end, sets its own answer.

use std::sync::{
    Mutex, MutexGuard, PoisonError,
    atomic::{AtomicI32, Ordering},
};

type Handler = Box<dyn FnMut(i32) + Send>;

static HANDLER: Mutex<Option<Handler>> = Mutex::new(None);
/// The last signal, for the exit code of what was stopped by it.
static LAST: AtomicI32 = AtomicI32::new(SIGINT);
const SIGINT: i32 = 2;

/// Ends the program at an interrupt from here on. A program without this is ended by the system,
/// and the next one sweeps what it leaves.
pub fn catch() {
    // Where interrupts cannot be caught the command runs all the same.
    let _ = listen(|signal| {
        LAST.store(signal, Ordering::Relaxed);
        match answer().as_mut() {
            Some(answer) => answer(signal),
            None => end(exit_code()),
        }
    });
}

/// Answers interrupts from here on in another way. It is called on a thread of its own.
pub fn on_interrupt(new: impl FnMut(i32) + Send + 'static) {
    *answer() = Some(Box::new(new));
}

/// Ends the program; output in progress to a file is removed.
pub fn end(code: i32) -> ! {
    hoid::io::remove_unfinished_files();
    std::process::exit(code)
}

/// The exit code after an interrupt, as shells have it.
pub fn exit_code() -> i32 {
    128 + LAST.load(Ordering::Relaxed)
}

fn answer() -> MutexGuard<'static, Option<Handler>> {
    HANDLER.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(unix)]
fn listen(heard: impl Fn(i32) + Send + 'static) -> std::io::Result<()> {
    use signal_hook::{
        consts::{SIGHUP, SIGTERM, SIGXFSZ},
        flag,
        iterator::Signals,
    };
    // A signal with a handler does not end the program: the write reports EFBIG.
    flag::register(SIGXFSZ, std::sync::Arc::default())?;
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    // As `nohup` wants it.
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

/// Whether the program was started with a signal ignored, where Linux reports it; elsewhere a signal
/// is taken for one that is not.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
