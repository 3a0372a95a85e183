//! An operator that may change at any time: a bank of hypotheses about the time of the change, weighted by how well
//! each predicts the output.
//!
//! The gains act at the output of the operator, `w = K_e x1 + K_e_dot x2`, where x1 and x2 are the responses of the
//! neuromuscular system to the delayed error and to its rate ([`response`]). After the whitening filter `D(q^-1)` of
//! the noise the model is
//!
//! `D u = K_e D x1 + K_e_dot D x2 + eps`,
//!
//! which is linear in the gains, so a step of their estimate causes no transient in a filter. omega_nm and zeta_nm
//! enter through the derivatives of x1 and x2 at a linearisation point that all hypotheses share and that follows the
//! estimate. D is taken from the start fit and stays constant.
//!
//! **A hypothesis** ([`hypothesis`]) assumes that the operator last changed at its birth. Each hypothesis is a Kalman
//! filter of `eta = [K_e, K_e_dot, omega_nm, zeta_nm]` with its own innovation variance. Apart from a slow drift of the
//! gains, which is faster in the first seconds of the hypothesis, nothing changes after its birth; its memory length
//! therefore grows with its age. At regular intervals a hypothesis is born ([`bank`]): a copy of the likeliest
//! hypothesis, with the covariance of a change added to the covariance of its gains, an innovation variance based on
//! few residuals, and the prior probability of a change since the last birth ([`prior`]). At every few births another
//! hypothesis is born in which omega_nm and zeta_nm may change too. At each sample the probability of a hypothesis is
//! multiplied by its predictive density of the innovation. If the bank is full, the least likely of the hypotheses that
//! are old enough is pruned. (M. Basseville and I. V. Nikiforov, *Detection of Abrupt Changes*, 1993, section 7.2; P.
//! Andersson, *International Journal of Control* 42 (1985) 1175-1193: adaptive forgetting by multiple models; R. P.
//! Adams and D. J. C. MacKay, *Bayesian online changepoint detection*, 2007.)
//!
//! **The estimate** is the mean of the mixture. The covariance of the estimate is the covariance of the mixture, which
//! includes the differences between the hypotheses. T_L is `E[K_e K_e_dot]/E[K_e^2]`, the T that minimises
//! `E (K_e_dot - T K_e)^2`; it stays finite as K_e approaches zero.
//!
//! **The delay** is known, or is a further quantity in which the hypotheses differ: each hypothesis has a delay of
//! whole samples and reads the signals for that delay ([`signal_ring`]). The delay of the mixture is the mean over the
//! hypotheses; its variance includes 1/12 for rounding to whole samples.
//!
//! **A change** ([`change`]) is detected from the odds of the hypotheses born within the last few seconds against the
//! older hypotheses.
//!
//! The modules, each of which depends only on those before it: [`prior`], [`response`], [`signal_ring`],
//! [`hypothesis`], [`change`], [`bank`], and the recursion [`MultipleModelFilter`].

pub mod bank;
pub mod change;
pub mod hypothesis;
pub mod prior;
pub mod response;
pub mod signal_ring;

pub(crate) mod elementary;
mod filter;

pub use filter::MultipleModelFilter;
