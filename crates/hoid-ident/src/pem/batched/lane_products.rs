//! Products and sums of two signals with one record in each lane.

use hoid_lanes::Number;

/// Returns `x' y` for four signals y.
#[inline(always)]
pub(super) fn four_products<R: Number>(zero: R, x: &[f64], [a, b, c, d]: [&[f64]; 4]) -> [R; 4] {
    let width = zero.lane_count();
    let mut sums = (zero, zero, zero, zero);
    let others =
        (a.chunks_exact(width).zip(b.chunks_exact(width))).zip(c.chunks_exact(width).zip(d.chunks_exact(width)));
    for (x, ((a, b), (c, d))) in x.chunks_exact(width).zip(others) {
        let x = zero.load(x);
        sums.0 = sums.0 + x * zero.load(a);
        sums.1 = sums.1 + x * zero.load(b);
        sums.2 = sums.2 + x * zero.load(c);
        sums.3 = sums.3 + x * zero.load(d);
    }
    [sums.0, sums.1, sums.2, sums.3]
}

/// Returns `x' y` for two signals y.
#[inline(always)]
pub(super) fn two_products<R: Number>(zero: R, x: &[f64], [a, b]: [&[f64]; 2]) -> [R; 2] {
    let width = zero.lane_count();
    let mut sums = (zero, zero);
    for ((x, a), b) in x
        .chunks_exact(width)
        .zip(a.chunks_exact(width))
        .zip(b.chunks_exact(width))
    {
        let x = zero.load(x);
        sums.0 = sums.0 + x * zero.load(a);
        sums.1 = sums.1 + x * zero.load(b);
    }
    [sums.0, sums.1]
}

/// Computes `y += k x`.
#[inline(always)]
pub(super) fn add_scaled<R: Number>(k: R, x: &[f64], y: &mut [f64]) {
    let width = k.lane_count();
    for (y, x) in y.chunks_exact_mut(width).zip(x.chunks_exact(width)) {
        (k.load(y) + k * k.load(x)).store(y);
    }
}
