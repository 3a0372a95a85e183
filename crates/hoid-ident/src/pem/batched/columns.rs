//! Products of eps and the columns of psi, for one record in each lane.
//!
//! A column that is the previous one delayed by one sample needs no separate pass: `sum x(t-1) y(t-1)` over a span is
//! `sum x(t) y(t)` except for the samples at both ends, as in [`crate::linalg::products`].

use hoid_lanes::Number;

use super::{
    lane_products::{four_products, two_products},
    signal_buffers::SignalBuffers,
};

/// The columns whose products are summed: `[eps, x_b(t).., v(t-1).., x_f(t-1)..]`.
pub(super) struct Columns {
    pub nb: usize,
    pub nd: usize,
    pub nf: usize,
}

impl Columns {
    pub fn count(&self) -> usize {
        1 + self.nb + self.nd + self.nf
    }

    /// True for a column that is the previous one delayed by one sample.
    fn follows(&self, column: usize) -> bool {
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

    /// Adds the products over these rows for which a pass is necessary: those of a column that does not follow another
    /// with all others.
    #[inline(always)]
    pub fn add_products<R: Number>(
        &self,
        zero: R,
        signals: &SignalBuffers,
        from: usize,
        to: usize,
        products: &mut [f64],
    ) {
        let (p1, width) = (self.count(), zero.lanes());
        for i in 0..p1 {
            if self.follows(i) {
                continue;
            }
            let x = self.rows(signals, i, from, to, width);
            let mut others = [0; 4];
            let mut count = 0;
            for j in 0..p1 {
                // Previous leading columns have been multiplied with it already.
                if j >= i || self.follows(j) {
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
                        // Three: the last is multiplied twice.
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

    /// Adds the products of the columns that both follow others: those of the previous columns over the same rows, plus
    /// `sign` times their products in one more row.
    #[inline(always)]
    pub fn add_row<R: Number>(&self, zero: R, signals: &SignalBuffers, row: usize, sign: f64, products: &mut [f64]) {
        let (p1, width) = (self.count(), zero.lanes());
        for i in 0..p1 {
            for j in 0..=i {
                if self.follows(i) && self.follows(j) {
                    let x = zero.load(self.rows(signals, i, row, row + 1, width));
                    let y = zero.load(self.rows(signals, j, row, row + 1, width));
                    let at = (i * p1 + j) * width;
                    let place = &mut products[at..at + width];
                    (zero.load(place) + zero.splat(sign) * (x * y)).store(place);
                }
            }
        }
    }

    /// Computes all products from the summed ones, with the initial states projected out.
    #[inline(always)]
    pub fn complete<R: Number>(&self, zero: R, inside: &[R], nf: usize, products: &mut [f64]) {
        let (p1, width) = (self.count(), zero.lanes());
        for i in 0..p1 {
            for j in 0..=i {
                let at = (i * p1 + j) * width;
                let value = if self.follows(i) && self.follows(j) {
                    zero.load(&products[at..]) + zero.load(&products[((i - 1) * p1 + j - 1) * width..])
                } else if self.follows(i) || !self.follows(j) {
                    // The one that follows none was multiplied with all others, the earlier one of
                    // two such.
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
