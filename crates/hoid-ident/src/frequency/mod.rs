//! Describing functions: the response of a human operator at the lines of a periodic excitation, without a model.
//!
//! Let `E_i, U_i` be the Fourier coefficients of e and u at a line in run i. `H_i = U_i/E_i` is the describing function
//! of that run. The remnant N in `U = H E + N` is fed back through the loop, so the mean of the ratios is biased; the
//! bias increases as E decreases. Let D_i be the coefficient of the forcing function or the disturbance, which is not
//! related to the remnant. The estimate
//!
//! `H = sum_i U_i D_i* / sum_i E_i D_i*`
//!
//! has a bias that is only of second order in the error of its denominator. [`Averaging`] offers the mean of the ratios
//! and this estimate, as well as `D_i = 1` for runs that all had the same excitation.
//!
//! - **Standard error**: with `N_i = U_i - H E_i`, `sigma^2 = n/(n-1) sum |N_i D_i*|^2 / |sum E_i D_i*|^2` estimates
//!   the expectation of `|dH|^2`. The coefficients of a stationary remnant are circular: the real and imaginary parts
//!   each have half of the variance. Therefore `20 log10 |H|` has the standard error `(20/ln 10) sigma/(sqrt(2) |H|)`,
//!   and the phase has the standard error `sigma/(sqrt(2) |H|)` rad. This is valid if the remnant in e is small
//!   compared with e; [`Line::confidence_circle`] is valid for any remnant.
//! - **Coherence** between excitation and u over runs: `|sum U_i D_i*|^2 / (sum |U_i|^2 sum |D_i|^2)`. Its expectation
//!   for n unrelated runs is 1/n.
//! - **Remnant**: the part of u at non-excited frequencies, i.e. the remnant as shaped by the closed loop, `N/(1 + L)`.
//!
//! Sources: D. T. McRuer and H. R. Jex, IEEE Trans. Human Factors in Electronics 8 (1967) 231-249;
//! M. M. van Paassen and M. Mulder, *Identification of Human Operator Control Behaviour in
//! Multiple-Loop Tracking Tasks*, IFAC MMS 1998; R. Pintelon and J. Schoukens, *System
//! Identification: A Frequency Domain Approach*, 2012, sections 2.4 to 2.7; J. S. Bendat and A. G.
//! Piersol, *Random Data*, 2010, chapters 9 and 11.
//!
//! | module | contents |
//! |---|---|
//! | [`Excitation`] | lines that are given, belong to a forcing function, or are found in a channel |
//! | `window`, `spectrum` | whole periods, offsets between channels, Fourier coefficients |
//! | [`DescribingOptions`] | averaging, span, offset, controlled element |
//! | `describe` | [`describe()`]: lines of all runs, averages, standard errors |
//! | `remnant` | power at non-excited frequencies: spectrum, share, noise ratio |
//! | `open_loop` | crossover frequency, phase margin and gain margin by interpolation, with their spread |
//! | `description` | [`describe_runs()`]: complete analysis with all choices made from the records, and the verdict |
//! | `diagnostics` | warnings and notes about a describing function |
//! | `unwrapping` | [`unwrapped_deg()`]: phase without jumps |
//! | `gain_lead_delay` | gain, lead and delay by weighted least squares |

mod describe;
mod description;
mod diagnostics;
mod excitation;
mod gain_lead_delay;
mod open_loop;
mod options;
mod ratio;
mod remnant;
pub(crate) mod spectrum;
mod unwrapping;
mod window;

#[cfg(test)]
mod descriptions;
#[cfg(test)]
mod simulated_runs;
#[cfg(test)]
mod synthetic_records;

pub(crate) use excitation::greatest_common_divisor;
pub(crate) use window::Window;

pub use describe::{DescribingFunction, Line, RunSummary, describe};
pub use description::{Description, RecordDescriptionOptions, describe_runs};
pub use diagnostics::chance_coherence;
pub use excitation::{COMMON_EXCITATIONS, Excitation, LineDetectionOptions, check_excitation};
pub use gain_lead_delay::{GainLeadDelay, GainLeadDelayOptions, LineWeights};
pub use open_loop::{Crossover, DescribingMargins, OpenLoop};
pub use options::{Averaging, DescribingOptions, MeasuredElement, Realisation};
pub use remnant::RemnantBand;
pub use unwrapping::unwrapped_deg;
