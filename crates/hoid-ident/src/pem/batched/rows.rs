//! Rows of values, with one value per lane, aligned to cache lines.

use std::ops::{Deref, DerefMut};

/// Size of a cache line in bytes.
const CACHE_LINE_BYTES: usize = 64;

/// Memory with one row per sample. It is aligned, because a row that crosses a cache line takes two reads.
#[derive(Debug, Default)]
pub(super) struct Rows {
    storage: Vec<f64>,
    first: usize,
    count: usize,
}

impl Rows {
    /// Allocates `count` values without initialising them.
    pub fn allocate(&mut self, count: usize) {
        let spare = CACHE_LINE_BYTES / size_of::<f64>();
        if self.storage.len() < count + spare {
            self.storage.resize(count + spare, 0.0);
        }
        self.first = self.storage.as_ptr().align_offset(CACHE_LINE_BYTES).min(spare);
        self.count = count;
    }
}

impl Deref for Rows {
    type Target = [f64];

    #[inline(always)]
    fn deref(&self) -> &[f64] {
        &self.storage[self.first..self.first + self.count]
    }
}

impl DerefMut for Rows {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.storage[self.first..self.first + self.count]
    }
}
