//! Small numerical routines shared by the crates of hoid.
//!
//! | module | contents |
//! |---|---|
//! | [`statistics`] | mean, variance, root mean square; quantiles according to three definitions |
//! | [`products`] | products of vectors and of small matrices |
//! | [`cholesky`] | small positive definite systems by Cholesky factorisation, and triangular systems |
//! | [`elimination`] | small positive definite or general systems by elimination, without a stored factor |
//!
//! The order of operations of each function is part of its specification: sums run from the first to the last term, no
//! multiplication and addition are fused, and square roots come from `libm`, so results are bit-identical on every
//! machine. If two functions differ only in rounding, their documentation mentions it.
//!
//! The crate is `no_std` and allocates no memory; the feature `alloc` adds the statistics that sort their values.
//! Matrices whose size is known only at run time use nalgebra, and sums over records use `hoid-lanes`.
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
