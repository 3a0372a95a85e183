//! Linear algebra of the estimators.
//!
//! | module | contents |
//! |---|---|
//! | `products` | sums of products of long signals |
//! | `least_squares` | linear regression by QR with column pivoting |
//! | `gram` | normal equations of few columns, row by row |
//! | `information` | the inverse of the information matrix of the free parameters |

pub(crate) mod gram;
pub(crate) mod information;
pub(crate) mod least_squares;
pub(crate) mod products;

pub use least_squares::dot;
