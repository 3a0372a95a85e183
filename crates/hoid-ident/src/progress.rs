//! How far a fit is, reported to the caller that waits on the thread that fits.
//!
//! A fit of forms or orders, one after the other, lasts seconds on many or long records. It reports
//! before each which one of how many it is; without anyone who watches that costs nothing.

use std::{
    cell::RefCell,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};

/// Current activity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// The counted items, in the plural.
    pub what: &'static str,
    /// How many are done.
    pub done: usize,
    /// Of how many.
    pub total: usize,
}

type Watcher = Arc<dyn Fn(Step) + Send + Sync>;

thread_local! {
    static WATCHER: RefCell<Option<Watcher>> = const { RefCell::new(None) };
}

/// Does the work and informs the watcher each of its steps on this thread.
pub fn watched<T>(watcher: impl Fn(Step) + Send + Sync + 'static, work: impl FnOnce() -> T) -> T {
    /// Puts back who watched before, whatever happens.
    struct Before(Option<Watcher>);
    impl Drop for Before {
        fn drop(&mut self) {
            WATCHER.set(self.0.take());
        }
    }
    let _before = Before(WATCHER.replace(Some(Arc::new(watcher))));
    work()
}

/// Reports that so many are done.
pub(crate) fn step(what: &'static str, done: usize, total: usize) {
    // Taken out of the cell first: the watcher may fit something itself.
    let watcher = WATCHER.with_borrow(Clone::clone);
    if let Some(watcher) = watcher {
        watcher(Step { what, done, total });
    }
}

/// Counts what is done on many threads for callers that watches this one: each call is one more of
/// `total`.
pub fn counter(what: &'static str, total: usize) -> impl Fn() + Send + Sync {
    let watcher = WATCHER.with_borrow(Clone::clone);
    let done = AtomicUsize::new(0);
    move || {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(watcher) = &watcher {
            watcher(Step { what, done, total });
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[test]
    fn the_innermost_watcher_is_told_and_the_outer_one_comes_back() {
        let told = Arc::new(Mutex::new(Vec::new()));
        let (outer, inner) = (told.clone(), told.clone());
        step("nobody", 0, 1);
        watched(
            move |step| outer.lock().unwrap().push(("outer", step.done)),
            || {
                step("forms", 0, 2);
                watched(
                    move |step| inner.lock().unwrap().push(("inner", step.done)),
                    || {
                        step("orders", 7, 9);
                    },
                );
                step("forms", 1, 2);
            },
        );
        step("nobody", 1, 1);
        assert_eq!(*told.lock().unwrap(), [("outer", 0), ("inner", 7), ("outer", 1)]);
    }

    #[test]
    fn what_other_threads_do_is_counted() {
        let told = Arc::new(Mutex::new(Vec::new()));
        let seen = told.clone();
        watched(
            move |step| seen.lock().unwrap().push(step.done),
            || {
                let one = counter("candidates", 3);
                std::thread::scope(|all| {
                    for _ in 0..3 {
                        all.spawn(&one);
                    }
                });
            },
        );
        let mut all = told.lock().unwrap().clone();
        all.sort_unstable();
        assert_eq!(all, [1, 2, 3]);
    }
}
