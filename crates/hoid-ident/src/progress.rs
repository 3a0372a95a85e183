//! Progress of a fit, reported to a caller that waits for the fit.
//!
//! A fit of several forms or orders takes seconds if the records are long or numerous. The fit reports the number of
//! finished items; without a watcher the reports cost practically no time.

use std::{
    cell::RefCell,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};

/// One progress report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// Name of the counted items, in the plural.
    pub item_name: &'static str,
    /// Number of finished items.
    pub finished: usize,
    /// Total number of items.
    pub total: usize,
}

type Watcher = Arc<dyn Fn(Step) + Send + Sync>;

thread_local! {
    static WATCHER: RefCell<Option<Watcher>> = const { RefCell::new(None) };
}

/// Runs `work`, passes every progress report of this thread to the watcher, and returns the result of `work`.
pub fn with_watcher<T>(watcher: impl Fn(Step) + Send + Sync + 'static, work: impl FnOnce() -> T) -> T {
    /// Restores the previous watcher when dropped, also after a panic.
    struct PreviousWatcher(Option<Watcher>);
    impl Drop for PreviousWatcher {
        fn drop(&mut self) {
            WATCHER.set(self.0.take());
        }
    }
    let _before = PreviousWatcher(WATCHER.replace(Some(Arc::new(watcher))));
    work()
}

/// Reports the number of finished items to the watcher of this thread.
pub(crate) fn report_step(what: &'static str, done: usize, total: usize) {
    // The watcher is cloned out of the cell first, because it may itself run a fit.
    let watcher = WATCHER.with_borrow(Clone::clone);
    if let Some(watcher) = watcher {
        watcher(Step {
            item_name: what,
            finished: done,
            total,
        });
    }
}

/// Returns a function that reports one more of `total` finished items at each call, from any thread, to the watcher of
/// the thread that called `counter`.
pub fn counter(what: &'static str, total: usize) -> impl Fn() + Send + Sync {
    let watcher = WATCHER.with_borrow(Clone::clone);
    let done = AtomicUsize::new(0);
    move || {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(watcher) = &watcher {
            watcher(Step {
                item_name: what,
                finished: done,
                total,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[test]
    fn innermost_watcher_is_notified_and_outer_one_restored() {
        let notified = Arc::new(Mutex::new(Vec::new()));
        let (outer, inner) = (notified.clone(), notified.clone());
        report_step("nobody", 0, 1);
        with_watcher(
            move |step| outer.lock().unwrap().push(("outer", step.finished)),
            || {
                report_step("forms", 0, 2);
                with_watcher(
                    move |step| inner.lock().unwrap().push(("inner", step.finished)),
                    || {
                        report_step("orders", 7, 9);
                    },
                );
                report_step("forms", 1, 2);
            },
        );
        report_step("nobody", 1, 1);
        assert_eq!(*notified.lock().unwrap(), [("outer", 0), ("inner", 7), ("outer", 1)]);
    }

    #[test]
    fn progress_of_other_threads_is_counted() {
        let notified = Arc::new(Mutex::new(Vec::new()));
        let seen = notified.clone();
        with_watcher(
            move |step| seen.lock().unwrap().push(step.finished),
            || {
                let one = counter("candidates", 3);
                std::thread::scope(|all| {
                    for _ in 0..3 {
                        all.spawn(&one);
                    }
                });
            },
        );
        let mut all = notified.lock().unwrap().clone();
        all.sort_unstable();
        assert_eq!(all, [1, 2, 3]);
    }
}
