//! Conditions of the thesis with a displayed target and a disturbance.
#![allow(clippy::unwrap_used)]

use hoid_lanes::InstructionSet;
use hoid_model::{
    Complex64, ContinuousTransferFunction, FamilyOperator, FamilyScenario, FamilyState, Feedforward, Form, Record,
    family_scenario::Excitation,
    forcing::ForcingFunction,
    polynomial,
    remnant_gain::NoiseDefinition,
    scenario::{Condition, RemnantStrength, Scenario},
    schedule::Schedule,
};
use hoid_sim::{FamilySimulator, RunSeed, Simulator};

const FEEDFORWARD_TEXT: &str = "derivative:0.012,tau_f=0.1,preview=0.25";

fn scenario_with_displayed_target(condition: Condition, level: f64) -> Scenario {
    let mut scenario = Scenario::condition(condition);
    let operator = scenario.initial.operator;
    let muscles = (operator.omega_nm_rad_s, operator.zeta_nm);
    scenario.feedforward = Some(Feedforward::from_text(FEEDFORWARD_TEXT, Some(muscles)).unwrap());
    scenario.disturbance = ForcingFunction::reference_disturbance(0.02).unwrap();
    scenario.remnant.strength = RemnantStrength::Level {
        level,
        definition: NoiseDefinition::Response,
    };
    scenario
}

fn seed(replication: u64) -> RunSeed {
    RunSeed {
        seed: 3,
        replication,
        ..RunSeed::default()
    }
}

fn coefficient(record: &Record, name: &str, omega: f64) -> Complex64 {
    let turned = |(k, v): (usize, &f64)| Complex64::from_polar(*v, -omega * k as f64 * record.sample_time().s());
    record.channel(name).unwrap().iter().enumerate().map(turned).sum()
}

/// At each line in the steady state U = Y E + F e^{j omega preview} F_t, with the exact discrete models of Y and F: the
/// lines of the disturbance contain Y alone.
#[test]
fn both_responses_are_exact_at_every_line() {
    for condition in [Condition::C1, Condition::C2] {
        let mut scenario = scenario_with_displayed_target(condition, 0.0);
        scenario.run_in_s = 60.0;
        let record = Simulator::new(&scenario).unwrap().run(seed(0), false).unwrap();
        let ts = scenario.sample_time;
        let operator = scenario.initial.operator.discretise(ts).unwrap();
        let of_target = &scenario.feedforward.as_ref().unwrap().operator;
        let lines = |f: &ForcingFunction| f.sinusoids().iter().map(|s| s.omega_rad_s).collect::<Vec<_>>();
        for omega in [lines(&scenario.forcing), lines(&scenario.disturbance)].concat() {
            let back = Complex64::from_polar(1.0, -omega * ts.s());
            let ratio = |b: &[f64], f: &[f64], nk: usize| {
                let f = [&[1.0][..], f].concat();
                polynomial::value(b, back) / polynomial::value(&f, back) * back.powi(nk as i32)
            };
            let h = operator.zoh;
            let y = ratio(&[h.b0, h.b1], &[h.f1, h.f2], operator.nk);
            let held = of_target.zoh(ts).unwrap();
            let f = ratio(&held.b, &held.f, held.nk) * Complex64::from_polar(1.0, 0.25 * omega);
            let of = |name: &str| coefficient(&record, name, omega);
            let expected = y * of("e") + f * of("f_t");
            assert!(
                (of("u") / expected - 1.0).norm() < 1e-6,
                "{condition} {omega}: {} {expected}",
                of("u")
            );
        }
        assert!(
            record
                .channels()
                .any(|c| c.name == "f_t" && c.role == "feedforward:0.25")
        );
        assert_eq!(record.channel("f_t_K_d").unwrap()[8191], 0.012);
        assert!((record.channel("f_t_tau_f").unwrap()[0] - 0.1).abs() < 1e-15);
        let d = record.channel("d").unwrap();
        let rms = (d.iter().map(|v| v * v).sum::<f64>() / d.len() as f64).sqrt();
        assert!((rms - 0.02).abs() < 1e-14);
    }
}

/// The same task as a scenario of the family, simulated with matrices of any order, gives the same loop through a
/// change in the operator, in its neuromuscular system and in the response to the target.
#[test]
fn loop_matches_the_family_simulator() {
    for condition in [Condition::C1, Condition::C3, Condition::C4, Condition::C6] {
        let mut scenario = scenario_with_displayed_target(condition, 0.0);
        if scenario.schedule != Schedule::Constant {
            scenario.last.operator.omega_nm_rad_s = 9.0;
            scenario.last.operator.zeta_nm = 0.5;
            let operator = scenario.initial.operator;
            let text = "derivative-lead:0.012..0.02,T_L=0.1..0.3,tau_f=0.1..0.12,preview=0.25";
            let muscles = Some((operator.omega_nm_rad_s, operator.zeta_nm));
            scenario.feedforward = Some(Feedforward::from_text(text, muscles).unwrap());
        }
        let state = |of: &hoid_model::scenario::OperatingState| {
            let (o, c) = (of.operator, of.controlled_element);
            let x = [o.k_e, o.t_l_s, o.omega_nm_rad_s.ln(), o.zeta_nm.ln(), o.tau_e_s];
            FamilyState {
                operator: FamilyOperator::new(Form::Lead, true, &x).unwrap(),
                controlled_element: ContinuousTransferFunction::new(&[c.k_c], &[1.0, c.omega_b_rad_s, 0.0]).unwrap(),
            }
        };
        let mut family = FamilyScenario::new(state(&scenario.initial), scenario.sample_time);
        let fixed = |function: &ForcingFunction| Excitation {
            function: function.clone(),
            random_phases: false,
        };
        family.last = state(&scenario.last);
        family.schedule = scenario.schedule;
        family.target = fixed(&scenario.forcing);
        family.disturbance = fixed(&scenario.disturbance);
        family.feedforward.clone_from(&scenario.feedforward);
        family.measurement_s = scenario.measurement_s;
        family.run_in_s = scenario.run_in_s;
        let one = Simulator::new(&scenario).unwrap().run(seed(0), true).unwrap();
        let other = FamilySimulator::new(&family)
            .unwrap()
            .run_with_truth(seed(0), true)
            .unwrap();
        for (name, of_family) in [("u", "u"), ("e", "e"), ("x", "y"), ("d", "d"), ("f_t_K_d", "f_t_K_d")] {
            let (a, b) = (one.channel(name).unwrap(), other.channel(of_family).unwrap());
            let largest = a.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            for (k, (a, b)) in a.iter().zip(b).enumerate() {
                assert!((a - b).abs() < 1e-9 * largest, "{condition} {name} {k}: {a} {b}");
            }
        }
        let roles = |record: &Record| record.channels().find(|c| c.name == "f_t").unwrap().role.clone();
        assert_eq!(roles(&one), roles(&other));
    }
}

#[test]
fn batched_runs_match_single_runs() {
    for condition in [Condition::C2, Condition::C4] {
        let simulator = Simulator::new(&scenario_with_displayed_target(condition, 0.1)).unwrap();
        let noises: Vec<Vec<f64>> = (0..3).map(|r| seed(r).white_noise(simulator.sample_count())).collect();
        for instructions in [InstructionSet::Best, InstructionSet::Scalar] {
            let batch = simulator.batched_signals(&noises, instructions).unwrap();
            for (noise, signals) in noises.iter().zip(&batch) {
                assert_eq!(*signals, simulator.signals(noise).unwrap());
            }
        }
    }
}

/// The noise level is the share of the remnant in the variance of u, which now contains the responses to the target and
/// the disturbance. The remnant gain is computed for the continuous loop.
#[test]
fn noise_level_refers_to_the_variance_of_all_of_u() {
    for (condition, level) in [(Condition::C1, 0.1), (Condition::C2, 0.2)] {
        let scenario = scenario_with_displayed_target(condition, level);
        let simulator = Simulator::new(&scenario).unwrap();
        let first = simulator.scenario().run_in_samples();
        let square = |x: &[f64]| x.iter().map(|v| v * v).sum::<f64>();
        let silent = simulator.signals(&vec![0.0; simulator.sample_count()]).unwrap();
        let (mut own, mut whole) = (0.0, 0.0);
        let runs = 60;
        for r in 0..runs {
            let noisy = simulator
                .signals(&seed(r).white_noise(simulator.sample_count()))
                .unwrap();
            let n: Vec<f64> = noisy.u.iter().zip(&silent.u).map(|(a, b)| a - b).collect();
            own += square(&n[first..]);
            whole += square(&noisy.u[first..]);
        }
        let found = own / whole;
        assert!((found / level - 1.0).abs() < 0.06, "{condition}: {found}");
        // Without the response to the target and the disturbance, this level needs another gain.
        let mut plain = scenario.clone();
        plain.feedforward = None;
        plain.disturbance = ForcingFunction::default();
        let gain = |s: &Scenario| s.resolve().unwrap().parameters_at(0.0).k_n;
        assert!((gain(&scenario) / gain(&plain) - 1.0).abs() > 0.05, "{condition}");
    }
}

#[test]
fn zero_feedforward_gives_the_same_signals() {
    let plain = Scenario::condition(Condition::C4);
    let record = Simulator::new(&plain).unwrap().run(seed(1), false).unwrap();
    assert!(record.channel("d").is_none() && record.channels().all(|c| c.role.is_empty()));
    // A response of zero gives the same signals.
    let mut zero = plain.clone();
    zero.feedforward = Some(Feedforward::from_text("gain:0", Some((11.25, 0.35))).unwrap());
    let of_zero = Simulator::new(&zero).unwrap().run(seed(1), false).unwrap();
    assert_eq!(of_zero.output(), record.output());
}

#[test]
fn invalid_target_displays_are_refused() {
    let refused = |change: &dyn Fn(&mut Scenario)| {
        let mut scenario = scenario_with_displayed_target(Condition::C4, 0.1);
        change(&mut scenario);
        Simulator::new(&scenario).unwrap_err().to_string()
    };
    assert!(refused(&|s| s.forcing = ForcingFunction::default()).contains("target is at rest"));
    let preview = |s: &mut Scenario| s.feedforward.as_mut().unwrap().preview_s = 0.255;
    assert!(refused(&preview).contains("preview of the target"));
    let bare = FamilyOperator::new(Form::Gain, false, &[1.0, 0.1]).unwrap();
    assert!(refused(&|s| s.feedforward = Some(Feedforward::new(bare.clone(), 0.0))).contains("neuromuscular"));
    let changing = Feedforward::from_text("gain:1..2", Some((11.25, 0.35))).unwrap();
    let constant = |s: &mut Scenario| {
        s.schedule = Schedule::Constant;
        s.last = s.initial;
        s.feedforward = Some(changing.clone());
    };
    assert!(refused(&constant).contains("a scenario with a change"));
}
