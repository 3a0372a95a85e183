//! Changes in the sampling rate: the filter, and decimation.
//!
//! For a signal x that is sampled every Ts, decimation by M keeps, after a low-pass filter h of linear phase,
//!
//! ```text
//! x'(k) = sum_n h(n) x(k M - n),    k = 0 .. round(N/M) - 1
//! ```
//!
//! (R. E. Crochiere and L. R. Rabiner, *Multirate Digital Signal Processing*, 1983, chapter 2). h is the windowed sinc
//! of [`Kernel`], the same for all channels, with its delay compensated: the dynamics between e and u are preserved.
//! Beyond its ends the record is continued by its reflection in the end point, `x(-n) = 2 x(0) - x(n)` (as for
//! zero-phase filters: F. Gustafsson, IEEE Trans. Signal Processing 44 (1996) 988-992), so no sample is lost and whole
//! periods are preserved. The effect of this reflection extends over half the filter, about 14 new samples, into the
//! record, and lies above the pass band.
//!
//! **The filter** passes frequencies up to 0.8 of the new Nyquist frequency. From 1.2 times this frequency on, it
//! attenuates the frequencies that would fold into the pass band by 80 dB; in between, its gain falls to one half at
//! the new Nyquist frequency. A filter with a stop band from the new Nyquist frequency on would leave a gap in the
//! spectrum of the remnant, which no noise model of low order can describe, and the true form of the operator would
//! then be rejected.
//!
//! **Held inputs.** The models of hoid hold e between two samples. With `T = M Ts` the hold delays by T/2, while the
//! person saw the error held over Ts, and the estimated delay would be too short by `(T - Ts)/2`: at 1000 Hz and M = 10
//! by 4.5 ms. Therefore the value of e that is held over M old samples is taken from the middle of these samples, at
//! `k M + (M - 1)/2`: `e'(k)` is ahead of `u'(k)` by `(T - Ts)/2` ([`Decimated::lead_s`]), and the delay is the same at
//! both rates. A ratio of the spectra of u and e contains this lead as a phase, for which it must be corrected.
//!
//! **Automatic choice.** People respond to frequencies below 10 rad/s, and their muscles up to 20 rad/s. At 1000 Hz a
//! neighbouring sample carries almost no new information, and the poles of every model are within 2 % of 1.
//! [`Decimation::Auto`] reduces rates of more than 200 Hz to about 100 Hz, with the M that gives the rate nearest to
//! 100 Hz.
//!
//! | file | contents |
//! |---|---|
//! | `kernel` | [`Kernel`]: the filter |
//! | `decimation` | [`Decimation`]: the factor; [`Decimated`]: the data of an applied decimation |
//! | `record_decimation` | decimated records |
//! | `decimator` | [`Decimator`]: decimation sample by sample, with identical values |

mod decimation;
mod decimator;
mod kernel;
mod record_decimation;

pub use decimation::{Decimated, Decimation};
pub use decimator::Decimator;
pub use kernel::{Kernel, PASS_BAND_EDGE, STOP_BAND_ATTENUATION_DB};

#[cfg(test)]
mod tests;
