use std::f64::consts::TAU;

use hoid_model::{Channel as Signal, FamilyOperator};
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

use super::{choice::SIGNIFICANCE_LEVEL, *};
use crate::{
    diagnostics::other_inputs,
    family::{ChannelRole, FamilyEstimator},
};

const TS: f64 = 0.02;

/// Returns a normal deviate.
fn normal_deviate(random: &mut ChaCha8Rng) -> f64 {
    let mut uniform = || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

/// Returns a sum of sines with these numbers of periods in 40 s.
fn sines(lines: &[u32], t: f64) -> f64 {
    let one = |(i, k): (usize, &u32)| (TAU * f64::from(*k) / 40.0 * t + 2.4 * i as f64 * i as f64).sin();
    lines.iter().enumerate().map(one).map(|x| 0.5 * x).sum()
}

/// Simulates 80 s of a person who controls 4/s and sees e and r, with r shown `preview` samples ahead.
fn run(operator: &FamilyOperator, target: Option<&FamilyOperator>, preview: usize, seed: u64) -> Record {
    let task = Task {
        preview,
        ..Task::default()
    };
    task.run(operator, target, seed)
}

/// Responses of the person.
struct Task {
    /// Number of samples by which the target is shown ahead.
    preview: usize,
    /// Amplitude of the disturbance, in the channel d.
    disturbance: f64,
    /// Half-width of the dead zone of the stick.
    dead_zone: f64,
}

impl Default for Task {
    fn default() -> Self {
        Self {
            preview: 0,
            disturbance: 0.5,
            dead_zone: 0.0,
        }
    }
}

impl Task {
    fn run(&self, operator: &FamilyOperator, target: Option<&FamilyOperator>, seed: u64) -> Record {
        let (preview, amplitude) = (self.preview, self.disturbance);
        let ts = SampleTime::new(TS).unwrap();
        let n = 4000;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let own = operator.zoh(ts).unwrap();
        let of_target = target.map(|target| target.zoh(ts).unwrap());
        let shown: Vec<f64> = (0..n + preview)
            .map(|k| sines(&[3, 7, 13, 19, 31, 43, 61], k as f64 * TS))
            .collect();
        let (mut e, mut u, mut y, mut w, mut v) =
            (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let past = |x: &[f64], k: usize, lag: usize| k.checked_sub(lag).map_or(0.0, |at| x[at]);
        let mut slow = 0.0;
        let mut disturbance = vec![0.0; n];
        for k in 0..n {
            let d = amplitude * sines(&[5, 11, 17, 23, 37, 47, 67], k as f64 * TS + 11.0);
            y[k] = past(&y, k, 1) + TS * 4.0 * (past(&u, k, 1) + d);
            disturbance[k] = d;
            e[k] = shown[k] - y[k];
            for (held, x, out) in [(Some(&own), &e, &mut w), (of_target.as_ref(), &shown, &mut v)] {
                let Some(held) = held else { continue };
                let b: f64 = held
                    .b
                    .iter()
                    .enumerate()
                    .map(|(j, b)| {
                        let ahead = if x.len() > n { preview } else { 0 };
                        (k + ahead).checked_sub(held.nk + j).map_or(0.0, |at| b * x[at])
                    })
                    .sum();
                let f: f64 = held.f.iter().enumerate().map(|(j, f)| f * past(out, k, j + 1)).sum();
                out[k] = b - f;
            }
            slow = 0.9 * slow + 0.03 * normal_deviate(&mut random);
            let moved = w[k] + v[k] + slow;
            u[k] = moved.signum() * (moved.abs() - self.dead_zone).max(0.0);
        }
        let cut = shown[..n].to_vec();
        Record::new(ts, Signal::new("e", "", e), Signal::new("u", "", u))
            .unwrap()
            .with_channel(Signal::new("r", "", cut))
            .unwrap()
            .with_channel(Signal::new("y", "", y))
            .unwrap()
            .with_channel(Signal::new("d", "", disturbance))
            .unwrap()
    }
}

fn operators() -> (FamilyOperator, FamilyOperator) {
    let muscles = [11.0_f64.ln(), 0.3_f64.ln()];
    (
        FamilyOperator::new(Form::Gain, true, &[0.6, muscles[0], muscles[1], 0.22]).unwrap(),
        FamilyOperator::new(Form::Derivative, true, &[0.15, muscles[0], muscles[1], 0.2]).unwrap(),
    )
}

fn estimator() -> FamilyEstimator {
    FamilyEstimator {
        intersample: Intersample::Zoh,
        channels: vec![SeenChannel::new("r", ChannelRole::Feedforward)],
        ..FamilyEstimator::default()
    }
}

fn normalised_error(parameters: &[Parameter], name: &str, truth: f64) -> f64 {
    let found = parameters
        .iter()
        .find(|p| p.name == name)
        .unwrap_or_else(|| panic!("{name}: {parameters:?}"));
    (found.value - truth) / found.standard_error.unwrap()
}

#[test]
fn responses_to_error_and_target_are_found() {
    let (operator, target) = operators();
    let record = run(&operator, Some(&target), 0, 3);
    let fit = estimator().fit(std::slice::from_ref(&record)).unwrap();
    let of = &fit.operators[0].parameters;
    let [channel] = fit.channels.as_slice() else {
        panic!("one channel")
    };
    let response = channel.response.as_ref().unwrap();
    println!("{of:#?} {channel:#?}");
    assert_eq!(response.operator.form(), Form::Derivative, "{channel:?}");
    for (all, name, truth) in [
        (of, "K", 0.6),
        (of, "tau_e", 0.22),
        (of, "omega_nm", 11.0),
        (&response.parameters, "K_d", 0.15),
        (&response.parameters, "tau_f", 0.2),
    ] {
        assert!(
            normalised_error(all, name, truth).abs() < 3.0,
            "{name} {}",
            normalised_error(all, name, truth)
        );
    }
    assert!(fit.lines.is_some(), "the lines of d and r");
    let together = |fit: &crate::family::FamilyFit| fit.verdict.findings().iter().any(|f| f.kind == "inputs-together");
    assert!(!together(&fit));
    // If the target alone excites the loop, no response to it is found, or a finding reports that the inputs are not
    // distinguished.
    let undisturbed = Task {
        disturbance: 0.0,
        ..Task::default()
    };
    let alone = undisturbed.run(&operator, Some(&target), 3);
    let alone = estimator().fit(std::slice::from_ref(&alone)).unwrap();
    assert!(
        alone.channels[0].response.is_none() || together(&alone),
        "{:?}",
        alone.channels[0]
    );
    // If the fit has only the input e, the response to r is reported.
    let one = FamilyEstimator {
        channels: Vec::new(),
        forms: vec![Form::Gain],
        ..estimator()
    };
    let one_input = one.fit(std::slice::from_ref(&record)).unwrap();
    let findings = other_inputs::family_findings(&one, &one_input, std::slice::from_ref(&record));
    assert!(
        findings
            .iter()
            .any(|f| f.kind == "other-input" && f.message.contains("to r")),
        "{findings:?}"
    );
    let gain = one_input.operators[0]
        .parameters
        .iter()
        .find(|p| p.name == "K")
        .unwrap();
    assert!(gain.value > 1.15 * 0.6, "{gain:?}");
}

#[test]
fn channel_text_round_trips() {
    for text in [
        "r=feedforward",
        "r=feedforward:0.5",
        "phi=motion",
        "r=output/lag",
        "r=feedforward:0.25/derivative",
    ] {
        assert_eq!(text.parse::<SeenChannel>().unwrap().to_string(), text);
    }
    assert_eq!(
        "r".parse::<SeenChannel>().unwrap(),
        SeenChannel::new("r", ChannelRole::Feedforward)
    );
    for wrong in [
        "",
        "=motion",
        "r=sight",
        "r=feedforward:x",
        "r=feedforward:-1",
        "r=feedforward/bend",
    ] {
        assert!(wrong.parse::<SeenChannel>().is_err(), "{wrong}");
    }
}

#[test]
fn absent_target_response_is_not_found() {
    let (operator, _) = operators();
    for seed in 0..4 {
        let record = run(&operator, None, 0, seed);
        let fit = estimator().fit(std::slice::from_ref(&record)).unwrap();
        assert!(fit.channels[0].response.is_none(), "{:?}", fit.channels[0]);
        assert!(fit.channels[0].p_value >= SIGNIFICANCE_LEVEL);
        let one = FamilyEstimator {
            channels: Vec::new(),
            ..estimator()
        };
        let records = [record];
        let findings = other_inputs::family_findings(&one, &one.fit(&records).unwrap(), &records);
        assert!(findings.is_empty(), "{findings:?}");
    }
}

#[test]
fn preview_gives_a_negative_delay() {
    let (operator, target) = operators();
    let record = run(&operator, Some(&target), 20, 5);
    let shown = SeenChannel {
        preview_s: 0.4,
        ..SeenChannel::new("r", ChannelRole::Feedforward)
    };
    let estimator = FamilyEstimator {
        channels: vec![shown],
        ..estimator()
    };
    let fit = estimator.fit(&[record]).unwrap();
    let response = fit.channels[0].response.as_ref().unwrap();
    println!("{response:#?}");
    assert!(normalised_error(&response.parameters, "tau_f", -0.2).abs() < 3.0);
}

#[test]
fn uninformative_inputs_are_refused() {
    let (operator, target) = operators();
    let record = run(&operator, Some(&target), 0, 3);
    let of = |names: &[&str]| {
        let channels = names.iter().map(|name| SeenChannel::new(*name, ChannelRole::Output));
        let estimator = FamilyEstimator {
            channels: channels.collect(),
            ..estimator()
        };
        estimator.fit(std::slice::from_ref(&record)).unwrap_err().to_string()
    };
    assert!(
        of(&["r", "y"]).contains("y is a linear combination of e and r"),
        "{}",
        of(&["r", "y"])
    );
    assert!(of(&["q"]).contains("no channel q"), "{}", of(&["q"]));
    let still = record
        .clone()
        .with_channel(Signal::new("s", "", vec![2.0; record.len()]))
        .unwrap();
    let estimator = FamilyEstimator {
        channels: vec![SeenChannel::new("s", ChannelRole::Motion)],
        ..estimator()
    };
    let error = estimator.fit(&[still]).unwrap_err().to_string();
    assert!(error.contains("s is constant"), "{error}");
}

#[test]
fn input_may_be_constant_in_one_of_several_records() {
    let (operator, target) = operators();
    let moving = run(&operator, Some(&target), 0, 3);
    let still = run(&operator, None, 0, 4);
    let n = still.len();
    let still = Record::new(
        still.sample_time(),
        Signal::new("e", "", still.input().to_vec()),
        Signal::new("u", "", still.output().to_vec()),
    )
    .unwrap()
    .with_channel(Signal::new("r", "", vec![0.0; n]))
    .unwrap();
    let fit = estimator().fit(&[moving.clone(), still.clone()]).unwrap();
    assert!(fit.channels[0].response.is_some(), "{:?}", fit.channels[0]);
    let left = fit.without_channels(&still, Detrend::Mean).unwrap();
    assert_eq!(left.output(), still.output());
    let left = fit.without_channels(&moving, Detrend::Mean).unwrap();
    assert!(left.output() != moving.output());
}

#[test]
fn dead_zone_is_not_mistaken_for_a_target_response() {
    let (operator, _) = operators();
    let task = Task {
        disturbance: 0.0,
        dead_zone: 0.4,
        ..Task::default()
    };
    let records: Vec<Record> = (0..3).map(|seed| task.run(&operator, None, seed)).collect();
    assert!(
        records
            .iter()
            .all(|record| crate::faults::StickRest::of(record.output()).is_some())
    );
    let one = FamilyEstimator {
        channels: Vec::new(),
        ..estimator()
    };
    let found = other_inputs::family_findings(&one, &one.fit(&records).unwrap(), &records);
    println!("{found:?}");
    assert!(
        found.iter().all(|f| f.severity == hoid_model::Severity::Note),
        "{found:?}"
    );
}
