//! Sums of products of many columns, in one pass over each.
//!
//! A normal matrix needs the product of each pair of its columns. One column against four others at a time reads five numbers for
//! four products, where single products read eight; and a column that is the one before it, a sample later, needs no pass:
//! `sum x(t-1) y(t-1)` over a span is `sum x(t) y(t)` but for the samples at both ends.

use wide::f64x4;

use crate::least_squares::{add_scaled, dot};

/// Partial sums of one product. Their number is part of the result's last digits, and the same on every machine.
const LANES: usize = 4;

/// `x' y` for each y, all as long as x.
pub(crate) fn products(x: &[f64], ys: &[&[f64]]) -> Vec<f64> {
    let mut all = Vec::with_capacity(ys.len());
    let mut fours = ys.chunks_exact(4);
    for four in &mut fours {
        all.extend(of_four(x, four[0], four[1], four[2], four[3]));
    }
    match *fours.remainder() {
        [a] => all.push(dot(x, a)),
        [a, b] => all.extend(of_two(x, a, b)),
        [a, b, c] => {
            all.extend(of_two(x, a, b));
            all.push(dot(x, c));
        }
        _ => {}
    }
    all
}

/// Named sums, because those of an array are kept in memory.
fn of_four(x: &[f64], a: &[f64], b: &[f64], c: &[f64], d: &[f64]) -> [f64; 4] {
    let mut sums = (f64x4::ZERO, f64x4::ZERO, f64x4::ZERO, f64x4::ZERO);
    let blocks = whole(x).iter().zip(whole(a)).zip(whole(b)).zip(whole(c)).zip(whole(d));
    for ((((x, a), b), c), d) in blocks {
        let x = f64x4::new(*x);
        sums.0 += x * f64x4::new(*a);
        sums.1 += x * f64x4::new(*b);
        sums.2 += x * f64x4::new(*c);
        sums.3 += x * f64x4::new(*d);
    }
    [
        total(sums.0, x, a),
        total(sums.1, x, b),
        total(sums.2, x, c),
        total(sums.3, x, d),
    ]
}

fn of_two(x: &[f64], a: &[f64], b: &[f64]) -> [f64; 2] {
    let mut sums = (f64x4::ZERO, f64x4::ZERO);
    for ((x, a), b) in whole(x).iter().zip(whole(a)).zip(whole(b)) {
        let x = f64x4::new(*x);
        sums.0 += x * f64x4::new(*a);
        sums.1 += x * f64x4::new(*b);
    }
    [total(sums.0, x, a), total(sums.1, x, b)]
}

fn whole(x: &[f64]) -> &[[f64; LANES]] {
    x.as_chunks::<LANES>().0
}

/// The partial sums in a fixed order, and the products behind the last whole block of x.
fn total(sums: f64x4, x: &[f64], y: &[f64]) -> f64 {
    let s = sums.to_array();
    let from = x.len() - x.len() % LANES;
    let rest: f64 = x[from..].iter().zip(&y[from..]).map(|(x, y)| x * y).sum();
    (s[0] + s[2]) + (s[1] + s[3]) + rest
}

/// Sum over all slices of x.
fn sum(x: &[f64]) -> f64 {
    let (blocks, tail) = x.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for block in blocks {
        for lane in 0..8 {
            sums[lane] += block[lane];
        }
    }
    sums.iter().chain(tail).sum()
}

/// Variance around the common mean of some spans.
pub(crate) fn variance(spans: &[&[f64]]) -> f64 {
    let n = spans.iter().map(|x| x.len()).sum::<usize>() as f64;
    let mean = spans.iter().map(|x| sum(x)).sum::<f64>() / n;
    let squares = |x: &[f64]| -> f64 {
        let (blocks, tail) = x.as_chunks::<8>();
        let mut sums = [0.0; 8];
        for block in blocks {
            for lane in 0..8 {
                let d = block[lane] - mean;
                sums[lane] += d * d;
            }
        }
        sums.iter().sum::<f64>() + tail.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>()
    };
    spans.iter().map(|x| squares(x)).sum::<f64>() / n
}

/// A column of a regression.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lagged<'a> {
    pub values: &'a [f64],
    /// True when this is the column before it, one sample later.
    pub follows: bool,
}

/// The symmetric matrix of the products of all columns, by rows.
///
/// A column that follows none leads: it is multiplied with all columns at once. What is left are pairs of columns that both follow, which come
/// from the pair before them.
pub(crate) fn gram(columns: &[Lagged<'_>]) -> Vec<f64> {
    let p = columns.len();
    let mut gram = vec![0.0; p * p];
    let mut others = Vec::with_capacity(p);
    for (i, leader) in columns.iter().enumerate().filter(|(_, column)| !column.follows) {
        // Leaders before this one have met it already.
        let unmet = |j: &usize| *j >= i || columns[*j].follows;
        others.clear();
        others.extend((0..p).filter(unmet).map(|j| columns[j].values));
        for (j, product) in (0..p).filter(unmet).zip(products(leader.values, &others)) {
            (gram[i * p + j], gram[j * p + i]) = (product, product);
        }
    }
    for i in 0..p {
        for j in (0..=i).filter(|j| columns[i].follows && columns[*j].follows) {
            let product = gram[(i - 1) * p + j - 1] + ends(columns, i, j);
            (gram[i * p + j], gram[j * p + i]) = (product, product);
        }
    }
    gram
}

/// `y -= sum_k factors_k x_k`.
pub(crate) fn subtract(y: &mut [f64], factors: &[f64], xs: &[&[f64]]) {
    let mut fours = xs.chunks_exact(4);
    let mut factor_fours = factors.chunks_exact(4);
    for (x, k) in (&mut fours).zip(&mut factor_fours) {
        let inputs = x[0].iter().zip(x[1]).zip(x[2]).zip(x[3]);
        for (y, (((a, b), c), d)) in y.iter_mut().zip(inputs) {
            *y -= (k[0] * a + k[1] * b) + (k[2] * c + k[3] * d);
        }
    }
    for (x, k) in fours.remainder().iter().zip(factor_fours.remainder()) {
        add_scaled(y, -k, x);
    }
}

/// What the product of columns i and j has more than that of the columns before them.
fn ends(columns: &[Lagged<'_>], i: usize, j: usize) -> f64 {
    let (x, y) = (columns[i - 1].values, columns[j - 1].values);
    let last = x.len() - 1;
    columns[i].values[0] * columns[j].values[0] - x[last] * y[last]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: usize, omega: f64) -> Vec<f64> {
        (0..n)
            .map(|t| (omega * t as f64).sin() + 0.1 * (1.7 * t as f64).cos())
            .collect()
    }

    #[test]
    fn products_of_any_number_and_length_are_plain_sums() {
        for n in [0, 1, 3, 4, 5, 127] {
            let x = wave(n, 0.3);
            let others: Vec<Vec<f64>> = (0..7).map(|k| wave(n, 0.1 * f64::from(k))).collect();
            for count in 0..=7 {
                let ys: Vec<&[f64]> = others[..count].iter().map(Vec::as_slice).collect();
                for (found, y) in products(&x, &ys).into_iter().zip(&ys) {
                    let plain: f64 = x.iter().zip(*y).map(|(a, b)| a * b).sum();
                    assert!(
                        (found - plain).abs() <= 1e-13 * n as f64,
                        "{n} samples, {count} columns"
                    );
                }
            }
        }
    }

    #[test]
    fn variance_is_that_around_the_mean_of_all_spans() {
        let x = wave(103, 0.3);
        let mean = x.iter().sum::<f64>() / 103.0;
        let plain = x.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / 103.0;
        for cut in [0, 1, 40, 103] {
            let (a, b) = x.split_at(cut);
            assert!((variance(&[a, b]) - plain).abs() < 1e-15);
        }
        // A constant has none, however large it is.
        assert_eq!(variance(&[&[1e8; 64]]), 0.0);
    }

    #[test]
    fn a_combination_is_subtracted_whatever_the_number_of_columns() {
        let others: Vec<Vec<f64>> = (0..6).map(|k| wave(50, 0.1 * f64::from(k))).collect();
        let factors = [0.3, -1.2, 0.7, 2.0, -0.1, 0.9];
        for count in 0..=6 {
            let xs: Vec<&[f64]> = others[..count].iter().map(Vec::as_slice).collect();
            let mut y = wave(50, 0.2);
            subtract(&mut y, &factors[..count], &xs);
            for (t, found) in y.iter().enumerate() {
                let plain: f64 = wave(50, 0.2)[t] - (0..count).map(|k| factors[k] * others[k][t]).sum::<f64>();
                assert!((found - plain).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn columns_that_follow_give_the_same_matrix() {
        let (u, e) = (wave(200, 0.05), wave(200, 0.11));
        let lagged = |x: &'static [f64], lag: usize| &x[10 - lag..200 - lag];
        let (u, e): (&'static [f64], &'static [f64]) = (u.leak(), e.leak());
        let columns = |follow: bool| -> Vec<Lagged<'static>> {
            let of = |x, lag, follows| Lagged {
                values: lagged(x, lag),
                follows: follows && follow,
            };
            vec![
                of(u, 0, false),
                of(u, 1, true),
                of(u, 2, true),
                of(e, 7, false),
                of(e, 8, true),
                of(e, 9, true),
            ]
        };
        for (fast, plain) in gram(&columns(true)).into_iter().zip(gram(&columns(false))) {
            assert!((fast - plain).abs() < 1e-12 * 200.0);
        }
    }
}
