//! Guard in front of a recursion. It detects samples and spans that do not come from tracking.
//!
//! A wrong sample of e has more effect than its innovation shows. It enters `w = (B/F) q^-nk e` and the gradients of w
//! only nk samples later, and affects them for the time constants of F. Limiting the innovations is therefore not
//! enough: the samples themselves are compared with their predictions before they are used.
//!
//! | file | contents |
//! |---|---|
//! | [`channel`] | one signal: causal prediction of its next sample, scale of the prediction errors, held-back samples |
//! | [`profile`] | both signals over a second: their magnitude and smoothness compared with earlier data; idle, frozen and swapped channels; a model that predicts u worse than the past of u alone |
//! | [`resting`] | distinction between a resting stick and a frozen channel |
//! | [`mod@reference`] | fixed model of the start of the recursion, with which a diverged estimate is detected |
//!
//! The crate `hoid-track` decides how such samples and spans are treated.

pub mod channel;
pub mod profile;
pub mod reference;
pub mod resting;
