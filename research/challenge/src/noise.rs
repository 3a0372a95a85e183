//! Remnants of the challenge.
//!
//! `n(k) = sigma sum over parts of G_i(q) s(k) w_i(k)`, where G_i has unit power, w_i is white with unit variance, and
//! s(k) is the strength, which is known before sample k. A lag is `x += (1 - e^(-Ts/T)) (w - x)`, repeated according to
//! its order; a peak has its poles at `e^(-zeta omega Ts) e^(+-j omega sqrt(1 - zeta^2) Ts)`.

use hoid_sim::RunSeed;

use super::case::{Course, Spectrum};

/// One part of a remnant: its filter and its weight.
#[derive(Debug, Clone)]
struct Part {
    filter: Filter,
    /// Factor on the output of the filter, which gives the part its share of the variance.
    scale: f64,
}

#[derive(Debug, Clone)]
enum Filter {
    Lag { part: f64, x: Vec<f64> },
    Peak { a: [f64; 2], x: [f64; 2] },
}

impl Filter {
    fn lag(time_s: f64, order: usize, ts: f64) -> Self {
        Self::Lag {
            part: 1.0 - (-ts / time_s).exp(),
            x: vec![0.0; order],
        }
    }

    fn peak(omega: f64, zeta: f64, ts: f64) -> Self {
        let radius = (-zeta * omega * ts).exp();
        let turn = omega * (1.0 - zeta * zeta).sqrt() * ts;
        Self::Peak {
            a: [2.0 * radius * turn.cos(), -radius * radius],
            x: [0.0; 2],
        }
    }

    fn step(&mut self, w: f64) -> f64 {
        match self {
            Self::Lag { part, x } => {
                let mut input = w;
                for x in x.iter_mut() {
                    *x += *part * (input - *x);
                    input = *x;
                }
                input
            }
            Self::Peak { a, x } => {
                let output = w + a[0] * x[0] + a[1] * x[1];
                *x = [output, x[0]];
                output
            }
        }
    }

    fn impulse(&self, samples: usize) -> Vec<f64> {
        let mut own = self.clone();
        match &mut own {
            Self::Lag { x, .. } => x.fill(0.0),
            Self::Peak { x, .. } => x.fill(0.0),
        }
        (0..samples).map(|k| own.step(if k == 0 { 1.0 } else { 0.0 })).collect()
    }
}

/// The remnant of a run.
#[derive(Debug, Clone)]
pub(super) struct Noise {
    parts: Vec<Part>,
    driving: Vec<Vec<f64>>,
    ts_s: f64,
}

/// Length of the computed impulse responses (s); the slowest part is a drift with a time constant of 10 s.
const MEMORY_S: f64 = 60.0;
/// Order of the autoregressive model that whitens a remnant.
const WHITENING_ORDER: usize = 30;

impl Noise {
    /// Creates the remnant of a run of the given length. `numbers` from `[0, 1)` determine the time constants and
    /// peaks; `streams` are the random streams of the parts and their pulses.
    pub fn new(
        spectrum: Spectrum,
        course: Course,
        omega_nm: f64,
        numbers: [f64; 3],
        streams: impl Fn(u64) -> RunSeed,
        ts_s: f64,
        samples: usize,
    ) -> Self {
        let between = |low: f64, high: f64, part: f64| low * (high / low).powf(part);
        let band_s = between(0.06, 0.25, numbers[0]);
        let filters = match spectrum {
            Spectrum::Lag(order) => vec![(Filter::lag(band_s / order as f64, order, ts_s), 1.0)],
            Spectrum::Rich => vec![
                (Filter::lag(band_s, 1, ts_s), 0.7),
                (Filter::peak(omega_nm, between(0.15, 0.4, numbers[1]), ts_s), 0.2),
                (Filter::lag(between(3.0, 10.0, numbers[2]), 1, ts_s), 0.1),
            ],
            Spectrum::Tremor => vec![
                (Filter::lag(band_s, 1, ts_s), 0.75),
                (Filter::peak(between(50.0, 60.0, numbers[1]), 0.03, ts_s), 0.25),
            ],
        };
        let length = (MEMORY_S / ts_s) as usize;
        let parts: Vec<Part> = (filters.into_iter())
            .map(|(filter, share): (Filter, f64)| {
                let power: f64 = filter.impulse(length).iter().map(|g| g * g).sum();
                Part {
                    scale: (share / power).sqrt(),
                    filter,
                }
            })
            .collect();
        let driving = (0..parts.len() as u64)
            .map(|i| driving_noise(course, streams(10 + 2 * i), streams(11 + 2 * i), ts_s, samples))
            .collect();
        Self { parts, driving, ts_s }
    }

    /// Returns the remnant at sample k, which has unit variance for s = 1.
    pub fn step(&mut self, k: usize, s: f64) -> f64 {
        let each = self.parts.iter_mut().zip(&self.driving);
        each.map(|(part, w)| part.scale * part.filter.step(s * w[k])).sum()
    }

    /// Returns the whitening filter `1 + a_1 q^-1 + ...` and the variance of the innovations, by the Levinson-Durbin
    /// recursion on the autocovariance.
    pub fn whitening(&self) -> (Vec<f64>, f64) {
        let length = (MEMORY_S / self.ts_s) as usize;
        let mut covariance = vec![0.0; WHITENING_ORDER + 1];
        for part in &self.parts {
            let g = part.filter.impulse(length);
            for (lag, sum) in covariance.iter_mut().enumerate() {
                let products: f64 = g[lag..].iter().zip(&g).map(|(a, b)| a * b).sum();
                *sum += part.scale * part.scale * products;
            }
        }
        // A little white noise protects the recursion from rounding errors.
        covariance[0] *= 1.0 + 1e-9;
        levinson(&covariance)
    }
}

/// Returns the coefficients `[1, a_1, ...]` and the innovation variance of the autoregressive model with this
/// autocovariance (J. Durbin, Rev. Int. Stat. Inst. 28 (1960) 233-244).
pub(super) fn levinson(covariance: &[f64]) -> (Vec<f64>, f64) {
    let order = covariance.len() - 1;
    let mut a = vec![0.0; order + 1];
    a[0] = 1.0;
    let mut variance = covariance[0];
    for m in 1..=order {
        let sum: f64 = (0..m).map(|i| a[i] * covariance[m - i]).sum();
        let reflection = -sum / variance;
        let before = a.clone();
        for i in 1..=m {
            a[i] = before[i] + reflection * before[m - i];
        }
        variance *= 1.0 - reflection * reflection;
    }
    (a, variance)
}

/// Number of pulses per second; `PULSE_VARIANCE_SHARE` is their share of the variance, and `IMPULSES` the probability
/// and the size of impulses.
const PULSES_PER_S: f64 = 2.0;
const PULSE_VARIANCE_SHARE: f64 = 0.8;
const IMPULSES: (f64, f64) = (0.02, 7.0);
const ON_OFF_S: f64 = 2.0;
const ON_OFF: [f64; 2] = [0.2, 1.8];

/// Returns the density of w as a mixture of normal densities, given by their weights and variances, for the oracle.
/// Each mixture has unit variance.
pub(super) fn density(course: Course, ts_s: f64) -> Vec<(f64, f64)> {
    match course {
        Course::Impulsive => {
            let (chance, size) = IMPULSES;
            let small = 1.0 / (1.0 - chance + chance * size * size);
            vec![(1.0 - chance, small), (chance, small * size * size)]
        }
        Course::Pulsed => {
            let chance = (PULSES_PER_S * ts_s).min(1.0);
            let small = 1.0 - PULSE_VARIANCE_SHARE;
            vec![(1.0 - chance, small), (chance, small + PULSE_VARIANCE_SHARE / chance)]
        }
        Course::Intermittent => ON_OFF.iter().map(|variance| (0.5, *variance)).collect(),
        _ => vec![(1.0, 1.0)],
    }
}

fn driving_noise(course: Course, normal: RunSeed, uniform: RunSeed, ts_s: f64, samples: usize) -> Vec<f64> {
    let mut w = normal.white_noise(samples);
    let density = density(course, ts_s);
    let draws = uniform.uniform_numbers(samples);
    match course {
        Course::Impulsive | Course::Pulsed => {
            for (w, draw) in w.iter_mut().zip(draws) {
                let kind = usize::from(draw < density[1].0);
                *w *= density[kind].1.sqrt();
            }
        }
        Course::Intermittent => {
            // Switching probability per sample of a two-state Markov chain with these mean times.
            let chance = 0.5 * (1.0 - (-2.0 * ts_s / ON_OFF_S).exp());
            let mut on = draws.first().is_some_and(|draw| *draw < 0.5);
            for (w, draw) in w.iter_mut().zip(draws.into_iter().rev()) {
                *w *= ON_OFF[usize::from(on)].sqrt();
                if draw < chance {
                    on = !on;
                }
            }
        }
        _ => {}
    }
    w
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(spectrum: Spectrum, course: Course, samples: usize) -> Vec<f64> {
        let streams = |tag| RunSeed {
            seed: 5,
            cell: tag,
            replication: 0,
        };
        let mut noise = Noise::new(spectrum, course, 11.0, [0.5; 3], streams, 0.01, samples);
        (0..samples).map(|k| noise.step(k, 1.0)).collect()
    }

    #[test]
    fn every_remnant_has_unit_variance() {
        for (spectrum, course) in [
            (Spectrum::Lag(1), Course::Steady),
            (Spectrum::Lag(3), Course::Impulsive),
            (Spectrum::Rich, Course::Intermittent),
            (Spectrum::Tremor, Course::Pulsed),
        ] {
            let n = noise(spectrum, course, 150_000);
            let variance = n.iter().map(|x| x * x).sum::<f64>() / n.len() as f64;
            // The drift of 5.5 s has 1500 s/11 s independent values, so its 10 % of the variance are accurate to 10 %;
            // the intermittent part has 375 on-off pairs.
            assert!((variance - 1.0).abs() < 0.12, "{spectrum:?} {course:?} {variance}");
        }
    }

    #[test]
    fn whitening_filter_whitens_the_noise() {
        let streams = |tag| RunSeed {
            seed: 6,
            cell: tag,
            replication: 0,
        };
        for spectrum in [Spectrum::Lag(2), Spectrum::Rich, Spectrum::Tremor] {
            let samples = 30_000;
            let mut noise = Noise::new(spectrum, Course::Steady, 11.0, [0.5; 3], streams, 0.01, samples);
            let n: Vec<f64> = (0..samples).map(|k| noise.step(k, 1.0)).collect();
            let (a, variance) = noise.whitening();
            let w: Vec<f64> = (a.len()..samples)
                .map(|k| a.iter().enumerate().map(|(i, a)| a * n[k - i]).sum())
                .collect();
            let power = w.iter().map(|x| x * x).sum::<f64>() / w.len() as f64;
            // The standard error sqrt(2/n) is .008.
            assert!(
                (power / variance - 1.0).abs() < 0.03,
                "{spectrum:?}: {power} {variance}"
            );
            for lag in [1, 2, 5, 20] {
                let product: f64 = w[lag..].iter().zip(&w).map(|(a, b)| a * b).sum();
                let correlation = product / w.len() as f64 / power;
                assert!(
                    correlation.abs() < 0.03,
                    "{spectrum:?} lag {lag}: {correlation}, power {power} of {variance}"
                );
            }
        }
    }

    #[test]
    fn densities_sum_to_one_and_have_unit_variance() {
        for course in [Course::Steady, Course::Impulsive, Course::Pulsed, Course::Intermittent] {
            let density = density(course, 0.01);
            let weights: f64 = density.iter().map(|(p, _)| p).sum();
            let variance: f64 = density.iter().map(|(p, v)| p * v).sum();
            assert!(
                (weights - 1.0).abs() < 1e-12 && (variance - 1.0).abs() < 1e-12,
                "{course:?}"
            );
        }
    }
}
