//! Errors that were predicted against the scatter of simulated experiments, each identified at its lines.
//!
//! Of 200 experiments the standard deviation of a parameter has an error of 5 %: 15 % are three of them.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use hoid_design::experiment::{Enters, Remnant, Task, expected};
use hoid_model::{
    Complex64, FamilyOperator, Form, SampleTime,
    family_scenario::{Excitation, FamilyScenario, FamilyState, RemnantPart, RemnantShape},
    forcing::{ForcingFunction, Sinusoid},
};
use hoid_sim::{FamilySimulator, RunSeed};
use nalgebra::{DMatrix, DVector};

const EXPERIMENTS: u64 = 200;

/// Fourier coefficients at the lines.
fn lines(values: &[f64], forcing: &ForcingFunction, ts: f64) -> Vec<Complex64> {
    let of = |omega: f64| -> Complex64 {
        let sum: Complex64 = values
            .iter()
            .enumerate()
            .map(|(k, v)| Complex64::from_polar(*v, -omega * ts * k as f64))
            .sum();
        sum * 2.0 / values.len() as f64
    };
    forcing.sinusoids().iter().map(|line| of(line.omega_rad_s)).collect()
}

/// Gauss-Newton through `U - H E`, weighted by the remnant.
fn fitted(
    start: &FamilyOperator,
    forcing: &ForcingFunction,
    e: &[Complex64],
    u: &[Complex64],
    weight: &dyn Fn(f64) -> f64,
) -> FamilyOperator {
    let mut operator = start.clone();
    for _ in 0..8 {
        let n = operator.coordinates().len();
        let (mut information, mut right) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        for (k, line) in forcing.sinusoids().iter().enumerate() {
            let response = operator.response_and_gradient(line.omega_rad_s);
            let residual = u[k] - response.value * e[k];
            let w = weight(line.omega_rad_s);
            for a in 0..n {
                let ga = response.gradient[a] * e[k];
                right[a] += w * (ga.conj() * residual).re;
                for b in 0..n {
                    information[(a, b)] += w * (ga.conj() * response.gradient[b] * e[k]).re;
                }
            }
        }
        let step = information.cholesky().unwrap().solve(&right);
        let moved: Vec<f64> = operator
            .coordinates()
            .iter()
            .zip(step.iter())
            .map(|(x, d)| x + d)
            .collect();
        operator = FamilyOperator::new(operator.form(), operator.has_neuromuscular(), &moved).unwrap();
    }
    operator
}

fn checked(
    form: Form,
    pairs: &[(&str, f64)],
    element: &str,
    (enters, share): (Enters, f64),
    (forcing, length_s): (&ForcingFunction, f64),
) {
    let pairs: Vec<(String, f64)> = pairs.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    let state = FamilyState {
        operator: FamilyOperator::of_names(form, &pairs).unwrap(),
        controlled_element: element.parse().unwrap(),
    };
    let remnant = Remnant {
        share,
        ..Remnant::default()
    };
    let task = Task {
        state: state.clone(),
        enters,
        remnant,
    };
    let predicted = expected(&task, forcing, length_s).unwrap();

    let ts = SampleTime::new(0.01).unwrap();
    let excitation = Excitation {
        function: forcing.clone(),
        random_phases: false,
    };
    let mut scenario = FamilyScenario::new(state.clone(), ts);
    match enters {
        Enters::Target => scenario.target = excitation,
        Enters::Disturbance => scenario.disturbance = excitation,
    }
    let shape = RemnantShape::Lag {
        time_constant_s: remnant.time_constant_s,
        order: 1,
    };
    scenario.remnant = vec![RemnantPart::new(shape, share)];
    scenario.measurement_s = length_s;
    scenario.run_in_s = 20.0;
    let simulator = FamilySimulator::new(&scenario).unwrap();
    let weight = |omega: f64| 1.0 + (remnant.time_constant_s * omega).powi(2);
    let names: Vec<&str> = predicted.parameters.iter().map(|p| p.name).collect();
    let mut all = vec![Vec::new(); names.len()];
    for replication in 0..EXPERIMENTS {
        let run = RunSeed {
            seed: 53,
            cell: 0,
            replication,
        };
        let record = simulator.run(run, false).unwrap();
        let e = lines(record.input(), forcing, 0.01);
        let u = lines(record.output(), forcing, 0.01);
        let found = fitted(&state.operator, forcing, &e, &u, &weight);
        for (values, parameter) in all.iter_mut().zip(found.named()) {
            values.push(parameter.value);
        }
    }
    for ((name, values), parameter) in names.iter().zip(&all).zip(&predicted.parameters) {
        let sd = hoid_numerics::statistics::sample_variance(values).sqrt();
        let ratio = sd / parameter.estimate.standard_error.unwrap();
        println!("{element} {enters:?} {share} {name}: scatter {sd:.5}, {ratio:.3} of what was predicted");
        assert!((ratio - 1.0).abs() < 0.15, "{name}: {ratio}");
    }
}

#[test]
fn a_target_with_a_lead() {
    let pairs = [
        ("K_e", 1.0),
        ("T_L", 0.4),
        ("omega_nm", 10.0),
        ("zeta_nm", 0.3),
        ("tau_e", 0.25),
    ];
    let forcing = ForcingFunction::reference();
    let length_s = 2.0 * 81.92;
    checked(
        Form::Lead,
        &pairs,
        "4/(s(s+1))",
        (Enters::Target, 0.15),
        (&forcing, length_s),
    );
}

/// Lines that are as large after the element as before a target.
#[test]
fn a_disturbance_with_a_gain() {
    let pairs = [("K", 2.0), ("omega_nm", 11.0), ("zeta_nm", 0.25), ("tau_e", 0.2)];
    let line = |p: f64| Sinusoid {
        amplitude_deg: 0.1 * p,
        omega_rad_s: p * std::f64::consts::TAU / 40.0,
        phase_rad: p * p,
    };
    let all = [3.0, 5.0, 7.0, 11.0, 17.0, 29.0, 47.0, 71.0].map(line);
    let forcing = ForcingFunction::new(all.to_vec()).unwrap();
    checked(Form::Gain, &pairs, "1/s", (Enters::Disturbance, 0.1), (&forcing, 160.0));
}
