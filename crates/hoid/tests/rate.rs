//! People who are recorded at high rates: decimation does not change their parameters.
#![allow(clippy::unwrap_used)]

use hoid::{
    ident::{
        GreyBox,
        frequency::{RecordDescriptionOptions, describe_runs},
    },
    model::{Decimation, remnant_gain::NoiseDefinition, scenario::RemnantStrength},
    prelude::*,
};

/// Simulates C1 with this noise level.
fn run(hz: f64, noise_level: f64, seed: u64) -> Record {
    let mut scenario = Scenario::condition(Condition::C1);
    scenario.sample_time = SampleTime::new(1.0 / hz).unwrap();
    scenario.remnant.strength = RemnantStrength::Level {
        level: noise_level,
        definition: NoiseDefinition::Response,
    };
    let seed = RunSeed {
        seed,
        ..RunSeed::default()
    };
    Simulator::new(&scenario).unwrap().run(seed, false).unwrap()
}

#[test]
fn decimation_keeps_the_delay() {
    // With a small remnant, a change of one millisecond in the delay is visible; the longer hold alone would change the
    // delay by 2.7 to 4.8 ms.
    for (hz, factor) in [(250.0, 3), (1000.0, 10), (2000.0, 20)] {
        let (record, done) = Decimation::Auto.apply(run(hz, 0.001, 0)).unwrap();
        let done = done.unwrap();
        assert!(done.factor == factor && done.lead_s > 0.0026);
        let fit = GreyBox::new(1..=4).fit(&[record]).unwrap();
        let o = fit.operator(0).unwrap();
        println!(
            "{hz} Hz: tau_e {:.5} +- {:.5}",
            o.tau_e_s.value,
            o.tau_e_s.standard_error.unwrap()
        );
        assert!((o.tau_e_s.value - 0.28).abs() < 0.001, "{hz}: {:?}", o.tau_e_s);
        assert!((o.t_l_s.value - 0.4).abs() < 0.01, "{hz}: {:?}", o.t_l_s);
        assert!(
            (o.omega_nm_rad_s.value - 11.25).abs() < 0.1,
            "{hz}: {:?}",
            o.omega_nm_rad_s
        );
    }
}

#[test]
fn decimation_keeps_the_describing_function() {
    let whole = run(1000.0, 0.1, 3);
    let of = |record: &Record, offset_samples: f64| {
        let options = RecordDescriptionOptions {
            excitation: Some("f_t".to_owned()),
            offset_samples,
            ..RecordDescriptionOptions::default()
        };
        describe_runs(std::slice::from_ref(record), &options).unwrap()
    };
    let fast = of(&whole, 0.0);
    let (slow, done) = whole.decimated(10).unwrap();
    let slow = of(&slow, done.lead_s / slow.sample_time().s());
    assert_eq!(fast.function.lines.len(), slow.function.lines.len());
    for (a, b) in fast.function.lines.iter().zip(&slow.function.lines) {
        let distance = (a.response - b.response).norm() / a.response.norm();
        assert!(distance < 2e-3, "{}: {distance:e}", a.omega_rad_s);
    }
}
