//! Normal equations for a small number of columns, summed row by row.

use std::ops::Range;

use super::vectors::add_scaled;

/// The sum `sum x x'` over rows x; only its lower triangle is stored.
pub(crate) struct Gram {
    size: usize,
    sums: Vec<f64>,
}

impl Gram {
    /// Creates an empty sum for this number of columns.
    pub fn new(size: usize) -> Self {
        Self {
            size,
            sums: vec![0.0; size * size],
        }
    }

    /// Adds a row, given by a function that returns its elements.
    pub fn add(&mut self, row: impl Fn(usize) -> f64) {
        for (i, sums) in self.sums.chunks_exact_mut(self.size).enumerate() {
            let x = row(i);
            for (j, sum) in sums.iter_mut().enumerate().take(i + 1) {
                *sum += x * row(j);
            }
        }
    }

    /// Adds the products over many rows, a symmetric matrix by rows.
    pub fn add_all(&mut self, products: &[f64]) {
        add_scaled(&mut self.sums, 1.0, products);
    }

    /// Returns the sum of the products of two columns.
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.sums[i.max(j) * self.size + i.min(j)]
    }

    /// Returns the products of some columns with each other, by rows, and their products with the column `with`.
    pub fn system(&self, columns: Range<usize>, with: usize) -> (Vec<f64>, Vec<f64>) {
        let pairs = columns.clone().flat_map(|i| columns.clone().map(move |j| (i, j)));
        let matrix = pairs.map(|(i, j)| self.at(i, j)).collect();
        (matrix, columns.map(|i| self.at(i, with)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gram_products_match_hand_calculation() {
        let mut gram = Gram::new(3);
        for row in [[1.0, 2.0, -1.0], [0.5, 0.0, 4.0]] {
            gram.add(|i| row[i]);
        }
        assert_eq!((gram.at(0, 2), gram.at(2, 0), gram.at(2, 2)), (1.0, 1.0, 17.0));
        assert_eq!(gram.system(1..3, 0), (vec![4.0, -2.0, -2.0, 17.0], vec![2.0, 1.0]));
        assert_eq!(gram.system(0..0, 1), (vec![], vec![]));
    }
}
