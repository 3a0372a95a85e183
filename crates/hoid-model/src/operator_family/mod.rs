//! The family of operators found for people.
//!
//! `Y(s) = K (T_L s + 1)^p / (T_I s + 1)^q e^{-tau s} omega^2/(s^2 + 2 zeta omega s + omega^2)`,
//! p = 0, 1, 2, q = 0, 1 (eq. 2.2 of the thesis; D. T. McRuer and H. R. Jex, IEEE Trans. Human
//! Factors in Electronics 8 (1967) 231-249), with or without the neuromuscular part, and two alternative forms for
//! controlled elements of second order ([`Form`]).
//!
//! A person who integrates slow errors has a lag with a long T_I. Then K and T_I cannot be determined separately, but
//! `K/T_I` can. An operator is therefore represented by the coordinates `[K/T_I, T_L, 1/T_I, ln omega, ln zeta, tau]`
//! ([`Coordinate`]), in which the pure integration, `1/T_I = 0`, is an ordinary point.
//!
//! | file | contents |
//! |---|---|
//! | `form` | [`Form`], [`Coordinate`] |
//! | `operator` | [`FamilyOperator`]: one operator, its response, its named parameters |
//! | `change` | operators between two states, with another neuromuscular system or delay |
//! | `fitted` | [`FittedOperator`]: an operator with the results of its fit |
//! | `zoh` | the exact discrete model of an operator for a held input, with derivatives |
//! | `interpolate` | the discrete model for an error that is linear between samples |
//! | `matrices` | the matrix exponential |
//! | `dual` | dual numbers, which carry their derivatives |

mod change;
mod dual;
#[cfg(test)]
mod examples;
mod fitted;
mod form;
mod interpolate;
mod matrices;
mod operator;
mod zoh;

pub use dual::PARTIAL_COUNT;
pub use fitted::FittedOperator;
pub use form::{Coordinate, Form, POWER_COUNT};
pub use operator::{FamilyOperator, FamilyResponse, NamedParameter, PARAMETERS};
pub use zoh::ZohFamilyOperator;
