//! Cost of a case on a loaded machine.

use std::{
    fs,
    time::{Duration, Instant},
};

/// Processor time of this thread if the system reports it, otherwise elapsed time.
pub struct ProcessorTime {
    on_processor: Option<Duration>,
    by_clock: Instant,
}

impl ProcessorTime {
    pub fn now() -> Self {
        let text = fs::read_to_string("/proc/thread-self/schedstat").ok();
        let nanoseconds = text.and_then(|text| text.split(' ').next()?.parse().ok());
        Self {
            on_processor: nanoseconds.map(Duration::from_nanos),
            by_clock: Instant::now(),
        }
    }

    pub fn elapsed(&self) -> Duration {
        match (self.on_processor, Self::now().on_processor) {
            (Some(then), Some(now)) => now.saturating_sub(then),
            _ => self.by_clock.elapsed(),
        }
    }
}
