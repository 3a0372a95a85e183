//! The loop of the family compared with results obtained in other ways.

#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use hoid_model::{
    Complex64, ContinuousTransferFunction, FamilyOperator, FamilyScenario, FamilyState, Form, SampleTime,
    family_scenario::{
        DependenceSignal, Excitation, Feedforward, Interleaved, Intermittence, MultiSine, PartStrength, Pulses,
        RemnantPart, RemnantShape, SignalDependence, Stick,
    },
    operator_family::Coordinate,
    polynomial,
    scenario::{Condition, Realisation, Scenario},
};
use hoid_sim::{FamilySimulator, RunSeed, SimError, Simulator};

fn sample_time() -> SampleTime {
    SampleTime::new(1.0 / 60.0).unwrap()
}

fn seed(replication: u64) -> RunSeed {
    RunSeed {
        seed: 5,
        cell: 2,
        replication,
    }
}

fn element(num: &[f64], den: &[f64]) -> ContinuousTransferFunction {
    ContinuousTransferFunction::new(num, den).unwrap()
}

fn lead_lag(tau_e_s: f64) -> FamilyOperator {
    let x = [4.0, 0.6, 0.2, 12.0_f64.ln(), 0.4_f64.ln(), tau_e_s];
    FamilyOperator::new(Form::LeadLag, true, &x).unwrap()
}

/// Returns a person who controls a single integrator with a disturbance.
fn typical_scenario() -> FamilyScenario {
    let state = FamilyState {
        operator: lead_lag(0.15),
        controlled_element: element(&[1.0], &[1.0, 0.0]),
    };
    let mut scenario = FamilyScenario::new(state, sample_time());
    scenario.disturbance = MultiSine::default().excitation().unwrap();
    scenario
}

fn mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), v| (sum + v * v, n + 1.0));
    sum / n
}

/// Returns the reference scenario in terms of the family.
fn family_scenario(scenario: &Scenario) -> FamilyScenario {
    let state = |s: &hoid_model::scenario::OperatingState| {
        let o = s.operator;
        let x = [o.k_e, o.t_l_s, o.omega_nm_rad_s.ln(), o.zeta_nm.ln(), o.tau_e_s];
        FamilyState {
            operator: FamilyOperator::new(Form::Lead, true, &x).unwrap(),
            controlled_element: s.controlled_element.transfer_function().unwrap(),
        }
    };
    let resolved = scenario.resolve().unwrap();
    let gain = |t: f64| resolved.parameters_at(t).k_n;
    let mut own = FamilyScenario::new(state(&scenario.initial), scenario.sample_time);
    own.last = state(&scenario.last);
    own.schedule = scenario.schedule;
    own.target.function = scenario.forcing.clone();
    own.remnant = vec![RemnantPart {
        strength: PartStrength::Gain {
            initial: gain(-1e6),
            last: gain(1e6),
        },
        ..RemnantPart::new(
            RemnantShape::Lag {
                time_constant_s: scenario.remnant.time_constant_s,
                order: scenario.remnant.order,
            },
            0.0,
        )
    }];
    own.measurement_s = scenario.measurement_s;
    own.run_in_s = scenario.run_in_s;
    own.realisation = scenario.realisation;
    own
}

#[test]
fn lead_form_matches_the_simulator_of_the_thesis() {
    for (condition, order, realisation) in [
        (Condition::C1, 1, Realisation::Input),
        (Condition::C2, 4, Realisation::Input),
        (Condition::C3, 2, Realisation::Output),
        (Condition::C4, 3, Realisation::Input),
    ] {
        let mut scenario = Scenario::condition(condition);
        scenario.remnant.order = order;
        scenario.realisation = realisation;
        if condition == Condition::C4 {
            scenario.last.operator.tau_e_s = 0.32;
        }
        let known = Simulator::new(&scenario).unwrap().run(seed(3), true).unwrap();
        let family = FamilySimulator::new(&family_scenario(&scenario)).unwrap();
        let ours = family.run_with_truth(seed(3), true).unwrap();
        for (a, b) in [
            ("e", "e"),
            ("u", "u"),
            ("y", "x"),
            ("n", "n"),
            ("f_t", "f_t"),
            ("K_e", "K_e"),
            ("tau_e", "tau_e"),
        ] {
            let (ours, known) = (ours.channel(a).unwrap(), known.channel(b).unwrap());
            let size = known.iter().map(|v| v.abs()).fold(0.0, f64::max);
            for (k, (a, b)) in ours.iter().zip(known).enumerate() {
                assert!((a - b).abs() < 1e-9 * size, "{condition} {b} {k}: {a} {b}");
            }
        }
    }
}

/// Returns a coordinate of an operator by its kind.
fn coordinate_value(operator: &FamilyOperator, wanted: Coordinate) -> f64 {
    let kinds = operator.form().coordinates(operator.has_neuromuscular());
    let at = kinds.iter().position(|kind| *kind == wanted);
    at.map_or(0.0, |i| operator.coordinates()[i])
}

/// Integrates `z' = slope(z)` over the time h by fourth-order Runge-Kutta.
fn runge_kutta<const N: usize>(z: [f64; N], h: f64, slope: impl Fn(&[f64; N]) -> [f64; N]) -> [f64; N] {
    let on = |z: &[f64; N], by: f64, d: &[f64; N]| std::array::from_fn(|i| z[i] + by * d[i]);
    let a = slope(&z);
    let b = slope(&on(&z, h / 2.0, &a));
    let c = slope(&on(&z, h / 2.0, &b));
    let d = slope(&on(&z, h, &c));
    std::array::from_fn(|i| z[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
}

const STEPS_PER_SAMPLE: usize = 60;

/// Simulates the loop by its differential equations: neuromuscular part
/// `v'' + 2 zeta omega v' + omega^2 v = omega^2 e(t - tau)`, lag `w' = v - w/T_I`, lead
/// `u = K/T_I (w + p T_L w' + ...)`; element by `x''' + c_2 x'' + c_1 x' + c_0 x = u + d`. The sampled error is held
/// and delayed by tau.
fn simulate_by_integration(scenario: &FamilyScenario, d: &[f64]) -> Vec<[f64; 2]> {
    let FamilyState {
        operator,
        controlled_element,
    } = &scenario.initial;
    let ts = scenario.sample_time.s();
    let h = ts / STEPS_PER_SAMPLE as f64;
    let (omega, zeta) = operator.neuromuscular_parameters().unwrap();
    let (gain, t_l, rate) = (
        coordinate_value(operator, Coordinate::Gain),
        coordinate_value(operator, Coordinate::Lead),
        coordinate_value(operator, Coordinate::LagRate),
    );
    let late = (operator.tau_e_s() / h).round() as usize;
    assert!((late as f64 * h - operator.tau_e_s()).abs() < 1e-12);
    let (num, den) = (controlled_element.num(), controlled_element.den());
    let order = den.len() - 1;
    let mut errors: Vec<f64> = Vec::new();
    let (mut z, mut x) = ([0.0; 3], [0.0; 3]);
    let mut out = Vec::new();
    for (k, d) in d.iter().enumerate() {
        let [w, v, v_dot] = z;
        let u = match operator.form() {
            Form::Lead => gain * (v + t_l * v_dot),
            Form::LeadLag => gain * (w + t_l * (v - rate * w)),
            Form::Lead2Lag => {
                let w_dot = v - rate * w;
                gain * (w + 2.0 * t_l * w_dot + t_l * t_l * (v_dot - rate * w_dot))
            }
            other => panic!("{other} is not written here"),
        };
        let y: f64 = (0..num.len()).map(|i| num[num.len() - 1 - i] * x[i]).sum();
        errors.push(-y);
        out.push([-y, u]);
        for step in 0..STEPS_PER_SAMPLE {
            let now = k * STEPS_PER_SAMPLE + step;
            let e = now
                .checked_sub(late)
                .map_or(0.0, |then| errors[then / STEPS_PER_SAMPLE]);
            z = runge_kutta(z, h, |[w, v, v_dot]| {
                [
                    v - rate * w,
                    *v_dot,
                    omega * omega * (e - v) - 2.0 * zeta * omega * v_dot,
                ]
            });
            x = runge_kutta(x, h, |x| {
                let own: f64 = (0..order).map(|i| den[order - i] * x[i]).sum();
                std::array::from_fn(|i| match i + 1 {
                    n if n < order => x[n],
                    n if n == order => u + d - own,
                    _ => 0.0,
                })
            });
        }
    }
    out
}

#[test]
fn loop_matches_numerical_integration() {
    let ts = 1.0 / 60.0;
    let tail = [12.0_f64.ln(), 0.4_f64.ln()];
    for (form, head, num, den, tau_samples) in [
        (
            Form::LeadLag,
            vec![4.0, 0.6, 0.2],
            vec![1.0],
            vec![1.0, 0.0],
            8.0 + 13.0 / 60.0,
        ),
        (Form::LeadLag, vec![4.0, 0.6, 0.0], vec![1.0], vec![1.0, 0.0], 0.5),
        (Form::Lead2Lag, vec![2.0, 0.8, 0.3], vec![1.0], vec![1.0, 1.0, 0.0], 9.0),
        (
            Form::Lead,
            vec![1.5, 0.9],
            vec![1.0],
            vec![1.0, 0.0, 0.0],
            10.0 + 59.0 / 60.0,
        ),
        (
            Form::Lead,
            vec![0.4, 0.5],
            vec![8.0, 16.0],
            vec![1.0, 9.0, 8.0, 0.0],
            11.0 + 0.2,
        ),
    ] {
        let mut scenario = typical_scenario();
        let x = [&head[..], &tail, &[tau_samples * ts]].concat();
        scenario.initial = FamilyState {
            operator: FamilyOperator::new(form, true, &x).unwrap(),
            controlled_element: element(&num, &den),
        };
        scenario.last = scenario.initial.clone();
        scenario.measurement_s = 15.0;
        let signals = FamilySimulator::new(&scenario).unwrap().signals(seed(0)).unwrap();
        let size = signals.u.iter().map(|u| u.abs()).fold(0.0, f64::max);
        for (k, [e, u]) in simulate_by_integration(&scenario, &signals.d).into_iter().enumerate() {
            let worst = (signals.e[k] - e).abs().max((signals.u[k] - u).abs());
            // Fourth-order integration in steps of 0.003/omega_nm.
            assert!(worst < 1e-8 * size, "{form} {k}: {worst}");
        }
    }
}

/// Returns the Fourier coefficient of a signal at a frequency.
fn coefficient(values: &[f64], omega_rad_s: f64, ts: f64) -> Complex64 {
    let turn = |(k, v): (usize, &f64)| Complex64::from_polar(*v, -omega_rad_s * k as f64 * ts);
    values.iter().enumerate().map(turn).sum()
}

#[test]
fn describing_function_equals_the_operator_with_a_hold() {
    let mut operators = vec![lead_lag(0.1437)];
    // Without a neuromuscular part, e acts immediately, after half a sample of the hold.
    operators.push(FamilyOperator::new(Form::LeadLag, false, &[2.0, 0.3, 0.2, 0.15]).unwrap());
    operators.push(FamilyOperator::new(Form::Gain, false, &[2.0, 0.15]).unwrap());
    operators.push(FamilyOperator::new(Form::Gain, false, &[2.0, 0.002]).unwrap());
    for operator in operators {
        let mut scenario = typical_scenario();
        scenario.initial.operator = operator.clone();
        scenario.last = scenario.initial.clone();
        scenario.run_in_s = 80.0;
        let record = FamilySimulator::new(&scenario).unwrap().run(seed(1), false).unwrap();
        let ts = scenario.sample_time.s();
        let held = operator.zoh(scenario.sample_time).unwrap();
        for line in scenario.disturbance.function.sinusoids() {
            let omega = line.omega_rad_s;
            let found = coefficient(record.output(), omega, ts) / coefficient(record.input(), omega, ts);
            let backward = Complex64::from_polar(1.0, -omega * ts);
            let f = [&[1.0][..], &held.f].concat();
            let exact =
                polynomial::value(&held.b, backward) / polynomial::value(&f, backward) * backward.powu(held.nk as u32);
            let error = (found - exact).norm() / exact.norm();
            assert!(error < 1e-6, "{:?} {omega}: {error}", operator.form());
            // The response in continuous time with half a sample of delay, accurate to (omega Ts)^2.
            let near = operator.response(omega) * Complex64::from_polar(1.0, -omega * ts / 2.0);
            assert!((found - near).norm() / near.norm() < 2e-3 + (omega * ts).powi(2));
        }
    }
}

#[test]
fn changed_parameters_take_effect_at_once() {
    // All parameters change in a step: from then on the loop is that of the final state, starting from the states of
    // the initial loop, so the later u satisfies the difference equation of the final operator.
    let mut scenario = typical_scenario();
    let x = [6.0, 0.4, 0.3, 9.0_f64.ln(), 0.3_f64.ln(), 0.15];
    scenario.last.operator = FamilyOperator::new(Form::LeadLag, true, &x).unwrap();
    scenario.schedule = hoid_model::schedule::Schedule::Sigmoid {
        rate_per_s: 1e6,
        midpoint_s: 20.0 + 0.4 / 60.0,
    };
    let simulator = FamilySimulator::new(&scenario).unwrap();
    let record = simulator.run_with_truth(seed(0), false).unwrap();
    let truth = record.channel("omega_nm").unwrap();
    assert!((truth[1200] - 12.0).abs() < 1e-12 && (truth[1201] - 9.0).abs() < 1e-12);
    assert!((record.channel("T_I").unwrap()[2399] - 1.0 / 0.3).abs() < 1e-12);
    // The difference equation of the final operator, with the recorded e and u.
    let only = |state: &FamilyState| {
        let held = state.operator.zoh(sample_time()).unwrap();
        (held.nk, held.b, held.f)
    };
    let (nk, b, f) = only(&scenario.last);
    for k in 1300..2400 {
        let (e, u) = (record.input(), record.output());
        let response: f64 = b.iter().enumerate().map(|(i, b)| b * e[k - nk - i]).sum();
        let own: f64 = f.iter().enumerate().map(|(i, f)| f * u[k - 1 - i]).sum();
        assert!((u[k] - response + own).abs() < 1e-9, "{k}");
    }
    // A changing delay changes in whole samples.
    let x = [4.0, 0.6, 0.2, 12.0_f64.ln(), 0.4_f64.ln(), 0.2];
    scenario.last.operator = FamilyOperator::new(Form::LeadLag, true, &x).unwrap();
    let later = FamilySimulator::new(&scenario)
        .unwrap()
        .run_with_truth(seed(0), false)
        .unwrap();
    let tau = later.channel("tau_e").unwrap();
    assert!((tau[0] - 9.0 / 60.0).abs() < 1e-12 && (tau[2399] - 0.2).abs() < 1e-12);
}

/// Returns every kind of remnant.
fn parts() -> Vec<Vec<RemnantPart>> {
    let lag = RemnantShape::Lag {
        time_constant_s: 0.1,
        order: 1,
    };
    let peak = RemnantShape::Resonance {
        omega_rad_s: 11.0,
        zeta: 0.2,
    };
    let drift = RemnantShape::Lag {
        time_constant_s: 4.0,
        order: 1,
    };
    let ar = RemnantShape::Ar {
        coefficients: vec![-1.5, 0.7],
    };
    let one = |shape: &RemnantShape| RemnantPart::new(shape.clone(), 0.2);
    let follows = |signal, share| RemnantPart {
        signal_dependence: Some(SignalDependence {
            signal,
            share,
            memory_s: 1.0,
        }),
        ..one(&lag)
    };
    vec![
        vec![one(&lag)],
        vec![one(&ar)],
        vec![one(&RemnantShape::White)],
        vec![
            RemnantPart::new(lag.clone(), 0.12),
            RemnantPart::new(peak, 0.05),
            RemnantPart::new(drift, 0.03),
        ],
        vec![follows(DependenceSignal::Control, 0.8)],
        vec![follows(DependenceSignal::Rate, 0.8)],
        vec![RemnantPart {
            pulses: Some(Pulses {
                share: 0.9,
                rate_per_s: 1.5,
            }),
            ..one(&lag)
        }],
        vec![RemnantPart {
            intermittence: Some(Intermittence { on_s: 1.0, off_s: 2.0 }),
            ..one(&lag)
        }],
    ]
}

#[test]
fn each_remnant_has_the_requested_share_of_the_variance() {
    // In the last scenario, most of u is the response of the person to a target.
    let mut seen = typical_scenario();
    let sum = |rms, interleaved| MultiSine {
        rms,
        interleaved,
        ..MultiSine::default()
    };
    seen.target = sum(1.0, Interleaved::Even).excitation().unwrap();
    seen.disturbance = sum(0.2, Interleaved::Odd).excitation().unwrap();
    let x = [0.7, 11.0_f64.ln(), 0.3_f64.ln(), 0.2];
    seen.feedforward = Some(Feedforward::new(
        FamilyOperator::new(Form::Derivative, true, &x).unwrap(),
        0.25,
    ));
    let all = parts().into_iter().map(|remnant| (typical_scenario(), remnant));
    let all = all.chain([(seen, parts().swap_remove(0))]);
    for (kind, (mut scenario, remnant)) in all.enumerate() {
        scenario.run_in_s = 20.0;
        let silent = FamilySimulator::new(&scenario).unwrap();
        scenario.remnant = remnant;
        let noisy = FamilySimulator::new(&scenario).unwrap();
        let first = noisy.scenario().run_in_samples();
        let runs = 60;
        let mut shares = Vec::new();
        let (mut whole, mut of_error) = (0.0, 0.0);
        for replication in 0..runs {
            // The loop is linear, so the effect of the remnant is the difference.
            let (a, b) = (
                silent.signals(seed(replication)).unwrap(),
                noisy.signals(seed(replication)).unwrap(),
            );
            let own = mean_square(a.u[first..].iter().zip(&b.u[first..]).map(|(a, b)| b - a));
            shares.push(own / noisy.control_variance()[0]);
            whole += mean_square(b.u[first..].iter().copied()) / runs as f64;
            of_error += mean_square(b.e[first..].iter().copied()) / runs as f64;
        }
        let mean = shares.iter().sum::<f64>() / runs as f64;
        let scatter = shares.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / (runs * (runs - 1)) as f64;
        // The tolerance is four standard errors; one standard error is 0.5 to 5 % of the share.
        assert!(scatter.sqrt() < 0.06 * mean, "kind {kind}: {mean} {}", scatter.sqrt());
        assert!(
            (mean - 0.2).abs() < 4.0 * scatter.sqrt(),
            "kind {kind}: {mean} {}",
            scatter.sqrt()
        );
        assert!((whole / noisy.control_variance()[0] - 1.0).abs() < 0.1, "kind {kind}");
        assert!((of_error / noisy.error_variance()[0] - 1.0).abs() < 0.1, "kind {kind}");
    }
}

#[test]
fn remnants_have_the_statistics_of_their_kind() {
    let kinds = parts();
    let remnant_of = |parts: &Vec<RemnantPart>| {
        let mut scenario = typical_scenario();
        scenario.measurement_s = 400.0;
        scenario.remnant = parts.clone();
        FamilySimulator::new(&scenario).unwrap().run(seed(9), false).unwrap()
    };
    let kurtosis = |n: &[f64]| {
        let square = mean_square(n.iter().copied());
        mean_square(n.iter().map(|v| v * v)) / (square * square)
    };
    let steady = kurtosis(remnant_of(&kinds[0]).channel("n").unwrap());
    // The kurtosis of a Gaussian remnant is 3. Pulses of 0.1 s at 1.5 per second, and intermittence, cause heavy tails.
    assert!((steady - 3.0).abs() < 0.5, "{steady}");
    for kind in [6, 7] {
        let heavy = kurtosis(remnant_of(&kinds[kind]).channel("n").unwrap());
        assert!(heavy > 5.0, "{kind}: {heavy}");
    }
    // The remnant that depends on u is larger where u has been large.
    let record = remnant_of(&kinds[4]);
    let (n, u) = (record.channel("n").unwrap(), record.output());
    let (mut products, mut large, mut small) = (0.0, 0.0, 0.0);
    for k in (120..n.len()).step_by(30) {
        let before = mean_square(u[k - 90..k].iter().copied()).ln();
        let after = mean_square(n[k..(k + 30).min(n.len())].iter().copied()).ln();
        products += before * after;
        large += before;
        small += after;
    }
    let count = (120..n.len()).step_by(30).len() as f64;
    assert!(products / count - large / count * small / count > 0.05);
}

#[test]
fn stick_bias_drift_and_recorder_offsets_are_applied() {
    let mut scenario = typical_scenario();
    let plain = FamilySimulator::new(&scenario).unwrap().signals(seed(4)).unwrap();
    scenario.stick = Stick {
        offset_e: 0.3,
        offset_u: -0.2,
        ..Stick::default()
    };
    let offset = FamilySimulator::new(&scenario).unwrap().signals(seed(4)).unwrap();
    for k in 0..plain.e.len() {
        assert!((offset.e[k] - plain.e[k] - 0.3).abs() < 1e-14 && (offset.u[k] - plain.u[k] + 0.2).abs() < 1e-14);
        assert_eq!(offset.y[k], plain.y[k]);
    }
    // In the loop the integrator removes a constant bias from u and leaves it in e.
    scenario.stick = Stick {
        bias: 0.5,
        ..Stick::default()
    };
    let biased = FamilySimulator::new(&scenario).unwrap().signals(seed(4)).unwrap();
    let end = plain.u.len() - 1;
    assert!((biased.n[end] - 0.5).abs() < 1e-14);
    assert!((biased.u[end] - plain.u[end]).abs() < 1e-3);
    // The gain K = 4/0.2 and the bias of 0.5 determine the offset of e.
    assert!((biased.e[end] - plain.e[end] + 0.5 / 20.0).abs() < 1e-3);
    // A random walk of s per root second has the variance s^2 T after T seconds.
    scenario.stick = Stick {
        walk_per_root_s: 0.1,
        ..Stick::default()
    };
    let simulator = FamilySimulator::new(&scenario).unwrap();
    let ends = (0..60).map(|r| *simulator.signals(seed(r)).unwrap().n.last().unwrap());
    // The standard error of a variance of 60 values is 18 %.
    assert!((mean_square(ends) / (0.01 * 45.0) - 1.0).abs() < 4.0 * 0.18);
}

#[test]
fn seed_determines_the_run() {
    let mut scenario = typical_scenario();
    scenario.remnant = parts().remove(3);
    let simulator = FamilySimulator::new(&scenario).unwrap();
    let again = FamilySimulator::new(&scenario).unwrap();
    let run = simulator.run(seed(1), false).unwrap();
    assert_eq!(run, again.run(seed(1), false).unwrap());
    let other = simulator.run(seed(2), false).unwrap();
    // Another run has other phases and another remnant.
    assert_ne!(run.channel("d"), other.channel("d"));
    assert_ne!(run.channel("n"), other.channel("n"));
    assert_eq!((run.len(), run.time_s(0)), (2400, 0.0));
    assert_eq!(simulator.run(seed(1), true).unwrap().len(), 2700);
    // Over two periods each line has its amplitude, whatever its phase.
    let d = run.channel("d").unwrap();
    assert!((mean_square(d.iter().copied()).sqrt() - 1.0).abs() < 1e-12);
    let line = 2.0 * coefficient(d, TAU * 3.0 / 20.0, 1.0 / 60.0).norm() / 2400.0;
    assert!((line - scenario.disturbance.function.sinusoids()[1].amplitude_deg).abs() < 1e-12);
}

#[test]
fn invalid_scenarios_are_refused() {
    let refused = |change: &dyn Fn(&mut FamilyScenario)| {
        let mut scenario = typical_scenario();
        change(&mut scenario);
        FamilySimulator::new(&scenario).unwrap_err()
    };
    let unstable = refused(&|s| {
        let x = [40.0, 0.6, 0.2, 12.0_f64.ln(), 0.4_f64.ln(), 0.3];
        s.initial.operator = FamilyOperator::new(Form::LeadLag, true, &x).unwrap();
        s.last = s.initial.clone();
    });
    assert!(
        matches!(&unstable, SimError::Model(e) if e.to_string().contains("not stable")),
        "{unstable}"
    );
    assert!(ContinuousTransferFunction::new(&[1.0, 0.0, 1.0], &[1.0, 0.0]).is_err());
    assert!(SampleTime::new(0.0).is_err());
    let alone = refused(&|s| {
        s.disturbance = Excitation::default();
        s.remnant = parts().remove(0);
    });
    assert!(alone.to_string().contains("give a target"), "{alone}");
    for change in [
        &(|s: &mut FamilyScenario| s.measurement_s = 0.0) as &dyn Fn(&mut FamilyScenario),
        &|s| s.run_in_s = -1.0,
        &|s| s.measurement_s = 0.015,
        &|s| s.last.controlled_element = element(&[1.0], &[1.0, 0.0, 0.0]),
        &|s| s.last.operator = FamilyOperator::new(Form::Gain, false, &[1.0, 0.1]).unwrap(),
        &|s| s.remnant = vec![RemnantPart::new(RemnantShape::White, 0.6); 2],
        &|s| s.stick.bias = f64::NAN,
        &|s| {
            s.initial.controlled_element = element(&[1.0], &[1.0, 0.0]).with_delay(0.1).unwrap();
            s.last = s.initial.clone();
        },
    ] {
        refused(change);
    }
}

#[test]
fn feedforward_with_preview_adds_to_the_control() {
    // e = f - y and y = P u, so at each line of f in the steady state U = Y E + F R e^{j omega preview}.
    let mut scenario = typical_scenario();
    scenario.disturbance = Excitation::default();
    scenario.target = MultiSine::default().excitation().unwrap();
    scenario.target.random_phases = false;
    scenario.measurement_s = 20.0;
    scenario.run_in_s = 60.0;
    let muscles = [12.0_f64.ln(), 0.4_f64.ln()];
    let seen = FamilyOperator::new(Form::Derivative, true, &[0.6, muscles[0], muscles[1], 0.21]).unwrap();
    let preview_s = 0.3;
    scenario.feedforward = Some(Feedforward::new(seen.clone(), preview_s));
    let record = FamilySimulator::new(&scenario).unwrap().run(seed(0), false).unwrap();
    let ts = record.sample_time();
    let coefficient = |values: &[f64], omega: f64| -> Complex64 {
        let turned = |(k, v): (usize, &f64)| Complex64::from_polar(*v, -omega * k as f64 * ts.s());
        values.iter().enumerate().map(turned).sum()
    };
    for line in scenario.target.function.sinusoids() {
        let omega = line.omega_rad_s;
        let of = |name: &str| coefficient(record.channel(name).unwrap(), omega);
        let held = |operator: &FamilyOperator| {
            let held = operator.zoh(ts).unwrap();
            let back = Complex64::from_polar(1.0, -omega * ts.s());
            let f = [&[1.0][..], &held.f].concat();
            polynomial::value(&held.b, back) / polynomial::value(&f, back) * back.powi(held.nk as i32)
        };
        let ahead = Complex64::from_polar(1.0, omega * preview_s);
        let expected = held(&scenario.initial.operator) * of("e") + held(&seen) * ahead * of("f_t");
        assert!(
            (of("u") / expected - 1.0).norm() < 1e-6,
            "{omega} {} {expected}",
            of("u")
        );
    }
    scenario.feedforward = Some(Feedforward::new(seen, 0.3001));
    assert!(FamilySimulator::new(&scenario).is_err());
}
