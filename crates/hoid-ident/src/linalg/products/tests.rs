#![allow(clippy::unwrap_used)]

use hoid_lanes::InstructionSet;

use super::*;

fn wave(n: usize, omega: f64) -> Vec<f64> {
    (0..n)
        .map(|t| (omega * t as f64).sin() + 0.1 * (1.7 * t as f64).cos())
        .collect()
}

fn waves(n: usize, count: usize) -> Vec<Vec<f64>> {
    (0..count).map(|k| wave(n, 0.3 + 0.1 * k as f64)).collect()
}

fn unshifted_columns(columns: &[Vec<f64>]) -> Vec<LaggedColumn<'_>> {
    (columns.iter())
        .map(|values| LaggedColumn {
            values,
            is_shift_of_previous: false,
        })
        .collect()
}

/// Returns the product by its definition: `count` partial sums, added in a fixed order, plus the sum over the samples
/// after the last whole block.
fn product_in_partial_sums(x: &[f64], y: &[f64], count: usize) -> f64 {
    let mut sums = [0.0; 8];
    let whole = x.len() - x.len() % count;
    for t in 0..whole {
        sums[t % count] += x[t] * y[t];
    }
    let s: [f64; 4] = std::array::from_fn(|i| sums[i] + sums[i + 4]);
    let rest: f64 = x[whole..].iter().zip(&y[whole..]).map(|(x, y)| x * y).sum();
    (s[0] + s[2]) + (s[1] + s[3]) + rest
}

/// Returns the number of partial sums of the k-th of n products with one column: eight for the last of an odd number.
fn partial_sum_count(k: usize, n: usize) -> usize {
    if n % 2 == 1 && k + 1 == n { 8 } else { 4 }
}

const LENGTHS: [usize; 9] = [0, 1, 5, 127, 510, 512, 518, 1024, 1100];

#[test]
fn products_are_bit_identical_on_each_path() {
    for n in LENGTHS {
        for count in 1..=8 {
            let columns = waves(n, count);
            for path in InstructionSet::available() {
                let found = path.with_four_lanes(Gram(&unshifted_columns(&columns))).unwrap();
                for i in 0..count {
                    for j in i..count {
                        let defined =
                            product_in_partial_sums(&columns[i], &columns[j], partial_sum_count(j - i, count - i));
                        for found in [found[i * count + j], found[j * count + i]] {
                            assert_eq!(
                                found.to_bits(),
                                defined.to_bits(),
                                "{path:?}: {i}, {j} of {count}, {n} samples"
                            );
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn two_lags_in_one_pass_are_bit_identical_to_the_tiles() {
    for n in LENGTHS.map(|n| n + 1) {
        let (u, e) = (wave(n + 2, 0.05), wave(n + 2, 0.11));
        let of = |x: &'static [f64], lag: usize| LaggedColumn {
            values: &x[2 - lag..n + 2 - lag],
            is_shift_of_previous: lag > 0,
        };
        let (u, e): (&'static [f64], &'static [f64]) = (u.leak(), e.leak());
        let columns = [of(u, 0), of(u, 1), of(u, 2), of(e, 0), of(e, 1)];
        for path in InstructionSet::available() {
            let found = path.with_four_lanes(Gram(&columns)).unwrap();
            let same = |i: usize, j: usize, count: usize| {
                let defined = product_in_partial_sums(columns[i].values, columns[j].values, count);
                assert_eq!(
                    found[i * 5 + j].to_bits(),
                    defined.to_bits(),
                    "{path:?}: {i}, {j}, {n} samples"
                );
            };
            (0..4).for_each(|j| same(0, j, 4));
            same(0, 4, 8);
            (1..5).for_each(|j| same(3, j, 4));
            let shifted = found[1] + (columns[1].values[0] * columns[2].values[0] - u[n + 1] * u[n]);
            assert_eq!(found[5 + 2].to_bits(), shifted.to_bits(), "{path:?}");
        }
    }
}

#[test]
fn residuals_are_bit_identical_on_each_path() {
    let factors = [0.3, -1.2, 0.7, 2.0, -0.1, 0.9, 0.4];
    for n in LENGTHS {
        for p in 1..=7 {
            let columns = waves(n, p + 1);
            let mut defined = ResidualProducts::new(p);
            for stretch in (0..n).collect::<Vec<_>>().chunks(512) {
                let of = |j: usize| &columns[j][stretch[0]..stretch[0] + stretch.len()];
                let mut r = of(0).to_vec();
                for (t, r) in r.iter_mut().enumerate() {
                    let term = |k: usize| factors[k] * of(k + 1)[t];
                    let in_fours = p - p % 4;
                    if in_fours > 0 {
                        *r -= (term(0) + term(1)) + (term(2) + term(3));
                    }
                    (in_fours..p).for_each(|k| *r -= term(k));
                }
                defined.squares += product_in_partial_sums(&r, &r, 8);
                for k in 0..p {
                    defined.products[k] += product_in_partial_sums(&r, of(k + 1), partial_sum_count(k, p));
                }
            }
            for path in InstructionSet::available() {
                let mut found = ResidualProducts::new(p);
                let task = Residuals {
                    columns: &unshifted_columns(&columns),
                    factors: &factors[..p],
                    products: &mut found,
                };
                path.with_four_lanes(task).unwrap();
                assert_eq!(found, defined, "{path:?}: {p} inputs, {n} samples");
            }
        }
    }
}

#[test]
fn variance_is_bit_identical_on_each_path() {
    for n in LENGTHS {
        let x = wave(n + 1, 0.3);
        let spans = x.split_at(n / 3);
        let on = |path: InstructionSet| path.with_four_lanes(Variance(&[spans.0, spans.1])).unwrap().to_bits();
        for path in InstructionSet::available() {
            assert_eq!(on(path), on(InstructionSet::Scalar), "{path:?}: {n} samples");
        }
    }
}

#[test]
fn variance_uses_the_mean_of_all_spans() {
    let x = wave(103, 0.3);
    let mean = x.iter().sum::<f64>() / 103.0;
    let plain = x.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / 103.0;
    for cut in [0, 1, 40, 103] {
        let (a, b) = x.split_at(cut);
        assert!((variance(&[a, b]) - plain).abs() < 1e-15);
    }
    // A constant has zero variance, however large it is.
    assert_eq!(variance(&[&[1e8; 64]]), 0.0);
}

#[test]
fn shifted_columns_give_the_same_matrix() {
    let (u, e) = (wave(200, 0.05), wave(200, 0.11));
    let lagged = |x: &'static [f64], lag: usize| &x[10 - lag..200 - lag];
    let (u, e): (&'static [f64], &'static [f64]) = (u.leak(), e.leak());
    let columns = |follow: bool| -> Vec<LaggedColumn<'static>> {
        let of = |x, lag, follows| LaggedColumn {
            values: lagged(x, lag),
            is_shift_of_previous: follows && follow,
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
