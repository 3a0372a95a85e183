//! Stored states of a recursion, which can be restored.

use hoid_core::state::State;

use crate::recursion::Recursion;

/// Largest length of a snapshot that is accepted from saved numbers.
const MAX_SNAPSHOT_LEN: usize = 1 << 20;

/// The numbers that are the state of a recursion. Their memory grows to the size of the largest snapshot and is then
/// reused.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Snapshot {
    numbers: Vec<f64>,
}

impl State for Snapshot {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let mut length = self.numbers.len();
        length.visit(each);
        self.numbers.resize(length.min(MAX_SNAPSHOT_LEN), 0.0);
        self.numbers.as_mut_slice().visit(each);
    }
}

impl Snapshot {
    /// Stores the state of a recursion.
    pub fn take(&mut self, recursion: &mut dyn Recursion) {
        self.numbers.clear();
        recursion.visit(&mut |number| self.numbers.push(*number));
    }

    /// Restores the stored state in a recursion; returns false if none is stored.
    pub fn restore(&self, recursion: &mut dyn Recursion) -> bool {
        let mut kept = self.numbers.iter();
        recursion.visit(&mut |number| {
            if let Some(value) = kept.next() {
                *number = *value;
            }
        });
        !self.numbers.is_empty()
    }
}
