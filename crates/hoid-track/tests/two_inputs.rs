//! Recursions with a further input: comparison with the batch fit, a change in one response, and rejected options.
#![allow(clippy::unwrap_used)]

use hoid_ident::{
    InitialState,
    family::ChannelRole,
    several_inputs::{InputOrders, SeveralInputs},
};
use hoid_model::{Channel, Orders, Record, SampleTime, Structure};
use hoid_track::{GuardKind, Method, Sample, StartSource, Trace, TrackOptions, TrackedInput, Tracker, track};

/// Standard normal random numbers.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

const TS: f64 = 0.02;
const F: [f64; 2] = [-1.6, 0.68];
const D: f64 = -0.8;
const NK: usize = 10;
const NK_R: usize = 5;
const SAMPLE_COUNT: usize = 4000;

/// Returns the coefficient b0 of the response to r at a sample; it doubles in the middle of the record.
fn gain(k: usize, changes: bool) -> f64 {
    if changes && k >= SAMPLE_COUNT / 2 { 0.06 } else { 0.03 }
}

/// Returns a record in which the response to r may double, see [`record_with`].
fn record(seed: u64, level: f64, changes: bool) -> Record {
    record_with(seed, level, |k| gain(k, changes))
}

/// Returns a record of `u = (B/F) q^-10 e + (B_r/F) q^-5 r + n`, `n = eps/D`, where e and r are sums of sines with
/// random phases.
fn record_with(seed: u64, level: f64, gain: impl Fn(usize) -> f64) -> Record {
    let mut noise = Noise(seed);
    let mut sines = |lines: &[f64]| -> Vec<f64> {
        let phases: Vec<f64> = lines.iter().map(|_| 6.3 * noise.uniform()).collect();
        let at = |k: usize| {
            let each = lines.iter().zip(&phases);
            each.map(|(w, p)| (w * k as f64 * TS + p).sin() / w.sqrt()).sum()
        };
        (0..SAMPLE_COUNT).map(at).collect()
    };
    let e = sines(&[0.4, 0.9, 1.6, 2.9, 4.7, 7.3, 11.0, 17.0]);
    let r = sines(&[0.6, 1.2, 2.1, 3.8, 6.1, 9.2, 14.0, 21.0]);
    let (mut of_e, mut of_r, mut n) = ([0.0; 2], [0.0; 2], 0.0);
    let past = |x: &[f64], k: usize, by: usize| k.checked_sub(by).map_or(0.0, |k| x[k]);
    let u = (0..SAMPLE_COUNT)
        .map(|k| {
            let w = 0.05 * past(&e, k, NK) - 0.03 * past(&e, k, NK + 1) - F[0] * of_e[0] - F[1] * of_e[1];
            let w_r = gain(k) * past(&r, k, NK_R) - F[0] * of_r[0] - F[1] * of_r[1];
            (of_e, of_r) = ([w, of_e[0]], [w_r, of_r[0]]);
            n = level * noise.next() - D * n;
            w + w_r + n
        })
        .collect();
    Record::new(
        SampleTime::new(TS).unwrap(),
        Channel::new("e", "", e),
        Channel::new("u", "", u),
    )
    .unwrap()
    .with_channel(Channel::new("r", "", r))
    .unwrap()
}

fn input(nb: usize, nf: usize, nk: usize) -> Option<TrackedInput> {
    Some(TrackedInput {
        channel: "r".to_owned(),
        role: ChannelRole::Feedforward,
        preview_s: 0.0,
        orders: InputOrders { nb, nf, nk },
    })
}

fn orders(na: usize, nd: usize, nf: usize) -> Orders {
    Orders {
        na,
        nb: 2,
        nc: 0,
        nd,
        nf,
        nk: NK,
    }
}

/// Returns the options for tracking a Box-Jenkins model with the recursive prediction error method.
fn box_jenkins() -> TrackOptions {
    TrackOptions {
        further: input(1, 2, NK_R),
        ..TrackOptions::new(Method::rpem(), Structure::BoxJenkins, orders(0, 1, 2))
    }
}

fn coefficient(trace: &Trace, row: usize, name: &str) -> (f64, f64) {
    let place = trace.parameter_names().iter().position(|known| known == name).unwrap();
    let estimate = trace.parameters(row)[place];
    (estimate.value, estimate.standard_error.unwrap())
}

#[test]
fn rls_with_infinite_memory_matches_the_batch_fit() {
    let record = record(1, 0.01, false);
    let method = Method::rls();
    let options = TrackOptions {
        further: input(2, 0, NK_R),
        start: StartSource::Nothing,
        ..TrackOptions::new(method, Structure::Arx, orders(2, 0, 0))
    }
    .with(&[("memory", "inf"), ("covariance", "1e10")])
    .unwrap();
    let trace = track(&record, &options, 500).unwrap();
    let batch = SeveralInputs {
        na: 2,
        inputs: vec![
            ("e".to_owned(), InputOrders { nb: 2, nf: 0, nk: NK }),
            ("r".to_owned(), InputOrders { nb: 2, nf: 0, nk: NK_R }),
        ],
        initial_state: InitialState::Zero,
        ..SeveralInputs::new(Structure::Arx)
    };
    let fit = batch.fit(&[record]).unwrap();
    assert_eq!(trace.parameter_names(), ["a1", "a2", "b0", "b1", "b0[r]", "b1[r]"]);
    let last = trace.len() - 1;
    for ((name, expected), found) in fit.parameters().iter().zip(trace.parameters(last)) {
        let difference = (found.value - expected.value).abs();
        assert!(difference < 1e-7, "{name}: {} {}", found.value, expected.value);
        let [found, expected] = [found, *expected].map(|e| e.standard_error.unwrap());
        assert!((found / expected - 1.0).abs() < 0.01, "{name}: {found} {expected}");
    }
    // The response to r is B_r/A with its own coefficients.
    let response = trace.further_response(last, 2.0).unwrap();
    let of_fit = &fit.frequency_response(1, &[2.0])[0];
    assert!((response.gain_db().value - of_fit.magnitude_db.value).abs() < 1e-4);
    assert!((response.phase_deg().value - of_fit.phase_deg.value).abs() < 1e-3);
}

#[test]
fn change_of_one_response_leaves_the_other_unchanged() {
    let (mut before, mut after) = (Vec::new(), Vec::new());
    let (mut changed, mut false_alarms) = (0, 0);
    let note = |trace: &Trace, record: &Record| {
        let verdict = trace.verdict(record, None).unwrap();
        let finding = verdict
            .findings()
            .iter()
            .find(|finding| finding.kind == "changed-input");
        finding.map_or_else(String::new, |finding| finding.message.clone())
    };
    for seed in 0..24 {
        let trace = track(&record(seed, 0.02, true), &box_jenkins(), 20).unwrap();
        let row = |t: f64| trace.times_s().partition_point(|time| *time < t);
        for (t, truth, into) in [(38.0, 0.03, &mut before), (78.0, 0.06, &mut after)] {
            let response = |t: f64| trace.further_response(row(t), 2.0).unwrap().gain_db();
            let gain = response(t);
            let expected = 20.0 * (truth / 0.03_f64).log10() + r_gain_db();
            into.push((gain.value - expected) / gain.standard_error.unwrap());
            // The response to e does not change.
            let own = trace.response_at(row(t), 2.0).gain_db();
            let expected = e_gain_db();
            into.push((own.value - expected) / own.standard_error.unwrap());
        }
        assert_eq!(
            coefficient(&trace, row(20.0), "b0[r]").0,
            coefficient(&trace, row(10.0), "b0[r]").0
        );
        let record = record(seed, 0.02, true);
        let named = note(&trace, &record);
        changed += usize::from(named.contains("response to r changed") && named.contains("response to e was found"));
        // Without a change no input is named.
        let steady = self::record(seed + 100, 0.02, false);
        let trace = track(&steady, &box_jenkins(), 20).unwrap();
        false_alarms += usize::from(!note(&trace, &steady).is_empty());
    }
    assert!(changed >= 22 && false_alarms <= 1, "{changed}, {false_alarms}");
    for (name, z) in [("before", before), ("after", after)] {
        let rms = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
        let inside = z.iter().filter(|z| z.abs() < 1.96).count() as f64 / z.len() as f64;
        // 48 values: the standard error of the rms is .1, that of the share is .03.
        assert!(
            (0.6..1.35).contains(&rms) && inside > 0.85,
            "{name}: {rms:.2}, {inside:.2}"
        );
    }
}

fn db(b: &[f64], nk: usize) -> f64 {
    let at = |k: f64| {
        let (sin, cos) = (-2.0 * TS * k).sin_cos();
        [cos, sin]
    };
    let sum = |of: &[f64], from: f64| {
        of.iter().enumerate().fold([0.0; 2], |[re, im], (j, c)| {
            let [cos, sin] = at(from + j as f64);
            [re + c * cos, im + c * sin]
        })
    };
    let ([b_re, b_im], [f_re, f_im]) = (sum(b, nk as f64), sum(&F, 1.0));
    20.0 * (b_re.hypot(b_im) / (1.0 + f_re).hypot(f_im)).log10()
}

/// Gain in dB of the response to r before the change, and of the response to e, at 2 rad/s.
fn r_gain_db() -> f64 {
    db(&[0.03], NK_R)
}

fn e_gain_db() -> f64 {
    db(&[0.05, -0.03], NK)
}

#[test]
fn omitting_the_further_input_biases_the_response_to_e() {
    // A target that e follows: without the target as an input, the estimated response to e includes the response to r.
    let plain = record(3, 0.01, false);
    let r = plain.channel("r").unwrap().to_vec();
    let e: Vec<f64> = plain.input().iter().zip(&r).map(|(e, r)| 0.3 * e + r).collect();
    let u: Vec<f64> = plain.output().to_vec();
    let ts = SampleTime::new(TS).unwrap();
    let joined = Record::new(ts, Channel::new("e", "", e), Channel::new("u", "", u))
        .unwrap()
        .with_channel(Channel::new("r", "", r))
        .unwrap();
    // u = (B q^-10/.3) e + (F q^-5 - (B/.3) q^-10) r: B of r has seven coefficients.
    let gain = |further: Option<TrackedInput>| {
        let options = TrackOptions {
            further,
            ..box_jenkins()
        };
        let trace = track(&joined, &options, 100).unwrap();
        trace.response_at(trace.len() - 1, 2.0).gain_db().value
    };
    let expected = e_gain_db() - 20.0 * 0.3_f64.log10();
    assert!((gain(input(7, 2, NK_R)) - expected).abs() < 0.5);
    assert!((gain(None) - expected).abs() > 3.0);
}

#[test]
fn samples_without_the_further_input_do_not_update() {
    let record = record(5, 0.01, false);
    let span = record.span(0.0, 26.0).unwrap();
    let mut tracker = Tracker::new(&box_jenkins(), Some(&span), record.sample_time()).unwrap();
    let r = record.channel("r").unwrap();
    let mut before = Vec::new();
    for k in 0..SAMPLE_COUNT {
        let known = !(3000..3100).contains(&k);
        let (e, u) = (record.input()[k], record.output()[k]);
        let sample = Sample {
            e,
            u,
            reference: known.then_some(r[k]),
        };
        tracker.update(sample, true);
        match k {
            2999 => before = tracker.theta().to_vec(),
            3000 | 3099 => assert_eq!(tracker.theta(), before),
            3100 => assert_ne!(tracker.theta(), before),
            _ => {}
        }
    }
    // The samples without r do not degrade the estimate.
    let found = (tracker.parameter_names().into_iter().zip(tracker.parameters())).find(|(name, _)| name == "b0[r]");
    let found = found.unwrap().1;
    let away = (found.value - 0.03).abs() / found.standard_error.unwrap();
    assert!(away < 3.5, "{found:?}");
}

#[test]
fn options_that_a_further_input_excludes_are_refused() {
    let record = record(7, 0.01, false);
    let refused = |options: TrackOptions| track(&record, &options, 10).unwrap_err().to_string();
    let words = refused(TrackOptions {
        further: input(1, 0, 1),
        ..TrackOptions::default_for(Method::adaptive(), NK)
    });
    assert!(words.contains("nb = 2, nf = 2"), "{words}");
    let previewed = input(1, 2, NK_R).map(|input| TrackedInput {
        preview_s: 0.2,
        ..input
    });
    let words = refused(TrackOptions {
        further: previewed,
        ..box_jenkins()
    });
    assert!(words.contains("preview"), "{words}");
    for (option, text) in [("track_delay", "0.1..0.3"), ("guard", "yes"), ("regressor", "cascade")] {
        let words = refused(box_jenkins().with(&[(option, text)]).unwrap());
        assert!(
            words.contains(&option.replace("_delay", "")) || words.contains("further"),
            "{words}"
        );
    }
    let words = refused(TrackOptions {
        further: Some(TrackedInput {
            channel: "nowhere".to_owned(),
            ..input(1, 0, 1).unwrap()
        }),
        ..box_jenkins()
    });
    assert!(words.contains("nowhere"), "{words}");
    // ARX has no F.
    let words = refused(TrackOptions {
        further: input(2, 2, 1),
        ..TrackOptions::new(Method::rls(), Structure::Arx, orders(2, 0, 0))
    });
    assert!(words.contains("nf"), "{words}");
}

/// Returns the options of the default tracker, with the default delays.
fn default_tracker(preview_s: f64) -> TrackOptions {
    let ts = SampleTime::new(TS).unwrap();
    let plain = TrackOptions::without_prior(Method::adaptive(), ts);
    TrackOptions {
        further: input(2, 2, plain.orders.nk).map(|input| TrackedInput { preview_s, ..input }),
        at_rad_s: vec![2.0],
        ..plain
    }
}

#[test]
fn default_tracker_follows_both_responses_and_names_the_input_that_changed() {
    let (mut named, mut inside, mut count) = (0, 0, 0);
    for seed in 0..6 {
        let record = record(seed, 0.01, true);
        let trace = track(&record, &default_tracker(0.0), 20).unwrap();
        let row = |t: f64| trace.times_s().partition_point(|time| *time < t);
        for (t, change_db) in [(38.0, 0.0), (78.0, 20.0 * 2.0_f64.log10())] {
            let own = trace.response(row(t), 0).unwrap().gain_db();
            let further = trace.further_response(row(t), 2.0).unwrap().gain_db();
            for (found, expected) in [(own, e_gain_db()), (further, r_gain_db() + change_db)] {
                let away = found.value - expected;
                assert!(away.abs() < 2.0, "{seed} {t}: {found:?} {expected}");
                inside += usize::from(away.abs() < 1.96 * found.standard_error.unwrap());
                count += 1;
            }
        }
        let named_r = |(t, change): &(f64, hoid_track::Change)| {
            let further = change.further.unwrap();
            *t > 40.0 && !further.changed_quantities().is_empty() && !change.of_operator
        };
        let verdict = trace.verdict(&record, None).unwrap();
        let note = verdict
            .findings()
            .iter()
            .find(|finding| finding.kind == "changed-input");
        let note = note.map_or("", |note| note.message.as_str());
        let said = note.contains("the response to r changed") && note.contains("no change in the response to e");
        named += usize::from(trace.changes().iter().any(named_r) && said);
    }
    assert!(named >= 5, "{named} of 6");
    assert!(inside + 2 >= count, "{inside} of {count}");
}

/// With little remnant a change in a response makes the innovations many times larger, as a fault of a channel would,
/// but it is followed.
#[test]
fn change_with_little_remnant_is_followed() {
    for seed in 0..6 {
        for factor in [3.0, -1.0] {
            let gain = |k: usize| if k < SAMPLE_COUNT / 2 { 0.03 } else { factor * 0.03 };
            let record = record_with(seed, 1e-4, gain);
            let trace = track(&record, &default_tracker(0.0), 20).unwrap();
            let paused: Vec<_> = trace.faults().iter().filter(|f| f.kind == GuardKind::Misfit).collect();
            assert!(paused.is_empty(), "{seed} {factor}: {paused:?}");
            let row = trace.times_s().partition_point(|time| *time < 52.0);
            let before = trace.times_s().partition_point(|time| *time < 38.0);
            let [now, before] = [row, before].map(|row| trace.further_response(row, 2.0).unwrap());
            let turned = (now.phase_deg().value - before.phase_deg().value + 90.0).rem_euclid(360.0) - 90.0;
            let away = now.gain_db().value - r_gain_db() - 20.0 * factor.abs().log10();
            assert!(
                away.abs() < 2.0 && (turned > 150.0) == (factor < 0.0),
                "{seed} {factor}: {away} {turned}"
            );
        }
    }
}

#[test]
fn preview_advances_the_further_input() {
    const LEAD: usize = 5;
    let original = record(9, 0.01, false).span(0.0, 30.0).unwrap();
    let r = original.channel("r").unwrap().to_vec();
    let shown: Vec<f64> = (0..r.len())
        .map(|k| k.checked_sub(LEAD).map_or(0.0, |k| r[k]))
        .collect();
    let delayed = Record::new(
        original.sample_time(),
        Channel::new("e", "", original.input().to_vec()),
        Channel::new("u", "", original.output().to_vec()),
    )
    .unwrap()
    .with_channel(Channel::new("r", "", shown))
    .unwrap();
    let preview_s = LEAD as f64 * TS;
    let (plain, ahead) = (
        track(&original, &default_tracker(0.0), 100).unwrap(),
        track(&delayed, &default_tracker(preview_s), 100).unwrap(),
    );
    // The person sees the same input, so the estimates are equal until the last samples, at which the input is not
    // known.
    let row = plain.len() - 2;
    assert_eq!(plain.theta(row), ahead.theta(row));
    let [one, other] = [&plain, &ahead].map(|trace| trace.further_operator(row).unwrap());
    assert_eq!(one.k_f, other.k_f);
    assert!((one.tau_f_s.value - preview_s - other.tau_f_s.value).abs() < 1e-12);
    let [one, other] = [&plain, &ahead].map(|trace| trace.further_response(row, 2.0).unwrap());
    assert!((one.gain_db().value - other.gain_db().value).abs() < 1e-9);
    let turned = other.phase_deg().value - one.phase_deg().value;
    assert!((turned - (2.0 * preview_s).to_degrees()).abs() < 1e-9, "{turned}");
    let errors = [one, other].map(|response| response.phase_deg().standard_error.unwrap());
    assert!((errors[0] / errors[1] - 1.0).abs() < 1e-9, "{errors:?}");
}

#[test]
fn default_tracker_pauses_without_the_further_input_and_refuses_dependent_inputs() {
    let record = record(5, 0.01, false);
    let options = default_tracker(0.0).with(&[("guard", "no")]).unwrap();
    let mut tracker = Tracker::new(&options, None, record.sample_time()).unwrap();
    let r = record.channel("r").unwrap();
    let mut before = Vec::new();
    for k in 0..1200 {
        let reference = Some(r[k]).filter(|_| !(1000..1050).contains(&k));
        let (e, u) = (record.input()[k], record.output()[k]);
        tracker.update(Sample { e, u, reference }, true);
        match k {
            999 => before = tracker.theta().to_vec(),
            1000 | 1049 => assert_eq!(tracker.theta(), before),
            1199 => assert_ne!(tracker.theta(), before),
            _ => {}
        }
    }
    let with_r = |r: Vec<f64>| {
        let channels = ["e", "u"].map(|name| {
            let values = if name == "e" { record.input() } else { record.output() };
            Channel::new(name, "", values.to_vec())
        });
        let [e, u] = channels;
        let made = Record::new(record.sample_time(), e, u).unwrap();
        let made = made.with_channel(Channel::new("r", "", r)).unwrap();
        track(&made, &default_tracker(0.0), 100).unwrap_err().to_string()
    };
    let multiple = record.input().iter().map(|e| 3.0 - 2.0 * e).collect();
    let refused = with_r(multiple);
    assert!(refused.contains("r is a linear combination of e"), "{refused}");
    let refused = with_r(vec![0.0; SAMPLE_COUNT]);
    assert!(refused.contains("r is constant"), "{refused}");
}
