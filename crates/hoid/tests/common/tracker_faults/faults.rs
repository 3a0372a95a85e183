//! Faults of e and u, inserted into a run.

use std::fmt;

/// Signal of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    E,
    U,
}

/// A fault. The size of an outlier is in standard deviations of the signal, the size of `Innovations` in standard
/// deviations of the innovations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// One or a few deviating samples.
    Outlier { signal: Signal, size: f64, seconds: f64 },
    /// One deviating sample of u.
    Innovations { size: f64 },
    /// Alternating signs, as from a broken contact.
    Crackle { signal: Signal, size: f64, seconds: f64 },
    /// e and u are multiplied by a factor.
    Scaled { factor: f64, seconds: f64 },
    /// One of the signals is multiplied by a factor.
    ScaledOne { signal: Signal, factor: f64, seconds: f64 },
    /// e and u are exchanged.
    Swapped { seconds: f64 },
    /// The sign of u is inverted.
    Flipped { seconds: f64 },
    /// Zeros are inserted into e and u.
    Silence { seconds: f64 },
    /// Noise with a thousandth of the size of the signals is inserted.
    NoisySilence { seconds: f64 },
    /// The signal keeps its last value.
    Frozen { signal: Signal, seconds: f64 },
    /// Both signals keep their last values.
    FrozenBoth { seconds: f64 },
    /// The signal is limited to a number of standard deviations.
    Saturated { signal: Signal, at: f64, seconds: f64 },
    /// The signal is NaN.
    Missing { signal: Signal, seconds: f64 },
    /// Both signals are NaN.
    MissingBoth { seconds: f64 },
}

impl Fault {
    /// Inserts the fault into e and u at sample `at`; returns the first sample after it.
    pub fn insert(&self, e: &mut Vec<f64>, u: &mut Vec<f64>, at: usize, per_second: f64, innovation: f64) -> usize {
        let deviation = |x: &[f64]| {
            let mean = x.iter().sum::<f64>() / x.len() as f64;
            (x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt()
        };
        let sizes = [deviation(e), deviation(u)];
        let size_of = |signal: Signal| sizes[signal as usize];
        let end = |seconds: f64| at + ((seconds * per_second).round() as usize).max(1);
        let mut noise = 7_u64;
        let mut draw = || {
            noise = noise
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (noise >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let pick =
            |signal: Signal, e: &mut Vec<f64>, u: &mut Vec<f64>, each: &mut dyn FnMut(usize, &mut f64), to: usize| {
                let x = if signal == Signal::E { e } else { u };
                (at..to.min(x.len())).for_each(|k| each(k, &mut x[k]));
            };
        let to = match *self {
            Self::Outlier { seconds, .. } | Self::Crackle { seconds, .. } => end(seconds),
            Self::Innovations { .. } => at + 1,
            Self::Scaled { seconds, .. }
            | Self::ScaledOne { seconds, .. }
            | Self::Swapped { seconds }
            | Self::Flipped { seconds }
            | Self::Silence { seconds }
            | Self::NoisySilence { seconds }
            | Self::Frozen { seconds, .. }
            | Self::FrozenBoth { seconds }
            | Self::Saturated { seconds, .. }
            | Self::Missing { seconds, .. }
            | Self::MissingBoth { seconds } => end(seconds),
        };
        match *self {
            Self::Outlier { signal, size, .. } => {
                let size = size * size_of(signal);
                pick(signal, e, u, &mut |_, x| *x += size, to);
            }
            Self::Innovations { size } => u[at] += size * innovation,
            Self::Crackle { signal, size, .. } => {
                let size = size * size_of(signal);
                pick(
                    signal,
                    e,
                    u,
                    &mut |k, x| *x += if k % 2 == 0 { size } else { -size },
                    to,
                );
            }
            Self::Scaled { factor, .. } => {
                pick(Signal::E, e, u, &mut |_, x| *x *= factor, to);
                pick(Signal::U, e, u, &mut |_, x| *x *= factor, to);
            }
            Self::ScaledOne { signal, factor, .. } => pick(signal, e, u, &mut |_, x| *x *= factor, to),
            Self::Swapped { .. } => (at..to.min(e.len())).for_each(|k| std::mem::swap(&mut e[k], &mut u[k])),
            Self::Flipped { .. } => pick(Signal::U, e, u, &mut |_, x| *x = -*x, to),
            Self::Silence { .. } => {
                e.splice(at..at, vec![0.0; to - at]);
                u.splice(at..at, vec![0.0; to - at]);
            }
            Self::NoisySilence { .. } => {
                let quiet: Vec<f64> = (at..to).map(|_| 1e-3 * sizes[0] * draw()).collect();
                e.splice(at..at, quiet);
                let quiet: Vec<f64> = (at..to).map(|_| 1e-3 * sizes[1] * draw()).collect();
                u.splice(at..at, quiet);
            }
            Self::Frozen { signal, .. } => {
                let last = if signal == Signal::E { e[at - 1] } else { u[at - 1] };
                pick(signal, e, u, &mut |_, x| *x = last, to);
            }
            Self::FrozenBoth { .. } => {
                let (a, b) = (e[at - 1], u[at - 1]);
                pick(Signal::E, e, u, &mut |_, x| *x = a, to);
                pick(Signal::U, e, u, &mut |_, x| *x = b, to);
            }
            Self::Saturated { signal, at: level, .. } => {
                let level = level * size_of(signal);
                pick(signal, e, u, &mut |_, x| *x = x.clamp(-level, level), to);
            }
            Self::Missing { signal, .. } => pick(signal, e, u, &mut |_, x| *x = f64::NAN, to),
            Self::MissingBoth { .. } => {
                pick(Signal::E, e, u, &mut |_, x| *x = f64::NAN, to);
                pick(Signal::U, e, u, &mut |_, x| *x = f64::NAN, to);
            }
        }
        to
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |signal: Signal| if signal == Signal::E { "e" } else { "u" };
        match *self {
            Self::Outlier { signal, size, seconds } => write!(f, "{} + {size} sd, {seconds} s", name(signal)),
            Self::Innovations { size } => write!(f, "u + {size} innovations, one sample"),
            Self::Crackle { signal, size, seconds } => write!(f, "{} ± {size} sd, {seconds} s", name(signal)),
            Self::Scaled { factor, seconds } => write!(f, "e, u x {factor:e}, {seconds} s"),
            Self::ScaledOne {
                signal,
                factor,
                seconds,
            } => write!(f, "{} x {factor}, {seconds} s", name(signal)),
            Self::Swapped { seconds } => write!(f, "e and u swapped, {seconds} s"),
            Self::Flipped { seconds } => write!(f, "sign of u changed, {seconds} s"),
            Self::Silence { seconds } => write!(f, "zeros, {seconds} s"),
            Self::NoisySilence { seconds } => write!(f, "noise of 1e-3 sd, {seconds} s"),
            Self::Frozen { signal, seconds } => write!(f, "{} frozen, {seconds} s", name(signal)),
            Self::FrozenBoth { seconds } => write!(f, "e, u frozen, {seconds} s"),
            Self::Saturated { signal, at, seconds } => write!(f, "{} cut at {at} sd, {seconds} s", name(signal)),
            Self::Missing { signal, seconds } => write!(f, "{} NaN, {seconds} s", name(signal)),
            Self::MissingBoth { seconds } => write!(f, "e, u NaN, {seconds} s"),
        }
    }
}

/// Returns all faults of the study.
#[allow(dead_code)]
pub fn faults() -> Vec<Fault> {
    use Signal::{E, U};
    let mut all = Vec::new();
    for signal in [E, U] {
        for size in [5.0, 30.0, 100.0, 1000.0, 1e5] {
            for seconds in [0.0, 0.03, 0.1] {
                all.push(Fault::Outlier { signal, size, seconds });
            }
        }
        all.push(Fault::Crackle {
            signal,
            size: 20.0,
            seconds: 0.06,
        });
    }
    for size in [5.0, 8.0, 15.0, 40.0, 200.0] {
        all.push(Fault::Innovations { size });
    }
    all.extend([
        Fault::Scaled {
            factor: 1e6,
            seconds: 50.0,
        },
        Fault::Scaled {
            factor: 1e3,
            seconds: 90.0,
        },
        Fault::Scaled {
            factor: 10.0,
            seconds: 50.0,
        },
        Fault::ScaledOne {
            signal: E,
            factor: 5.0,
            seconds: 50.0,
        },
        Fault::ScaledOne {
            signal: U,
            factor: 100.0,
            seconds: 20.0,
        },
        Fault::Swapped { seconds: 80.0 },
        Fault::Swapped { seconds: 10.0 },
        Fault::Flipped { seconds: 50.0 },
        Fault::Silence { seconds: 1000.0 },
        Fault::NoisySilence { seconds: 1000.0 },
        Fault::Frozen {
            signal: E,
            seconds: 20.0,
        },
        Fault::Frozen {
            signal: U,
            seconds: 20.0,
        },
        Fault::FrozenBoth { seconds: 50.0 },
        Fault::Saturated {
            signal: U,
            at: 0.7,
            seconds: 50.0,
        },
        Fault::Saturated {
            signal: E,
            at: 0.7,
            seconds: 50.0,
        },
        Fault::Missing {
            signal: E,
            seconds: 3.0,
        },
        Fault::Missing {
            signal: U,
            seconds: 3.0,
        },
        Fault::MissingBoth { seconds: 0.5 },
        Fault::MissingBoth { seconds: 60.0 },
    ]);
    all
}
