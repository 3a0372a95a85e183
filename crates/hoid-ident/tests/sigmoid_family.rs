//! An operator of the family whose numerator changes once: recovery without noise, errors over simulated runs, and the
//! report if there is no change.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::collections::BTreeMap;

use hoid_ident::{Constraint, IdentError, Reason, Remark, SigmoidChange, SigmoidFit, family::OperatorPrior};
use hoid_model::{
    Channel, ContinuousTransferFunction, FamilyOperator, FamilyScenario, FamilyState, Form, Record, SampleTime,
    VerdictLevel,
    family_scenario::{MultiSine, RemnantPart, RemnantShape},
    scenario::{Condition, Scenario},
    schedule::Schedule,
};
use hoid_sim::{FamilySimulator, RunSeed, Simulator};

const T_M: f64 = 30.0;
const G: f64 = 2.0;
/// K/T_I and T_L of a lead-lag operator before and after the change.
const END_PARAMETERS: [[f64; 2]; 2] = [[4.0, 0.3], [2.0, 1.0]];
/// T_I, omega_nm, zeta_nm and tau_e, which is nine samples of 1/60 s.
const CONSTANT_PARAMETERS: [f64; 4] = [5.0, 12.0, 0.4, 0.15];

fn element(text: &str) -> ContinuousTransferFunction {
    text.parse().unwrap()
}

/// Returns the scenario of a person with a lag who controls an integrator and changes their lead; the form without a
/// lead controls a gain.
fn scenario(form: Form, share: f64) -> FamilyScenario {
    let state = |[gain, lead]: [f64; 2]| {
        let [t_i, omega, zeta, tau] = CONSTANT_PARAMETERS;
        let mut x = vec![gain];
        if form != Form::Lag {
            x.push(lead);
        }
        x.extend([1.0 / t_i, omega.ln(), zeta.ln(), tau]);
        FamilyState {
            operator: FamilyOperator::new(form, true, &x).unwrap(),
            controlled_element: element(if form == Form::Lag { "1" } else { "1/s" }),
        }
    };
    let mut scenario = FamilyScenario::new(state(END_PARAMETERS[0]), SampleTime::new(1.0 / 60.0).unwrap());
    scenario.last = state(END_PARAMETERS[1]);
    scenario.schedule = Schedule::Sigmoid {
        rate_per_s: G,
        midpoint_s: T_M,
    };
    scenario.disturbance = MultiSine::default().excitation().unwrap();
    scenario.measurement_s = 60.0;
    if share > 0.0 {
        let shape = RemnantShape::Lag {
            time_constant_s: 0.15,
            order: 1,
        };
        scenario.remnant = vec![RemnantPart::new(shape, share)];
    }
    scenario
}

fn run(scenario: &FamilyScenario, replication: u64) -> Record {
    let seed = RunSeed {
        seed: 20,
        cell: 1,
        replication,
    };
    FamilySimulator::new(scenario).unwrap().run(seed, false).unwrap()
}

fn estimator(form: Form) -> SigmoidChange {
    SigmoidChange {
        form,
        likelihood_intervals: false,
        ..SigmoidChange::default()
    }
}

fn value(fit: &SigmoidFit, name: &str) -> f64 {
    fit.parameter(name).unwrap().estimate.value
}

/// Name and true value of each parameter.
fn truth() -> Vec<(&'static str, f64)> {
    vec![
        ("K_over_T_I1", END_PARAMETERS[0][0]),
        ("K_over_T_I2", END_PARAMETERS[1][0]),
        ("T_L1", END_PARAMETERS[0][1]),
        ("T_L2", END_PARAMETERS[1][1]),
        ("t_M", T_M),
        ("G", G),
        ("T_I", CONSTANT_PARAMETERS[0]),
        ("omega_nm", CONSTANT_PARAMETERS[1]),
        ("zeta_nm", CONSTANT_PARAMETERS[2]),
        ("tau_e", CONSTANT_PARAMETERS[3]),
    ]
}

#[test]
fn noise_free_change_is_recovered() {
    let record = run(&scenario(Form::LeadLag, 0.0), 0);
    let fit = estimator(Form::LeadLag).fit(std::slice::from_ref(&record)).unwrap();
    for (name, expected) in truth() {
        let error = value(&fit, name) / expected - 1.0;
        assert!(error.abs() < 1e-7, "{name}: {error:e}, from {}", fit.start());
    }
    assert_eq!(fit.termination().reason, Reason::ExactFit);
    assert!(fit.has_change() && fit.covariance().is_none());
    // The operators before and after the change have the parameter names of the family.
    let (before, after) = (fit.initial_operator(), fit.last_operator());
    for (operator, [gain, lead]) in [(before, END_PARAMETERS[0]), (after, END_PARAMETERS[1])] {
        for (name, expected) in [("K", 5.0 * gain), ("K_over_T_I", gain), ("T_L", lead), ("T_I", 5.0)] {
            let found = operator.get(name).unwrap().value;
            assert!((found / expected - 1.0).abs() < 1e-7, "{name}: {found}");
        }
        assert!(operator.operator_estimate().is_none() && operator.operator.form() == Form::LeadLag);
    }
    let names: Vec<&str> = fit.gains_at(30.0).gains.iter().map(|g| g.name).collect();
    assert_eq!(names, ["K", "K_over_T_I", "T_L"]);
    assert!((fit.gains_at(T_M).get("K_over_T_I").unwrap().value - 3.0).abs() < 1e-6);
}

#[test]
fn squared_lead_is_recovered() {
    // The operator has a direct part, since the squared lead has as many zeros as there are poles.
    let mut with = scenario(Form::Lag, 0.0);
    for (state, [gain, lead]) in [(&mut with.initial, [0.9, 0.1]), (&mut with.last, [0.5, 0.2])] {
        let [_, omega, zeta, tau] = CONSTANT_PARAMETERS;
        let x = [gain, lead, omega.ln(), zeta.ln(), tau];
        state.operator = FamilyOperator::new(Form::Lead2, true, &x).unwrap();
        state.controlled_element = element("1/s");
    }
    let record = run(&with, 0);
    let fit = estimator(Form::Lead2).fit(std::slice::from_ref(&record)).unwrap();
    for (name, expected) in [
        ("K1", 0.9),
        ("K2", 0.5),
        ("T_L1", 0.1),
        ("T_L2", 0.2),
        ("tau_e", 0.15),
        ("t_M", T_M),
    ] {
        let error = value(&fit, name) / expected - 1.0;
        assert!(error.abs() < 1e-6, "{name}: {error:e}, from {}", fit.start());
    }
}

#[test]
fn level_of_u_is_found_without_bias() {
    // Each record is fitted without and with an added level of u. The squares of the level, in standard errors, are
    // summed.
    let (runs, level) = (6, 0.7);
    let with_level = SigmoidChange {
        level: true,
        ..estimator(Form::Lead)
    };
    let simulator = Simulator::new(&Scenario::condition(Condition::C3)).unwrap();
    let mut squares = 0.0;
    for replication in 0..runs {
        let seed = RunSeed {
            seed: 21,
            replication,
            ..RunSeed::default()
        };
        let record = simulator.run(seed, false).unwrap();
        let channel = |name: &str, x: &[f64], by: f64| Channel::new(name, "", x.iter().map(|v| v + by).collect());
        let e = channel("e", record.input(), 0.0);
        let moved = Record::new(record.sample_time(), e, channel("u", record.output(), level)).unwrap();
        let clean = with_level.fit(std::slice::from_ref(&record)).unwrap();
        let fit = with_level.fit(std::slice::from_ref(&moved)).unwrap();
        // The two fits are equal within the tolerance of the searches.
        for (a, b) in clean.parameters().iter().zip(fit.parameters()) {
            let (a, b) = (a.estimate, b.estimate);
            let error = a.standard_error.unwrap_or(f64::INFINITY);
            assert!(
                (a.value - b.value).abs() < 0.02 * error,
                "{}: {a} and {b}",
                clean.start()
            );
        }
        let (before, after) = (clean.level(&record).unwrap(), fit.level(&moved).unwrap());
        let error = before.standard_error.unwrap();
        assert!(
            (after.value - before.value - level).abs() < 0.02 * error,
            "{before} and {after}"
        );
        squares += (before.value / error).powi(2);
        let bare = estimator(Form::Lead).fit(std::slice::from_ref(&record)).unwrap();
        assert!(bare.level(&record).is_none());
    }
    // Chi-square with 6 degrees of freedom is between 0.68 and 18.5, except for 0.5 % on each side.
    assert!((0.68..18.5).contains(&squares), "{squares}");
}

/// Returns the errors of `runs` fits in units of the standard error; t_M and G are included if their errors are normal.
fn standardised_errors(runs: u64) -> Vec<(String, Vec<f64>)> {
    // The remnant is so small that the errors are normal after one minute.
    let scenario = scenario(Form::LeadLag, 0.02);
    let mut all: Vec<(String, Vec<f64>)> = truth().iter().map(|(name, _)| ((*name).to_owned(), vec![])).collect();
    for replication in 0..runs {
        let record = run(&scenario, replication);
        let records = std::slice::from_ref(&record);
        // The prior is the one used for people.
        let estimator = SigmoidChange {
            prior: OperatorPrior::population(),
            ..estimator(Form::LeadLag)
        };
        let fit = estimator.fit(records).unwrap();
        assert!(fit.termination().converged(), "{}", fit.termination());
        assert!(fit.has_change());
        for ((name, errors), (_, expected)) in all.iter_mut().zip(truth()) {
            let parameter = fit.parameter(name).unwrap();
            if ["t_M", "G"].contains(&name.as_str()) && parameter.remark == Some(Remark::ChangePoint) {
                assert!(name == "G" || (parameter.estimate.value - expected).abs() < 1.0);
                continue;
            }
            let Some(error) = parameter.estimate.standard_error else {
                panic!("{name}: {:?} from {}", parameter.remark, fit.start());
            };
            // The lag is assessed in 1/T_I, whose errors are normal.
            let z = if name == "T_I" {
                (1.0 / parameter.estimate.value - 1.0 / expected) * parameter.estimate.value.powi(2) / error
            } else {
                (parameter.estimate.value - expected) / error
            };
            errors.push(z);
        }
    }
    all
}

#[test]
fn errors_have_nominal_coverage_over_simulated_runs() {
    let runs = 10;
    let (mut inside, mut count) = (0, 0);
    for (name, errors) in standardised_errors(runs) {
        let n = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / n;
        let square = errors.iter().map(|z| z * z).sum::<f64>() / n;
        println!("{name}: {n} errors, mean {mean:.2}, mean square {square:.2}");
        inside += errors.iter().filter(|z| z.abs() < 1.96).count();
        count += errors.len();
        // The mean of n values has a standard error of 1/sqrt n; three and a half of them are allowed.
        assert!(n >= 5.0 && mean.abs() < 3.5 / n.sqrt(), "{name}: {errors:?}");
    }
    // About 100 intervals of 95 %: if they were independent, the standard error of the share would be 2.2 %.
    assert!(inside * 100 >= 85 * count, "{inside} of {count}");
}

#[test]
fn parameter_determined_by_the_prior_alone_is_reported() {
    let record = run(&scenario(Form::LeadLag, 0.1), 3);
    let records = std::slice::from_ref(&record);
    let fit = estimator(Form::LeadLag).fit(records).unwrap();
    let verdict = fit.verdict(records).unwrap();
    assert_eq!(verdict.level, VerdictLevel::Trustworthy, "{verdict}");
    assert!(fit.has_neuromuscular() && fit.form() == Form::LeadLag);
    // One prior carries much more information than the data, the other much less.
    let tight = SigmoidChange {
        prior: "zeta_nm=0.4:0.001,T_L=0.5:10".parse().unwrap(),
        ..estimator(Form::LeadLag)
    };
    let held = tight.fit(records).unwrap();
    let zeta = held.parameter("zeta_nm").unwrap();
    assert_eq!(zeta.remark, Some(Remark::PriorAlone));
    assert!((zeta.estimate.value - 0.4).abs() < 0.002);
    assert!((zeta.estimate.standard_error.unwrap() / 4e-4 - 1.0).abs() < 0.05);
    let lead = held.parameter("T_L1").unwrap();
    assert_eq!(lead.remark, None);
    let own = fit.parameter("T_L1").unwrap().estimate;
    assert!((lead.estimate.value - own.value).abs() < own.standard_error.unwrap());
    let verdict = held.verdict(records).unwrap();
    assert!(verdict.findings().iter().any(|f| f.kind == "prior"), "{verdict}");
}

#[test]
fn start_and_constraints_use_the_names_of_the_form() {
    let record = run(&scenario(Form::Lag, 0.1), 0);
    let records = std::slice::from_ref(&record);
    let names = estimator(Form::Lag).names();
    assert_eq!(
        names,
        [
            "K_over_T_I1",
            "K_over_T_I2",
            "t_M",
            "G",
            "T_I",
            "omega_nm",
            "zeta_nm",
            "tau_e",
            "d1"
        ]
    );
    let started = SigmoidChange {
        start: Some(vec![4.0, 2.0, 31.0, 1.5, 4.0, 11.0, 0.5, 0.16, -0.8]),
        constraints: BTreeMap::from([("T_I".to_owned(), Constraint::Fixed(5.0))]),
        ..estimator(Form::Lag)
    };
    let fit = started.fit(records).unwrap();
    let t_i = fit.parameter("T_I").unwrap();
    assert_eq!((t_i.estimate.standard_error, t_i.remark), (None, Some(Remark::Fixed)));
    assert!((t_i.estimate.value - 5.0).abs() < 1e-12 && fit.start() == "given");
    let wrong = SigmoidChange {
        start: Some(vec![4.0, 2.0, 31.0, 1.5, -4.0, 11.0, 0.5, 0.16, -0.8]),
        ..estimator(Form::Lag)
    };
    assert!(matches!(wrong.fit(records), Err(IdentError::BadStart { .. })));
}

#[test]
fn no_change_is_reported() {
    // The change comes after the record has ended.
    let mut late = scenario(Form::LeadLag, 0.1);
    late.schedule = Schedule::Sigmoid {
        rate_per_s: G,
        midpoint_s: 90.0,
    };
    let record = run(&late, 0);
    let records = std::slice::from_ref(&record);
    let fit = estimator(Form::LeadLag).fit(records).unwrap();
    assert!(!fit.has_change());
    assert_eq!(fit.parameter("t_M").unwrap().remark, Some(Remark::NoChange));
    let steady = fit.constant_operator();
    let gain = steady.get("K_over_T_I").unwrap();
    assert!(
        (gain.value - END_PARAMETERS[0][0]).abs() < 4.0 * gain.standard_error.unwrap(),
        "{gain}"
    );
    assert_eq!(fit.gains_at(20.0).gains, fit.gains_at(50.0).gains);
    let verdict = fit.verdict(records).unwrap();
    assert!(verdict.findings().iter().any(|f| f.kind == "no-change"), "{verdict}");

    // A record without excitation, a record that is too short and invalid options are rejected.
    let still = Channel::new("e", "deg", vec![0.0; record.len()]);
    let still = Record::new(record.sample_time(), still, record.output_channel().clone()).unwrap();
    let silent = estimator(Form::LeadLag).fit(&[still]);
    assert!(silent.is_err(), "{silent:?}");
    let brief = record.span(0.0, 0.7).unwrap();
    assert!(matches!(
        estimator(Form::LeadLag).fit(&[brief]),
        Err(IdentError::TooFewSamples { .. })
    ));
    let derivative = SigmoidChange {
        neuromuscular: false,
        ..estimator(Form::Lead)
    };
    assert!(matches!(derivative.fit(records), Err(IdentError::BadOption { .. })));
    let unknown = SigmoidChange {
        constraints: BTreeMap::from([("K_e1".to_owned(), Constraint::Fixed(1.0))]),
        ..estimator(Form::LeadLag)
    };
    assert!(matches!(unknown.fit(records), Err(IdentError::UnknownParameter { .. })));
}
