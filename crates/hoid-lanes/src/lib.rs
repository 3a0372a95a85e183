//! Simultaneous runs of a recursion in the lanes of vector registers, bit-identical to each run alone.
//!
//! A recursion `y(t) = x(t) - f y(t-1)` must wait at each sample for its previous result. A single run therefore leaves
//! most of a processor idle, and no vector instruction can speed it up: sample t + 1 cannot start before sample t has
//! finished. Several runs can be computed simultaneously, one in each lane of a register:
//!
//! `[y_1(t) .. y_L(t)] = [x_1(t) .. x_L(t)] - [f_1 .. f_L] [y_1(t-1) .. y_L(t-1)]`, lane by lane.
//!
//! The same holds for a sum over a record, `s(t) = s(t-1) + a(t) b(t)`: four partial sums, each over every fourth term,
//! are independent of each other.
//!
//! The registers are selected at run time (AVX-512, AVX2 or scalar; Neon on ARM). Each lane performs the operations of
//! a single run, in the same order and without contraction (no fused multiply-add). The result is therefore
//! bit-identical for all registers and independent of the other lanes.
//!
//! A task is written once, for a [`Number`], and runs in the registers of an [`InstructionSet`]:
//!
//! ```
//! use hoid_lanes::{InstructionSet, LaneTask, Number};
//!
//! /// `y(t) = x(t) - f y(t-1)` of several runs; `x` holds the sample t of all runs, then that of t + 1 ...
//! struct FirstOrder<'a> {
//!     f: f64,
//!     x: &'a [f64],
//! }
//!
//! impl LaneTask for FirstOrder<'_> {
//!     type Output = Vec<f64>;
//!
//!     #[inline(always)]
//!     fn run<R: Number>(self, zero: R) -> Vec<f64> {
//!         let (f, mut y) = (zero.splat(self.f), zero);
//!         let mut out = vec![0.0; self.x.len()];
//!         for (x, out) in self.x.chunks_exact(zero.lane_count()).zip(out.chunks_exact_mut(zero.lane_count())) {
//!             y = zero.load(x) - f * y;
//!             y.store(out);
//!         }
//!         out
//!     }
//! }
//!
//! let lanes = InstructionSet::Best.lane_count().ok_or("no registers")?;
//! // An impulse in each run, larger from lane to lane.
//! let mut x = vec![0.0; 3 * lanes];
//! (0..lanes).for_each(|lane| x[lane] = lane as f64);
//! let y = InstructionSet::Best.with_lanes(FirstOrder { f: -0.5, x: &x }).ok_or("no registers")?;
//! assert_eq!(y[2 * lanes + 1], 0.25);
//! # Ok::<(), &str>(())
//! ```
//!
//! | item | meaning |
//! |---|---|
//! | [`Number`] | one f64, or several f64 in lanes |
//! | [`LaneTask`], [`InstructionSet::with_lanes`] | computation over numbers, and its execution in the lanes of the selected registers |
//! | [`with_one_lane`] | execution for a single run |
//! | [`FourLanes`], [`FourLaneTask`], [`with_four_lanes`] | four partial sums over one record, in one or two registers |

mod four_lanes;
mod instruction_set;
mod number;
mod registers;

pub use four_lanes::{FourLaneTask, FourLanes, with_four_lanes};
pub use instruction_set::{InstructionSet, LaneTask, with_one_lane};
pub use number::Number;
