//! The initial covariance determined by a second run, and the share of that run that a trace explains.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use hoid_ident::validation::vaf;
use hoid_model::{
    Channel, Record, SampleTime,
    scenario::{Condition, RemnantStrength, Scenario},
};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{
    CANDIDATE_COVARIANCES, CovarianceUpdates, Method, StartSource, TrackOptions, choose_covariance, track,
    track_validated,
};

const NK: usize = 29;

fn run(noise_level: f64, seed: u64) -> Record {
    let mut scenario = Scenario::condition(Condition::C4);
    if let RemnantStrength::Level { level, .. } = &mut scenario.remnant.strength {
        *level = noise_level;
    }
    let seed = RunSeed {
        seed,
        ..RunSeed::default()
    };
    Simulator::new(&scenario).unwrap().run(seed, false).unwrap()
}

fn options(method: Method) -> TrackOptions {
    TrackOptions {
        start: StartSource::Span(Some((0.0, 30.72))),
        ..TrackOptions::default_for(method, NK)
    }
}

/// Compares a constant model with the difference equation.
#[test]
fn vaf_of_a_constant_trace_matches_its_model() {
    let (record, other) = (run(0.1, 1), run(0.1, 2));
    let theta = vec![0.075, -0.074, -0.8, -1.912, 0.924];
    let stays = TrackOptions {
        start: StartSource::Theta(theta.clone()),
        update_from_s: Some(1e6),
        ..options(Method::rpem())
    };
    let (e, u) = (other.input(), other.output());
    let mut w = vec![0.0; e.len()];
    for k in 0..e.len() {
        let of = |signal: &[f64], lag: usize| if k >= lag { signal[k - lag] } else { 0.0 };
        w[k] = theta[0] * of(e, NK) + theta[1] * of(e, NK + 1) - theta[3] * of(&w, 1) - theta[4] * of(&w, 2);
    }
    for every in [1, 7] {
        let trace = track(&record, &stays, every).unwrap();
        let (found, (from_s, to_s)) = trace.vaf_of(&other).unwrap();
        let first = (from_s * 100.0).round() as usize;
        assert_eq!((first, (to_s * 100.0).round() as usize), (NK + 200, other.len()));
        let expected = vaf(&u[first..], &w[first..]);
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        assert!(expected > 50.0, "{expected}");
    }
}

/// The candidate P that explains the largest share of the second run is chosen; this share is above 80 %.
#[test]
fn best_covariance_of_the_grid_is_chosen() {
    let (record, other) = (run(0.1, 3), run(0.1, 4));
    for method in [Method::rls(), Method::rpem(), hoid_survey::physical()] {
        let (chosen, choice) = choose_covariance(&record, &other, &options(method.clone())).unwrap();
        assert_eq!(choice.candidates.len(), CANDIDATE_COVARIANCES.len());
        assert_eq!(chosen.method.initial_covariance(), Some(choice.covariance));
        let most = choice.candidates.iter().map(|(_, vaf)| *vaf).fold(0.0, f64::max);
        assert_eq!(choice.vaf(), most, "{method}");
        // The output of the model equals that of the trace.
        let trace = track(&record, &chosen, 1).unwrap();
        assert_eq!(trace.vaf_of(&other).unwrap(), (most, choice.span_s));
        assert!(most > 80.0, "{method}: {choice:?}");
        // Everything except the covariance is unchanged.
        let mut without = chosen.clone();
        without.method.set("covariance", "0.1").unwrap();
        let mut given = options(method.clone());
        given.method.set("covariance", "0.1").unwrap();
        assert_eq!(without, given);
    }
    let clean = choose_covariance(&run(0.0, 5), &run(0.0, 6), &options(Method::rpem()))
        .unwrap()
        .1;
    let ends = [
        clean.candidates[0].1,
        clean.candidates[CANDIDATE_COVARIANCES.len() - 1].1,
    ];
    assert!(clean.vaf() > 98.0 && ends.iter().all(|end| *end < 90.0), "{clean:?}");
}

#[test]
fn invalid_choices_are_refused_with_advice() {
    let (record, other) = (run(0.1, 7), run(0.1, 8));
    let refusal = |validation: &Record, options: &TrackOptions| {
        choose_covariance(&record, validation, options).unwrap_err().to_string()
    };
    let given = options(Method::rpem()).with(&[("covariance", "0.1")]).unwrap();
    let found = refusal(&other, &given);
    assert!(
        found.contains("covariance: found 0.1") && found.contains("one of the two"),
        "{found}"
    );
    for method in [Method::adaptive(), hoid_survey::multiple_model(), hoid_survey::window()] {
        let found = refusal(&other, &options(method.clone()));
        assert!(
            found.contains(method.name()) && found.contains("rls or rpem"),
            "{found}"
        );
        assert!(
            method
                .settings()
                .list()
                .iter()
                .all(|setting| setting.name != "covariance")
        );
    }
    let gradient = options(Method::rpem()).with(&[("forgetting", "gradient")]).unwrap();
    assert!(refusal(&other, &gradient).contains("has P"));
    let tracked = options(Method::rpem()).with(&[("track_delay", "0.2..0.4")]).unwrap();
    assert!(refusal(&other, &tracked).contains("without track_delay"));
    // A second run is refused if it has another sample time, too few samples, the sign of u inverted, only zeros, or no
    // input.
    let (e, u) = (other.input().to_vec(), other.output().to_vec());
    let of = |ts: f64, e: &[f64], u: Vec<f64>| {
        let (e, u) = (Channel::new("e", "", e.to_vec()), Channel::new("u", "", u));
        Record::new(SampleTime::new(ts).unwrap(), e, u).unwrap()
    };
    let found = refusal(&of(0.02, &e, u.clone()), &options(Method::rls()));
    assert!(found.contains("0.02") && found.contains("0.01"), "{found}");
    let found = refusal(&of(0.01, &e[..700], u[..700].to_vec()), &options(Method::rls()));
    assert!(found.contains("7 s in common") && found.contains("7.29"), "{found}");
    let turned = of(0.01, &e, u.iter().map(|value| -value).collect());
    let found = refusal(&turned, &options(Method::rpem()));
    assert!(found.contains("VAF of 0 %") && found.contains("signs"), "{found}");
    let found = refusal(&of(0.01, &e, vec![0.0; e.len()]), &options(Method::rpem()));
    assert!(found.contains("VAF of 0 %"), "{found}");
    let alone = Record::from_output(record.sample_time(), Channel::new("u", "", u)).unwrap();
    assert!(refusal(&alone, &options(Method::rls())).contains("no input"));
}

/// With a power of zero the results are bit-identical; with the default power P is reduced, and the estimate for a
/// person who changes oscillates less, as the thesis expects.
#[test]
fn vaf_power_reduces_the_covariance() {
    let (mut default, mut updated, mut differs) = (0.0, 0.0, false);
    for seed in 20..26 {
        let (record, other) = (run(0.2, seed), run(0.2, seed + 100));
        let settings = [
            ("memory", "256"),
            ("covariance", "0.1"),
            ("limit", "inf"),
            ("stable", "noise"),
        ];
        let text = options(Method::rpem()).with(&settings).unwrap();
        let alone = CovarianceUpdates {
            power: 0.0,
            ..CovarianceUpdates::default()
        };
        let plain = track(&record, &text, 1).unwrap();
        let left = track_validated(&record, &other, &text, &alone, 1).unwrap();
        let by_vaf = track_validated(&record, &other, &text, &CovarianceUpdates::default(), 1).unwrap();
        for k in (0..plain.len()).step_by(500) {
            assert_eq!(plain.theta(k), left.theta(k), "{k}");
            differs |= plain.theta(k) != by_vaf.theta(k);
        }
        default += plain.vaf_of(&other).unwrap().0;
        updated += by_vaf.vaf_of(&other).unwrap().0;
    }
    println!(
        "VAF of the second run, mean of six: {:.2} %, with updates {:.2} %",
        default / 6.0,
        updated / 6.0
    );
    assert!(differs && updated > default, "{default} {updated}");
    let (record, other) = (run(0.1, 30), run(0.1, 31).span(0.0, 60.0).unwrap());
    let refusal = |other: &Record, options: TrackOptions| {
        let updates = CovarianceUpdates::default();
        track_validated(&record, other, &options, &updates, 1)
            .unwrap_err()
            .to_string()
    };
    assert!(refusal(&other, options(Method::rpem())).contains("6000 samples"));
    assert!(refusal(&record, options(hoid_survey::window())).contains("rls or rpem"));
    let tracked = options(Method::rpem()).with(&[("track_delay", "0.2..0.4")]).unwrap();
    assert!(refusal(&record, tracked).contains("without track_delay"));
    // A second run without any signal contains no information.
    let n = record.len();
    let silent = Record::new(
        record.sample_time(),
        Channel::new("e", "", vec![0.0; n]),
        Channel::new("u", "", vec![0.0; n]),
    );
    let silent = silent.unwrap();
    let updates = CovarianceUpdates::default();
    let found = track_validated(&record, &silent, &options(Method::rls()), &updates, n).unwrap();
    assert_eq!(
        found.theta(0),
        track(&record, &options(Method::rls()), n).unwrap().theta(0)
    );
}
