//! Start and end of a span in which a signal stays constant. Faults are found in whole blocks; their times are not
//! rounded to blocks.

/// The last span in which a signal stayed constant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ConstantSpan {
    last: f64,
    /// Number of samples that repeat their predecessor, up to the last sample.
    repeats: u64,
    /// Number of samples before the end of the last long span.
    end: u64,
}

hoid_core::state!([] ConstantSpan { last, repeats, end });

impl ConstantSpan {
    /// Takes a sample; `samples` is the number of samples so far. Spans of `long` samples or more are kept.
    pub fn update(&mut self, x: f64, tolerance: f64, samples: u64, long: u64) {
        if (x - self.last).abs() <= tolerance {
            self.repeats = self.repeats.saturating_add(1);
        } else {
            if self.repeats >= long {
                self.end = samples.saturating_sub(1);
            }
            self.repeats = 0;
        }
        self.last = x;
    }

    /// Returns the length of the current span in samples.
    pub fn len(&self) -> u64 {
        self.repeats.saturating_add(1)
    }

    /// Returns the number of samples before the end of the last long span.
    pub fn end(&self) -> u64 {
        self.end
    }
}
