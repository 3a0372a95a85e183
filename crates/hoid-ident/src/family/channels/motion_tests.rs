//! People who feel the motion of the machine.

use hoid_model::{
    FamilyOperator, FamilyScenario, FamilyState, Form, Record, SampleTime,
    family_scenario::{Interleaved, MultiSine, RemnantPart, RemnantShape},
};
use hoid_sim::{FamilySimulator, RunSeed};

use crate::family::{ChannelRole, FamilyEstimator, FamilyFit, Intersample, Parameter, SeenChannel};

const GAIN: f64 = -2.5;

fn operator(form: Form, head: &[f64], tau_s: f64) -> FamilyOperator {
    let tail = [11.0_f64.ln(), 0.3_f64.ln(), tau_s];
    FamilyOperator::new(form, true, &[head, &tail].concat()).unwrap()
}

/// Scenario of a person who controls 3/(s(s+1)), with separate lines for target and disturbance.
fn task(motion: Option<FamilyOperator>, share: f64) -> FamilyScenario {
    let state = FamilyState {
        operator: operator(Form::Lead, &[0.6, 0.5], 0.25),
        controlled_element: "3/(s(s+1))".parse().unwrap(),
    };
    let mut scenario = FamilyScenario::new(state, SampleTime::AT_100_HZ);
    let sum = |rms, interleaved| MultiSine {
        rms,
        interleaved,
        largest: 61,
        ..MultiSine::default()
    };
    scenario.target = sum(1.0, Interleaved::Even).excitation().unwrap();
    scenario.disturbance = sum(0.6, Interleaved::Odd).excitation().unwrap();
    scenario.measurement_s = 80.0;
    scenario.run_in_s = 20.0;
    scenario.motion = motion;
    if share > 0.0 {
        let shape = RemnantShape::Lag {
            time_constant_s: 0.1,
            order: 1,
        };
        scenario.remnant = vec![RemnantPart::new(shape, share)];
    }
    scenario
}

fn run(scenario: &FamilyScenario, seed: u64) -> Record {
    let seed = RunSeed {
        seed,
        ..RunSeed::default()
    };
    FamilySimulator::new(scenario).unwrap().run(seed, false).unwrap()
}

/// Fits these forms. With the default intersample behaviour the criterion is smooth in the delay; with a held input the
/// direct part of the canals causes a kink.
fn fit(records: &[Record], forms: &[Form], intersample: Intersample) -> FamilyFit {
    let mut channel = SeenChannel::new("y", ChannelRole::Motion);
    if !forms.is_empty() {
        channel.forms = forms.to_vec();
    }
    let estimator = FamilyEstimator {
        intersample,
        forms: vec![Form::Lead],
        channels: vec![channel],
        ..FamilyEstimator::default()
    };
    estimator.fit(records).unwrap()
}

fn find_parameter<'p>(parameters: &'p [Parameter], name: &str) -> &'p Parameter {
    parameters.iter().find(|p| p.name == name).unwrap()
}

/// For these seeds the selected form is the canals, and the parameters agree with those of the simulated person, within
/// their errors or, where the search ends at a kink of the direct part and gives no errors, within 15 %.
#[test]
fn response_of_the_semicircular_canals_is_found() {
    let scenario = task(Some(operator(Form::Canals, &[GAIN], 0.18)), 0.1);
    for seed in 1..=4 {
        let records: Vec<Record> = (0..3).map(|k| run(&scenario, 10 * seed + k)).collect();
        let found = fit(&records, &[], Intersample::Auto);
        let [channel] = found.channels.as_slice() else {
            panic!("one channel")
        };
        let response = channel.response.as_ref().unwrap();
        assert_eq!(response.operator.form(), Form::Canals, "{seed}: {:?}", channel.forms);
        let findings = found.verdict.findings();
        assert!(findings.iter().all(|f| f.kind != "inputs-together"), "{findings:?}");
        let own = &found.operators[0].parameters;
        for (parameter, truth) in [
            (find_parameter(&response.parameters, "K_m"), GAIN),
            (find_parameter(&response.parameters, "tau_f"), 0.18),
            (find_parameter(own, "K_e"), 0.6),
            (find_parameter(own, "tau_e"), 0.25),
        ] {
            let off = parameter.value - truth;
            let most = parameter.standard_error.map_or(0.15 * truth.abs(), |error| 3.5 * error);
            assert!(off.abs() < most, "{seed} {}: {off} {most}", parameter.name);
        }
    }
}

#[test]
fn gain_and_derivative_responses_to_motion_are_found() {
    for (form, head) in [(Form::Gain, vec![-0.3]), (Form::Derivative, vec![-0.25])] {
        let scenario = task(Some(operator(form, &head, 0.18)), 0.1);
        let records: Vec<Record> = (0..3).map(|k| run(&scenario, 50 + k)).collect();
        let found = fit(&records, &[], Intersample::Auto);
        let response = found.channels[0].response.as_ref().unwrap();
        assert_eq!(response.operator.form(), form, "{:?}", found.channels[0].forms);
        let gain = find_parameter(&response.parameters, form.gain_name_and_unit().0);
        let off = (gain.value - head[0]) / gain.standard_error.unwrap();
        assert!(off.abs() < 3.5, "{form} {off}");
    }
}

#[test]
fn no_motion_response_is_found_where_there_is_none() {
    let scenario = task(None, 0.1);
    for seed in 1..=4 {
        let records: Vec<Record> = (0..3).map(|k| run(&scenario, 100 + 10 * seed + k)).collect();
        let found = fit(&records, &[], Intersample::Auto);
        assert!(found.channels[0].response.is_none(), "{seed}: {:?}", found.channels[0]);
        assert_eq!(found.channels[0].forms.len(), Form::MOTION_FORMS.len() + 1);
    }
}

/// Without a remnant and from rest, the parameters equal the simulated ones. If the record starts later, the state of
/// the canals at its start is unknown, and the error of their gain is 1 %.
#[test]
fn noise_free_motion_response_is_recovered_exactly() {
    let mut scenario = task(Some(operator(Form::Canals, &[GAIN], 0.18)), 0.0);
    let late = fit(&[run(&scenario, 1)], &[Form::Canals], Intersample::Zoh);
    let late = find_parameter(&late.channels[0].response.as_ref().unwrap().parameters, "K_m").value;
    assert!((late / GAIN - 1.0).abs() < 0.015, "{late}");
    scenario.run_in_s = 0.0;
    let record = run(&scenario, 1);
    let found = fit(std::slice::from_ref(&record), &[Form::Canals], Intersample::Zoh);
    let response = found.channels[0].response.as_ref().unwrap();
    for (name, truth) in [("K_m", GAIN), ("tau_f", 0.18)] {
        let off = find_parameter(&response.parameters, name).value / truth - 1.0;
        println!("{name} {off:e}");
        assert!(off.abs() < 1e-4, "{name} {off}");
    }
}
