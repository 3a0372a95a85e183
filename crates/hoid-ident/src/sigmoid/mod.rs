//! An operator that changes once: gains that follow a sigmoid, with the time and the rate of the change estimated.
//!
//! `u(t) = sum_i n_i(t - tau) y_i(t) + (1/D) eps`, where y_i is the exact response of `s^i` over the poles of the
//! operator, after their delay, to the held error ([`objective`]), and n_i the coefficients of their numerator. Its
//! parameters, the gain and T_L (or c_1 and c_2, or T_L and alpha), change from their initial to their last value as
//! `1/(1 + e^{-G (t - t_M)})` (eq. 5); the lag, the neuromuscular part and the delay are constant. Every form of
//! [`hoid_model::operator_family`] is possible; the default is a gain and a lead, `u = K_e y_0 + K_e_dot y_1`,
//! `K_e_dot = K_e T_L`. The numerators before and after the change, t_M, G, the poles, a real tau_e and D are estimated
//! together by the prediction error method, which is maximum likelihood for normal innovations. Source: P. M. T. Zaal,
//! *Manual control adaptation to changing vehicle dynamics in roll-pitch control tasks*, J. Guidance, Control, and
//! Dynamics 39 (2016); the family: D. T. McRuer and H. R. Jex, IEEE Trans. Human Factors in Electronics 8 (1967)
//! 231-249.
//!
//! The innovations may have another standard deviation after the change ([`NoiseLevel`]). Without this the error bars
//! of one end would be too small and those of the other too large.
//!
//! **Test for a change.** The same model without a change is fitted to the same residuals with the same weights:
//! `LR = n ln(V_0/V_1)`. Without a change t_M and G have no meaning, so that LR does not have a chi-square distribution
//! (R. B. Davies, *Biometrika* 74 (1987) 33-43); the decision is by the BIC, `LR > 4 ln n`.
//!
//! | module | contents |
//! |---|---|
//! | `options` | [`SigmoidChange`]: the options, by fields and by names |
//! | `estimator` | the fit |
//! | `layout` | order and meaning of the parameters |
//! | `bounds` | their search ranges |
//! | `instant` | the sigmoid and the numerator at one time |
//! | `unit_operator` | responses of each power of s over the poles, with their derivatives |
//! | `objective` | the criterion and its derivatives |
//! | `prior` | prior knowledge |
//! | `frozen`, `ranking`, `starts` | poles, numerators and changes from which searches start |
//! | `search` | searches across the kinks of the delay |
//! | `noise_level`, `reweighting` | one noise level before the change and one after it |
//! | `inference` | covariance, and the test for a change |
//! | `profile_likelihood` | intervals of t_M and G |
//! | `ends` | the operator before and after the change, and at any time |
//! | `fit` | the fitted change with its standard errors |

mod bounds;
mod ends;
mod estimator;
mod fit;
mod frozen;
mod inference;
mod instant;
mod layout;
mod noise_level;
mod objective;
mod options;
mod prior;
mod profile_likelihood;
mod ranking;
mod reweighting;
mod search;
mod starts;
mod unit_operator;

pub use ends::{ChangedOperator, NamedEstimate};
pub use fit::{ChangeParameter, GainsAt, SigmoidFit};
pub use inference::{Comparison, Remark};
pub use layout::SIGMOID_NAMES;
pub use noise_level::NoiseLevel;
pub use options::SigmoidChange;
