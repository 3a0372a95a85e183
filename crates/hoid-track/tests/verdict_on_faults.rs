//! The verdict of the default method on clean loops that are hard to assess, and on recordings with faults.
#![allow(clippy::unwrap_used)]

use hoid_model::{
    Channel, Record, SampleTime, Severity, VerdictLevel,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{Method, Trace, TrackOptions, track};

fn condition_1() -> Record {
    let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
    simulator.run(RunSeed::default(), false).unwrap()
}

fn record(e: Vec<f64>, u: Vec<f64>) -> Record {
    let (e, u) = (Channel::new("e", "", e), Channel::new("u", "", u));
    Record::new(SampleTime::AT_100_HZ, e, u).unwrap()
}

/// Returns the record with changed signals.
fn changed(clean: &Record, change: impl Fn(usize, &mut f64, &mut f64)) -> Record {
    let (mut e, mut u) = (clean.input().to_vec(), clean.output().to_vec());
    (e.iter_mut().zip(&mut u).enumerate()).for_each(|(k, (e, u))| change(k, e, u));
    record(e, u)
}

fn tracked(record: &Record, options: &[(&str, &str)]) -> Trace {
    let options = TrackOptions::default_for(Method::adaptive(), 29).with(options).unwrap();
    track(record, &options, 10).unwrap()
}

/// Returns the kinds of the findings that are not notes.
fn warning_kinds(trace: &Trace, record: &Record) -> Vec<&'static str> {
    let verdict = trace.verdict(record, None).unwrap();
    let found = verdict.findings().iter().filter(|f| f.severity != Severity::Note);
    found.map(|f| f.kind).collect()
}

/// Simulates `k/(lag s + 1) e^(-.2 s)` with the element `1/(s + pole)` and a target of steps or of filtered noise.
fn simulated_loop(seed: u64, operator: [f64; 2], pole: f64, steps: bool) -> Record {
    simulated_steps(seed, operator, pole, (steps.then_some(400), 0.5))
}

/// Like [`simulated_loop`], with a step after each `interval` of samples, or filtered noise without an interval, and a
/// gain of the remnant.
fn simulated_steps(seed: u64, [k, lag]: [f64; 2], pole: f64, (interval, remnant_gain): (Option<usize>, f64)) -> Record {
    let n = 8000;
    let noise = |replication| {
        let seed = RunSeed {
            seed,
            replication,
            ..RunSeed::default()
        };
        seed.white_noise(n)
    };
    let (target, remnant, ts) = (noise(0), noise(1), 0.01);
    let (mut e, mut u) = (vec![0.0; n], vec![0.0; n]);
    let (mut y, mut x, mut n_u, mut slow, mut r) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for t in 0..n {
        slow += 0.015 * (target[t] - slow);
        r += 0.015 * (slow - r);
        e[t] = interval.map_or(20.0 * r, |interval| target[t - t % interval]) - y;
        let seen = t.checked_sub(20).map_or(0.0, |t| e[t]);
        x += if lag > 0.0 {
            ts / lag * (k * seen - x)
        } else {
            k * seen - x
        };
        n_u += 0.1 * (remnant[t] - n_u);
        u[t] = x + remnant_gain * n_u;
        y += ts * (u[t] - pole * y);
    }
    record(e, u)
}

#[test]
fn step_targets_and_coarse_signals_have_a_response_of_e() {
    let steps: Vec<Record> = (0..4).map(|seed| simulated_loop(seed, [2.0, 0.0], 0.0, true)).collect();
    for (seed, run) in steps.iter().enumerate() {
        assert!(!warning_kinds(&tracked(run, &[]), run).contains(&"no-answer"), "{seed}");
        let other = record(run.input().to_vec(), steps[(seed + 1) % 4].output().to_vec());
        assert!(
            warning_kinds(&tracked(&other, &[]), &other).contains(&"no-answer"),
            "{seed}"
        );
    }
    let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
    let clean = condition_1();
    let resolution = [clean.input(), clean.output()].map(|x| 0.02 * rms(x));
    let coarse = changed(&clean, |_, e, u| {
        *e = resolution[0] * (*e / resolution[0]).round();
        *u = resolution[1] * (*u / resolution[1]).round();
    });
    assert!(!warning_kinds(&tracked(&coarse, &[]), &coarse).contains(&"no-answer"));
}

/// Between rare steps, e and u are small: the steps, of all sizes, and the response to them are no faults.
#[test]
fn rare_steps_of_the_target_are_no_faults() {
    for seed in 0..4 {
        let run = simulated_steps(seed, [2.5, 0.0], 0.0, (Some(700), 0.5));
        // The record starts between two steps.
        let run = record(run.input()[500..].to_vec(), run.output()[500..].to_vec());
        let trace = tracked(&run, &[]);
        let kinds = warning_kinds(&trace, &run);
        assert!(
            !kinds.contains(&"hostile-span") && !kinds.contains(&"restarted"),
            "{seed}: {}",
            trace.verdict(&run, None).unwrap()
        );
    }
}

#[test]
fn single_outlier_does_not_change_the_verdict() {
    let clean = condition_1();
    for (channel, size) in [(0, -9999.0), (0, 30.0), (1, -9999.0)] {
        let spoilt = changed(&clean, |k, e, u| {
            if k == 4000 {
                *[e, u][channel] = size;
            }
        });
        let verdict = tracked(&spoilt, &[]).verdict(&spoilt, None).unwrap();
        assert_eq!(verdict.level, VerdictLevel::Trustworthy, "{verdict}");
        assert!(verdict.findings().iter().any(|f| f.kind == "held-back"), "{verdict}");
    }
}

/// If u is zero, or e or u keeps its value, from 40.00 to 60.50 s, one fault with these times is found, and no change
/// is declared.
#[test]
fn frozen_span_has_its_own_times_and_no_changes() {
    let clean = condition_1();
    let value_at_start = [clean.input()[4000], clean.output()[4000]];
    for (channel, value) in [(1, 0.0), (0, value_at_start[0]), (1, value_at_start[1])] {
        let frozen = changed(&clean, |k, e, u| {
            if (4000..6050).contains(&k) {
                *[e, u][channel] = value;
            }
        });
        let trace = tracked(&frozen, &[]);
        let [fault] = trace.faults() else {
            panic!("{:?}", trace.faults())
        };
        let times = [fault.from_s, fault.to_s];
        assert!(
            (times[0] - 40.0).abs() < 1e-6 && (times[1] - 60.5).abs() < 1e-6,
            "{fault:?}"
        );
        assert!(trace.changes().is_empty(), "{:?}", trace.changes());
    }
}

#[test]
fn short_record_has_no_estimate() {
    let short = condition_1().span(0.0, 0.8).unwrap();
    let verdict = tracked(&short, &[]).verdict(&short, None).unwrap();
    assert_eq!(verdict.level, VerdictLevel::NotDetermined);
    let kinds: Vec<&str> = verdict.findings().iter().map(|f| f.kind).collect();
    assert!(
        kinds.contains(&"no-estimate") && !kinds.contains(&"not-convertible"),
        "{verdict}"
    );
}

/// For a person with a lag of 8 s and the element `1/(s + 1)`, a finding reports the lag; with a prior of this lag
/// there is no such finding.
#[test]
fn another_lag_is_named_with_a_prior_that_works() {
    for seed in 10..12 {
        let run = simulated_loop(seed, [20.0, 8.0], 1.0, false);
        let held = tracked(&run, &[]);
        assert!(warning_kinds(&held, &run).contains(&"held-lag"), "{seed}");
        let known = tracked(&run, &[("prior", "T_I=8:0.1")]);
        assert!(!warning_kinds(&known, &run).contains(&"held-lag"), "{seed}");
    }
}
