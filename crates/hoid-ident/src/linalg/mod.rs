//! Linear algebra for the estimators.
//!
//! | module | contents |
//! |---|---|
//! | `products` | sums of products of long signals |
//! | `least_squares` | linear regression by QR with column pivoting |
//! | `gram` | normal equations for a small number of columns, row by row |
//! | `vectors` | sums of vectors and products of vectors |
//! | `information` | inverse of the information matrix of the free parameters |

pub(crate) mod gram;
pub(crate) mod information;
pub(crate) mod least_squares;
pub(crate) mod products;
pub(crate) mod vectors;

pub use vectors::dot;
