//! Grey box: prediction error fit in physical parameters.
//!
//! The parameters are `eta = [K_e, K_e_dot, omega_nm, zeta_nm, tau_e, T_n]` with a real-valued delay
//! ([`mod@hoid_model::delayed_operator`]). The remnant is the exact zero-order hold of `K_n/(T_n s + 1)^m`, including
//! its zeros ([`hoid_model::remnant_noise`]). The predictor is the predictor of `u = (B/F) q^-nk e + (C/D) eps` with
//! the polynomials `theta(eta)`. The criterion is the same as for the general model, so initial states are eliminated
//! exactly, and `psi_eta = psi d theta/d eta`. A Box-Jenkins model with nc = 0 has a free D of order m; the grey box
//! has only T_n, and neither D nor nk has to compensate for missing structure, so T_n, K_n and tau_e are estimated
//! consistently. K_n follows from the standard deviation sigma of the innovations: `K_n = sigma/g(T_n)`.
//!
//! The order m is given or chosen by BIC from a range. All orders m >= 1 have the same number of parameters, so the
//! loss decides between these orders.
//!
//! Sources: L. Ljung, *System Identification*, 1999, sections 4.3 (grey boxes) and 7.2; T. Bohlin, *Practical Grey-box
//! Process Identification*, 2006.
//!
//! | module | contents |
//! |---|---|
//! | `options` | [`GreyBox`]: options as fields, and their names in text input |
//! | `estimator` | fit of each order, and choice of the order |
//! | `layout` | positions and bounds of the physical parameters |
//! | `parametrisation` | interface between the criterion and the physical parameters |
//! | `objective` | criterion in physical parameters, and its derivatives |
//! | `starts` | starts of the searches |
//! | `result` | fit with its standard errors |

mod estimator;
pub(crate) mod layout;
pub(crate) mod objective;
mod options;
pub(crate) mod parametrisation;
mod result;
mod starts;

pub use layout::GREY_BOX_PARAMETER_NAMES;
pub use options::GreyBox;
pub use result::{GreyBoxFit, OrderCandidate, OrderFigures};
