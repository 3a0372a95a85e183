//! A person in a basis that people share: what changes is a few gains.
//!
//! People who track integrate slow errors, lead, and act through a neuromuscular system and a delay,
//!
//! `Y(s) = N(s)/((T_I s + 1) (s^2/omega^2 + 2 zeta s/omega + 1)) e^{-tau s}`,
//! `N(s) = n_0 + n_1 s + n_2 s^2`
//!
//! (D. T. McRuer and H. R. Jex, IEEE Trans. Human Factors in Electronics 8 (1967) 231-249). Data of
//! seconds determine the numerator; poles, lag and delay they do not, and they are nearly the same
//! for everybody. So those begin at what is usual ([`basis`]), and with the responses x_i of
//! `s^i/(..)` to the error
//!
//! `u = sum_i theta_i x_i + level + v`, `D(q^-1) v = eps`,
//!
//! which is linear in the gains. Data of a minute do determine omega, zeta and tau: corrections of
//! them are estimated with the gains, to first order, and where they have grown the basis moves
//! there (`place`). The lag stays. A gain with a lead but without a lag is in the span: then
//! `N = (K_e + K_e_dot s)(T_I s + 1)`, and is weighed against any numerator.
//!
//! - **Noise** ([`noise`]). D is a long autoregression by least squares with a slow memory. At each
//!   sample all its lags are made with the same gains, so that a move of the gains leaves no step in
//!   it. The level of eps follows with a time constant of its own: a remnant that grows makes the
//!   gains slower, not faster.
//! - **Gains** ([`gains`]). Extended Kalman filters of `[theta, level, corrections]` differ in form and
//!   in how much the gains drift: hardly, somewhat, much, or just changed. Weights follow the
//!   likelihood, forgotten slowly. While nothing changes the one that hardly drifts wins, and the
//!   precision grows. (D. T. Magill, IEEE Trans. Automatic Control 10 (1965) 434-439.) The likelihood
//!   and the gain are those of a Student distribution, so that an outlier says little.
//! - **Rivals** (`contest`). Others begin at other delays and poles, at the start and after each
//!   change; the one that foretells best is believed.
//! - **The end of the stick** (`ends`). Nothing is learnt of an output that stands there.
//! - **Changes** ([`detector`]). Declared from the difference of Y at one frequency, or of gains
//!   and what is held, between the last seconds and the time before ([`blocks`]), each fitted by least squares with
//!   a variance of its own (G. C. Chow, Econometrica 28 (1960) 591-605; unequal variances: B. L. Welch,
//!   Biometrika 34 (1947) 28-35), in units of how much the same person varies without a change. What
//!   changed is told by [`difference`].
//!
//! Nothing has to be fitted before: the estimate begins with the first second, whose ratio of
//! output to error gives the scale of the gains' prior. Where an earlier fit of the person is at hand
//! ([`known`]), it begins there. [`PopulationFilter`] is the recursion.

pub mod basis;
pub mod blocks;
pub mod detector;
pub mod difference;
pub mod gains;
pub mod known;
pub mod noise;
pub mod usual;

mod cholesky;
mod contest;
mod elimination;
mod ends;
mod filter;
mod follower;
mod kalman;
mod operator;
mod pair;
mod past;
mod place;
mod prior;
mod sizes;

pub use filter::{PopulationFilter, errors_needed};
pub use operator::through;
pub use prior::PopulationPrior;
pub use sizes::{DRIFTS, FORMS, GAINS, HELD, LARGEST_ORDER, LINEAR, PARAMETERS, RIVALS, SIGNALS, STATES};
