//! Long computations that can be interrupted.
//!
//! The computation runs in a separate thread, while the calling thread checks the interpreter for signals.

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
const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);

/// State shared by the computation and the waiting thread.
#[derive(Debug, Default)]
pub struct RunStatus {
    stopped: AtomicBool,
    done: AtomicU64,
    total: AtomicU64,
}

impl RunStatus {
    /// False if the computation must stop.
    pub fn should_continue(&self) -> bool {
        !self.stopped.load(Ordering::Relaxed)
    }

    /// Increments the number of completed units.
    pub fn increment(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }

    /// Sets the completed and the total number of units.
    pub fn set(&self, done: u64, total: u64) {
        self.total.store(total, Ordering::Relaxed);
        self.done.store(done, Ordering::Relaxed);
    }
}

/// Runs a computation that reports its progress to the waiting thread.
pub fn with_progress<T>(status: &Arc<RunStatus>, work: impl FnOnce() -> T) -> T {
    let status = Arc::clone(status);
    progress::with_watcher(move |step| status.set(step.finished as u64, step.total as u64), work)
}

/// Runs a computation without the interpreter lock and returns its result.
///
/// `progress` is called with the completed and the total number of units. An interrupt asks the computation to stop. If
/// `patient` is set, the computation must react to this request, and `run` waits for it, so that its files are
/// complete; otherwise the computation is left to end in its own thread.
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
            // After an interrupt the receiver may no longer exist.
            let _ = send.send(work(&shared));
        })
        .map_err(|error| bad_option(format!("the system cannot start a thread: {error}")))?;
    let mut reported = u64::MAX;
    let mut report = || -> PyResult<()> {
        let done = status.done.load(Ordering::Relaxed);
        if let Some(progress) = progress.filter(|_| done != reported) {
            progress.call1((done, status.total.load(Ordering::Relaxed)))?;
            reported = done;
        }
        py.check_signals()
    };
    // mpsc::Receiver is not Sync, so it is moved into the closure that waits, which returns it.
    let mut receive = receive;
    let mut interrupted: Option<PyErr> = None;
    loop {
        let (outcome, back) = py.detach(move || (receive.recv_timeout(SIGNAL_INTERVAL), receive));
        receive = back;
        match outcome {
            Ok(result) => {
                if let Some(error) = interrupted {
                    return Err(error.into());
                }
                let result = result.map_err(Into::into)?;
                report()?;
                return Ok(result);
            }
            Err(RecvTimeoutError::Timeout) => {
                if interrupted.is_none()
                    && let Err(error) = report()
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
                    "the computation ended without a result because of an error in hoid; please report it",
                ));
            }
        }
    }
}
