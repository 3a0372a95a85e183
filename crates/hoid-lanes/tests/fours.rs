//! Four numbers have the same bits on every path that this processor has.

#![allow(clippy::unwrap_used)]

use hoid_lanes::{ByFours, Four, Path, by_fours};

/// A sum, a difference and a product of each four; products that a contraction would round otherwise.
struct Horner<'a>(&'a [[f64; 4]]);

impl ByFours for Horner<'_> {
    type Output = [f64; 4];

    #[inline(always)]
    fn run<F: Four>(self, zero: F) -> [f64; 4] {
        let mut sum = zero;
        for x in self.0 {
            let x = zero.load(x);
            sum = (sum * x + x * x) - zero.like(0.1);
        }
        sum.to_array()
    }
}

#[test]
fn each_number_goes_alone_and_without_contraction() {
    let values: Vec<[f64; 4]> = (0..100)
        .map(|t| [0.3, 0.7, 1.1, 1.3].map(|omega: f64| (omega * f64::from(t)).sin()))
        .collect();
    let alone: [f64; 4] =
        std::array::from_fn(|lane| (values.iter()).fold(0.0, |sum, x| (sum * x[lane] + x[lane] * x[lane]) - 0.1));
    let bits = |x: [f64; 4]| x.map(f64::to_bits);
    assert_eq!(bits(by_fours(Horner(&values))), bits(alone));
    for path in Path::available() {
        assert_eq!(bits(path.by_fours(Horner(&values)).unwrap()), bits(alone), "{path:?}");
    }
}

#[test]
fn what_the_processor_lacks_is_said() {
    for path in [Path::Avx2, Path::Avx512] {
        let four = path.by_fours(Horner(&[]));
        assert!(path.lanes().is_none() || four.is_some(), "{path:?}");
    }
}
