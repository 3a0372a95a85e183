//! Small numerical routines that the crates of hoid share, each written once.
//!
//! | module | contents |
//! |---|---|
//! | [`statistics`] | mean, variance, root mean square; quantiles by three definitions |
//! | [`products`] | the product of two vectors |
//! | [`cholesky`] | small positive definite systems by their factor, and its triangular systems |
//! | [`elimination`] | small systems without a factor, positive definite or any |
//!
//! The order of operations of each function is part of its specification: sums run from the first to the last term,
//! nothing is contracted, and roots are those of `libm`, so that results are the same to the last bit on every
//! machine. The docs of two functions that differ only in rounding state it.
//!
//! `no_std`, without allocation; the feature `alloc` adds the statistics that sort their values. Matrices whose size
//! is known only at run time are those of nalgebra, and sums over records those of `hoid-lanes`.
//!
//! ```
//! use hoid_numerics::{cholesky, statistics};
//!
//! let (a, b) = ([[4.0, 2.0], [2.0, 5.0]], [2.0, -1.0]);
//! let (mut l, mut x) = (a, b);
//! assert!(cholesky::factor(&mut l, 2));
//! cholesky::solve(&l, 2, &mut x);
//! assert_eq!(x, [0.75, -0.5]);
//! assert_eq!(statistics::mean(&x), 0.125);
//! ```
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

#[cfg(test)]
extern crate std;

pub mod cholesky;
pub mod elimination;
pub mod products;
pub mod statistics;
