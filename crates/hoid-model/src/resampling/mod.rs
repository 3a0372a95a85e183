//! Other sampling rates: the filter, and decimation.
//!
//! For a signal x that is sampled every Ts, decimation by M keeps, after a low-pass filter h of linear phase,
//!
//! ```text
//! x'(k) = sum_n h(n) x(k M - n),    k = 0 .. round(N/M) - 1
//! ```
//!
//! (R. E. Crochiere and L. R. Rabiner, *Multirate Digital Signal Processing*, 1983, chapter 2). h is the windowed sinc
//! of [`Kernel`], the same for all channels, its delay compensated: what is between e and u stays between them. Beyond
//! its ends the record continues as its reflection in the end point, `x(-n) = 2 x(0) - x(n)` (as zero-phase filters
//! have it: F. Gustafsson, IEEE Trans. Signal Processing 44 (1996) 988-992), so that no sample is lost and whole
//! periods stay whole. What is invented so reaches half the filter, about 14 new samples, into the record, and is above
//! its pass band.
//!
//! **The filter** passes up to 0.8 of the new Nyquist frequency and stops what would fold into that
//! band, from 1.2 of it on, by 80 dB; in between it falls to half at the Nyquist frequency. A filter
//! that stopped there already would leave a hole in the spectrum of the remnant, which no noise model
//! of a low order has: the form of an operator is then refuted that is true.
//!
//! **Held inputs.** A model of this project holds e between two samples. One with `T = M Ts` delays by T/2 where the
//! person saw the error held over Ts, and the delay that is found would be shorter by `(T - Ts)/2`: at 1000 Hz and M =
//! 10 by 4.5 ms. So the value of e that is held over M old samples is taken in the middle of them, at
//! `k M + (M - 1)/2`: `e'(k)` is ahead of `u'(k)` by `(T - Ts)/2` ([`Decimated::lead_s`]), and the delay is the same at
//! both rates. A ratio u/e of samples has this lead as a phase, which [`Decimated::lead_s`] takes back.
//!
//! **When.** People respond below 10 rad/s and their muscles up to 20 rad/s; at 1000 Hz a neighbouring sample carries
//! almost no new information, and the poles of every model lie within 2 % of 1. [`Decimation::Auto`] takes what is
//! recorded at more than 200 Hz to about 100 Hz: by the M for which the new rate is nearest to it.
//!
//! | file | contents |
//! |---|---|
//! | `kernel` | [`Kernel`]: the filter |
//! | `decimation` | [`Decimation`]: by how much; [`Decimated`]: the actions taken |
//! | `of_record` | decimated records |
//! | `decimator` | [`Decimator`]: sample by sample, with the same digits |

mod decimation;
mod decimator;
mod kernel;
mod of_record;

pub use decimation::{Decimated, Decimation};
pub use decimator::Decimator;
pub use kernel::{Kernel, PASS, STOP_DB};

#[cfg(test)]
mod tests;
