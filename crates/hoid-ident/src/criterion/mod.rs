//! The prediction-error criterion of the general model, its gradient and its Gauss-Newton matrix.
//!
//! With `A u = (B/F) q^-nk e + (C/D) eps` and given theta,
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
//! **Initial states.** With [`InitialState::Zero`] all signals are zero before the record, and all residuals count.
//! With [`InitialState::Estimate`] nothing is assumed. The residuals start at the first sample at which every input and
//! output of the regression lies inside the record. The nf past values of w and the nc past values of eps are still
//! unknown; they are estimated for each record. Since eps is affine in these states, they are eliminated exactly for
//! each theta (variable projection; G. H. Golub and V. Pereyra, *SIAM J. Numer. Anal.* 10 (1973) 413-432): with the
//! orthonormal basis Q of their responses, `eps = (I - Q Q') eps_0`. The loss is then a function of theta alone. Its
//! gradient is exactly `-psi' eps`, because the states are optimal, and the Gauss-Newton matrix is
//! `psi' (I - Q Q') psi` (the approximation of L. Kaufman, *BIT* 15 (1975) 49-57). A shifted signal differs from the
//! true derivative only by a free response of 1/F or 1/C, which lies in the span of Q, so shifting remains exact. The
//! same holds if u has a level ([`Data::level`]), which is one more such state.
//!
//! With [`InitialState::Backcast`] the past of w is also unknown, but the past of the noise is stationary
//! ([`stationary_noise`]). The residuals start nd samples earlier, and the r states of the noise model count as
//! additional residuals z. Without an input, A replaces D, and the residuals start at the first sample of the record.
//!
//! **Several inputs.** `A u = sum_i (B_i/F_i) q^-nk_i e_i + (C/D) eps`: each input has its own w, B and F. Its columns
//! of psi follow from its own signals by the formulas for `b_j` and `f_j` above, and the past values of each w are
//! unknown ([`further_inputs`]). Ljung, 1999, section 4.2 (eq. 4.35).
//!
//! **Weights** multiply the squared residuals; the robust loss uses them.
//!
//! **Long records** are processed in spans after a first part ([`pass`]), so a fit needs little memory in addition to
//! the record.
//!
//! | module | contents |
//! |---|---|
//! | `prediction_error` | the criterion: records, orders, residuals that count |
//! | `initial_state` | assumptions about the time before a record |
//! | `polynomials` | division of theta into A, B, C, D and F |
//! | `further_input` | a further input: orders, values, signals |
//! | `further_inputs` | responses to inputs in addition to e, and their columns of psi |
//! | `signals`, `whitening` | the signals of a record for one theta |
//! | `initial_state_responses` | exact elimination of the unknown past of a record |
//! | `stationary_noise` | stationary noise before the record |
//! | `pass` | a pass over a record, in spans if the record is long |
//! | `normal_equations` | products of the residuals and the columns of psi |
//! | `linearisation` | evaluation of the criterion for a search |
//! | `workspace` | memory for the signals |

pub(crate) mod further_input;
mod further_inputs;
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
