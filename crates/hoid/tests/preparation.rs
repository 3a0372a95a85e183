//! Fits on prepared records: the effect of alignment, units and another rate on the parameters of the operator.
#![allow(clippy::unwrap_used)]

use hoid::{
    ident::GreyBox,
    io::{NewRate, Offset, Preparation, Scaling},
    prelude::*,
};

fn run(replication: u64) -> Record {
    let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
    let run_seed = RunSeed {
        seed: 21,
        cell: 0,
        replication,
    };
    simulator.run(run_seed, false).unwrap()
}

/// Returns a record of e and u only, with the output `late` samples late.
fn delayed_record(record: &Record, late: usize) -> Record {
    let n = record.len();
    let channel = |name: &str, values: &[f64]| Channel::new(name, "", values.to_vec());
    Record::new(
        record.sample_time(),
        channel("e", &record.input()[late..]),
        channel("u", &record.output()[..n - late]),
    )
    .unwrap()
}

fn prepare(record: Record, change: impl FnOnce(&mut Preparation)) -> Record {
    let mut preparation = Preparation::default();
    change(&mut preparation);
    preparation.apply(record).unwrap().0
}

#[test]
fn offset_gives_the_aligned_record() {
    let whole = run(1);
    // u is recorded three samples late in the file.
    let late = delayed_record(&whole, 3);
    let aligned = prepare(late, |p| {
        p.offset.insert("u".into(), Offset::Samples(3.0));
    });
    let n = aligned.len();
    assert_eq!(aligned.input(), &whole.input()[3..3 + n]);
    assert_eq!(aligned.output(), &whole.output()[3..3 + n]);
}

#[test]
fn units_change_only_the_gains() {
    let orders = Structure::BoxJenkins.operator_orders(29);
    let fit = |record: Record| Estimator::new(Structure::BoxJenkins, orders).fit(&[record]).unwrap();
    let plain = fit(delayed_record(&run(1), 0)).operator().unwrap();
    let volts = fit(prepare(delayed_record(&run(1), 0), |p| {
        p.scale
            .insert("u".into(), Scaling::from_factor(0.25, Some("V")).unwrap());
    }))
    .operator()
    .unwrap();
    // The search ends within 1e-12 of the minimum loss, which corresponds to a relative error of 1e-6 in a parameter.
    for (found, expected) in [
        (volts.k_e.value, 0.25 * plain.k_e.value),
        (volts.t_l_s.value, plain.t_l_s.value),
        (volts.omega_nm_rad_s.value, plain.omega_nm_rad_s.value),
        (volts.zeta_nm.value, plain.zeta_nm.value),
    ] {
        assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
    }
}

#[test]
fn decimated_record_gives_the_same_operator() {
    const RUNS: u64 = 12;
    const FACTOR: usize = 4;
    // Gain, lead, neuromuscular frequency and damping, and delay. The longer hold would shorten the delay by .015 s,
    // which the shift of the input compensates.
    let expected = [0.09, 0.4, 11.25, 0.35, 0.28];
    let mut sums = [[0.0; 2]; 5];
    let mut worst = 0.0_f64;
    for replication in 0..RUNS {
        let record = prepare(delayed_record(&run(replication), 0), |p| {
            p.rate = NewRate::Decimated(FACTOR)
        });
        assert!((record.sample_time().s() - 0.04).abs() < 1e-15);
        let fit = GreyBox::new(1..=4).fit(&[record]).unwrap();
        let o = fit.operator(0).unwrap();
        let tau = o.tau_e_s;
        let all = [o.k_e, o.t_l_s, o.omega_nm_rad_s, o.zeta_nm, tau];
        for ((sum, estimate), truth) in sums.iter_mut().zip(all).zip(expected) {
            sum[0] += estimate.value / RUNS as f64;
            sum[1] += estimate.standard_error.unwrap().powi(2) / (RUNS * RUNS) as f64;
            worst = worst.max((estimate.value - truth).abs() / estimate.standard_error.unwrap());
        }
    }
    for (name, (sum, truth)) in ["K_e", "T_L", "omega_nm", "zeta_nm", "tau_e"]
        .iter()
        .zip(sums.iter().zip(expected))
    {
        println!("{name}: {:.5} +- {:.5}, expected {truth:.5}", sum[0], sum[1].sqrt());
    }
    println!("worst single estimate: {worst:.2} standard errors");
    for (sum, truth) in sums.iter().zip(expected) {
        assert!(
            (sum[0] - truth).abs() < 4.0 * sum[1].sqrt() + 0.01 * truth,
            "{} {truth}",
            sum[0]
        );
    }
}
