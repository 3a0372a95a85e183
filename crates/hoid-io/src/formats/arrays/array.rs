//! An array of numbers, and the rows and columns of a matrix.

use super::numbers::Numbers;

/// An array of numbers.
#[derive(Debug, Clone)]
pub(crate) struct Array {
    pub(crate) numbers: Numbers,
    /// Length of each dimension. Their product is the number of elements.
    pub(crate) dims: Vec<usize>,
    /// True if the last index varies fastest, as in C; false if the first index varies fastest, as in Fortran and
    /// MATLAB.
    pub(crate) is_row_major: bool,
}

impl Array {
    /// Creates a one-dimensional array of all numbers in file order.
    pub(crate) fn vector(numbers: Numbers) -> Self {
        Self {
            dims: vec![numbers.len()],
            numbers,
            is_row_major: true,
        }
    }

    /// Returns row or column `k` of a matrix.
    pub(super) fn line(&self, k: usize, along_first: bool) -> Numbers {
        let [rows, columns] = *self.dims.as_slice() else {
            return self.numbers.line(0, 1, 0);
        };
        let len = if along_first { rows } else { columns };
        // Elements along the fastest index are adjacent in the file.
        let (first, stride) = match (along_first, self.is_row_major) {
            (true, true) => (k, columns),
            (true, false) => (k.saturating_mul(rows), 1),
            (false, true) => (k.saturating_mul(columns), 1),
            (false, false) => (k, rows),
        };
        self.numbers.line(first, stride, len)
    }
}
