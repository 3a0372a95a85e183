//! People who feel the motion of the machine.
#![allow(clippy::unwrap_used)]

use hoid_model::{
    Complex64, FamilyOperator, FamilyScenario, FamilyState, Form, Record, SampleTime,
    family_scenario::{Interleaved, MultiSine, RemnantPart, RemnantShape},
    polynomial,
    schedule::Schedule,
};
use hoid_sim::{FamilyOperatorRun, FamilySimulator, RunSeed, SimError};

const NEUROMUSCULAR: (f64, f64) = (11.0, 0.3);

fn seed(replication: u64) -> RunSeed {
    RunSeed {
        seed: 8,
        replication,
        ..RunSeed::default()
    }
}

fn operator(form: Form, head: &[f64], tau_s: f64) -> FamilyOperator {
    let tail = [NEUROMUSCULAR.0.ln(), NEUROMUSCULAR.1.ln(), tau_s];
    FamilyOperator::new(form, true, &[head, &tail].concat()).unwrap()
}

/// Scenario of a person who controls 3/(s(s+1)), with separate lines for the target and the disturbance.
fn task(motion: Option<FamilyOperator>) -> FamilyScenario {
    let state = FamilyState {
        operator: operator(Form::Lead, &[0.6, 0.6], 0.2),
        controlled_element: "3/(s(s+1))".parse().unwrap(),
    };
    let mut scenario = FamilyScenario::new(state, SampleTime::AT_100_HZ);
    let sum = |rms, interleaved| MultiSine {
        rms,
        interleaved,
        largest: 43,
        ..MultiSine::default()
    };
    scenario.target = sum(1.0, Interleaved::Even).excitation().unwrap();
    scenario.disturbance = sum(0.5, Interleaved::Odd).excitation().unwrap();
    scenario.measurement_s = 40.0;
    scenario.run_in_s = 60.0;
    scenario.motion = motion;
    scenario
}

fn responses() -> Vec<FamilyOperator> {
    vec![
        operator(Form::Gain, &[-0.2], 0.17),
        operator(Form::Lag, &[-0.3, 0.5], 0.15),
        operator(Form::Derivative, &[-0.15], 0.1537),
        operator(Form::Canals, &[-0.9], 0.18),
        operator(Form::CanalsRate, &[-0.6], 0.18),
        // Without a delay, the direct part of the canals acts within a sample.
        operator(Form::Canals, &[-0.9], 0.0),
    ]
}

fn coefficient(record: &Record, name: &str, omega: f64) -> Complex64 {
    let turned = |(k, v): (usize, &f64)| Complex64::from_polar(*v, -omega * k as f64 * record.sample_time().s());
    record.channel(name).unwrap().iter().enumerate().map(turned).sum()
}

/// At each line of the target and the disturbance, U = Y E + M Y_out with the exact discrete models.
#[test]
fn motion_response_is_exact_at_every_line() {
    for felt in responses() {
        let mut scenario = task(Some(felt.clone()));
        // The response of the canals decays with a time constant of 5.9 s, so the run-in must be long.
        scenario.run_in_s = 160.0;
        let record = FamilySimulator::new(&scenario)
            .unwrap()
            .run_with_truth(seed(0), false)
            .unwrap();
        let ts = record.sample_time();
        for of in [&scenario.target, &scenario.disturbance] {
            for line in of.function.sinusoids() {
                let omega = line.omega_rad_s;
                let held = |operator: &FamilyOperator| {
                    let held = operator.zoh(ts).unwrap();
                    let back = Complex64::from_polar(1.0, -omega * ts.s());
                    let f = [&[1.0][..], &held.f].concat();
                    polynomial::value(&held.b, back) / polynomial::value(&f, back) * back.powi(held.nk as i32)
                };
                let of = |name: &str| coefficient(&record, name, omega);
                let expected = held(&scenario.initial.operator) * of("e") + held(&felt) * of("y");
                assert!((of("u") / expected - 1.0).norm() < 1e-6, "{felt:?} {omega}");
                // The target is f_t = e + y.
                assert!((of("f_t") - of("e") - of("y")).norm() < 1e-9);
            }
        }
        let role = |name: &str| record.channels().find(|c| c.name == name).unwrap().role.clone();
        assert_eq!((role("y").as_str(), role("f_t").as_str()), ("motion", ""));
        let (name, _) = felt.form().gain_name_and_unit();
        let name = if felt.form() == Form::Lag { "K_over_T_I" } else { name };
        assert_eq!(record.channel(&format!("y_{name}")).unwrap()[0], felt.coordinates()[0]);
    }
}

/// The predicted variances of u and e include the response to motion, and the remnant has its share.
#[test]
fn remnant_share_includes_the_motion_response() {
    let mut scenario = task(Some(operator(Form::Canals, &[-2.0], 0.18)));
    let shape = RemnantShape::Lag {
        time_constant_s: 0.1,
        order: 1,
    };
    scenario.remnant = vec![RemnantPart::new(shape, 0.2)];
    let simulator = FamilySimulator::new(&scenario).unwrap();
    let (mut u, mut e) = (0.0, 0.0);
    let runs = 40;
    for r in 0..runs {
        let record = simulator.run(seed(r), false).unwrap();
        let square = |x: &[f64]| x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64;
        u += square(record.output()) / runs as f64;
        e += square(record.input()) / runs as f64;
    }
    assert!((u / simulator.control_variance()[0] - 1.0).abs() < 0.05);
    assert!((e / simulator.error_variance()[0] - 1.0).abs() < 0.05);
    scenario.motion = None;
    let plain = FamilySimulator::new(&scenario).unwrap();
    let ratio = plain.error_variance()[0] / simulator.error_variance()[0];
    assert!((ratio - 1.0).abs() > 0.1, "{ratio}");
}

/// Both responses share a changing neuromuscular system: after the change, the response is that of the final state.
#[test]
fn changing_neuromuscular_system_is_shared() {
    let mut scenario = task(Some(operator(Form::Canals, &[-0.9], 0.18)));
    scenario.target.random_phases = false;
    scenario.disturbance.random_phases = false;
    scenario.measurement_s = 100.0;
    scenario.last.operator = scenario.last.operator.with_neuromuscular(8.0, 0.6).unwrap();
    scenario.schedule = Schedule::Sigmoid {
        rate_per_s: 100.0,
        midpoint_s: 10.0,
    };
    let changing = FamilySimulator::new(&scenario).unwrap().run(seed(0), false).unwrap();
    let mut after = scenario.clone();
    after.schedule = Schedule::Constant;
    after.initial = scenario.last.clone();
    after.motion = Some(scenario.motion.as_ref().unwrap().with_neuromuscular(8.0, 0.6).unwrap());
    let constant = FamilySimulator::new(&after).unwrap().run(seed(0), false).unwrap();
    let largest = constant.output().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    for k in (9000..10_000).step_by(37) {
        let off = (changing.output()[k] - constant.output()[k]).abs();
        assert!(off < 1e-6 * largest, "{k} {off}");
    }
}

#[test]
fn invalid_motion_responses_are_refused() {
    let bare = FamilyOperator::new(Form::Gain, false, &[-0.2, 0.1]).unwrap();
    let refused = FamilySimulator::new(&task(Some(bare))).unwrap_err().to_string();
    assert!(refused.contains("share one neuromuscular system"), "{refused}");
    // A response that reinforces the motion of the machine makes the loop unstable.
    let unstable = FamilySimulator::new(&task(Some(operator(Form::Gain, &[2.0], 0.2))));
    assert!(matches!(unstable, Err(SimError::Model(_))), "{unstable:?}");
    // The operator alone has the error as its only input.
    let simulator = FamilySimulator::new(&task(Some(operator(Form::Canals, &[-0.9], 0.18)))).unwrap();
    assert!(FamilyOperatorRun::new(simulator, seed(0), 0.0).is_ok());
}
