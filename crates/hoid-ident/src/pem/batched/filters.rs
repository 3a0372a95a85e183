//! Filters for the signals of a span, with one record in each lane; the past samples of every signal are stored before
//! the span.

use hoid_lanes::Number;

use super::{lane_products::add_scaled, signal_buffers::SignalBuffers};

/// Computes all signals of a span with a known past in one pass, for two poles and low orders of B and D. The
/// recursions of s and r run in parallel, and values that are not needed later are not stored. The arithmetic
/// operations are the same as in separate passes. Returns false for other orders, without computing anything.
#[inline(always)]
pub(super) fn filter_all<R: Number>(
    zero: R,
    [b, d, f]: [&[f64]; 3],
    data: [&[f64]; 2],
    signals: &mut SignalBuffers,
    at: usize,
) -> bool {
    let width = zero.lane_count();
    if f.len() != 2 * width {
        return false;
    }
    match (b.len() / width, d.len() / width) {
        (2, 0) => filter_all_of_orders::<R, 2, 0>(zero, [b, d, f], data, signals, at),
        (2, 1) => filter_all_of_orders::<R, 2, 1>(zero, [b, d, f], data, signals, at),
        (2, 2) => filter_all_of_orders::<R, 2, 2>(zero, [b, d, f], data, signals, at),
        (3, 0) => filter_all_of_orders::<R, 3, 0>(zero, [b, d, f], data, signals, at),
        (3, 1) => filter_all_of_orders::<R, 3, 1>(zero, [b, d, f], data, signals, at),
        (3, 2) => filter_all_of_orders::<R, 3, 2>(zero, [b, d, f], data, signals, at),
        _ => return false,
    }
    true
}

/// Returns one row, i.e. one sample of all lanes.
#[inline(always)]
fn row<R: Number>(zero: R, rows: &[f64], index: usize) -> R {
    zero.load(&rows[index * zero.lane_count()..])
}

/// Returns one row, or zeros if its index is not below `end`.
#[inline(always)]
fn row_below<R: Number>(zero: R, rows: &[f64], index: usize, end: usize) -> R {
    if index < end { row(zero, rows, index) } else { zero }
}

#[inline(always)]
fn filter_all_of_orders<R: Number, const NB: usize, const ND: usize>(
    zero: R,
    [b, d, f]: [&[f64]; 3],
    [e, u]: [&[f64]; 2],
    signals: &mut SignalBuffers,
    at: usize,
) {
    let (width, end) = (zero.lane_count(), at + e.len());
    let (b0, b1, b2) = (row(zero, b, 0), row(zero, b, 1), row_below(zero, b, 2, NB));
    let (d1, d2) = (row_below(zero, d, 0, ND), row_below(zero, d, 1, ND));
    let (f1, f2) = (row(zero, f, 0), row(zero, f, 1));
    let now = at / width;
    let (mut s1, mut s2) = (row(zero, &signals.s, now - 1), row(zero, &signals.s, now - 2));
    let (mut v1, mut v2) = (row(zero, &signals.v, now - 1), row(zero, &signals.v, now - 2));
    let (mut r1, mut r2) = (row(zero, &signals.r, now - 1), row(zero, &signals.r, now - 2));
    let inputs = e.chunks_exact(width).zip(u.chunks_exact(width));
    let of_v = signals.v[at..end]
        .chunks_exact_mut(width)
        .zip(signals.eps[at..end].chunks_exact_mut(width));
    let of_x = signals.x_b[at..end]
        .chunks_exact_mut(width)
        .zip(signals.x_f[at..end].chunks_exact_mut(width));
    for ((e, u), ((v, eps), (x_b, x_f))) in inputs.zip(of_v.zip(of_x)) {
        let s0 = (zero.load(e) - f2 * s2) - f1 * s1;
        let mut w = b0 * s0 + b1 * s1;
        if NB == 3 {
            w = w + b2 * s2;
        }
        let r0 = (w - f2 * r2) - f1 * r1;
        let v0 = zero.load(u) - w;
        let (mut white, mut by_b, mut by_f) = (v0, s0, r0);
        if ND > 0 {
            (white, by_b, by_f) = (white + d1 * v1, by_b + d1 * s1, by_f + d1 * r1);
        }
        if ND > 1 {
            (white, by_b, by_f) = (white + d2 * v2, by_b + d2 * s2, by_f + d2 * r2);
        }
        v0.store(v);
        white.store(eps);
        by_b.store(x_b);
        by_f.store(x_f);
        (s2, s1, v2, v1, r2, r1) = (s1, s0, v1, v0, r1, r0);
    }
    for (signal, [one, two]) in [(&mut signals.s, [s1, s2]), (&mut signals.r, [r1, r2])] {
        two.store(&mut signal[end - 2 * width..]);
        one.store(&mut signal[end - width..]);
    }
}

/// Computes `s = e/F`, `w = B s` (stored in r) and `v = u - w` from index `at` on.
#[inline(always)]
pub(super) fn compute_response<R: Number>(
    zero: R,
    [b, f]: [&[f64]; 2],
    [e, u]: [&[f64]; 2],
    signals: &mut SignalBuffers,
    at: usize,
) {
    let (width, end) = (zero.lane_count(), at + e.len());
    if (b.len(), f.len()) == (2 * width, 2 * width) {
        // For the orders of the operator, the response is computed in one pass.
        let (b0, b1) = (zero.load(b), zero.load(&b[width..]));
        let (f1, f2) = (zero.load(f), zero.load(&f[width..]));
        let (mut s1, mut s2) = (
            zero.load(&signals.s[at - width..]),
            zero.load(&signals.s[at - 2 * width..]),
        );
        let inputs = e.chunks_exact(width).zip(u.chunks_exact(width));
        let responses = signals.s[at..end]
            .chunks_exact_mut(width)
            .zip(signals.r[at..end].chunks_exact_mut(width));
        for (((e, u), (s, w)), v) in inputs.zip(responses).zip(signals.v[at..end].chunks_exact_mut(width)) {
            let s0 = (zero.load(e) - f2 * s2) - f1 * s1;
            let w0 = b0 * s0 + b1 * s1;
            s0.store(s);
            w0.store(w);
            (zero.load(u) - w0).store(v);
            (s2, s1) = (s1, s0);
        }
        return;
    }
    divide(zero, f, e, &mut signals.s, at);
    fir(zero, b, &signals.s, &mut signals.r[at..end], at);
    let rows = signals.v[at..end]
        .chunks_exact_mut(width)
        .zip(signals.r[at..end].chunks_exact(width));
    for ((v, w), u) in rows.zip(u.chunks_exact(width)) {
        (zero.load(u) - zero.load(w)).store(v);
    }
}

/// Computes `r = w/F` (in place of w) from index `at` on, and `x_f = D r`.
#[inline(always)]
pub(super) fn filter_response<R: Number>(zero: R, [d, f]: [&[f64]; 2], r: &mut [f64], x_f: &mut [f64], at: usize) {
    let width = zero.lane_count();
    if (d.len(), f.len()) == (width, 2 * width) {
        let (d1, f1, f2) = (zero.load(d), zero.load(f), zero.load(&f[width..]));
        let (mut r1, mut r2) = (zero.load(&r[at - width..]), zero.load(&r[at - 2 * width..]));
        for (r, x_f) in r[at..].chunks_exact_mut(width).zip(x_f.chunks_exact_mut(width)) {
            let r0 = (zero.load(r) - f2 * r2) - f1 * r1;
            r0.store(r);
            (r0 + d1 * r1).store(x_f);
            (r2, r1) = (r1, r0);
        }
        return;
    }
    continue_division(zero, f, r, at);
    whiten(zero, d, r, x_f, at);
}

/// Computes `y = x/F` from index `at` on, continuing from the previous values of y.
#[inline(always)]
fn divide<R: Number>(zero: R, f: &[f64], x: &[f64], y: &mut [f64], at: usize) {
    y[at..at + x.len()].copy_from_slice(x);
    let end = at + x.len();
    continue_division(zero, f, &mut y[..end], at);
}

/// Computes `y <- y/F` from index `at` on; the previous values are already filtered.
#[inline(always)]
fn continue_division<R: Number>(zero: R, f: &[f64], y: &mut [f64], at: usize) {
    let width = zero.lane_count();
    if f.len() == 2 * width {
        let (f1, f2) = (zero.load(f), zero.load(&f[width..]));
        let (mut y1, mut y2) = (zero.load(&y[at - width..]), zero.load(&y[at - 2 * width..]));
        for value in y[at..].chunks_exact_mut(width) {
            let next = (zero.load(value) - f2 * y2) - f1 * y1;
            next.store(value);
            (y2, y1) = (y1, next);
        }
        return;
    }
    let nf = f.len() / width;
    for row in at / width..y.len() / width {
        let mut next = zero.load(&y[row * width..]);
        for i in (0..nf).rev() {
            next = next - zero.load(&f[i * width..]) * zero.load(&y[(row - 1 - i) * width..]);
        }
        next.store(&mut y[row * width..]);
    }
}

/// Computes `y = D x` for x from index `at` on.
#[inline(always)]
pub(super) fn whiten<R: Number>(zero: R, d: &[f64], x: &[f64], y: &mut [f64], at: usize) {
    let width = zero.lane_count();
    let end = at + y.len();
    if d.is_empty() {
        y.copy_from_slice(&x[at..end]);
        return;
    }
    match d.len() / width {
        1 => whiten_by::<R, 1>(zero, d, &x[at - width..end], y),
        2 => whiten_by::<R, 2>(zero, d, &x[at - 2 * width..end], y),
        3 => whiten_by::<R, 3>(zero, d, &x[at - 3 * width..end], y),
        4 => whiten_by::<R, 4>(zero, d, &x[at - 4 * width..end], y),
        _ => {
            y.copy_from_slice(&x[at..end]);
            for (i, di) in d.chunks_exact(width).enumerate() {
                let lag = (i + 1) * width;
                add_scaled(zero.load(di), &x[at - lag..end - lag], y);
            }
        }
    }
}

/// Computes `y = D x` of order N in one pass; x starts N rows before y.
#[inline(always)]
fn whiten_by<R: Number, const N: usize>(zero: R, d: &[f64], x: &[f64], y: &mut [f64]) {
    let width = zero.lane_count();
    let mut k = [zero; N];
    for i in 0..N {
        k[i] = zero.load(&d[i * width..]);
    }
    for (row, y) in y.chunks_exact_mut(width).enumerate() {
        let x = &x[row * width..(row + N + 1) * width];
        let mut sum = zero.load(&x[N * width..]);
        for i in 0..N {
            sum = sum + k[i] * zero.load(&x[(N - 1 - i) * width..]);
        }
        sum.store(y);
    }
}

/// Computes `y = B x` for x from index `at` on.
#[inline(always)]
fn fir<R: Number>(zero: R, b: &[f64], x: &[f64], y: &mut [f64], at: usize) {
    let width = zero.lane_count();
    let end = at + y.len();
    y.fill(0.0);
    for (j, bj) in b.chunks_exact(width).enumerate() {
        let lag = j * width;
        add_scaled(zero.load(bj), &x[at - lag..end - lag], y);
    }
}
