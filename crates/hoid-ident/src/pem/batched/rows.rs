//! Rows of values, with one value per lane, aligned to cache lines.

use std::ops::{Deref, DerefMut};

/// Size of a cache line in bytes.
const LINE: usize = 64;

/// Memory with one row per sample. It is aligned, because a row that crosses a cache line takes two reads.
#[derive(Debug, Default)]
pub(super) struct Rows {
    all: Vec<f64>,
    begin: usize,
    count: usize,
}

impl Rows {
    /// Allocates `count` values without initialising them.
    pub fn allocate(&mut self, count: usize) {
        let spare = LINE / size_of::<f64>();
        if self.all.len() < count + spare {
            self.all.resize(count + spare, 0.0);
        }
        self.begin = self.all.as_ptr().align_offset(LINE).min(spare);
        self.count = count;
    }
}

impl Deref for Rows {
    type Target = [f64];

    #[inline(always)]
    fn deref(&self) -> &[f64] {
        &self.all[self.begin..self.begin + self.count]
    }
}

impl DerefMut for Rows {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.all[self.begin..self.begin + self.count]
    }
}
