//! The whitening filter D/C, applied from rest or continued from previous samples.

use hoid_core::filter::{SecondOrder, divide_from};
use hoid_lanes::{FourLaneTask, FourLanes, with_four_lanes};

use crate::linalg::vectors::add_scaled;

/// Computes `y = (1 + d1 q^-1) / (1 + f1 q^-1 + f2 q^-2) x` from rest.
pub(super) fn divide_and_whiten([f1, f2]: [f64; 2], d1: f64, x: &[f64], y: &mut [f64]) {
    let mut filter = SecondOrder::new(f1, f2);
    let mut before = 0.0;
    let (x_blocks, x_rest) = x.as_chunks::<4>();
    let (y_blocks, y_rest) = y.as_chunks_mut::<4>();
    for (y, x) in y_blocks.iter_mut().zip(x_blocks) {
        let s = filter.filter_four(*x);
        *y = [s[0] + d1 * before, s[1] + d1 * s[0], s[2] + d1 * s[1], s[3] + d1 * s[2]];
        before = s[3];
    }
    for (y, x) in y_rest.iter_mut().zip(x_rest) {
        let s = filter.filter_one(*x);
        *y = s + d1 * before;
        before = s;
    }
}

/// Computes `y = (D/C) x` from index `from` on and sets y to zero before it. The filter 1/C starts from rest, but D
/// also uses x before `from`.
pub(super) fn whiten(c: &[f64], d: &[f64], x: &[f64], y: &mut [f64], from: usize) {
    if from >= x.len() {
        y.fill(0.0);
        return;
    }
    y[..from].fill(0.0);
    continue_whitening(c, d, x, y, from);
}

/// Computes `y = (D/C) x` from index `from` on. The values of x and y before `from` must be the previous inputs and
/// outputs of the filter.
pub(super) fn continue_whitening(c: &[f64], d: &[f64], x: &[f64], y: &mut [f64], from: usize) {
    match *d {
        // The first lag is added while x is copied.
        [d1, ref rest @ ..] if from > 0 => {
            for ((y, x0), x1) in y[from..].iter_mut().zip(&x[from..]).zip(&x[from - 1..]) {
                *y = x0 + d1 * x1;
            }
            add_lags(rest, 2, x, y, from);
        }
        _ => {
            y[from..].copy_from_slice(&x[from..]);
            add_lags(d, 1, x, y, from);
        }
    }
    divide_from(c, y, from);
}

/// Computes `y(t) += sum_i d_i x(t - first_lag - i)` from index `from` on. Each pass adds eight or four lags, so y is
/// read and written only once for them.
fn add_lags(d: &[f64], first_lag: usize, x: &[f64], y: &mut [f64], from: usize) {
    let (eights, rest) = d.as_chunks::<8>();
    let (fours, rest) = rest.as_chunks::<4>();
    let mut lag = first_lag;
    for d in eights {
        add_lag_group(d, lag, x, y, from);
        lag += d.len();
    }
    for d in fours {
        add_lag_group(d, lag, x, y, from);
        lag += d.len();
    }
    for (i, &di) in rest.iter().enumerate() {
        add_lag(di, lag + i, x, y, from);
    }
}

/// Computes `y(t) += sum_i d_i x(t - lag - i)` from index `from` on, in one pass.
fn add_lag_group<const N: usize>(d: &[f64; N], lag: usize, x: &[f64], y: &mut [f64], from: usize) {
    // The lags are added one by one up to the sample at which all of them are inside x.
    let whole = from.max(lag + N - 1).min(y.len());
    for (i, &di) in d.iter().enumerate() {
        add_lag(di, lag + i, x, &mut y[..whole], from);
    }
    if whole < y.len() {
        let earlier = std::array::from_fn(|i| &x[whole - lag - i..]);
        let y = &mut y[whole..];
        with_four_lanes(AddLags { d, earlier, y });
    }
}

/// Adds N lags to y, in the order of the lags; `earlier` holds x delayed by each lag.
struct AddLags<'a, const N: usize> {
    d: &'a [f64; N],
    earlier: [&'a [f64]; N],
    y: &'a mut [f64],
}

impl<const N: usize> FourLaneTask for AddLags<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run<F: FourLanes>(self, zero: F) {
        let Self { d, earlier, y } = self;
        let factors = d.map(|d| zero.splat(d));
        let (blocks, rest) = y.as_chunks_mut::<4>();
        let n = blocks.len();
        let columns = earlier.map(|x| &x.as_chunks::<4>().0[..n]);
        for (t, y) in blocks.iter_mut().enumerate() {
            let mut sum = zero.load(y);
            for i in 0..N {
                sum = sum + factors[i] * zero.load(&columns[i][t]);
            }
            *y = sum.to_array();
        }
        for (t, y) in rest.iter_mut().enumerate() {
            for i in 0..N {
                *y += d[i] * earlier[i][4 * n + t];
            }
        }
    }
}

/// Computes `y(t) += d x(t - lag)` from index `from` on.
fn add_lag(d: f64, lag: usize, x: &[f64], y: &mut [f64], from: usize) {
    let start = from.max(lag);
    if start < y.len() {
        add_scaled(&mut y[start..], d, &x[start - lag..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adding_several_lags_at_once_equals_adding_each_lag() {
        let signal = |n: usize, k: f64| (0..n).map(|t| (k * t as f64).sin()).collect::<Vec<f64>>();
        for n in [1, 3, 5, 6, 40] {
            let x = signal(n, 0.7);
            for lags in 0..22 {
                let d = signal(lags, 1.3);
                for (first_lag, from) in [(1, 0), (2, 1), (2, 7), (1, 30)] {
                    let (mut several, mut ones) = (signal(n, 0.2), signal(n, 0.2));
                    add_lags(&d, first_lag, &x, &mut several, from);
                    for (i, &di) in d.iter().enumerate() {
                        add_lag(di, first_lag + i, &x, &mut ones, from);
                    }
                    assert_eq!(several, ones, "{n} {lags} {first_lag} {from}");
                }
            }
        }
    }
}
