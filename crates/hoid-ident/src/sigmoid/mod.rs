//! An operator that changes once: the gains follow a sigmoid whose time and rate are estimated.
//!
//! The model is `u(t) = sum_i n_i(t - tau) y_i(t) + (1/D) eps`. Here y_i is the exact response to the held error of an
//! operator with the numerator `s^i`, the poles and the delay ([`objective`]), and n_i are the coefficients of the
//! actual numerator. The parameters of the numerator, i.e. the gain and T_L (or c_1 and c_2, or T_L and alpha), change
//! from their initial to their final value as `1/(1 + e^{-G (t - t_M)})` (eq. 5); lag, neuromuscular part and delay are
//! constant. Every form of [`hoid_model::operator_family`] is possible; the default is a gain and a lead,
//! `u = K_e y_0 + K_e_dot y_1`, `K_e_dot = K_e T_L`. The numerators before and after the change, t_M, G, the poles, a
//! real-valued tau_e and D are estimated together by the prediction error method, which is maximum likelihood for
//! normal innovations. Sources: P. M. T. Zaal, *Manual control adaptation to changing vehicle dynamics in roll-pitch
//! control tasks*, J. Guidance, Control, and Dynamics 39 (2016); for the family, D. T. McRuer and H. R. Jex, IEEE
//! Trans. Human Factors in Electronics 8 (1967) 231-249.
//!
//! The innovations may have a different standard deviation after the change ([`NoiseLevel`]). If this were ignored, the
//! error bars would be too small on one side of the change and too large on the other.
//!
//! **Test for a change.** The same model without a change is fitted to the same records with the same weights:
//! `LR = n ln(V_0/V_1)`. Without a change t_M and G have no meaning, so LR does not have a chi-square distribution (R.
//! B. Davies, *Biometrika* 74 (1987) 33-43). The BIC decides: there is a change if `LR > q ln n` for q additional
//! parameters (four for a gain and a lead).
//!
//! | module | contents |
//! |---|---|
//! | `options` | [`SigmoidChange`]: options as fields, and their names in text input |
//! | `estimator` | fit of the change |
//! | `layout` | order and meaning of the parameters |
//! | `bounds` | search ranges of the parameters |
//! | `sigmoid_point` | sigmoid and numerator at one time |
//! | `unit_operator` | responses for each power of s in the numerator, with their derivatives |
//! | `objective` | criterion and its derivatives |
//! | `prior` | prior knowledge |
//! | `start_dynamics`, `ranking`, `starts` | poles, numerators and changes for the starts of searches |
//! | `search` | searches across the kinks of the loss |
//! | `noise_level`, `reweighting` | different noise levels before and after the change |
//! | `inference` | covariance, and the test for a change |
//! | `profile_likelihood` | intervals of t_M and G |
//! | `operator_states` | operator before the change, after the change and at any time |
//! | `fit` | fitted change with its standard errors |

mod bounds;
mod estimator;
mod fit;
mod inference;
mod layout;
mod noise_level;
mod objective;
mod operator_states;
mod options;
mod prior;
mod profile_likelihood;
mod ranking;
mod reweighting;
mod search;
mod sigmoid_point;
mod start_dynamics;
mod starts;
mod unit_operator;

pub use fit::{ChangeParameter, InstantGains, SigmoidFit};
pub use inference::{Comparison, Remark};
pub use layout::SIGMOID_NAMES;
pub use noise_level::NoiseLevel;
pub use operator_states::{ChangedOperator, NamedEstimate};
pub use options::SigmoidChange;
