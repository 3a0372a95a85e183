//! A guard in front of a recursion: detects samples that no tracking signal contains, and spans without tracking.
//!
//! A wrong sample of e has more effect than its innovation. It enters `w = (B/F) q^-nk e` and the gradients of w only
//! nk samples later, and stays in them for the time constants of F. Limiting innovations is therefore not enough: the
//! samples themselves are compared with their prediction, before they are used.
//!
//! | file | contents |
//! |---|---|
//! | [`channel`] | one signal: the causal prediction of its next sample, the scale of its errors, samples that are held back |
//! | [`profile`] | both signals over a second: sizes and smoothness against those of the past; idle, frozen and swapped channels, a model that predicts less than the past of u alone |
//! | [`resting`] | a resting stick, distinguished from a frozen channel |
//! | [`mod@reference`] | the model of the start next to the estimate: an estimate that has gone diverged |
//!
//! The treatment of such samples and spans is in the crate `hoid-track`.

pub mod channel;
pub mod profile;
pub mod reference;
pub mod resting;
