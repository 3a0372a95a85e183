//! Solution of positive definite systems in place: `A = U' U`, then two triangular systems.
//!
//! By rows, whose numbers stand one after another: several columns are made at a time.

/// Columns that are made at a time.
const WIDE: usize = 4;

/// U in the place of the upper triangle of A, n by n with rows of N; false where A is not positive
/// definite. What is below the diagonal is zero next to it and else no result, nor is what is beyond n.
#[inline(always)]
pub(super) fn factor<const N: usize>(a: &mut [[f64; N]; N], n: usize) -> bool {
    for i in 0..n {
        let (above, below) = a.split_at_mut(i);
        let Some(row) = below.first_mut() else { return false };
        let (blocks, rest) = row.as_chunks_mut::<WIDE>();
        let end = n.div_ceil(WIDE).min(blocks.len());
        for (b, block) in blocks[..end].iter_mut().enumerate().skip(i / WIDE) {
            let mut sums = *block;
            for other in above.iter() {
                let (factor, other) = (other[i], &other.as_chunks::<WIDE>().0[b]);
                for (sum, u) in sums.iter_mut().zip(other) {
                    *sum -= factor * u;
                }
            }
            *block = sums;
        }
        for (sum, k) in rest.iter_mut().zip(N / WIDE * WIDE..n) {
            for other in above.iter() {
                *sum -= other[i] * other[k];
            }
        }
        let square = row[i];
        if !(square > 0.0 && square.is_finite()) {
            return false;
        }
        let pivot = libm::sqrt(square);
        row[i] = pivot;
        row[i + 1..n].iter_mut().for_each(|u| *u /= pivot);
        row[i / WIDE * WIDE..i].fill(0.0);
    }
    true
}

/// `a' b`, in some sums that do not wait for one another.
#[inline(always)]
fn product(a: &[f64], b: &[f64]) -> f64 {
    let (blocks, rest) = a.as_chunks::<WIDE>();
    let (of_blocks, of_rest) = b.as_chunks::<WIDE>();
    let mut sums = [0.0; WIDE];
    for (a, b) in blocks.iter().zip(of_blocks) {
        for i in 0..WIDE {
            sums[i] += a[i] * b[i];
        }
    }
    let rest: f64 = rest.iter().zip(of_rest).map(|(a, b)| a * b).sum();
    rest + (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// The solution in the place of b, with U of [`factor`].
#[inline(always)]
pub(super) fn solve<const N: usize>(u: &[[f64; N]; N], n: usize, b: &mut [f64; N]) {
    for (i, row) in u.iter().enumerate().take(n) {
        let x = b[i] / row[i];
        // By blocks: what is in the first of them before i is zero in U, and at i stands x.
        let (blocks, rest) = b.as_chunks_mut::<WIDE>();
        let (of_blocks, of_rest) = row.as_chunks::<WIDE>();
        for (block, of) in blocks[..n.div_ceil(WIDE).min(N / WIDE)].iter_mut().zip(of_blocks).skip(i / WIDE) {
            for (b, u) in block.iter_mut().zip(of) {
                *b -= x * u;
            }
        }
        for (b, u) in rest.iter_mut().zip(of_rest) {
            *b -= x * u;
        }
        b[i] = x;
    }
    for (i, row) in u.iter().enumerate().take(n).rev() {
        b[i] = (b[i] - product(&row[i + 1..n], &b[i + 1..n])) / row[i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_and_refuses() {
        let a: [[f64; 3]; 3] = [[4.0, 2.0, 0.5], [2.0, 5.0, 1.0], [0.5, 1.0, 3.0]];
        let (mut l, mut x) = (a, [1.0, -2.0, 0.5]);
        assert!(factor(&mut l, 3));
        solve(&l, 3, &mut x);
        for (row, b) in a.iter().zip([1.0, -2.0, 0.5]) {
            let product: f64 = row.iter().zip(x).map(|(a, x)| a * x).sum();
            assert!((product - b).abs() < 1e-12);
        }
        assert!(!factor(&mut [[1.0, 2.0], [2.0, 1.0]], 2));
        assert!(!factor(&mut [[f64::NAN; 2]; 2], 2));
    }
}
