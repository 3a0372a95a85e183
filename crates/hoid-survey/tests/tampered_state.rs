//! Trackers and warm-ups are not restored from numbers that were changed, truncated or never saved: these are rejected
//! without a panic.
#![allow(clippy::unwrap_used)]

use std::sync::OnceLock;

use hoid_model::{
    Record, SampleTime, Structure,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{Method, Sample, Stage, TrackOptions, Tracker, WarmUp, sealed, unsealed};
use proptest::{collection::vec, prelude::*, sample::Index, test_runner::RngSeed};

/// Options and numbers of a tracker after a run, for each method, and the numbers of a warm-up.
struct SavedStates {
    sample_time: SampleTime,
    trackers: Vec<(TrackOptions, Vec<f64>)>,
    warm_up: Vec<f64>,
}

fn record() -> Record {
    let simulator = Simulator::new(&Scenario::condition(Condition::C4)).unwrap();
    let seed = RunSeed {
        seed: 4,
        ..RunSeed::default()
    };
    simulator.run(seed, false).unwrap()
}

fn saved_states() -> &'static SavedStates {
    static SAVED: OnceLock<SavedStates> = OnceLock::new();
    SAVED.get_or_init(|| {
        let record = record();
        let span = record.span(0.0, 20.0).unwrap();
        let bj = Structure::BoxJenkins;
        let of = |method| TrackOptions::new(method, bj, bj.operator_orders(29));
        let all = [
            TrackOptions::new(Method::rls(), Structure::Arx, Structure::Arx.operator_orders(29)),
            of(Method::rpem()),
            of(hoid_survey::physical()),
            of(hoid_survey::multiple_model()),
            of(hoid_survey::ekf()),
            of(hoid_survey::window()).with(&[("refit", "400")]).unwrap(),
        ];
        let sample = |k: usize| Sample {
            e: record.input()[k],
            u: record.output()[k],
            reference: None,
        };
        let run = |options: TrackOptions| {
            let mut tracker = Tracker::new(&options, Some(&span), record.sample_time()).unwrap();
            (2000..2300).for_each(|k| {
                tracker.update(sample(k), true);
            });
            let numbers = tracker.save();
            (options, numbers)
        };
        let mut live = Stage::new(&of(hoid_survey::physical()), 2000, record.sample_time()).unwrap();
        let keep = of(hoid_survey::physical());
        for k in 0..100 {
            live.update(sample(k), true, &|_| Ok((keep.clone(), None)));
        }
        let Stage::Collecting(mut warm_up) = live else {
            panic!("the warm-up is over")
        };
        SavedStates {
            sample_time: record.sample_time(),
            trackers: all.into_iter().map(run).collect(),
            warm_up: warm_up.save(),
        }
    })
}

/// A modification of the numbers.
#[derive(Debug, Clone)]
enum Tampering {
    Set(Index, f64),
    Flip(Index, u32),
    Swap(Index, Index),
    Remove(Index),
    Insert(Index, f64),
    Cut(Index),
}

fn tampering() -> impl Strategy<Value = Tampering> {
    let number = prop_oneof![
        any::<f64>(),
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(-1.0),
        Just(1e18),
        Just(1e300)
    ];
    let at = any::<Index>;
    prop_oneof![
        (at(), number.clone()).prop_map(|(at, to)| Tampering::Set(at, to)),
        (at(), 0..64_u32).prop_map(|(at, bit)| Tampering::Flip(at, bit)),
        (at(), at()).prop_map(|(a, b)| Tampering::Swap(a, b)),
        at().prop_map(Tampering::Remove),
        (at(), number).prop_map(|(at, to)| Tampering::Insert(at, to)),
        at().prop_map(Tampering::Cut),
    ]
}

fn tamper(numbers: &mut Vec<f64>, by: &Tampering) {
    let n = numbers.len();
    if n == 0 {
        return;
    }
    match by {
        Tampering::Set(at, to) => numbers[at.index(n)] = *to,
        Tampering::Flip(at, bit) => {
            let number = &mut numbers[at.index(n)];
            *number = f64::from_bits(number.to_bits() ^ (1 << bit));
        }
        Tampering::Swap(a, b) => numbers.swap(a.index(n), b.index(n)),
        Tampering::Remove(at) => {
            numbers.remove(at.index(n));
        }
        Tampering::Insert(at, number) => numbers.insert(at.index(n), *number),
        Tampering::Cut(at) => numbers.truncate(at.index(n)),
    }
}

fn is_bit_identical(a: &[f64], b: &[f64]) -> bool {
    let both_nan = |a: &f64, b: &f64| a.is_nan() && b.is_nan();
    a.len() == b.len()
        && a.iter()
            .zip(b)
            .all(|(a, b)| a.to_bits() == b.to_bits() || both_nan(a, b))
}

/// Changes each number in turn and writes a valid checksum: no index, length or difference of counters causes a panic.
#[test]
fn changing_any_number_never_panics() {
    let (saved, record) = (saved_states(), record());
    for (options, numbers) in &saved.trackers {
        let numbers = unsealed(numbers).unwrap();
        for (at, number) in (0..numbers.len()).flat_map(|at| [(at, 0.0), (at, 1e18)]) {
            let mut changed = numbers.to_vec();
            changed[at] = number;
            let restored = Tracker::restore(options, saved.sample_time, &sealed(changed));
            let Ok(mut tracker) = restored else { continue };
            for k in 2300..2340 {
                tracker.step(record.input()[k], record.output()[k]);
            }
            let _ = (tracker.covariance(), tracker.operator(), tracker.response(1.0));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(23), ..ProptestConfig::with_cases(200) })]

    #[test]
    fn changed_numbers_are_refused(which in any::<Index>(), by in vec(tampering(), 1..4)) {
        let saved = saved_states();
        let (options, numbers) = which.get(&saved.trackers);
        let mut changed = numbers.clone();
        by.iter().for_each(|one| tamper(&mut changed, one));
        let restored = Tracker::restore(options, saved.sample_time, &changed);
        prop_assert_eq!(restored.is_ok(), is_bit_identical(numbers, &changed));
        if let Err(error) = restored {
            prop_assert!(error.to_string().contains("save it again"), "{}", error);
        }
        let mut changed = saved.warm_up.clone();
        by.iter().for_each(|one| tamper(&mut changed, one));
        prop_assert_eq!(WarmUp::restore(saved.sample_time, &changed).is_some(), is_bit_identical(&saved.warm_up, &changed));
    }

    #[test]
    fn state_of_another_tracker_is_refused(a in any::<Index>(), b in any::<Index>(), nk in 1..60_usize) {
        let saved = saved_states();
        let (options, numbers) = a.get(&saved.trackers);
        let (others, of_others) = b.get(&saved.trackers);
        if options != others && numbers.len() != of_others.len() {
            prop_assert!(Tracker::restore(options, saved.sample_time, of_others).is_err());
        }
        // Numbers of the right length are accepted as numbers of that tracker, and no values cause a panic.
        let orders = options.structure.operator_orders(nk);
        let other = TrackOptions { orders, ..options.clone() };
        let _ = Tracker::restore(&other, saved.sample_time, numbers);
        prop_assert!(WarmUp::restore(saved.sample_time, numbers).is_none());
    }

    #[test]
    fn arbitrary_numbers_are_refused_as_a_state(which in any::<Index>(), numbers in vec(any::<f64>(), 0..50)) {
        let saved = saved_states();
        let (options, _) = which.get(&saved.trackers);
        prop_assert!(Tracker::restore(options, saved.sample_time, &numbers).is_err());
        prop_assert!(WarmUp::restore(saved.sample_time, &numbers).is_none());
    }
}
