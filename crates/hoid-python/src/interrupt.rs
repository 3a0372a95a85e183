//! Long work that an interrupt can end.
//!
//! It runs in a thread of its own, while this one asks the interpreter for signals.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
        mpsc::{RecvTimeoutError, channel},
    },
    time::Duration,
};

use hoid_ident::progress;
use pyo3::prelude::*;

use crate::errors::{Failure, Outcome, bad_option};

/// Time between two checks for signals.
const LOOK: Duration = Duration::from_millis(50);

/// Common parts of the work and the waiting thread.
#[derive(Debug, Default)]
pub struct RunStatus {
    stopped: AtomicBool,
    done: AtomicU64,
    total: AtomicU64,
}

impl RunStatus {
    /// False once the work has to stop.
    pub fn goes_on(&self) -> bool {
        !self.stopped.load(Ordering::Relaxed)
    }

    /// One more is done.
    pub fn inc(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }

    /// Completed share of the work.
    pub fn set(&self, done: u64, total: u64) {
        self.total.store(total, Ordering::Relaxed);
        self.done.store(done, Ordering::Relaxed);
    }
}

/// Does work that reports how far it is, and informs the waiting thread.
pub fn told<T>(status: &Arc<RunStatus>, work: impl FnOnce() -> T) -> T {
    let status = Arc::clone(status);
    progress::watched(move |step| status.set(step.done as u64, step.total as u64), work)
}

/// Runs the work without the interpreter and returns its result.
///
/// `progress` is called with the work done and the whole work. An interrupt asks the work to stop.
/// `patient` work listens and is waited for, so that files are complete; other work is left to end
/// in its thread.
pub fn run<T: Send + 'static, E: Send + 'static + Into<Failure>>(
    py: Python<'_>,
    total: u64,
    progress: Option<&Bound<'_, PyAny>>,
    patient: bool,
    work: impl FnOnce(&Arc<RunStatus>) -> Result<T, E> + Send + 'static,
) -> Outcome<T> {
    let status = Arc::new(RunStatus::default());
    status.set(0, total);
    let (send, receive) = channel();
    let shared = Arc::clone(&status);
    let thread = std::thread::Builder::new().name("hoid".to_owned());
    thread
        .spawn(move || {
            // After an interrupt no one listens any more.
            let _ = send.send(work(&shared));
        })
        .map_err(|error| bad_option(format!("the system cannot start a thread: {error}")))?;
    let mut told = u64::MAX;
    let mut tell = || -> PyResult<()> {
        let done = status.done.load(Ordering::Relaxed);
        if let Some(progress) = progress.filter(|_| done != told) {
            progress.call1((done, status.total.load(Ordering::Relaxed)))?;
            told = done;
        }
        py.check_signals()
    };
    // mpsc::Receiver is not Sync; it is moved into the wait and back.
    let mut receive = receive;
    let mut interrupted: Option<PyErr> = None;
    loop {
        let (outcome, back) = py.detach(move || (receive.recv_timeout(LOOK), receive));
        receive = back;
        match outcome {
            Ok(result) => {
                if let Some(error) = interrupted {
                    return Err(error.into());
                }
                let result = result.map_err(Into::into)?;
                tell()?;
                return Ok(result);
            }
            Err(RecvTimeoutError::Timeout) => {
                if interrupted.is_none()
                    && let Err(error) = tell()
                {
                    status.stopped.store(true, Ordering::Relaxed);
                    if !patient {
                        return Err(error.into());
                    }
                    interrupted = Some(error);
                }
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(bad_option(
                    "the work ended without a result; this is an error in hoid, please report it",
                ));
            }
        }
    }
}
