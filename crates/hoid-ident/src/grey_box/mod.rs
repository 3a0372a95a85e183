//! Grey box: the prediction-error fit in physical parameters.
//!
//! `eta = [K_e, K_e_dot, omega_nm, zeta_nm, tau_e, T_n]` with a real delay
//! ([`mod@hoid_model::delayed_operator`]) and the remnant as the exact zero-order hold of
//! `K_n/(T_n s + 1)^m` with its zeros ([`hoid_model::remnant_noise`]). The predictor is the one of
//! `u = (B/F) q^-nk e + (C/D) eps` with the polynomials `theta(eta)`; the criterion is that of the
//! general model, so that initial states are eliminated exactly, and `psi_eta = psi d theta/d eta`.
//! Where Box-Jenkins with nc = 0 has a free D of order m, this model has only T_n, and neither D nor nk has to
//! compensate for missing structure: T_n, K_n and tau_e are consistent. K_n follows from the innovation:
//! `K_n = sigma/g(T_n)`.
//!
//! The order m is given or chosen by BIC over a range; for m of 1 and more the number of parameters is the same, so
//! that the loss is decisive.
//!
//! Source: L. Ljung, *System Identification*, 1999, sections 4.3 (grey boxes) and 7.2; T. Bohlin,
//! *Practical Grey-box Process Identification*, 2006.
//!
//! | module | contents |
//! |---|---|
//! | `options` | [`GreyBox`]: the options, by fields and by names |
//! | `estimator` | the fit |
//! | `layout` | order and bounds of the physical parameters |
//! | `parametrisation` | interface of the criterion to physical parameters |
//! | `objective` | the criterion in physical parameters, and its derivatives |
//! | `starts` | starts of the searches |
//! | `result` | the fit with its standard errors |

mod estimator;
pub(crate) mod layout;
pub(crate) mod objective;
mod options;
pub(crate) mod parametrisation;
mod result;
mod starts;

pub use layout::GREY_BOX_NAMES;
pub use options::GreyBox;
pub use result::{GreyBoxFit, OrderCandidate, OrderFigures};
