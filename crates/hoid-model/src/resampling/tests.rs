//! Decimated records and streams, compared with the expected values.

use std::f64::consts::PI;

use super::*;
use crate::{Channel, ModelError, Record, SampleTime};

/// Sinusoids below 40 Hz, in the pass band at 100 Hz: frequency in Hz, amplitude, phase.
const SINUSOIDS: [(f64, f64, f64); 4] = [(0.13, 1.0, 0.3), (1.7, 0.8, 1.1), (6.3, 0.5, -2.0), (31.0, 0.3, 2.0)];

fn sum_of_sinusoids(t: f64) -> f64 {
    SINUSOIDS
        .iter()
        .map(|(hz, a, p)| a * (2.0 * PI * hz * t + p).cos())
        .sum()
}

fn record(hz: f64, n: usize, e: impl Fn(f64) -> f64, u: impl Fn(f64) -> f64) -> Record {
    let ts = SampleTime::new(1.0 / hz).unwrap();
    let channel = |name: &str, f: &dyn Fn(f64) -> f64| {
        Channel::new(name, "deg", (0..n).map(|k| f(k as f64 * ts.s())).collect::<Vec<_>>())
    };
    let record = Record::new(ts, channel("e", &e), channel("u", &u)).unwrap();
    record
        .with_channel(channel("f_t", &u))
        .unwrap()
        .labelled("run")
        .starting_at(-2.0)
}

/// Largest deviation from a function of time, except near the ends, where the reflection has an effect.
fn max_deviation(values: &[f64], ts: f64, lead: f64, f: impl Fn(f64) -> f64) -> f64 {
    let edge = 30;
    (edge..values.len() - edge)
        .map(|k| (values[k] - f(k as f64 * ts + lead)).abs())
        .fold(0.0, f64::max)
}

#[test]
fn sum_of_sines_is_preserved_at_the_new_rate() {
    for hz in [250.0, 1000.0 / 3.0, 500.0, 1000.0, 1024.0, 2000.0] {
        let (n, slow) = ((8.0 * hz) as usize, |t: f64| 3.0 + sum_of_sinusoids(t));
        let (found, done) = Decimation::Auto.apply(record(hz, n, slow, |t| 2.0 * slow(t))).unwrap();
        let (done, ts) = (done.unwrap(), found.sample_time().s());
        assert!((1.0 / ts - hz / done.factor as f64).abs() < 1e-9);
        let lost = found.len() as f64 * ts * hz - n as f64;
        assert!(lost.abs() <= 0.5 * done.factor as f64, "no sample is lost: {lost}");
        assert!((found.time_s(0) + 2.0).abs() < 1e-12);
        assert!((done.lead_s - 0.5 * (ts - 1.0 / hz)).abs() < 1e-15);
        // The tolerance is 80 dB below the sum of the offset and the amplitudes, which is about 6. At a new rate of 83
        // Hz, the pass band still ends above 31 Hz.
        for (values, lead, times) in [
            (found.input(), done.lead_s, 1.0),
            (found.output(), 0.0, 2.0),
            (found.channel("f_t").unwrap(), 0.0, 2.0),
        ] {
            let error = max_deviation(values, ts, lead, |t| times * slow(t)) / times;
            assert!(error < 6e-4, "{hz} Hz: {error:e}");
        }
    }
}

#[test]
fn gain_and_phase_between_channels_are_preserved() {
    // At each frequency, u is e with half the amplitude and a delay of .1 s.
    for hz in [1.0, 5.0, 20.0, 39.0] {
        let wave = |t: f64| (2.0 * PI * hz * t).cos();
        let late = |t: f64| 0.5 * wave(t - 0.1);
        let (found, done) = record(1000.0, 8000, wave, late).decimated(10).unwrap();
        // Fourier sums over 6 s, which is a whole number of periods, away from the ends.
        let sums = |values: &[f64], lead: f64| {
            let angle = |k: usize| 2.0 * PI * hz * (k as f64 * 0.01 + lead);
            let sum = |f: fn(f64) -> f64| (100..700).map(|k| values[k] * f(angle(k))).sum::<f64>();
            (sum(f64::cos), sum(f64::sin))
        };
        let ((er, ei), (ur, ui)) = (sums(found.input(), done.lead_s), sums(found.output(), 0.0));
        let gain = ur.hypot(ui) / er.hypot(ei);
        let turns = (ui.atan2(ur) - ei.atan2(er)) / (2.0 * PI) - 0.1 * hz;
        assert!((gain - 0.5).abs() < 1e-4, "{hz}: {gain}");
        assert!((turns - turns.round()).abs() < 1e-5, "{hz}: {turns}");
    }
}

#[test]
fn aliasing_frequencies_are_removed() {
    for hz in [60.0, 65.0, 99.0, 100.0, 250.0, 499.0] {
        let (found, _) = record(
            1000.0,
            4000,
            |t| (2.0 * PI * hz * t).cos(),
            |t| (2.0 * PI * hz * t).sin(),
        )
        .decimated(10)
        .unwrap();
        for values in [found.input(), found.output()] {
            assert!(max_deviation(values, 0.01, 0.0, |_| 0.0) < 1e-4, "{hz}");
        }
    }
}

#[test]
fn straight_lines_are_preserved_to_the_ends() {
    let line = |t: f64| 5.0 - 3.0 * t;
    let (found, done) = record(1000.0, 3000, line, line).decimated(10).unwrap();
    for (k, (e, u)) in found.input().iter().zip(found.output()).enumerate() {
        let t = k as f64 * 0.01;
        assert!(
            (e - line(t + done.lead_s)).abs() < 1e-9 && (u - line(t)).abs() < 1e-9,
            "{k}"
        );
    }
    // With an odd factor, the middle coincides with a sample.
    let (found, done) = record(300.0, 900, line, line).decimated(3).unwrap();
    assert!((done.lead_s - 1.0 / 300.0).abs() < 1e-15 && found.len() == 300);
}

#[test]
fn records_that_cannot_be_decimated_are_refused() {
    let short = |n| record(1000.0, n, f64::sin, f64::cos);
    let half = short(2000).decimated(10).unwrap().1.taps / 2;
    for n in [1, 10, half] {
        let error = Decimation::Auto.apply(short(n)).unwrap_err();
        let expected = format!(
            "decimation of run: found {n} samples, but the filter extends {half} samples to each side, expected a longer record"
        );
        assert!(error.to_string().starts_with(&expected), "{error}");
        assert!(Decimation::Off.apply(short(n)).is_ok());
    }
    assert_eq!(short(half + 1).decimated(10).unwrap().0.len(), (half + 1) / 10);
    assert!(matches!(short(100).decimated(0), Err(ModelError::Decimation { .. })));
    assert!(short(2000).decimated(usize::MAX).is_err());
    let slow = record(200.0, 50, f64::sin, f64::cos);
    assert_eq!(Decimation::Auto.apply(slow.clone()).unwrap(), (slow, None));
    for factor in [0, 1, usize::MAX] {
        assert!(
            Decimator::new(factor, SampleTime::AT_100_HZ, [true]).is_err(),
            "{factor}"
        );
    }
    // A record without an input has no held channel.
    let alone = Record::from_output(SampleTime::new(0.001).unwrap(), Channel::new("u", "", vec![1.0; 2000])).unwrap();
    let (found, _) = alone.decimated(10).unwrap();
    assert!(found.input().is_empty() && found.output().iter().all(|u| (u - 1.0).abs() < 1e-12));
}

/// Returns the output of a stream for these samples.
fn streamed(hz: f64, factor: usize, samples: impl Iterator<Item = (f64, f64)>) -> Vec<[f64; 2]> {
    let mut decimator = Decimator::new(factor, SampleTime::new(1.0 / hz).unwrap(), [true, false]).unwrap();
    samples.filter_map(|(e, u)| decimator.push([e, u])).collect()
}

#[test]
fn streamed_decimation_is_bit_identical_to_batch() {
    for (hz, factor) in [(1000.0, 10), (250.0, 3), (2000.0, 20), (500.0, 5), (400.0, 2)] {
        let whole = record(hz, (4.0 * hz) as usize, sum_of_sinusoids, |t| sum_of_sinusoids(t - 0.2));
        let samples = whole.input().iter().copied().zip(whole.output().iter().copied());
        let found = streamed(hz, factor, samples);
        let (batch, done) = whole.clone().decimated(factor).unwrap();
        let lag_samples = batch.len() - found.len();
        assert!(
            lag_samples as f64 * factor as f64 / hz <= done.lag_s + 2.0 * factor as f64 / hz,
            "{lag_samples}"
        );
        for (k, [e, u]) in found.iter().enumerate() {
            assert_eq!((*e, *u), (batch.input()[k], batch.output()[k]), "{hz}: {k}");
        }
    }
}

#[test]
fn missing_values_stay_missing_and_are_not_used() {
    let value = |k: usize| sum_of_sinusoids(k as f64 * 1e-3);
    let samples = |k: usize| match k {
        // A gap in e and u, a single invalid value of u, and missing samples at the start.
        0..7 | 1500..1523 => (f64::NAN, f64::NAN),
        2000 => (value(k), f64::INFINITY),
        _ => (value(k), value(k)),
    };
    let found = streamed(1000.0, 10, (0..4000).map(samples));
    for (k, [e, u]) in found.iter().enumerate() {
        let gone = k == 0 || (150..153).contains(&k);
        assert_eq!((e.is_nan(), u.is_nan()), (gone, gone || k == 200), "{k}");
        // The held value in the filter causes errors next to the gap, which are not larger than the step at its end.
        assert!(gone || (e - value(10 * k)).abs() < 0.5, "{k}");
    }
    let nothing = streamed(1000.0, 10, (0..1000).map(|_| (f64::NAN, f64::NAN)));
    assert!(!nothing.is_empty() && nothing.iter().flatten().all(|v| v.is_nan()));
}

#[test]
fn restored_decimator_is_bit_identical() {
    let fresh = || Decimator::new(10, SampleTime::new(1e-3).unwrap(), [true, false]).unwrap();
    for at in [0, 100, 290, 777, 1503] {
        let value = |k: usize| {
            if k % 97 == 3 {
                f64::NAN
            } else {
                sum_of_sinusoids(k as f64 * 1e-3)
            }
        };
        let mut first = fresh();
        for k in 0..at {
            let _ = first.push([value(k), value(k + 1)]);
        }
        let numbers = first.saved_state();
        let mut second = fresh();
        assert!(second.restore(&numbers));
        assert!(!fresh().restore(&numbers[1..]) && !fresh().restore(&[]));
        for k in at..at + 900 {
            let bits = |found: Option<[f64; 2]>| found.map(|values| values.map(f64::to_bits));
            let sample = [value(k), value(k + 1)];
            assert_eq!(bits(first.push(sample)), bits(second.push(sample)), "{at}, {k}");
        }
    }
}
