//! Responses to the initial states of 1/F, with one record in each lane, and the least-squares estimates of these
//! states.
//!
//! With the impulse responses h of 1/F and g of D/F, a state that enters w k samples after its first value adds
//! `x_k h(t-k)` to w and subtracts `x_k g(t-k)` from the residuals. The columns `g(t-k)` over the residuals are
//! orthogonalised with the Cholesky factor of their products. This is done twice, because a single pass leaves the
//! rounding errors of nearly parallel columns (Y. Yamamoto et al., *Electronic Trans. Numerical Analysis* 44 (2015)
//! 306-326). Since the columns are shifts of one signal, the first matrix takes only nf products. The criterion for
//! single records computes an orthonormal basis by Gram-Schmidt ([`crate::criterion::initial_state_responses`]), with
//! the same result except for rounding; it is used for a lane with linearly dependent columns.

use hoid_lanes::Number;

use super::{
    columns::Columns,
    lane_products::{add_scaled, four_products, two_products},
    signal_buffers::SignalBuffers,
};

/// Number of samples of an impulse response between two tests of whether it has decayed.
const TEST_INTERVAL: usize = 128;
/// A response has decayed if its last values are below this limit; its first value is 1.
const DECAY_LIMIT: f64 = 1e-17;
/// Minimum share of the sum of squares of a column that must be outside the space of the previous columns.
const MIN_INDEPENDENT_SHARE: f64 = 1e-12;

/// The responses h and g are stored in [`SignalBuffers::h`] and [`SignalBuffers::g`], preceded and followed by nf
/// zeros; the orthogonal columns q are stored in [`SignalBuffers::q`].
pub(super) struct InitialStateResponses<R> {
    /// Number of rows of a column, counted from the first residual.
    pub rows: usize,
    nd: usize,
    nf: usize,
    /// Number of samples of the impulse response h.
    length: usize,
    /// Cholesky factors by rows: `first` belongs to the original columns, with each column of the factor divided by its
    /// diagonal element; `second` belongs to q.
    first: Vec<R>,
    second: Vec<R>,
}

impl<R: Number> InitialStateResponses<R> {
    /// Computes the responses for a given number of residuals.
    #[inline(always)]
    pub fn of(
        zero: R,
        [d, f]: [&[f64]; 2],
        residuals: usize,
        signals: &mut SignalBuffers,
        dependent: &mut Vec<bool>,
    ) -> Self {
        let width = zero.lane_count();
        let (nd, nf) = (d.len() / width, f.len() / width);
        let longest = residuals + nd;
        signals.h.allocate((longest + 2 * nf) * width);
        signals.g.allocate((longest + nd + 2 * nf) * width);
        let length = impulse_response(zero, f, longest, &mut signals.h);
        let (from, to) = (nf * width, (nf + length + nd + nf) * width);
        let g = &mut signals.g[..to];
        g[..from].fill(0.0);
        g[from..to].fill(0.0);
        g[from..from + length * width].copy_from_slice(&signals.h[from..from + length * width]);
        for (i, di) in d.chunks_exact(width).enumerate() {
            let at = from + (i + 1) * width;
            add_scaled(zero.load(di), &signals.h[from..from + length * width], &mut g[at..]);
        }
        let mut responses = Self {
            rows: (length + nf - 1).min(residuals),
            nd,
            nf,
            length,
            first: Vec::new(),
            second: Vec::new(),
        };
        dependent.clear();
        dependent.resize(width, false);
        responses.orthogonalise(zero, signals, dependent);
        responses
    }

    #[inline(always)]
    fn orthogonalise(&mut self, zero: R, signals: &mut SignalBuffers, dependent: &mut [bool]) {
        let (width, nf, rows) = (zero.lane_count(), self.nf, self.rows);
        let mut s = vec![zero; nf * nf];
        for j in (0..nf).step_by(2) {
            let last = (j + 1).min(nf - 1);
            let pair = [self.shift(signals, j, width), self.shift(signals, last, width)];
            [s[j * nf], s[last * nf]] = two_products(zero, self.shift(signals, 0, width), pair);
        }
        for k in 1..nf {
            for i in k..nf {
                // For the delayed columns, a row of the previous columns enters at the front and their last row leaves.
                let entering = self.at(zero, signals, k - 1, -1) * self.at(zero, signals, i - 1, -1);
                let last = rows as isize - 1;
                let leaving = self.at(zero, signals, k - 1, last) * self.at(zero, signals, i - 1, last);
                s[i * nf + k] = s[(i - 1) * nf + k - 1] + entering - leaving;
            }
        }
        factor(zero, nf, &mut s, dependent);
        for k in 0..nf {
            let diagonal = s[k * nf + k];
            for i in k..nf {
                s[i * nf + k] = s[i * nf + k] / diagonal;
            }
        }
        self.first = s;

        signals.q.allocate(nf * rows * width);
        for k in 0..nf {
            let from = (nf + self.nd - k) * width;
            let (before, rest) = signals.q.split_at_mut(k * rows * width);
            let column = &mut rest[..rows * width];
            column.copy_from_slice(&signals.g[from..from + rows * width]);
            for (j, q) in before.chunks_exact(rows * width).enumerate() {
                add_scaled(-self.first[k * nf + j], q, column);
            }
        }
        let mut s = vec![zero; nf * nf];
        for k in 0..nf {
            for i in (k..nf).step_by(2) {
                let last = (i + 1).min(nf - 1);
                let pair = [self.column(signals, i, width), self.column(signals, last, width)];
                [s[i * nf + k], s[last * nf + k]] = two_products(zero, self.column(signals, k, width), pair);
            }
        }
        factor(zero, nf, &mut s, dependent);
        self.second = s;
    }

    /// Returns the original column k: g delayed by k samples.
    #[inline(always)]
    fn shift<'r>(&self, signals: &'r SignalBuffers, k: usize, width: usize) -> &'r [f64] {
        let first = self.nf + self.nd - k;
        &signals.g[first * width..(first + self.rows) * width]
    }

    /// Returns an element of the original column k; `row` may be the row before the first.
    #[inline(always)]
    fn at(&self, zero: R, signals: &SignalBuffers, k: usize, row: isize) -> R {
        zero.load(&signals.g[(self.nf + self.nd - k).wrapping_add_signed(row) * zero.lane_count()..])
    }

    /// Returns the orthogonal column k.
    #[inline(always)]
    fn column<'r>(&self, signals: &'r SignalBuffers, k: usize, width: usize) -> &'r [f64] {
        &signals.q[k * self.rows * width..(k + 1) * self.rows * width]
    }

    /// Adds the effect of the least-squares initial states to w (stored in r), v and eps. w starts in row `regressed`
    /// of the span, the residuals start in row `counted`.
    #[inline(always)]
    pub fn eliminate(&self, zero: R, signals: &mut SignalBuffers, regressed: usize, counted: usize) {
        let (width, nf) = (zero.lane_count(), self.nf);
        let (from, to) = (counted * width, (counted + self.rows) * width);
        let eps = &signals.eps[from..to];
        let mut x = Vec::with_capacity(nf);
        for k in (0..nf).step_by(2) {
            let last = (k + 1).min(nf - 1);
            let pair = [self.column(signals, k, width), self.column(signals, last, width)];
            x.extend_from_slice(&two_products(zero, eps, pair)[..=last - k]);
        }
        self.forward_substitute(&mut x);
        for k in (0..nf).rev() {
            for i in k + 1..nf {
                x[k] = x[k] - self.second[i * nf + k] * x[i];
            }
            x[k] = x[k] / self.second[k * nf + k];
        }
        for k in 0..nf {
            let q = &signals.q[k * self.rows * width..(k + 1) * self.rows * width];
            add_scaled(-x[k], q, &mut signals.eps[from..to]);
        }
        // Converts the coefficients of the orthogonal columns to coefficients of the original columns.
        for k in (0..nf).rev() {
            for j in 0..k {
                x[j] = x[j] - self.first[k * nf + j] * x[k];
            }
        }
        let mut minus = Vec::with_capacity(nf);
        for k in 0..nf {
            minus.push(-x[k]);
        }
        let count = (self.length + nf).min(signals.r.len() / width - regressed);
        let (from, to) = (regressed * width, (regressed + count) * width);
        add_shifts(zero, &x, &signals.h, nf, &mut signals.r[from..to]);
        add_shifts(zero, &minus, &signals.h, nf, &mut signals.v[from..to]);
    }

    /// Returns the components of the columns of psi in the space of the responses, one row for each column. The row of
    /// eps, the first column, is zero.
    #[inline(always)]
    pub fn components(&self, zero: R, columns: &Columns, signals: &SignalBuffers, counted: usize) -> Vec<R> {
        let (width, nf, count) = (zero.lane_count(), self.nf, columns.count());
        let mut inside = vec![zero; count * nf];
        let end = counted + self.rows;
        for k in 0..nf {
            let x = self.column(signals, k, width);
            for i in (1..count).step_by(4) {
                let a = columns.rows(signals, i, counted, end, width);
                let b = columns.rows(signals, (i + 1).min(count - 1), counted, end, width);
                let c = columns.rows(signals, (i + 2).min(count - 1), counted, end, width);
                let d = columns.rows(signals, (i + 3).min(count - 1), counted, end, width);
                let sums = four_products(zero, x, [a, b, c, d]);
                for j in i..(i + 4).min(count) {
                    inside[j * nf + k] = sums[j - i];
                }
            }
        }
        for of_column in inside.chunks_exact_mut(nf) {
            self.forward_substitute(of_column);
        }
        inside
    }

    /// Computes `y <- L^-1 y`, where L is the second factor.
    #[inline(always)]
    fn forward_substitute(&self, y: &mut [R]) {
        for k in 0..self.nf {
            for j in 0..k {
                y[k] = y[k] - self.second[k * self.nf + j] * y[j];
            }
            y[k] = y[k] / self.second[k * self.nf + k];
        }
    }
}

/// Replaces the lower triangle of s by its Cholesky factor, and marks the lanes in which there is no such factor.
#[inline(always)]
fn factor<R: Number>(zero: R, nf: usize, s: &mut [R], dependent: &mut [bool]) {
    for k in 0..nf {
        for i in k..nf {
            let mut rest = s[i * nf + k];
            for j in 0..k {
                rest = rest - s[i * nf + j] * s[k * nf + j];
            }
            if i > k {
                s[i * nf + k] = rest / s[k * nf + k];
                continue;
            }
            let square = s[k * nf + k];
            for lane in 0..zero.lane_count() {
                let own = rest.lane(lane);
                let independent = own > MIN_INDEPENDENT_SHARE * square.lane(lane);
                dependent[lane] |= !independent;
                rest.set_lane(lane, own.sqrt());
            }
            s[k * nf + k] = rest;
        }
    }
}

/// Computes `y(t) += sum_k x_k s(t-k)`; row `at` of s belongs to t = 0.
#[inline(always)]
fn add_shifts<R: Number>(zero: R, x: &[R], s: &[f64], at: usize, y: &mut [f64]) {
    let width = zero.lane_count();
    let (from, count) = (at * width, y.len());
    if let [x0, x1] = *x {
        let rows = s[from..from + count]
            .chunks_exact(width)
            .zip(s[from - width..].chunks_exact(width));
        for (y, (s0, s1)) in y.chunks_exact_mut(width).zip(rows) {
            (zero.load(y) + x0 * zero.load(s0) + x1 * zero.load(s1)).store(y);
        }
        return;
    }
    for (k, x) in x.iter().enumerate() {
        let from = from - k * width;
        add_scaled(*x, &s[from..from + count], y);
    }
}

/// Computes the impulse response of 1/F until it has decayed in all lanes or its length is `longest`; the response is
/// preceded and followed by nf zeros. In each lane the response is set to zero after its decay. Returns the length of
/// the response.
#[inline(always)]
fn impulse_response<R: Number>(zero: R, f: &[f64], longest: usize, h: &mut [f64]) -> usize {
    let (width, nf) = (zero.lane_count(), f.len() / zero.lane_count());
    h[..nf * width].fill(0.0);
    let mut impulse = zero.splat(1.0);
    let mut ends = vec![usize::MAX; width];
    let mut rows = nf;
    while rows < nf + longest && ends.contains(&usize::MAX) {
        let to = (rows + TEST_INTERVAL).min(nf + longest);
        for row in rows..to {
            let mut y = impulse;
            impulse = zero;
            for i in (0..nf).rev() {
                y = y - zero.load(&f[i * width..]) * zero.load(&h[(row - 1 - i) * width..]);
            }
            y.store(&mut h[row * width..]);
        }
        rows = to;
        for (lane, end) in ends.iter_mut().enumerate() {
            // All subsequent values depend only on the last nf values.
            let gone = (rows - nf..rows).all(|row| h[row * width + lane].abs() < DECAY_LIMIT);
            if gone {
                *end = rows.min(*end);
            }
        }
    }
    for (lane, end) in ends.iter().enumerate() {
        for row in *end.min(&rows)..rows {
            h[row * width + lane] = 0.0;
        }
    }
    h[rows * width..(rows + nf) * width].fill(0.0);
    rows - nf
}
