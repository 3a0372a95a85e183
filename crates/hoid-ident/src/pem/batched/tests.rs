use hoid_model::scenario::{Condition, RemnantStrength, Scenario};
use hoid_sim::{RunSeed, Simulator};

use hoid_lanes::InstructionSet;
use hoid_model::{Orders, Record, Structure};

use super::lanes::Lanes;
use crate::{
    Estimator, Fit, IdentError, InitialState,
    criterion::{Criterion, Data, Workspace, first_residual},
    optimize::{Linearisation, Objective},
};

/// Returns the fits of an estimator in lanes.
fn fit_each(estimator: &Estimator, records: &[&Record], path: InstructionSet) -> Option<Vec<Result<Fit, IdentError>>> {
    super::fit_each(&estimator.settings(), records, path)
}

/// Returns runs of C1, each with another remnant.
fn runs(count: u64, samples: usize) -> Vec<Record> {
    let run = |replication: u64| {
        let mut scenario = Scenario::condition(Condition::C1);
        scenario.remnant.order = 1 + (replication % 4) as usize;
        scenario.remnant.strength = RemnantStrength::Level {
            level: 0.05 * (1 + replication % 5) as f64,
            definition: Default::default(),
        };
        let run_seed = RunSeed {
            seed: 17,
            replication,
            ..RunSeed::default()
        };
        let run = Simulator::new(&scenario).unwrap().run(run_seed, false).unwrap();
        run.span(0.0, samples as f64 * 0.01).unwrap()
    };
    (0..count).map(run).collect()
}

fn references(records: &[Record]) -> Vec<&Record> {
    records.iter().collect()
}

fn orders(nb: usize, nd: usize, nf: usize, nk: usize) -> Orders {
    Orders {
        nb,
        nd,
        nf,
        nk,
        ..Orders::default()
    }
}

/// Returns the criterion of each record in a lane, each at its own theta.
fn pass(o: Orders, records: &[Record], thetas: &[Vec<f64>], path: InstructionSet) -> Vec<(Linearisation, bool)> {
    let first = first_residual(&o, InitialState::Estimate);
    let mut lanes = Lanes::new(o, first, records[0].len(), path.lane_count().unwrap());
    for (lane, (record, theta)) in records.iter().zip(thetas).enumerate().take(lanes.width) {
        lanes.load_record(lane, Data::of(std::slice::from_ref(record))[0]);
        for (i, value) in theta.iter().enumerate() {
            lanes.memory.theta[i * lanes.width + lane] = *value;
        }
    }
    lanes.pass(path);
    (0..lanes.width.min(records.len()))
        .map(|lane| (lanes.linearisation(lane), lanes.memory.sums.dependent[lane]))
        .collect()
}

fn all_sums(there: &Linearisation) -> Vec<f64> {
    let mut all = vec![there.sum_of_squares];
    all.extend(&there.descent);
    all.extend(&there.gram);
    all
}

/// Returns a theta with poles similar to those of a person, different in each lane.
fn theta(o: &Orders, lane: usize) -> Vec<f64> {
    let shift = 0.003 * lane as f64;
    let mut theta: Vec<f64> = (0..o.nb).map(|j| 0.06 - 0.05 * j as f64 + shift).collect();
    theta.extend((0..o.nd).map(|i| (-0.7 + 10.0 * shift) / f64::powi(2.0, i as i32)));
    let f: &[f64] = match o.nf {
        1 => &[-0.93],
        2 => &[-1.91, 0.92],
        3 => &[-2.2, 1.5, -0.28],
        _ => &[-2.2, 1.5, -0.28, 0.01],
    };
    theta.extend(f.iter().map(|f| f * (1.0 - 0.2 * shift)));
    theta
}

#[test]
fn lane_criterion_matches_a_single_record() {
    let records = runs(8, 1500);
    for o in [
        orders(2, 1, 2, 29),
        orders(2, 0, 2, 29),
        orders(2, 4, 2, 25),
        orders(1, 2, 1, 3),
        orders(4, 1, 4, 1),
        orders(3, 6, 3, 0),
    ] {
        let thetas: Vec<Vec<f64>> = (0..8).map(|lane| theta(&o, lane)).collect();
        for (lane, (found, dependent)) in pass(o, &records, &thetas, InstructionSet::Best).into_iter().enumerate() {
            assert!(!dependent);
            let criterion = Criterion {
                orders: o,
                data: Data::of(&records[lane..=lane]),
                initial: InitialState::Estimate,
                first: first_residual(&o, InitialState::Estimate),
                weights: None,
                further: Vec::new(),
            };
            let alone = criterion.linearise(&thetas[lane], &mut Workspace::default());
            let p = o.parameter_count();
            let size = |i: usize| match i {
                0 => alone.sum_of_squares,
                i if i <= p => (alone.sum_of_squares * alone.gram[(i - 1) * (p + 1)]).sqrt(),
                i => {
                    let (j, k) = ((i - 1 - p) / p, (i - 1 - p) % p);
                    (alone.gram[j * (p + 1)] * alone.gram[k * (p + 1)]).sqrt()
                }
            };
            for (i, (a, b)) in all_sums(&found).into_iter().zip(all_sums(&alone)).enumerate() {
                // The tolerance allows for the rounding errors of filters with poles near the unit circle, relative to
                // the sizes of the columns.
                assert!(
                    (a - b).abs() <= 1e-11 * size(i),
                    "{o} lane {lane} number {i}: {a} for {b}"
                );
            }
        }
    }
}

#[test]
fn lane_is_bit_identical_on_every_path_and_alone() {
    let (records, o) = (runs(8, 1200), orders(2, 2, 2, 29));
    let thetas: Vec<Vec<f64>> = (0..8).map(|lane| theta(&o, lane)).collect();
    let bits = |there: &Linearisation| -> Vec<u64> { all_sums(there).into_iter().map(f64::to_bits).collect() };
    let best = pass(o, &records, &thetas, InstructionSet::Best);
    for path in InstructionSet::available() {
        for lane in 0..best.len() {
            let (alone, _) = &pass(o, &records[lane..=lane], &thetas[lane..=lane], path)[0];
            assert_eq!(bits(alone), bits(&best[lane].0), "lane {lane} on {path:?}");
        }
    }
}

#[test]
fn batched_fits_match_single_fits() {
    let records = runs(11, 3072);
    for (nd, start) in [
        (1, None),
        (2, Some(vec![0.075, -0.075, 0.0, 0.0, -1.912, 0.924])),
        (4, None),
    ] {
        let estimator = Estimator {
            start,
            ..Estimator::new(Structure::BoxJenkins, orders(2, nd, 2, 29))
        };
        let each = fit_each(&estimator, &references(&records), InstructionSet::Best).unwrap();
        for (record, found) in records.iter().zip(each) {
            let (found, alone) = (found.unwrap(), estimator.fit(std::slice::from_ref(record)).unwrap());
            assert_eq!(found.start(), alone.start());
            assert_eq!(found.termination().reason, alone.termination().reason);
            for (a, b) in found.parameters().iter().zip(alone.parameters()) {
                let (a, b) = (&a.1, b.1);
                let (se_a, se_b) = (a.standard_error.unwrap(), b.standard_error.unwrap());
                assert!((a.value - b.value).abs() <= 1e-7 * se_b, "{a:?} for {b:?}");
                assert!((se_a - se_b).abs() <= 1e-8 * se_b);
            }
        }
    }
}

#[test]
fn batched_fits_are_bit_identical_on_every_path_and_alone() {
    let records = runs(5, 2048);
    let estimator = Estimator::new(Structure::BoxJenkins, orders(2, 1, 2, 29));
    let bits = |records: &[Record], path: InstructionSet| -> Vec<Vec<u64>> {
        let fits = fit_each(&estimator, &references(records), path).unwrap();
        let theta = |fit: Result<Fit, IdentError>| fit.unwrap().model().theta().iter().map(|t| t.to_bits()).collect();
        fits.into_iter().map(theta).collect()
    };
    let best = bits(&records, InstructionSet::Best);
    for path in InstructionSet::available() {
        assert_eq!(bits(&records, path), best, "{path:?}");
        for (lane, alone) in best.iter().enumerate() {
            assert_eq!(
                bits(&records[lane..=lane], path)[0],
                *alone,
                "record {lane} on {path:?}"
            );
        }
    }
}

#[test]
fn bad_record_does_not_affect_other_fits() {
    let mut records = runs(3, 1024);
    let silent = Record::new(
        records[0].sample_time(),
        hoid_model::Channel::new("e", "", vec![0.0; 1024]),
        hoid_model::Channel::new("u", "", vec![0.0; 1024]),
    );
    records[1] = silent.unwrap();
    let estimator = Estimator::new(Structure::BoxJenkins, orders(2, 1, 2, 29));
    let each = estimator.fit_each(&references(&records));
    for (record, found) in records.iter().zip(each) {
        match (found, estimator.fit(std::slice::from_ref(record))) {
            (Ok(found), Ok(alone)) => assert!((found.loss() - alone.loss()).abs() <= 1e-12 * alone.loss()),
            (Err(found), Err(alone)) => assert_eq!(found.to_string(), alone.to_string()),
            (found, alone) => panic!("{found:?} for {alone:?}"),
        }
    }
    assert!(estimator.fit_each(&[]).is_empty());
}

#[test]
fn unsupported_batches_are_fitted_one_by_one() {
    let mut records = runs(2, 1024);
    let bj = Estimator::new(Structure::BoxJenkins, orders(2, 1, 2, 29));
    let arx = Estimator::new(Structure::Arx, Structure::Arx.operator_orders(29));
    assert!(fit_each(&arx, &references(&records), InstructionSet::Best).is_none());
    // The pass has no C.
    let with_c = Orders { nc: 1, ..bj.orders };
    let with_c = Estimator::new(Structure::BoxJenkins, with_c);
    assert!(fit_each(&with_c, &references(&records), InstructionSet::Best).is_none());
    assert!(arx.fit_each(&references(&records)).into_iter().all(|fit| fit.is_ok()));
    records[1] = records[1].span(0.0, 9.0).unwrap();
    assert!(fit_each(&bj, &references(&records), InstructionSet::Best).is_none());
    assert!(bj.fit_each(&references(&records)).into_iter().all(|fit| fit.is_ok()));
}
