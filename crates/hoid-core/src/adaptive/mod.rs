//! Sample-by-sample tracking of a human operator: a bank of Kalman filters in a physical basis, with change detection.
//!
//! Symbols follow Y. Bar-Shalom, X. R. Li and T. Kirubarajan, *Estimation with Applications to Tracking and
//! Navigation*, 2001 (BLK). Changes follow R. P. Adams and D. J. C. MacKay, *Bayesian online changepoint detection*,
//! 2007 (AM), and A. S. Willsky and H. L. Jones, *IEEE Trans. Automatic Control* 21 (1976) 108-112 (WJ). The steps, in
//! the order of the code:
//!
//! 1. **Model** ([`basis`]; D. T. McRuer and H. R. Jex, *IEEE Trans. Human Factors in Electronics* 8 (1967) 231-249).
//!    `Y(s) = (n_0 + n_1 s + n_2 s^2)/((T_I s + 1)(s^2/omega^2 + 2 zeta s/omega + 1)) e^{-tau s}`. With the responses
//!    z_i of `s^i/(..)` to the error, `u = sum_i theta_i z_i(omega, zeta, tau) + level + v`, `D(q^-1) v = eps`. The
//!    state is `x = [theta (3), level, d omega, d zeta, d tau]`: the gains may change, omega, zeta and tau have small
//!    corrections, and T_I is fixed. A few seconds of data determine the numerator; a minute also determines omega,
//!    zeta and tau.
//! 2. **Whitening** (`candidate`). `y = D u` is the measurement and `H = D [dz/dx]` its row; filtering by D turns the
//!    coloured noise v into white noise.
//! 3. **Innovation** (`candidate`). `nu = y - H x^`, where x^ is the mean of step 8 before the sample. The innovation
//!    updates D and sigma^2.
//! 4. **Measurement sums** (`moments`). Over a block of 0.32 s, `A = sum H' H`, `b = sum H' nu`, `E = sum nu^2`.
//! 5. **Prediction** ([`mixture`], `hypothesis`). Hypothesis j assumes no change since its birth: `P_j <- P_j + Q_j`.
//! 6. **Gain and update** (`hypothesis`; BLK section 7.2, information form). `P_j <- (I + P_j A/sigma_j^2)^-1 P_j`,
//!    `x^_j <- x^_j + P_j b/sigma_j^2`, with the new P_j. `W_j = P_j H'/sigma_j^2` is the gain of a sample.
//! 7. **Probability** (`hypothesis`; BLK section 11.6). `mu_j <- Lambda_j mu_j/sum_i Lambda_i mu_i`, where Lambda_j is
//!    the density of the block:
//!    `ln Lambda_j = -1/2 ln det(I + P_j A/sigma_j^2) - (E - b' P_j b/sigma_j^2)/(2 sigma_j^2) + ..`
//! 8. **Mixture** ([`mixture`]; BLK section 1.4.16). `x^ = sum_j mu_j x^_j`,
//!    `P = sum_j mu_j (P_j + (x^_j - x^)(x^_j - x^)')`.
//! 9. **Births and pruning** ([`mixture`]; AM algorithm 1, WJ). The best hypothesis of each class has a child. The
//!    child starts with the probability of the class times the hazard `H = block/mean time between changes`, and the
//!    covariance of a jump is added to P_j.
//! 10. **Noise** ([`noise`], `volatility`). D is an autoregression of the residuals, fitted by least squares. The
//!     spread of the block energies gives the number of samples that count as one independent sample.
//! 11. **Replay** (`filter`). A second candidate reads the record again with the new basis point and D, and replaces
//!     the first candidate when it has caught up. The replays amount to a batch prediction-error fit, repeated at a
//!     bounded cost per sample.
//! 12. **Change test** ([`detector`], [`contrast`], [`difference`]). Least-squares fits before and after a possible
//!     change give `T = d' C^-1 d` (Wald; G. C. Chow, *Econometrica* 28 (1960) 591-605; H. White, *Econometrica* 48
//!     (1980) 817-838). The test of `gain_and_lead` assumes that nothing else changes, and needs fewer data.
//!
//! | this module | BLK | filterpy `IMMEstimator` | difference |
//! |---|---|---|---|
//! | `Hypothesis` | mode-matched filter M_j | `filters[j]` | information form, one update per block |
//! | `state`, `covariance` | `x^_j`, `P_j` | `filters[j].x`, `.P` | P may be singular (a gain with a lead) |
//! | `inflate_gains` | `Q_j` | `filters[j].Q` | the drift decays after a birth |
//! | `log_weight`, `weigh` | `mu_j`, `Lambda_j` | `mu[j]`, `likelihood` | Student density, since sigma_j^2 is estimated |
//! | `mean`, `covariance` | `x^`, `P` | `x`, `P` | none |
//! | `child`, `add_children` | transition p_ij | `M` | births by run length (AM), with P of the parent plus a jump (WJ) |
//! | `free_slot` | merging | mixing | the least likely hypothesis is pruned; no hypotheses are merged |
//!
//! **Time per step.** No step reads more than [`REPLAY_SAMPLES_PER_STEP`] stored samples, so the number of operations
//! is bounded. For two minutes of data at 50 to 200 Hz, the longest step takes 77 us without replays, at the end of a
//! block. With replays over 100 s the longest step takes 193 to 339 us. The mean is 1 to 2 us without and 28 to 80 us
//! with replays (one core of a shared server: `cargo xtask slow step-time`).
//!
//! Outputs at a limit of the stick are censored samples (`saturation`). Operators with other poles and delays that
//! predict u about as well as the estimate widen the reported errors (`alternatives`). The estimate starts either after
//! one second, during which the ratio of output to error sets the scale of the prior of the gains, or from an earlier
//! fit ([`initial_estimate`]). [`AdaptiveFilter`] needs no operating system; its memory is an array that the caller
//! owns.
//! ```
//! use hoid_core::adaptive::{AdaptiveFilter, min_memory, defaults::DefaultOperator};
//!
//! const SAMPLE_TIME_S: f64 = 0.02;
//! // Without memory for replays, as on a microcontroller; memory_needed() gives the numbers that replays take.
//! const MEMORY: usize = 192;
//! assert!(MEMORY >= min_memory(SAMPLE_TIME_S));
//! let person = DefaultOperator::with_delay(0.2);
//! let mut tracker = AdaptiveFilter::new(person.prior(SAMPLE_TIME_S), [0.0; MEMORY]).ok_or("no filter")?;
//!
//! // Two minutes of an operator with a gain of 0.5, a neuromuscular system of 11 rad/s, a delay of 0.2 s, and noise.
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
mod bases;
mod blocks;
mod candidate;
mod f64x2;
mod filter;
mod gain_and_lead;
mod history;
mod hypothesis;
mod last_blocks;
mod memory;
mod moments;
mod operator;
mod prior;
mod saturation;
mod segments;
mod signal_history;
mod sizes;
mod volatility;

pub use filter::{AdaptiveFilter, REPLAY_SAMPLES_PER_STEP, TwoInputFilter};
pub use memory::{errors_needed, memory_needed, memory_needed_for, min_memory};
pub use prior::{AdaptivePrior, DelayPrior};
pub use sizes::{
    DYNAMICS_COUNT, GAIN_COUNT, LINEAR_COUNT, MAX_HYPOTHESES, MAX_NOISE_ORDER, PARAMETER_COUNT, PRODUCT_COUNT,
    SIGNAL_COUNT, START_COUNT, STATE_COUNT, SUM_COUNT, correction_places, delay_place, first_gain, product_count,
    state_count, sum_count,
};
