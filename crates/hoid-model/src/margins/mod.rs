//! Crossover frequency, phase and gain margins, and the stability of a loop with delay.
//!
//! For the open loop L in a loop with unit negative feedback,
//!
//! - a gain crossover is a frequency at which `|L| = 1`; the phase margin there is `180 deg + arg L`, between -180 and
//!   180 deg;
//! - a phase crossover is a frequency at which L crosses the negative real axis (`arg L = -180 deg` modulo 360 deg);
//!   the gain margin there is `-20 log10 |L|` dB.
//!
//! If there are several crossovers, the phase margin nearest to 0 deg and the gain margin nearest to 0 dB are returned,
//! each with its frequency. MATLAB's `margin` and python-control's `margin` use the same rule. Margins do not show
//! whether a loop is stable, and have no meaning for an unstable loop: see [`closed_loop_is_stable`].
//!
//! **Scan.** The scan starts from a logarithmic grid. A step of the grid is halved if the phase changes by more than
//! 0.5 rad over it, as computed from the phases and from the slopes of the phase at both ends (the phases alone would
//! not show a whole turn within the step). The phase is therefore followed even with a long delay. Each crossing, found
//! by a change of sign, is refined by bisection to rounding. Two crossings between neighbouring grid points
//! (the curve only just crosses the limit and returns) are not detected.
//!
//! **Stability.** With `L = N e^{-s tau} / D`, the closed loop is stable if `F(s) = D + N e^{-s tau}` has no zero in
//! the closed right half plane. `F/(s + a)^n`, where n is the degree of D, is analytic there and, if L is strictly
//! proper, tends to 1. Its argument therefore changes by `-pi Z` along s = j omega from omega = 0 to infinity, where Z
//! is the number of zeros (Cauchy's argument principle; Mikhailov's form of the Nyquist criterion). F has no poles:
//! open-loop poles at the origin or on the imaginary axis need no indentation of the contour, and common factors of N
//! and D in the right half plane are counted correctly. If only the frequency response Y of a stable, sampled operator
//! is known ([`unstable_poles`]), `F = D + N Y e^{-s tau}` is followed up to a frequency beyond which `|L| < 1`.

mod closed_loop;
mod crossings;

pub use closed_loop::{closed_loop_is_stable, unstable_poles};
pub use crossings::{Crossing, Crossings, MANUAL_CONTROL_RANGE_RAD_S, Margins, crossings, margins};

#[cfg(test)]
mod tests;
