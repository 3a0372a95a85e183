//! Sums of products of many columns, with one pass over each column.
//!
//! A normal matrix contains the product of each pair of columns. Multiplying one column by four others at a time reads
//! five numbers for four products, whereas single products read eight. A column that is the previous column delayed by
//! one sample needs no pass: `sum x(t-1) y(t-1)` over a span equals `sum x(t) y(t)` except for the samples at both
//! ends.
//!
//! Each product is accumulated in a fixed number of partial sums in a fixed order, in registers that are chosen at run
//! time ([`hoid_lanes::with_four_lanes`]). The result is bitwise independent of the type of registers, of other sums
//! computed at the same time, and of the stretches in which the record is read.

use std::ops::Range;

use hoid_lanes::{FourLaneTask, FourLanes, with_four_lanes};

use crate::linalg::vectors::add_scaled;

/// Number of samples that are read at a time, such that the samples of all columns remain in the first-level cache. It
/// is a multiple of eight, the largest number of partial sums of a product. The last digits of sums over residuals
/// depend on it, since these sums are completed after each stretch.
const STRETCH_LENGTH: usize = 512;

/// Products of one column with four, two or one other columns.
#[derive(Debug, Clone, Copy)]
struct Tile<F> {
    x: usize,
    ys: [usize; 4],
    count: usize,
    /// Four partial sums for each product. If the tile has a single product, the first two elements contain its eight
    /// partial sums.
    sums: [F; 4],
}

impl<F: FourLanes> Tile<F> {
    /// Creates tiles for the products of column x with each of the columns ys; their sums are zero.
    fn add_tiles(x: usize, mut ys: &[usize], zero: F, tiles: &mut Vec<Self>) {
        while !ys.is_empty() {
            let count = match ys.len() {
                1 => 1,
                2 | 3 => 2,
                _ => 4,
            };
            let (now, later) = ys.split_at(count);
            let mut tile = Self {
                x,
                ys: [x; 4],
                count,
                sums: [zero; 4],
            };
            tile.ys[..count].copy_from_slice(now);
            tiles.push(tile);
            ys = later;
        }
    }

    /// Adds the products over the whole blocks of four or eight samples in a stretch. The sums are separate variables,
    /// because the elements of an array would be kept in memory.
    #[inline(always)]
    fn add<'a>(&mut self, column: impl Fn(usize) -> &'a [f64]) {
        let x = column(self.x);
        let [a, b, c, d] = self.ys;
        let [mut s0, mut s1, mut s2, mut s3] = self.sums;
        let kind = s0;
        match self.count {
            4 => {
                let blocks = chunks_of_four(x)
                    .iter()
                    .zip(chunks_of_four(column(a)))
                    .zip(chunks_of_four(column(b)));
                for ((((x, a), b), c), d) in blocks.zip(chunks_of_four(column(c))).zip(chunks_of_four(column(d))) {
                    let x = kind.load(x);
                    s0 = s0 + x * kind.load(a);
                    s1 = s1 + x * kind.load(b);
                    s2 = s2 + x * kind.load(c);
                    s3 = s3 + x * kind.load(d);
                }
            }
            2 => {
                for ((x, a), b) in chunks_of_four(x)
                    .iter()
                    .zip(chunks_of_four(column(a)))
                    .zip(chunks_of_four(column(b)))
                {
                    let x = kind.load(x);
                    s0 = s0 + x * kind.load(a);
                    s1 = s1 + x * kind.load(b);
                }
            }
            _ => {
                for ([x, later_x], [a, later_a]) in chunks_of_eight(x).iter().zip(chunks_of_eight(column(a))) {
                    s0 = s0 + kind.load(x) * kind.load(a);
                    s1 = s1 + kind.load(later_x) * kind.load(later_a);
                }
            }
        }
        self.sums = [s0, s1, s2, s3];
    }

    /// Returns the product of column x with the k-th of the columns ys over the whole record: the partial sums, plus
    /// the samples after the last whole block.
    #[inline(always)]
    fn total<'a>(&self, k: usize, column: impl Fn(usize) -> &'a [f64]) -> f64 {
        let (x, y) = (column(self.x), column(self.ys[k]));
        let (sums, block) = match self.count {
            1 => (self.sums[0] + self.sums[1], 8),
            _ => (self.sums[k], 4),
        };
        let from = x.len() - x.len() % block;
        let rest: f64 = x[from..].iter().zip(&y[from..]).map(|(x, y)| x * y).sum();
        sum_in_order(sums) + rest
    }
}

/// Adds the partial sums in a fixed order.
#[inline(always)]
fn sum_in_order<F: FourLanes>(sums: F) -> f64 {
    let s = sums.to_array();
    (s[0] + s[2]) + (s[1] + s[3])
}

#[inline(always)]
fn chunks_of_four(x: &[f64]) -> &[[f64; 4]] {
    x.as_chunks().0
}

#[inline(always)]
fn chunks_of_eight(x: &[f64]) -> &[[[f64; 4]; 2]] {
    chunks_of_four(x).as_chunks().0
}

/// Returns the ranges of samples of the stretches into which n samples are divided.
fn stretches(n: usize) -> impl Iterator<Item = Range<usize>> {
    (0..n)
        .step_by(STRETCH_LENGTH)
        .map(move |from| from..n.min(from + STRETCH_LENGTH))
}

/// Returns the sum of all elements of x.
#[inline(always)]
fn sum<F: FourLanes>(x: &[f64], zero: F) -> f64 {
    let (mut s0, mut s1) = (zero, zero);
    for [a, b] in chunks_of_eight(x) {
        s0 = s0 + zero.load(a);
        s1 = s1 + zero.load(b);
    }
    let tail = &x[x.len() - x.len() % 8..];
    let sums = [s0.to_array(), s1.to_array()];
    sums.as_flattened().iter().chain(tail).sum()
}

/// Returns the sum of the squared distances of the elements of x from the mean.
#[inline(always)]
fn sum_of_squares<F: FourLanes>(x: &[f64], mean: f64, zero: F) -> f64 {
    let (mut s0, mut s1) = (zero, zero);
    let means = zero.splat(mean);
    for [a, b] in chunks_of_eight(x) {
        let (a, b) = (zero.load(a) - means, zero.load(b) - means);
        s0 = s0 + a * a;
        s1 = s1 + b * b;
    }
    let tail = &x[x.len() - x.len() % 8..];
    let sums = [s0.to_array(), s1.to_array()];
    sums.as_flattened().iter().sum::<f64>() + tail.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>()
}

/// Returns the variance of several spans about their common mean.
pub(crate) fn variance(spans: &[&[f64]]) -> f64 {
    with_four_lanes(Variance(spans))
}

struct Variance<'c, 'a>(&'c [&'a [f64]]);

impl FourLaneTask for Variance<'_, '_> {
    type Output = f64;

    #[inline(always)]
    fn run<F: FourLanes>(self, zero: F) -> f64 {
        let Self(spans) = self;
        let n = spans.iter().map(|x| x.len()).sum::<usize>() as f64;
        let (mut total, mut squared) = (0.0, 0.0);
        for x in spans {
            total += sum(x, zero);
        }
        for x in spans {
            squared += sum_of_squares(x, total / n, zero);
        }
        squared / n
    }
}

/// A column of a regression, with a mark if it is a shift of the previous column.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LaggedColumn<'a> {
    pub values: &'a [f64],
    /// True if the column is the previous column delayed by one sample.
    pub is_shift_of_previous: bool,
}

/// Returns the symmetric matrix of the products of all columns, by rows.
///
/// A column that is not a shift of the previous column is multiplied by all columns. In each remaining pair both
/// columns are shifts, so their product follows from the product of the two columns before them.
pub(crate) fn gram(columns: &[LaggedColumn<'_>]) -> Vec<f64> {
    with_four_lanes(Gram(columns))
}

struct Gram<'c, 'a>(&'c [LaggedColumn<'a>]);

impl FourLaneTask for Gram<'_, '_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn run<F: FourLanes>(self, zero: F) -> Vec<f64> {
        let Self(columns) = self;
        let p = columns.len();
        let (mut tiles, mut others) = (Vec::with_capacity(p), Vec::with_capacity(p));
        for (i, _) in columns
            .iter()
            .enumerate()
            .filter(|(_, column)| !column.is_shift_of_previous)
        {
            others.clear();
            // The products with earlier columns that are not shifts are already known.
            others.extend((0..p).filter(|j| *j >= i || columns[*j].is_shift_of_previous));
            Tile::add_tiles(i, &others, zero, &mut tiles);
        }
        match columns {
            &[u, u1, u2, e, e1] if [u, u1, u2, e, e1].map(|c| c.is_shift_of_previous) == COMMON_SHIFTS => {
                add_common_products(&mut tiles, [u, u1, u2, e, e1].map(|c| c.values));
            }
            _ => {
                for stretch in stretches(columns.first().map_or(0, |column| column.values.len())) {
                    for tile in &mut tiles {
                        tile.add(|j| &columns[j].values[stretch.clone()]);
                    }
                }
            }
        }
        let mut gram = vec![0.0; p * p];
        for tile in &tiles {
            for (k, &j) in tile.ys[..tile.count].iter().enumerate() {
                let product = tile.total(k, |j| columns[j].values);
                (gram[tile.x * p + j], gram[j * p + tile.x]) = (product, product);
            }
        }
        for i in 0..p {
            for j in (0..=i).filter(|j| columns[i].is_shift_of_previous && columns[*j].is_shift_of_previous) {
                let product = gram[(i - 1) * p + j - 1] + end_difference(columns, i, j);
                (gram[i * p + j], gram[j * p + i]) = (product, product);
            }
        }
        gram
    }
}

/// Returns the product of columns i and j minus the product of columns i - 1 and j - 1, if i and j are shifts.
fn end_difference(columns: &[LaggedColumn<'_>], i: usize, j: usize) -> f64 {
    let (x, y) = (columns[i - 1].values, columns[j - 1].values);
    let last = x.len() - 1;
    columns[i].values[0] * columns[j].values[0] - x[last] * y[last]
}

/// Marks of the columns that are shifts, in the most frequent regression: an output with two lags, and an input with
/// one.
const COMMON_SHIFTS: [bool; 5] = [false, true, true, false, true];

/// Adds the products of the regression [`COMMON_SHIFTS`] in one pass, which reads five numbers for nine products;
/// separate tiles would read twelve.
#[inline(always)]
fn add_common_products<F: FourLanes>(tiles: &mut [Tile<F>], columns: [&[f64]; 5]) {
    // The tiles are u with the first four columns, u with the last column, and e with the last four columns.
    let [by_u, by_u_alone, by_e] = tiles else { return };
    let [mut uu, mut uu1, mut uu2, mut ue] = by_u.sums;
    let [mut ue1, mut ue1_later, ..] = by_u_alone.sums;
    let [mut eu1, mut eu2, mut ee, mut ee1] = by_e.sums;
    let kind = uu;
    let [u, u1, u2, e, e1] = columns;
    let whole = u.len() - u.len() % 8;
    let blocks = chunks_of_four(&u[..whole])
        .iter()
        .zip(chunks_of_four(u1))
        .zip(chunks_of_four(u2));
    for ((((u, u1), u2), e), e1) in blocks.zip(chunks_of_four(e)).zip(chunks_of_four(e1)) {
        let (u, e) = (kind.load(u), kind.load(e));
        uu = uu + u * u;
        ue = ue + u * e;
        ee = ee + e * e;
        let u1 = kind.load(u1);
        uu1 = uu1 + u * u1;
        eu1 = eu1 + e * u1;
        let u2 = kind.load(u2);
        uu2 = uu2 + u * u2;
        eu2 = eu2 + e * u2;
        let e1 = kind.load(e1);
        ee1 = ee1 + e * e1;
        // The product of a single pair has eight partial sums, which are used alternately: with two blocks per step the
        // sums would not fit in sixteen registers.
        (ue1, ue1_later) = (ue1_later, ue1 + u * e1);
    }
    by_u.sums = [uu, uu1, uu2, ue];
    (by_u_alone.sums[0], by_u_alone.sums[1]) = (ue1, ue1_later);
    by_e.sums = [eu1, eu2, ee, ee1];
    for tile in [by_u, by_u_alone, by_e] {
        tile.add(|j| &columns[j][whole..]);
    }
}

/// Sum of squares of the residuals of a regression, and the products of the residuals with the columns.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ResidualProducts {
    pub squares: f64,
    pub products: Vec<f64>,
}

impl ResidualProducts {
    /// Creates zero sums for the products with p columns.
    pub fn new(p: usize) -> Self {
        Self {
            squares: 0.0,
            products: vec![0.0; p],
        }
    }

    /// Adds the sums for the residuals `y - sum_k factors_k x_k`; only one stretch of the residuals is in memory at a
    /// time. The first column is y.
    pub fn add(&mut self, columns: &[LaggedColumn<'_>], factors: &[f64]) {
        with_four_lanes(Residuals {
            columns,
            factors,
            products: self,
        });
    }
}

struct Residuals<'c, 'a> {
    columns: &'c [LaggedColumn<'a>],
    factors: &'c [f64],
    products: &'c mut ResidualProducts,
}

impl FourLaneTask for Residuals<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<F: FourLanes>(self, zero: F) {
        let Self {
            columns,
            factors,
            products: of,
        } = self;
        let inputs: Vec<usize> = (1..columns.len()).collect();
        // In the tiles for the residual, the residual replaces y.
        let mut tiles = Vec::with_capacity(columns.len());
        Tile::add_tiles(0, &[0], zero, &mut tiles);
        Tile::add_tiles(0, &inputs, zero, &mut tiles);
        let mut residual = [0.0; STRETCH_LENGTH];
        for stretch in stretches(columns[0].values.len()) {
            let measured = |j: usize| &columns[j].values[stretch.clone()];
            if let (STRETCH_LENGTH, &[a, b, c, d]) = (stretch.len(), factors) {
                let five = [measured(0), measured(1), measured(2), measured(3), measured(4)];
                let (squares, products) = four_input_products(five, [a, b, c, d], zero);
                of.squares += squares;
                add_scaled(&mut of.products, 1.0, &products);
                continue;
            }
            let r = &mut residual[..stretch.len()];
            r.copy_from_slice(measured(0));
            subtract(r, factors, |k| measured(k + 1));
            let column = |j: usize| if j == 0 { &*r } else { measured(j) };
            for tile in &mut tiles {
                tile.sums = [zero; 4];
                tile.add(column);
                for (k, &j) in tile.ys[..tile.count].iter().enumerate() {
                    let product = tile.total(k, column);
                    match j {
                        0 => of.squares += product,
                        _ => of.products[j - 1] += product,
                    }
                }
            }
        }
    }
}

/// Returns the sum of squares of the residuals and their products with four columns over a whole stretch; all sums are
/// kept in registers.
#[inline(always)]
fn four_input_products<F: FourLanes>(columns: [&[f64]; 5], factors: [f64; 4], zero: F) -> (f64, [f64; 4]) {
    let [y, a, b, c, d] = columns;
    let [ka, kb, kc, kd] = factors;
    let (ka, kb, kc, kd) = (zero.splat(ka), zero.splat(kb), zero.splat(kc), zero.splat(kd));
    let (mut rr, mut rr_later) = (zero, zero);
    let (mut ra, mut rb, mut rc, mut rd) = (zero, zero, zero, zero);
    let blocks = chunks_of_four(y).iter().zip(chunks_of_four(a)).zip(chunks_of_four(b));
    for ((((y, a), b), c), d) in blocks.zip(chunks_of_four(c)).zip(chunks_of_four(d)) {
        let (a, b, c, d) = (zero.load(a), zero.load(b), zero.load(c), zero.load(d));
        let r = zero.load(y) - ((ka * a + kb * b) + (kc * c + kd * d));
        (rr, rr_later) = (rr_later, rr + r * r);
        ra = ra + r * a;
        rb = rb + r * b;
        rc = rc + r * c;
        rd = rd + r * d;
    }
    let products = [sum_in_order(ra), sum_in_order(rb), sum_in_order(rc), sum_in_order(rd)];
    (sum_in_order(rr + rr_later), products)
}

/// Computes `y -= sum_k factors_k x_k`.
#[inline(always)]
fn subtract<'a>(y: &mut [f64], factors: &[f64], x: impl Fn(usize) -> &'a [f64]) {
    let (by_four, alone) = factors.as_chunks::<4>();
    for (i, k) in by_four.iter().enumerate() {
        let inputs = x(4 * i).iter().zip(x(4 * i + 1)).zip(x(4 * i + 2)).zip(x(4 * i + 3));
        for (y, (((a, b), c), d)) in y.iter_mut().zip(inputs) {
            *y -= (k[0] * a + k[1] * b) + (k[2] * c + k[3] * d);
        }
    }
    for (i, k) in alone.iter().enumerate() {
        add_scaled(y, -k, x(4 * by_four.len() + i));
    }
}

#[cfg(test)]
mod tests;
