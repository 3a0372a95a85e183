//! Rational filters over slices.
//!
//! A monic polynomial `D(q^-1) = 1 + d_1 q^-1 + ... + d_n q^-n` is given by its coefficients `[d_1, ..., d_n]`; the
//! leading 1 is never stored. All filters start at rest (zeros before the first sample).

/// Applies an all-pole filter: `y = x / D(q^-1)`.
///
/// # Panics
/// If `x` and `y` have different lengths.
pub fn divide(d: &[f64], x: &[f64], y: &mut [f64]) {
    assert_eq!(x.len(), y.len(), "input and output of a filter have the same length");
    if let [d1, d2] = *d {
        return divide_by_second_order(d1, d2, x, y);
    }
    y.copy_from_slice(x);
    divide_in_place(d, y);
}

/// Applies an all-pole filter in place: `x <- x / D(q^-1)`, that is
/// `y(t) = x(t) - d_1 y(t-1) - ... - d_n y(t-n)`.
pub fn divide_in_place(d: &[f64], x: &mut [f64]) {
    divide_from(d, x, 0);
}

/// Like [`divide_in_place`], but starting at index `from`. The values before that index are past outputs of the filter;
/// outputs before the start of the slice are zero.
pub fn divide_from(d: &[f64], x: &mut [f64], from: usize) {
    let before = |lag: usize, x: &[f64]| from.checked_sub(lag).map_or(0.0, |t| x[t]);
    match *d {
        [] => {}
        [d1] => divide_in_registers([d1], x, from),
        [d1, d2] => {
            let filter = SecondOrder {
                y1: before(1, x),
                y2: before(2, x),
                ..SecondOrder::new(d1, d2)
            };
            divide_by_second_order_in_place(filter, &mut x[from..]);
        }
        [d1, d2, d3] => divide_in_registers([d1, d2, d3], x, from),
        [d1, d2, d3, d4] => divide_in_registers([d1, d2, d3, d4], x, from),
        [d1, d2, d3, d4, d5] => divide_in_registers([d1, d2, d3, d4, d5], x, from),
        _ => {
            for t in from..x.len() {
                let mut y = x[t];
                for (i, di) in d.iter().enumerate().take(t) {
                    y -= di * x[t - 1 - i];
                }
                x[t] = y;
            }
        }
    }
}

/// Like [`divide_from`] for a low order, with the past outputs in registers.
fn divide_in_registers<const N: usize>(d: [f64; N], x: &mut [f64], from: usize) {
    let mut past: [f64; N] = core::array::from_fn(|i| from.checked_sub(i + 1).map_or(0.0, |t| x[t]));
    for value in &mut x[from..] {
        let mut y = *value;
        for i in 0..N {
            y -= d[i] * past[i];
        }
        for i in (1..N).rev() {
            past[i] = past[i - 1];
        }
        past[0] = y;
        *value = y;
    }
}

/// Second-order all-pole filter `y = x / (1 + d_1 q^-1 + d_2 q^-2)` from rest, four samples at a time.
///
/// Computed sample by sample, each output would wait for the previous output. With the impulse response h, four outputs
/// can be written as `y(t+k) = sum_{i<=k} h_i x(t+k-i) + h_{k+1} y(t-1) - d_2 h_k y(t-2)`, k = 0 to 3. All four outputs
/// then wait only for y(t-1) and y(t-2), and only for one product and two sums.
#[derive(Debug, Clone, Copy)]
pub struct SecondOrder {
    /// Samples h_1 to h_4 of the impulse response; h_0 is one.
    h: [f64; 4],
    /// Products -d_2 h_0 to -d_2 h_3.
    g: [f64; 4],
    y1: f64,
    y2: f64,
}

impl SecondOrder {
    /// Builds the filter at rest.
    pub fn new(d1: f64, d2: f64) -> Self {
        let h1 = -d1;
        let h2 = -d1 * h1 - d2;
        let h3 = -d1 * h2 - d2 * h1;
        let h4 = -d1 * h3 - d2 * h2;
        Self {
            h: [h1, h2, h3, h4],
            g: [-d2, -d2 * h1, -d2 * h2, -d2 * h3],
            y1: 0.0,
            y2: 0.0,
        }
    }

    /// Filters four samples.
    #[inline(always)]
    pub fn filter_four(&mut self, [x0, x1, x2, x3]: [f64; 4]) -> [f64; 4] {
        let Self { h, g, y1, y2 } = *self;
        // The input terms come first, so only the last two sums wait for the previous block.
        let y = [
            (x0 + g[0] * y2) + h[0] * y1,
            ((x1 + h[0] * x0) + g[1] * y2) + h[1] * y1,
            ((x2 + h[0] * x1 + h[1] * x0) + g[2] * y2) + h[2] * y1,
            ((x3 + h[0] * x2 + h[1] * x1 + h[2] * x0) + g[3] * y2) + h[3] * y1,
        ];
        (self.y1, self.y2) = (y[3], y[2]);
        y
    }

    /// Filters one sample.
    #[inline(always)]
    pub fn filter_one(&mut self, x: f64) -> f64 {
        let y = (x + self.g[0] * self.y2) + self.h[0] * self.y1;
        (self.y2, self.y1) = (self.y1, y);
        y
    }
}

fn divide_by_second_order(d1: f64, d2: f64, x: &[f64], y: &mut [f64]) {
    let mut filter = SecondOrder::new(d1, d2);
    let (x_blocks, x_rest) = x.as_chunks::<4>();
    let (y_blocks, y_rest) = y.as_chunks_mut::<4>();
    for (y, x) in y_blocks.iter_mut().zip(x_blocks) {
        *y = filter.filter_four(*x);
    }
    for (y, x) in y_rest.iter_mut().zip(x_rest) {
        *y = filter.filter_one(*x);
    }
}

fn divide_by_second_order_in_place(mut filter: SecondOrder, x: &mut [f64]) {
    let (blocks, rest) = x.as_chunks_mut::<4>();
    for block in blocks {
        *block = filter.filter_four(*block);
    }
    for value in rest {
        *value = filter.filter_one(*value);
    }
}

/// Applies a monic FIR filter: `y = D(q^-1) x`, that is `y(t) = x(t) + d_1 x(t-1) + ... + d_n x(t-n)`.
///
/// # Panics
/// If `x` and `y` have different lengths.
pub fn multiply(d: &[f64], x: &[f64], y: &mut [f64]) {
    assert_eq!(x.len(), y.len(), "input and output of a filter have the same length");
    y.copy_from_slice(x);
    for (i, &di) in d.iter().enumerate() {
        let lag = i + 1;
        if lag >= x.len() {
            break;
        }
        for (yt, xt) in y[lag..].iter_mut().zip(x) {
            *yt += di * xt;
        }
    }
}

/// Applies a general FIR filter: `y = B(q^-1) q^-nk x`, `b = [b_0, ..., b_{nb-1}]`.
///
/// # Panics
/// If `x` and `y` have different lengths.
pub fn fir(b: &[f64], nk: usize, x: &[f64], y: &mut [f64]) {
    assert_eq!(x.len(), y.len(), "input and output of a filter have the same length");
    y.fill(0.0);
    for (j, &bj) in b.iter().enumerate() {
        let lag = nk + j;
        if lag >= x.len() {
            break;
        }
        for (yt, xt) in y[lag..].iter_mut().zip(x) {
            *yt += bj * xt;
        }
    }
}

/// Returns the coefficients `g_1 ... g_(nc+nf)` of `G = C F`, where C and F have a leading 1.
#[inline(always)]
pub(crate) fn product<const N: usize>(c: &[f64], f: &[f64]) -> [f64; N] {
    let mut g = [0.0; N];
    g[..f.len()].copy_from_slice(f);
    for (i, c) in c.iter().enumerate() {
        g[i] += c;
        for (j, f) in f.iter().enumerate() {
            g[i + j + 1] += c * f;
        }
    }
    g
}

/// Inserts the newest value into a history of n values and drops the oldest value.
#[inline(always)]
pub(crate) fn push(history: &mut [f64], n: usize, value: f64) {
    if n > 0 {
        history.copy_within(0..n - 1, 1);
        history[0] = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{vec, vec::Vec};

    fn wave(n: usize) -> Vec<f64> {
        (0..n).map(|t| sample(t as f64)).collect()
    }

    fn sample(t: f64) -> f64 {
        (0.37 * t).sin() + 0.2 * (1.7 * t).cos()
    }

    #[test]
    fn division_inverts_multiplication_for_every_order() {
        let d = [-0.7, 0.31, -0.12, 0.05, -0.02, 0.01];
        let x = wave(200);
        for n in 0..=d.len() {
            let mut y = vec![0.0; x.len()];
            multiply(&d[..n], &x, &mut y);
            let mut apart = vec![0.0; y.len()];
            divide(&d[..n], &y, &mut apart);
            divide_in_place(&d[..n], &mut y);
            assert_eq!(apart, y);
            for (a, b) in x.iter().zip(&y) {
                assert!((a - b).abs() < 1e-12, "order {n}: {a} and {b}");
            }
        }
    }

    #[test]
    fn division_in_parts_equals_one_division() {
        let d = [-0.7, 0.31, -0.12, 0.05, -0.02, 0.01];
        for n in 0..=d.len() {
            let mut whole = wave(200);
            divide_in_place(&d[..n], &mut whole);
            // This also holds for a cut after one sample, where the missing past output of the filter is zero.
            for cut in [1, 3, 64] {
                let mut parts = wave(200);
                divide_in_place(&d[..n], &mut parts[..cut]);
                divide_from(&d[..n], &mut parts, cut);
                for (a, b) in whole.iter().zip(&parts) {
                    assert!((a - b).abs() < 1e-14, "order {n}: {a} and {b}");
                }
            }
        }
    }

    #[test]
    fn fir_applies_delay_and_coefficients() {
        let mut y = [0.0; 5];
        fir(&[2.0, 3.0], 1, &[1.0, 10.0, 0.0, 0.0, 0.0], &mut y);
        assert_eq!(y, [0.0, 2.0, 23.0, 30.0, 0.0]);
        // A delay longer than the record leaves zeros, and does not panic.
        fir(&[2.0], 9, &[1.0; 5], &mut y);
        assert_eq!(y, [0.0; 5]);
    }

    #[test]
    fn empty_and_short_slices_are_accepted() {
        divide_in_place(&[0.5, 0.2, 0.1], &mut []);
        let mut one = [1.0];
        divide_in_place(&[0.5, 0.2, 0.1], &mut one);
        assert_eq!(one, [1.0]);
        multiply(&[0.5], &[], &mut []);
    }
}
