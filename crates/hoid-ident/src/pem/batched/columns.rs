//! Products of eps and the columns of psi, for one record in each lane.
//!
//! A column that is the previous column delayed by one sample needs no separate pass: `sum x(t-1) y(t-1)` over a span
//! equals `sum x(t) y(t)` except for the samples at both ends, as in [`crate::linalg::products`].

use hoid_lanes::Number;

use super::{
    lane_products::{four_products, two_products},
    signal_buffers::SignalBuffers,
};

/// Columns for which products are summed: `[eps, x_b(t).., v(t-1).., x_f(t-1)..]`.
pub(super) struct Columns {
    pub nb: usize,
    pub nd: usize,
    pub nf: usize,
}

impl Columns {
    pub fn count(&self) -> usize {
        1 + self.nb + self.nd + self.nf
    }

    /// True if a column is the previous column delayed by one sample.
    fn is_shift_of_previous(&self, column: usize) -> bool {
        column > 1 && column != 1 + self.nb && column != 1 + self.nb + self.nd
    }

    /// Returns the values of a column in these rows of the span.
    #[inline(always)]
    pub fn rows<'r>(
        &self,
        signals: &'r SignalBuffers,
        column: usize,
        from: usize,
        to: usize,
        width: usize,
    ) -> &'r [f64] {
        let (signal, lag) = if column == 0 {
            (&*signals.eps, 0)
        } else if column <= self.nb {
            (&*signals.x_b, column - 1)
        } else if column <= self.nb + self.nd {
            (&*signals.v, column - self.nb)
        } else {
            (&*signals.x_f, column - self.nb - self.nd)
        };
        &signal[(from - lag) * width..(to - lag) * width]
    }

    /// Adds the products over these rows that must be summed: the products with all columns of each column that is not
    /// a shift of the previous column.
    #[inline(always)]
    pub fn add_products<R: Number>(
        &self,
        zero: R,
        signals: &SignalBuffers,
        from: usize,
        to: usize,
        products: &mut [f64],
    ) {
        let (p1, width) = (self.count(), zero.lane_count());
        for i in 0..p1 {
            if self.is_shift_of_previous(i) {
                continue;
            }
            let x = self.rows(signals, i, from, to, width);
            let mut others = [0; 4];
            let mut count = 0;
            for j in 0..p1 {
                // The products with earlier columns that are not shifts are already known.
                if j >= i || self.is_shift_of_previous(j) {
                    others[count] = j;
                    count += 1;
                }
                if count == 4 || (j == p1 - 1 && count > 0) {
                    let mut sums = [zero; 4];
                    if count <= 2 {
                        let last = self.rows(signals, others[count - 1], from, to, width);
                        let pair = [self.rows(signals, others[0], from, to, width), last];
                        [sums[0], sums[1]] = two_products(zero, x, pair);
                    } else {
                        // If there are three columns, the last is multiplied twice.
                        let last = self.rows(signals, others[count - 1], from, to, width);
                        let a = self.rows(signals, others[0], from, to, width);
                        let b = self.rows(signals, others[1], from, to, width);
                        let c = self.rows(signals, others[2], from, to, width);
                        sums = four_products(zero, x, [a, b, c, last]);
                    }
                    for k in 0..count {
                        let at = (i * p1 + others[k]) * width;
                        let place = &mut products[at..at + width];
                        (zero.load(place) + sums[k]).store(place);
                    }
                    count = 0;
                }
            }
        }
    }

    /// Adds `sign` times the products in one row, for pairs of columns that are shifts of their previous columns. The
    /// rows at both ends make up the difference between their products and the products of the previous columns.
    #[inline(always)]
    pub fn add_row<R: Number>(&self, zero: R, signals: &SignalBuffers, row: usize, sign: f64, products: &mut [f64]) {
        let (p1, width) = (self.count(), zero.lane_count());
        for i in 0..p1 {
            for j in 0..=i {
                if self.is_shift_of_previous(i) && self.is_shift_of_previous(j) {
                    let x = zero.load(self.rows(signals, i, row, row + 1, width));
                    let y = zero.load(self.rows(signals, j, row, row + 1, width));
                    let at = (i * p1 + j) * width;
                    let place = &mut products[at..at + width];
                    (zero.load(place) + zero.splat(sign) * (x * y)).store(place);
                }
            }
        }
    }

    /// Completes the matrix of products from the summed products, and projects out the initial states.
    #[inline(always)]
    pub fn complete<R: Number>(&self, zero: R, inside: &[R], nf: usize, products: &mut [f64]) {
        let (p1, width) = (self.count(), zero.lane_count());
        for i in 0..p1 {
            for j in 0..=i {
                let at = (i * p1 + j) * width;
                let value = if self.is_shift_of_previous(i) && self.is_shift_of_previous(j) {
                    zero.load(&products[at..]) + zero.load(&products[((i - 1) * p1 + j - 1) * width..])
                } else if self.is_shift_of_previous(i) || !self.is_shift_of_previous(j) {
                    // The product was computed for the column that is not a shift or, if neither column is a shift, for
                    // the earlier column.
                    zero.load(&products[(j * p1 + i) * width..])
                } else {
                    zero.load(&products[at..])
                };
                value.store(&mut products[at..]);
                value.store(&mut products[(j * p1 + i) * width..]);
            }
        }
        for i in 1..p1 {
            for j in 1..p1 {
                let place = &mut products[(i * p1 + j) * width..(i * p1 + j + 1) * width];
                let mut value = zero.load(place);
                for k in 0..nf {
                    value = value - inside[i * nf + k] * inside[j * nf + k];
                }
                value.store(place);
            }
        }
    }
}
