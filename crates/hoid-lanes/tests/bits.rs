//! Every lane has the same bits as its run alone, in all registers of this processor.

#![allow(clippy::unwrap_used)]

use hoid_lanes::{FourLaneTask, FourLanes, InstructionSet, LaneTask, Number, with_four_lanes, with_one_lane};

/// Sums, differences and products of groups of four numbers; contraction would change the rounding of the products.
struct Horner<'a>(&'a [[f64; 4]]);

impl FourLaneTask for Horner<'_> {
    type Output = [f64; 4];

    #[inline(always)]
    fn run<F: FourLanes>(self, zero: F) -> [f64; 4] {
        let mut sum = zero;
        for x in self.0 {
            let x = zero.load(x);
            sum = (sum * x + x * x) - zero.splat(0.1);
        }
        sum.to_array()
    }
}

#[test]
fn lanes_are_computed_independently_without_fma() {
    let values: Vec<[f64; 4]> = (0..100)
        .map(|t| [0.3, 0.7, 1.1, 1.3].map(|omega: f64| (omega * f64::from(t)).sin()))
        .collect();
    let alone: [f64; 4] =
        std::array::from_fn(|lane| (values.iter()).fold(0.0, |sum, x| (sum * x[lane] + x[lane] * x[lane]) - 0.1));
    let bits = |x: [f64; 4]| x.map(f64::to_bits);
    assert_eq!(bits(with_four_lanes(Horner(&values))), bits(alone));
    for set in InstructionSet::available() {
        assert_eq!(
            bits(set.with_four_lanes(Horner(&values)).unwrap()),
            bits(alone),
            "{set:?}"
        );
    }
}

/// A second-order recursion whose gain is divided by the input power. It uses all operations of a number, with products
/// whose rounding would change by contraction. `x` contains one sample of all lanes, followed by the next sample.
struct Recursion<'a>(&'a [f64]);

impl LaneTask for Recursion<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn run<R: Number>(self, zero: R) -> Vec<f64> {
        let (mut y1, mut y2, mut p) = (zero, zero, zero.splat(10.0));
        let mut out = vec![0.0; self.0.len()];
        let lanes = zero.lane_count();
        for (x, out) in self.0.chunks_exact(lanes).zip(out.chunks_exact_mut(lanes)) {
            let x = zero.load(x);
            p = p / (zero.splat(1.0) + x * p * x);
            let y = x * p - (zero.splat(-1.6) * y1 + zero.splat(0.7) * y2);
            (y1, y2) = (-(-y), y1);
            for lane in 0..lanes {
                if y1.lane(lane) > 20.0 {
                    y1.set_lane(lane, 0.0);
                }
            }
            y.store(out);
        }
        out
    }
}

#[test]
fn each_lane_is_bit_identical_to_a_scalar_run() {
    let run = |k: usize| -> Vec<f64> {
        let omega = 0.05 + 0.011 * k as f64;
        (0..500).map(|t| (omega * t as f64).sin() + 0.3 * k as f64).collect()
    };
    for set in InstructionSet::available() {
        let lanes = set.lane_count().unwrap();
        let runs: Vec<Vec<f64>> = (0..lanes).map(run).collect();
        let interleaved: Vec<f64> = (0..500 * lanes).map(|i| runs[i % lanes][i / lanes]).collect();
        let found = set.with_lanes(Recursion(&interleaved)).unwrap();
        for (lane, run) in runs.iter().enumerate() {
            let alone = with_one_lane(Recursion(run));
            assert!(alone.iter().all(|y| y.is_finite()));
            for (t, y) in alone.iter().enumerate() {
                assert_eq!(
                    found[t * lanes + lane].to_bits(),
                    y.to_bits(),
                    "{set:?} lane {lane} at {t}"
                );
            }
        }
    }
}

#[test]
fn unavailable_instruction_sets_give_none() {
    for set in [InstructionSet::Avx2, InstructionSet::Avx512] {
        let four = set.with_four_lanes(Horner(&[]));
        assert!(set.lane_count().is_none() || four.is_some(), "{set:?}");
        let available = InstructionSet::available().contains(&set);
        assert_eq!(set.with_lanes(Recursion(&[])).is_some(), available, "{set:?}");
    }
}
