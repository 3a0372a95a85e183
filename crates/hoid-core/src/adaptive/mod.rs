//! A person in a basis that people share: what changes is a few gains.
//!
//! People who track integrate slow errors, lead, and act through a neuromuscular system and a delay,
//!
//! `Y(s) = N(s)/((T_I s + 1) (s^2/omega^2 + 2 zeta s/omega + 1)) e^{-tau s}`,
//! `N(s) = n_0 + n_1 s + n_2 s^2`
//!
//! (D. T. McRuer and H. R. Jex, IEEE Trans. Human Factors in Electronics 8 (1967) 231-249). Data of seconds determine
//! the numerator; poles, lag and delay they do not, and they are nearly the same for everybody. So those start at the
//! default ([`basis`]), and with the responses x_i of `s^i/(..)` to the error
//!
//! `u = sum_i theta_i x_i + level + v`, `D(q^-1) v = eps`,
//!
//! which is linear in the gains. Data of a minute do determine omega, zeta and tau: corrections of
//! them are estimated with the gains, to first order, and where they have grown the basis moves
//! there. The lag stays. A gain with a lead but without a lag is in the span: then
//! `N = (K_e + K_e_dot s)(T_I s + 1)`, and is weighed against any numerator.
//!
//! - **Candidates** (`candidate`). One basis and one noise model read the data sample by sample: that is the prediction
//!   error method for given D and a linearisation. The current candidate answers; next to it another one reads the
//!   record again ([`AdaptiveFilter`]), from where the estimate points, with what has been learnt of the noise, and
//!   takes over when it has caught up. Every second one starts elsewhere. So the estimate is that of a batch fit which
//!   is repeated again and again, at a bounded cost for each sample.
//! - **Changes** ([`mixture`]). Within a candidate, hypotheses assume when the operator last changed: they are born in
//!   each block, weighed by what they predicted, and pruned. For each there are forms and drifts.
//! - **Noise** ([`noise`], `volatility`). D is a long autoregression of the residuals, by least squares. The
//!   innovations of a steep remnant have 1e-7 of the power of u, those of a flat one 1e-2: what is supposed of their
//!   variance and of D before the data is in the scale of what D leaves, never in that of u. How unevenly the
//!   innovations come reports how many samples count for one.
//! - **What else predicts as well** (`alternatives`). Other poles and delays that predict u about as well are in the
//!   errors that are reported.
//! - **The end of the stick** (`saturation`). An output that is there says that it would be at least so far.
//! - **Declared changes** ([`detector`]). From the difference of gains and what is held between the last seconds and
//!   the time before (`blocks`, `last_blocks`), by least squares, with the errors that the scores show ([`contrast`];
//!   G. C. Chow, Econometrica 28 (1960) 591-605; H. White, Econometrica 48 (1980) 817-838). What changed is reported by
//!   [`difference`].
//!
//! Nothing has to be fitted before: the estimate starts with the first second, whose ratio of output to error gives the
//! scale of the gains' prior. Where an earlier fit of the person is available ([`known`]), it starts there.
//! [`AdaptiveFilter`] is the recursion: it needs no operating system, and its memory is an array of the caller's.
//!
//! ```
//! use hoid_core::adaptive::{AdaptiveFilter, least_memory, defaults::DefaultOperator};
//!
//! const SAMPLE_TIME_S: f64 = 0.02;
//! // Without what is kept for replays, as on a microcontroller; memory_needed() says how much those take.
//! const MEMORY: usize = 192;
//! assert!(MEMORY >= least_memory(SAMPLE_TIME_S));
//! let person = DefaultOperator::with_delay(0.2);
//! let mut tracker = AdaptiveFilter::new(person.prior(SAMPLE_TIME_S), [0.0; MEMORY]).ok_or("no filter")?;
//!
//! // Two minutes of somebody with a gain of 0.5, muscles of 11 rad/s and a delay of 0.2 s; some noise.
//! let (mut u, mut rate, mut late, mut draw) = (0.0, 0.0, [0.0; 10], 1_u32);
//! for k in 0..6000_u32 {
//!     let t = f64::from(k) * SAMPLE_TIME_S;
//!     let e: f64 = [0.2, 0.6, 1.1, 1.7, 2.8, 4.1, 6.3, 9.0].map(|w| libm::sin(w * t + w * w)).iter().sum();
//!     late.rotate_left(1);
//!     late[9] = e;
//!     rate += SAMPLE_TIME_S * 121.0 * (0.5 * late[0] - u - 2.0 * 0.25 / 11.0 * rate);
//!     u += SAMPLE_TIME_S * rate;
//!     draw = draw.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
//!     let noise = 0.2 * (f64::from(draw) / f64::from(u32::MAX) - 0.5);
//!     tracker.step(e, u + noise);
//! }
//! let [k_e, k_e_dot, omega_nm, zeta_nm, tau_e] = tracker.operator();
//! let error = libm::sqrt(tracker.operator_covariance()[0][0]);
//! assert!((k_e - 0.5).abs() < 4.0 * error && error < 0.05, "{k_e} {error} {k_e_dot} {omega_nm} {zeta_nm} {tau_e}");
//! # Ok::<(), &str>(())
//! ```

pub mod basis;
pub mod contrast;
pub mod defaults;
pub mod detector;
pub mod difference;
pub mod initial_estimate;
pub mod mixture;
pub mod noise;

mod alternatives;
mod blocks;
mod candidate;
mod f64x2;
mod filter;
mod history;
mod hypothesis;
mod last_blocks;
mod moments;
mod operator;
mod prior;
mod saturation;
mod signal_history;
mod sizes;
mod volatility;

pub use filter::{AdaptiveFilter, REPLAYED, errors_needed, least_memory, memory_needed};
pub use operator::through;
pub use prior::AdaptivePrior;
pub use sizes::{DYNAMICS, GAINS, HYPOTHESES, LARGEST_ORDER, LINEAR, PARAMETERS, SIGNALS, STARTS, STATES};
