//! The idle head of a record: the samples recorded before the run started.
//!
//! A person who waits for the run to start is not tracking. A fit of such samples gives meaningless delays and poles
//! with small standard errors. The head is the longest stretch at the start of a record in which both e and u stay
//! within [`IDLE_SHARE`] of their later size from their median over the first second, or within one step of their
//! resolution. The size is the 90 % quantile of the distance from the median in the second half of the record. A head
//! shorter than [`MIN_HEAD_S`] does not count, because signals start near zero.

use hoid_model::Record;
use hoid_numerics::statistics::{upper_median, upper_quantile};

/// Distance from the median of the first second, as a share of the later size of the signal, within which a signal is
/// idle.
const IDLE_SHARE: f64 = 0.02;
/// Shortest idle head, s.
const MIN_HEAD_S: f64 = 1.0;
/// Quantile of the distance from the median that defines the size of a signal.
const SIZE_QUANTILE: f64 = 0.9;
/// Largest distance, in steps of the resolution, of an idle value from the median of the first second.
const MAX_RESOLUTION_STEPS: f64 = 1.01;
/// Largest step of a resolution, as a share of the size of the signal.
const MAX_RESOLUTION_SHARE: f64 = 0.2;

/// Returns the number of samples at the start of a record in which neither e nor u moves; 0 if they last less than a
/// second, and all samples if neither signal ever moves.
pub fn idle_head(record: &Record) -> usize {
    let second = (1.0 / record.sample_time().s()).round().max(1.0) as usize;
    let still = |signal: &[f64]| {
        let later = &signal[signal.len() / 2..];
        let centre = upper_median(&mut later.to_vec()).unwrap_or(0.0);
        let mut off: Vec<f64> = later.iter().map(|x| (x - centre).abs()).collect();
        let size = upper_quantile(&mut off, SIZE_QUANTILE).unwrap_or(0.0);
        let steps = || later.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0);
        let step = steps().fold(f64::INFINITY, f64::min);
        // Noise has no resolution: its differences are not multiples of the smallest difference.
        let multiple = |d: f64| (d / step - (d / step).round()).abs() < 1e-3;
        let coarse = step <= MAX_RESOLUTION_SHARE * size && steps().all(multiple);
        let room = if coarse {
            (MAX_RESOLUTION_STEPS * step).max(IDLE_SHARE * size)
        } else {
            IDLE_SHARE * size
        };
        let first = upper_median(&mut signal[..second.min(signal.len())].to_vec()).unwrap_or(0.0);
        signal.iter().take_while(|x| (*x - first).abs() <= room).count()
    };
    if record.is_empty() {
        return 0;
    }
    let head = match record.input() {
        [] => still(record.output()),
        input => still(input).min(still(record.output())),
    };
    if head as f64 * record.sample_time().s() < MIN_HEAD_S {
        0
    } else {
        head
    }
}

/// Returns the default span of the start fit (in s): the first third after the idle head.
pub fn default_start_span(record: &Record) -> (f64, f64) {
    let head = match idle_head(record) {
        all if all >= record.len() => 0,
        head => head,
    };
    let begin = record.time_s(head);
    (
        begin,
        begin + (record.len() - head) as f64 * record.sample_time().s() / 3.0,
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::{
        Channel,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use super::*;

    fn with_head(record: &Record, e: &[f64], u: &[f64]) -> Record {
        let joined = |name: &str, head: &[f64], rest: &[f64]| Channel::new(name, "", [head, rest].concat());
        let input = joined("e", e, record.input());
        Record::new(record.sample_time(), input, joined("u", u, record.output())).unwrap()
    }

    #[test]
    fn idle_head_ends_at_the_start_of_the_run() {
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        for seed in 0..20 {
            let seed = RunSeed {
                seed,
                ..RunSeed::default()
            };
            let record = simulator.run(seed, false).unwrap();
            assert_eq!(idle_head(&record), 0);
            let third = record.len() as f64 * 0.01 / 3.0;
            assert_eq!(default_start_span(&record), (0.0, third));
            let noise: Vec<f64> = (0..1500).map(|k| 1e-3 * (f64::from(k) * 12.9898).sin()).collect();
            let offset: Vec<f64> = noise.iter().map(|n| 0.3 + n * 0.1).collect();
            let idle = with_head(&record, &noise, &offset);
            let head = idle_head(&idle);
            assert!((1490..1540).contains(&head), "{head}");
            let (from, to) = default_start_span(&idle);
            assert!((from - 15.0).abs() < 0.5 && (to - from - third).abs() < 0.2);
            // An idle head of half a second is not reported, nor is a head in which only e is idle.
            assert_eq!(idle_head(&with_head(&record, &noise[..50], &offset[..50])), 0);
            let moving: Vec<f64> = (0..1500).map(|k| (f64::from(k) * 0.02).sin()).collect();
            assert_eq!(idle_head(&with_head(&record, &moving, &offset)), 0);
        }
    }

    #[test]
    fn constant_record_is_idle_throughout() {
        let still = |name: &str, x: f64| Channel::new(name, "", vec![x; 500]);
        let record = Record::new(hoid_model::SampleTime::AT_100_HZ, still("e", 0.0), still("u", 2.0)).unwrap();
        assert_eq!(idle_head(&record), 500);
        assert_eq!(default_start_span(&record).0, 0.0);
    }
}
