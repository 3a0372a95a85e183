use std::collections::BTreeMap;
use std::f64::consts::PI;

use hoid_model::{Channel, Detrend, Record, SampleTime};

use super::*;

const TS: f64 = 0.01;

/// Sinusoids below 0.8 of the Nyquist frequency of 50 Hz: frequency in Hz, amplitude, phase.
const WAVES: [(f64, f64, f64); 5] = [
    (0.13, 1.0, 0.3),
    (1.7, 0.8, 1.1),
    (6.3, 0.5, -2.0),
    (17.0, 0.4, 0.5),
    (39.0, 0.3, 2.0),
];

fn signal(t: f64) -> f64 {
    WAVES.iter().map(|(hz, a, p)| a * (2.0 * PI * hz * t + p).cos()).sum()
}

fn channel(name: &str, n: usize, f: impl Fn(f64) -> f64) -> Channel {
    Channel::new(name, "", (0..n).map(|k| f(k as f64 * TS)).collect())
}

fn record(n: usize, e: impl Fn(f64) -> f64, u: impl Fn(f64) -> f64) -> Record {
    let ts = SampleTime::new(TS).unwrap();
    Record::new(ts, channel("r-y", n, e), channel("stick", n, u))
        .unwrap()
        .labelled("run")
        .starting_at(3.0)
}

fn preparation_with(change: impl FnOnce(&mut Preparation)) -> Preparation {
    let mut preparation = Preparation::default();
    change(&mut preparation);
    preparation
}

fn offset_preparation(channel: &str, offset: Offset) -> Preparation {
    preparation_with(|p| p.offset = BTreeMap::from([(channel.to_owned(), offset)]))
}

fn scaling_preparation(channel: &str, scaling: Scaling) -> Preparation {
    preparation_with(|p| p.scale = BTreeMap::from([(channel.to_owned(), scaling)]))
}

fn message(preparation: &Preparation, n: usize) -> String {
    preparation.apply(record(n, signal, signal)).unwrap_err().to_string()
}

fn max_deviation(a: &[f64], b: impl Fn(usize) -> f64) -> f64 {
    a.iter().enumerate().map(|(k, v)| (v - b(k)).abs()).fold(0.0, f64::max)
}

#[test]
fn default_preparation_changes_nothing() {
    let whole = record(50, signal, f64::sin);
    let (same, steps) = Preparation::default().apply(whole.clone()).unwrap();
    assert_eq!((same, steps.len()), (whole, 0));
}

#[test]
fn scaling_changes_values_and_units() {
    let preparation = preparation_with(|p| {
        p.scale.insert("e".into(), "rad:deg".parse().unwrap());
        p.scale.insert("stick".into(), "12.5:deg".parse().unwrap());
    });
    let (found, steps) = preparation.apply(record(5, |_| PI, |_| 2.0)).unwrap();
    assert!((found.input()[0] - 180.0).abs() < 1e-12 && found.output()[0] == 25.0);
    assert_eq!((found.output_channel().unit.as_str(), steps.len()), ("deg", 2));
    assert_eq!(steps[1].to_string(), "stick multiplied by 12.5 (now in deg)");
    // Each pair is converted forwards and backwards.
    for (from, to) in [("rad", "deg"), ("deg", "mrad"), ("in", "cm"), ("V", "mV"), ("lbf", "N")] {
        let there: Scaling = format!("{from}:{to}").parse().unwrap();
        let back: Scaling = format!("{to}:{from}").parse().unwrap();
        assert!((there.factor() * back.factor() - 1.0).abs() < 1e-15, "{from} {to}");
    }
    let typed: Scaling = "Radians:degrees".parse().unwrap();
    assert_eq!(typed, "rad:deg".parse().unwrap());
    let declared = preparation_with(|p| {
        p.units.insert("e".into(), "degs".into());
        p.units.insert("stick".into(), "counts".into());
    });
    let (found, _) = declared.apply(record(5, |_| PI, |_| 2.0)).unwrap();
    assert_eq!(
        found.channels().map(|c| c.unit.as_str()).take(2).collect::<Vec<_>>(),
        ["deg", "counts"]
    );
    for bad in [
        "0",
        "NaN",
        "inf",
        "",
        ":",
        "deg",
        "rad:m",
        "deg:",
        "2:",
        "rad:furlong",
        "1e999",
    ] {
        let message = bad.parse::<Scaling>().unwrap_err().to_string();
        assert!(message.contains("expected"), "{bad}: {message}");
    }
    let unknown = scaling_preparation("q", Scaling::from_factor(2.0, None).unwrap());
    assert_eq!(
        message(&unknown, 5),
        "run: scale: there is no channel \"q\", expected one of r-y, stick, or e for the input and u for the output"
    );
    let twice = preparation_with(|p| {
        for name in ["e", "r-y"] {
            p.scale.insert(name.into(), Scaling::from_factor(2.0, None).unwrap());
        }
    });
    assert!(message(&twice, 5).contains("named twice"));
    let ts = SampleTime::new(TS).unwrap();
    let in_deg = Record::from_output(ts, Channel::new("u", "deg", vec![1.0])).unwrap();
    let contradicted = scaling_preparation("u", "rad:deg".parse().unwrap());
    let message = contradicted.apply(in_deg).unwrap_err().to_string();
    assert!(message.contains("in deg according to its file"), "{message}");
}

#[test]
fn whole_sample_offsets_shift_rows_exactly() {
    // The output is two samples late in the file.
    let late = record(100, signal, |t| signal(t - 2.0 * TS));
    let preparation = offset_preparation("u", Offset::Samples(2.0));
    let (found, steps) = preparation.apply(late.clone()).unwrap();
    assert_eq!(found.output(), &late.output()[2..]);
    assert_eq!(found.input(), &late.input()[..98]);
    assert!((found.time_s(0) - 3.0).abs() < 1e-12);
    assert!(matches!(
        steps[0],
        Step::Offset {
            interpolated: false,
            cut_samples: (0, 2),
            ..
        }
    ));
    // An offset in s, for a channel that was recorded early: the same number of rows is cut at the other end.
    let early = offset_preparation("e", Offset::Seconds(-0.02));
    let (found, _) = early.apply(late.clone()).unwrap();
    assert_eq!(found.input(), &late.input()[..98]);
    assert_eq!(found.output(), &late.output()[2..]);
    assert!((found.time_s(0) - 3.02).abs() < 1e-12);
}

#[test]
fn fractional_offsets_use_band_limited_interpolation() {
    for offset in [0.5, 1.0 / 3.0, -0.71, 3.017] {
        let n = 600;
        let late = record(n, signal, |t| signal(t - offset * TS));
        let preparation = offset_preparation("u", Offset::Samples(offset));
        let (found, steps) = preparation.apply(late).unwrap();
        let start_s = found.time_s(0) - 3.0;
        // The amplitudes add up to 3, and the relative error is at most 1e-4.
        let error = max_deviation(found.output(), |k| signal(start_s + k as f64 * TS));
        assert!(error < 3e-4, "{offset}: {error:e}");
        assert!(max_deviation(found.input(), |k| signal(start_s + k as f64 * TS)) < 1e-12);
        // The ends are cut, and no values are extrapolated.
        let Step::Offset {
            cut_samples: (start, end),
            ..
        } = &steps[0]
        else {
            panic!()
        };
        assert!(found.len() + start + end == n && *start + *end >= 28);
    }
}

#[test]
fn decimation_matches_the_model_crate() {
    for factor in [2_usize, 3, 10] {
        let whole = record(4000, signal, |t| signal(t) + 1.0);
        let decimate = preparation_with(|p| p.rate = NewRate::Decimated(factor));
        let (found, steps) = decimate.apply(whole.clone()).unwrap();
        let (expected, done) = whole.decimated(factor).unwrap();
        assert_eq!((found, steps), (expected, vec![Step::from(done)]));
    }
    let (_, steps) = preparation_with(|p| p.rate = NewRate::Decimated(2))
        .apply(record(400, signal, signal))
        .unwrap();
    assert!(
        steps[0]
            .to_string()
            .starts_with("100 Hz, filtered and decimated by 2 to 50 Hz: "),
        "{}",
        steps[0]
    );
}

#[test]
fn resampling_to_lower_and_higher_rates_is_accurate() {
    for hz in [60.0, 128.0, 250.0, 36.7] {
        let edge = 0.8 * 0.5 * f64::min(hz, 100.0);
        let low = |t: f64| (2.0 * PI * 0.99 * edge * t).cos() + (2.0 * PI * 0.5 * t).sin();
        let (found, steps) = preparation_with(|p| p.rate = NewRate::Hz(hz))
            .apply(record(3000, low, low))
            .unwrap();
        let (start_s, ts) = (found.time_s(0) - 3.0, found.sample_time().s());
        assert!((ts * hz - 1.0).abs() < 1e-12);
        // The input is sampled in the middle of its new hold, so that the delay of a model is the same at both rates.
        let lead_s = 0.5 * (ts - 0.01);
        let Step::Rate { input_lead_s, .. } = steps[0] else {
            panic!("{}", steps[0]);
        };
        assert!((input_lead_s - lead_s).abs() < 1e-12);
        let error_of = |values: &[f64], lead_s: f64| max_deviation(values, |k| low(start_s + k as f64 * ts + lead_s));
        let errors = [error_of(found.input(), lead_s), error_of(found.output(), 0.0)];
        assert!(errors.iter().all(|error| *error < 2e-4), "{hz}: {errors:?}");
        // The new samples are on the grid that starts at the first sample.
        let steps = (found.time_s(0) - 3.0) / ts;
        assert!((steps - steps.round()).abs() < 1e-6, "{steps}");
    }
    // If the requested rate is the rate of the record, no step is applied.
    assert!(
        preparation_with(|p| p.rate = NewRate::Hz(100.0))
            .apply(record(3, signal, signal))
            .unwrap()
            .1
            .is_empty()
    );
}

#[test]
fn run_in_is_counted_in_file_time_and_trend_removed_last() {
    let preparation = preparation_with(|p| {
        p.run_in_s = 5.0;
        p.rate = NewRate::Decimated(4);
        p.detrend = Detrend::Mean;
        p.offset.insert("u".into(), Offset::Samples(1.0));
    });
    let (found, steps) = preparation.apply(record(2000, signal, signal)).unwrap();
    assert!((found.time_s(0) - 8.0).abs() < 1e-9, "{}", found.time_s(0));
    assert!(found.input().iter().sum::<f64>().abs() < 1e-9);
    let names: Vec<&str> = steps.iter().map(Step::name).collect();
    assert_eq!(names, ["offset", "rate", "run-in", "detrend"]);
    assert!(
        steps[1]
            .to_string()
            .starts_with("100 Hz, filtered and decimated by 4 to 25 Hz"),
        "{}",
        steps[1]
    );
}

#[test]
fn invalid_preparations_are_errors() {
    let rate = |rate| preparation_with(|p| p.rate = rate);
    for (preparation, n, words) in [
        (rate(NewRate::Decimated(0)), 10, "found a factor of 0"),
        (rate(NewRate::Decimated(4)), 1, "found 1 samples, but the filter"),
        (rate(NewRate::Decimated(4)), 50, "a longer record"),
        (rate(NewRate::Decimated(usize::MAX)), 200, "a longer record"),
        (rate(NewRate::Hz(f64::NAN)), 200, "new-fs: NaN Hz, expected a positive"),
        (rate(NewRate::Hz(-1.0)), 200, "new-fs: -1 Hz, expected a positive"),
        (rate(NewRate::Hz(1e9)), 200, "at most 100"),
        (rate(NewRate::Hz(1e-9)), 200, "a longer record"),
        (preparation_with(|p| p.run_in_s = -1.0), 10, "run-in: -1 s"),
        (preparation_with(|p| p.run_in_s = f64::NAN), 10, "run-in: NaN s"),
        (preparation_with(|p| p.run_in_s = 0.1), 10, "0.1 s in a record of 0.1 s"),
        (
            offset_preparation("u", Offset::Samples(10.0)),
            10,
            "stick=10 samples in a record of 10",
        ),
        (offset_preparation("u", Offset::Seconds(-1e300)), 10, "offset"),
        (
            offset_preparation("u", Offset::Samples(f64::NAN)),
            10,
            "a finite number",
        ),
        (
            offset_preparation("u", Offset::Samples(0.5)),
            20,
            "to each side for interpolation",
        ),
        (offset_preparation("x", Offset::Samples(1.0)), 20, "no channel \"x\""),
    ] {
        let message = message(&preparation, n);
        assert!(message.contains(words), "{words}: {message}");
    }
    for bad in ["", "s", "x", "NaN", "infs", "1 s s"] {
        assert!(bad.parse::<Offset>().is_err(), "{bad}");
    }
    assert_eq!(" 0.02s".parse::<Offset>().unwrap(), Offset::Seconds(0.02));
    // A factor that makes values overflow is reported as an error of the record.
    let large = scaling_preparation("u", Scaling::from_factor(1e300, None).unwrap());
    assert!(
        large
            .apply(record(5, signal, |_| 1e300))
            .unwrap_err()
            .to_string()
            .contains("finite")
    );
}

/// Pseudo-random numbers, the same in every run.
struct RandomNumbers(u64);

impl RandomNumbers {
    fn next(&mut self) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    fn number(&mut self) -> f64 {
        const EDGE_VALUES: [f64; 12] = [
            0.0,
            1.0,
            -1.0,
            0.5,
            1e-12,
            1e12,
            f64::NAN,
            f64::INFINITY,
            -f64::INFINITY,
            f64::MAX,
            5e-324,
            2.0,
        ];
        match self.next() % 4 {
            0 => EDGE_VALUES[self.next() as usize % EDGE_VALUES.len()],
            _ => (self.next() as f64 / 2.0_f64.powi(30) - 1.0) * 10_f64.powi((self.next() % 7) as i32 - 3),
        }
    }
}

#[test]
fn arbitrary_preparations_do_not_cause_a_panic() {
    let mut any = RandomNumbers(7);
    let mut done = 0;
    for _ in 0..4000 {
        let n = 1 + any.next() as usize % 300;
        let preparation = preparation_with(|p| {
            let names = ["e", "u", "r-y", "stick", "q"];
            for _ in 0..any.next() % 3 {
                let name = names[any.next() as usize % names.len()].to_owned();
                let offset = if any.next().is_multiple_of(2) {
                    Offset::Samples(any.number())
                } else {
                    Offset::Seconds(any.number())
                };
                p.offset.insert(name, offset);
            }
            if let Ok(scaling) = Scaling::from_factor(any.number(), None) {
                p.scale
                    .insert(names[any.next() as usize % names.len()].to_owned(), scaling);
            }
            p.rate = match any.next() % 4 {
                0 => NewRate::Decimated(any.next() as usize % 6),
                1 => NewRate::Hz(any.number().abs() * 10.0),
                _ => NewRate::Kept,
            };
            if any.next().is_multiple_of(2) {
                p.run_in_s = any.number();
            }
        });
        if let Ok((found, steps)) = preparation.apply(record(n, signal, signal)) {
            done += 1;
            assert!(found.channels().all(|c| c.values.len() == found.len()) && found.len() <= 100 * n);
            assert!(steps.iter().all(|step| !step.to_string().is_empty()));
        }
    }
    assert!(done > 300, "{done}");
}
