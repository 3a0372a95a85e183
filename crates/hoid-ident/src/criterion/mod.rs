//! The prediction-error criterion of the general model, its gradient and its Gauss-Newton matrix.
//!
//! For `A u = (B/F) q^-nk e + (C/D) eps` and given theta
//!
//! `w = (B/F) q^-nk e`, `v = A u - w`, `eps = (D/C) v` (eq. 5.4)
//!
//! and the negative gradient `psi = -d eps/d theta` consists of shifts of one filtered signal per polynomial (Ljung,
//! *System Identification*, 1999, eq. 10.53; with the signs of this notation):
//!
//! | parameter | psi(t) |
//! |---|---|
//! | `a_j` | `-(D/C) u(t-j)` |
//! | `b_j` | `(D/(C F)) e(t-nk-j)` |
//! | `c_j` | `(1/C) eps(t-j)` |
//! | `d_j` | `-(1/C) v(t-j)` |
//! | `f_j` | `-(D/(C F)) w(t-j)` |
//!
//! **Initial states.** With [`InitialState::Zero`] everything before the record is zero and all
//! residuals count. With [`InitialState::Estimate`] nothing is assumed: residuals are used from the
//! first sample at which every input and output in the regression lies inside the record, and what
//! then remains unknown, the nf past values of w and the nc past values of eps, is estimated in
//! each record. eps is affine in these states, so that they are eliminated exactly for each theta
//! (variable projection; G. H. Golub and V. Pereyra, *SIAM J. Numer. Anal.* 10 (1973) 413-432):
//! with the orthonormal basis Q of their responses, `eps = (I - Q Q') eps_0`. The loss is then a function of theta
//! only, its gradient is `-psi' eps` exactly (the states are optimal), and the Gauss-Newton matrix is
//! `psi' (I - Q Q') psi` (the approximation of L. Kaufman, *BIT* 15 (1975) 49-57). A shifted signal differs from the
//! true derivative only by a free response of 1/F or 1/C, which lies in the span of Q: shifting stays exact. This also
//! holds if u has a level ([`Data::level`]), which is one more such state.
//!
//! With [`InitialState::Backcast`] the past of w is unknown as before, but that of the noise is
//! stationary ([`stationary_noise`]): the residuals start nd samples earlier, and the state of the
//! noise model counts as r further residuals z. Without an input, A replaces D and the residuals start with the record.
//!
//! **Several inputs.** `A u = sum_i (B_i/F_i) q^-nk_i e_i + (C/D) eps`: each has its own s, w, B and
//! F, psi of its coefficients has the two rows of B and F above with its own signals, and the past
//! values of each w are unknown ([`further`]). Ljung, 1999, section 4.2 (eq. 4.35).
//!
//! **Weights** multiply the squared residuals; they are used by the robust loss.
//!
//! **A long record** is processed span by span after its first part ([`pass`]), so that a fit needs little memory in
//! addition to the record.
//!
//! | module | contents |
//! |---|---|
//! | `prediction_error` | the criterion: records, orders, residuals that count |
//! | `initial_state` | assumptions about the time before a record |
//! | `polynomials` | A, B, C, D and F as parts of theta |
//! | `further_input` | a further input: orders, values, signals |
//! | `further` | inputs in addition to e |
//! | `signals`, `whitening` | the signals of a record at one theta |
//! | `initial_state_responses` | exact elimination of the unknown past of a record |
//! | `stationary_noise` | the noise before the record, when it was stationary |
//! | `pass` | a pass over a record; a long one span by span |
//! | `normal_equations` | products of the residuals and the columns of psi |
//! | `linearisation` | evaluation of the criterion for a search |
//! | `workspace` | the memory of the signals |

mod further;
pub(crate) mod further_input;
mod initial_state;
pub mod initial_state_responses;
mod linearisation;
mod normal_equations;
mod pass;
mod polynomials;
mod prediction_error;
mod signals;
pub mod stationary_noise;
mod whitening;
mod workspace;

pub use initial_state::{InitialState, first_residual};
pub(crate) use polynomials::Block;
pub(crate) use prediction_error::{Criterion, Data, output_variance};
pub(crate) use workspace::Workspace;

#[cfg(test)]
mod tests;
