//! An operator who changes once: gains that follow a sigmoid, with the time and the rate of the
//! change estimated.
//!
//! `u(t) = K_e(t - tau) y1(t) + K_e_dot(t - tau) y2(t) + (1/D) eps`, `K_e_dot = K_e T_L`, where K_e
//! and T_L go from their initial to their last value as `1/(1 + e^{-G (t - t_M)})` (eq. 5) and y1,
//! y2 are the exact responses of the neuromuscular system and the delay to the held error
//! (`objective`). Gains at both ends, t_M, G, omega_nm, zeta_nm, a real tau_e and D are found
//! together by the prediction error method, which is maximum likelihood for normal innovations.
//! Source: P. M. T. Zaal, *Manual control adaptation to changing vehicle dynamics in roll-pitch
//! control tasks*, J. Guidance, Control, and Dynamics 39 (2016).
//!
//! The innovations may have another size after the change ([`NoiseLevel`]). Without that the error
//! bars of one end would be too small and those of the other too large.
//!
//! **Was there a change?** The same model without one is fitted to the same residuals with the same
//! weights: `LR = n ln(V_0/V_1)`. Without a change t_M and G mean nothing, so that LR has no
//! chi-square distribution then (R. B. Davies, *Biometrika* 74 (1987) 33-43); the decision is by
//! the BIC, `LR > 4 ln n`.
//!
//! | module | what it holds |
//! |---|---|
//! | `estimator` | options, and the fit |
//! | `layout` | order and meaning of the parameters, the sigmoid, the bounds |
//! | `objective` | the criterion and its derivatives |
//! | `starts`, `search` | where the searches begin, and how they cross the kinks of the delay |
//! | `noise_level`, `reweighting` | one noise level before the change and one after it |
//! | `inference` | covariance, and whether there was a change |
//! | `profile_likelihood` | intervals of t_M and G |
//! | `fit` | the fitted change with its uncertainty |

mod estimator;
mod fit;
mod inference;
mod layout;
mod noise_level;
mod objective;
mod profile_likelihood;
mod reweighting;
mod search;
mod starts;

pub use estimator::SigmoidChange;
pub use fit::{ChangeParameter, GainsAt, SigmoidFit};
pub use inference::{Comparison, Remark};
pub use layout::SIGMOID_NAMES;
pub use noise_level::NoiseLevel;
