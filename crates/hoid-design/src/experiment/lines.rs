//! Lines of a forcing function: integer multiples of `2 pi/T`, none of which is a harmonic of another.
//!
//! **Frequencies.** The response of a person to a line contains harmonics, and a nonlinearity adds power at multiples
//! of its frequency. The multiples are chosen so that no ratio of two of them is an integer. Primes have this property,
//! but this condition leaves a larger choice (R. Pintelon and J. Schoukens, *System Identification*, 2012, section
//! 5.2). The candidates are evenly spaced over the logarithm of frequency.
//!
//! **Phases.** The search starts from the phases of M. R. Schroeder (*IEEE Trans. Inf. Theory* 16 (1970) 85-89),
//! `phi_k = -2 pi sum_{j < k} (k - j) p_j` with the relative powers p, and from others spread over the circle. From
//! each start, the phases are changed one at a time, in steps of an eighth of a turn or less, as long as the peak of
//! the signal decreases; the best result is kept.

use std::f64::consts::TAU;

use hoid_model::forcing::Sinusoid;

/// True if two multiples differ by at least `spacing` and neither is a harmonic of the other.
pub(super) fn are_separate_lines(a: u32, b: u32, spacing: u32) -> bool {
    a.abs_diff(b) >= spacing.max(1) && !a.is_multiple_of(b) && !b.is_multiple_of(a)
}

/// Returns multiples within these bounds, all separate ([`are_separate_lines`]) and approximately evenly spaced over
/// the logarithm; fewer than `count` if there is not enough room.
pub(super) fn multiples((least, largest): (u32, u32), count: usize, spacing: u32) -> Vec<u32> {
    let mut taken: Vec<u32> = Vec::new();
    let (low, high) = (f64::from(least).ln(), f64::from(largest).ln());
    for k in 0..count {
        let part = if count > 1 { k as f64 / (count - 1) as f64 } else { 0.0 };
        let wanted = (low + part * (high - low)).exp().round() as u32;
        // Takes the nearest free multiple; of two equally near ones, the larger.
        let near = (0..=largest)
            .flat_map(|d| [wanted.checked_add(d), wanted.checked_sub(d)])
            .flatten();
        let mut near = near.filter(|m| (least..=largest).contains(m));
        if let Some(m) = near.find(|m| taken.iter().all(|t| are_separate_lines(*t, *m, spacing))) {
            taken.push(m);
        }
    }
    taken.sort_unstable();
    taken
}

/// Returns `A cos(omega t)` and `A sin(omega t)` of each line over one period T, with 16 samples per period of the
/// fastest line, but 64 to 8192 in total.
fn sampled_lines(lines: &[Sinusoid], period_s: f64) -> Vec<Vec<(f64, f64)>> {
    let fastest = lines.iter().map(|l| l.omega_rad_s).fold(0.0, f64::max);
    let n = ((16.0 * fastest * period_s / TAU).ceil() as usize).clamp(64, 8192);
    let of = |line: &Sinusoid| -> Vec<(f64, f64)> {
        let angle = |k: usize| line.omega_rad_s * period_s * k as f64 / n as f64;
        (0..n)
            .map(|k| (line.amplitude_deg * angle(k).cos(), line.amplitude_deg * angle(k).sin()))
            .collect()
    };
    lines.iter().map(of).collect()
}

/// Returns the ratio of peak to rms of a sum of sines over its period.
pub fn crest_factor(lines: &[Sinusoid], period_s: f64) -> f64 {
    let table = sampled_lines(lines, period_s);
    peak(&sum(&table, lines)) / rms(lines)
}

fn rms(lines: &[Sinusoid]) -> f64 {
    lines.iter().map(|l| 0.5 * l.amplitude_deg.powi(2)).sum::<f64>().sqrt()
}

fn peak(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, v| most.max(v.abs()))
}

/// Computes the sum of the lines by `A sin(omega t + phi) = sin phi A cos(omega t) + cos phi A sin(omega t)`.
fn sum(table: &[Vec<(f64, f64)>], lines: &[Sinusoid]) -> Vec<f64> {
    let mut values = vec![0.0; table.first().map_or(0, Vec::len)];
    for (of, line) in table.iter().zip(lines) {
        let (s, c) = line.phase_rad.sin_cos();
        for (v, (cosine, sine)) in values.iter_mut().zip(of) {
            *v += s * cosine + c * sine;
        }
    }
    values
}

/// Steps by which phases are changed, alternately.
const PHASE_STEPS: [f64; 6] = [1.0 / 8.0, 1.0 / 16.0, 1.0 / 32.0, 1.0 / 64.0, 1.0 / 128.0, 1.0 / 256.0];
/// Largest number of rounds per step.
const MAX_ROUNDS: usize = 12;
/// Number of starts of the search for phases.
const START_COUNT: usize = 24;

/// Sets the phases of the lines for a low crest factor. Different seeds use different starts.
pub(super) fn set_phases(lines: &mut [Sinusoid], period_s: f64, seed: u64) {
    let power: f64 = lines.iter().map(|l| l.amplitude_deg.powi(2)).sum();
    let relative: Vec<f64> = lines.iter().map(|l| l.amplitude_deg.powi(2) / power).collect();
    let table = sampled_lines(lines, period_s);
    let mut best = f64::INFINITY;
    let mut trial = lines.to_vec();
    // The seed is limited to a million, because larger products would lose their fractional part.
    let first = (seed % 1_000_000) as usize * START_COUNT;
    for start in first..first + START_COUNT {
        for k in 0..trial.len() {
            let turns = match start {
                0 => -(0..k).map(|j| (k - j) as f64 * relative[j]).sum::<f64>(),
                // The fractional parts of the multiples of an irrational number do not repeat.
                _ => ((start * (k + 1)) as f64 * 0.618_033_988_75) + ((k * k) as f64 * 0.414_213_562_37 * start as f64),
            };
            trial[k].phase_rad = (TAU * turns).rem_euclid(TAU);
        }
        let found = minimise_peak(&mut trial, &table);
        if found < best {
            best = found;
            lines.copy_from_slice(&trial);
        }
    }
}

/// Changes the phases until the peak no longer decreases, and returns the peak.
fn minimise_peak(lines: &mut [Sinusoid], table: &[Vec<(f64, f64)>]) -> f64 {
    let mut values = sum(table, lines);
    let mut least = peak(&values);
    for step in PHASE_STEPS {
        for _ in 0..MAX_ROUNDS {
            let before = least;
            for k in 0..lines.len() {
                for sign in [1.0, -1.0] {
                    let phase = (lines[k].phase_rad + sign * step * TAU).rem_euclid(TAU);
                    let [was, is] = [lines[k].phase_rad, phase].map(f64::sin_cos);
                    let turn = |(v, (c, s)): (&f64, &(f64, f64))| v + (is.0 - was.0) * c + (is.1 - was.1) * s;
                    let moved: Vec<f64> = values.iter().zip(&table[k]).map(turn).collect();
                    let found = peak(&moved);
                    if found < least {
                        (least, values) = (found, moved);
                        lines[k].phase_rad = phase;
                    }
                }
            }
            if least >= before {
                break;
            }
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    fn equal_lines(multiples: &[u32], period_s: f64) -> Vec<Sinusoid> {
        let line = |m: &u32| Sinusoid {
            amplitude_deg: 1.0,
            omega_rad_s: f64::from(*m) * TAU / period_s,
            phase_rad: 0.0,
        };
        multiples.iter().map(line).collect()
    }

    #[test]
    fn no_line_is_a_harmonic_of_another() {
        for (least, largest, count) in [(2, 200, 10), (3, 40, 12), (1, 30, 5), (2, 500, 60)] {
            for spacing in [1, 2, 4] {
                let all = multiples((least, largest), count, spacing);
                assert!(!all.is_empty() && all.len() <= count);
                for (i, a) in all.iter().enumerate() {
                    assert!((least..=largest).contains(a));
                    let apart = |b: &u32| !b.is_multiple_of(*a) && b - a >= spacing;
                    assert!(all[i + 1..].iter().all(apart), "{all:?}");
                }
            }
        }
        assert_eq!(multiples((2, 200), 10, 2).len(), 10);
        assert_eq!(multiples((3, 234), 20, 3).len(), 20);
    }

    #[test]
    fn optimised_phases_reduce_the_crest_factor() {
        let all = multiples((2, 200), 10, 1);
        let mut lines = equal_lines(&all, 80.0);
        let before = crest_factor(&lines, 80.0);
        set_phases(&mut lines, 80.0, 0);
        let crest = crest_factor(&lines, 80.0);
        println!("crest factor {crest:.3}, of sines with equal phases {before:.3}");
        assert!(crest < 2.3 && crest < 0.9 * before, "{crest} {before}");
        let mut again = equal_lines(&all, 80.0);
        set_phases(&mut again, 80.0, 0);
        assert_eq!(lines, again);
        let mut other = equal_lines(&all, 80.0);
        set_phases(&mut other, 80.0, 7);
        assert!(lines != other && crest_factor(&other, 80.0) < 2.3);
        // A single line has the crest factor of a sine.
        let one = equal_lines(&[3], 10.0);
        assert!((crest_factor(&one, 10.0) - 2f64.sqrt()).abs() < 1e-2);
    }
}
