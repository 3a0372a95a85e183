//! Crossover frequency, phase and gain margin, and the stability of a loop with delay.
//!
//! For the open loop L in a loop with unit negative feedback,
//!
//! - the gain crossovers are where `|L| = 1`; the phase margin there is `180 deg + arg L`, between
//!   -180 and 180 deg;
//! - the phase crossovers are where L crosses the negative real axis (`arg L = -180 deg` modulo 360
//!   deg); the gain margin there is `-20 log10 |L|` dB.
//!
//! If there are several, the phase margin nearest to 0 deg and the gain margin nearest to 0 dB are returned, each with
//! its frequency. MATLAB's `margin` and python-control's `margin` use the same rule. Margins do not show whether a loop
//! is stable, and have no meaning for an unstable one: see [`closed_loop_is_stable`].
//!
//! **Scan.** A logarithmic grid, halved wherever the phase turns by more than 0.5 rad between
//! neighbours, as seen from their phases or from the slope of the phase at each (a whole round
//! between two points would look like no turn), so that the phase is followed however fast a delay
//! turns it; sign changes are refined by bisection to rounding. A pair of crossings closer than the
//! grid (a curve that only touches) is not seen.
//!
//! **Stability.** With `L = N e^{-s tau} / D`, the closed loop is stable when
//! `F(s) = D + N e^{-s tau}` has no zero in the closed right half plane. `F/(s + a)^n`, n the
//! degree of D, is analytic there and goes to 1, so that its argument turns by `-pi Z` along s = j
//! omega, omega from 0 to infinity, Z the number of zeros (Cauchy's argument principle; Mikhailov's
//! form of the Nyquist criterion). F has no poles, so that open-loop poles at the origin or on the
//! axis need no detour, and common factors of N and D in the right half plane count as they should.
//! For an operator of which only the frequency response Y is known ([`unstable_poles`]), stable and
//! sampled, `F = D + N Y e^{-s tau}` is followed up to a frequency beyond which `|L| < 1`.

mod closed_loop;
mod crossings;

pub use closed_loop::{closed_loop_is_stable, unstable_poles};
pub use crossings::{Crossing, Crossings, MANUAL_CONTROL_RANGE_RAD_S, Margins, crossings, margins};

#[cfg(test)]
mod tests;
