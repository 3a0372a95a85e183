//! `cargo xtask slow lab [RUNS] [SEEDS]`: compares the plant of the page with Rust over 10 000 runs, and identifies
//! simulated operators that track with the page's engine in injected time.
//!
//! There are three operators: the operators of C1 and C2, and a gain with a lag for the element 4/s. Each has a
//! first-order remnant whose variance is a tenth of the variance of u. The operator receives e at each tick, whereas
//! the record contains every tenth tick and estimators assume a hold; the estimated delay is therefore half a sample
//! shorter. The program reports the bias of each parameter in percent with its standard error, the coverage of the 95 %
//! intervals, the number of runs in which the live estimate determines a lag without knowing the form, and the error of
//! this lag.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../tests/common/page.rs"]
mod page;

use std::process::ExitCode;

use data_encoding::BASE64;
use hoid_ident::family::{FamilyEstimator, OperatorPrior};
use hoid_lab::{
    config::{Condition, Signal},
    lag::Lag,
    plant::{InputMap, Plant},
    task::{TICK_S, Task},
};
use hoid_model::{
    Channel, ContinuousTransferFunction, FamilyOperator, Form, Record, SampleTime, operator_family::Coordinate,
    scenario::OperatingState, zoh_system::ZohSystem,
};
use hoid_sim::RunSeed;
use serde_json::{Value, json};

/// Range wide enough that no operator reaches its ends.
const INPUT_MAP: InputMap = InputMap {
    centre: 0.0,
    span: 1000.0,
    dead: 0.0,
    gain: 1000.0,
};
const REMNANT_TIME_CONSTANT_S: f64 = 0.06;
const REMNANT_SHARE: f64 = 0.1;

struct Person {
    name: &'static str,
    form: Form,
    neuromuscular: bool,
    /// Parameters in the order of the form, tau last.
    coordinates: Vec<f64>,
    element: String,
}

fn people() -> Vec<Person> {
    let of_state = |name, state: OperatingState| {
        let (o, c) = (state.operator, state.controlled_element);
        Person {
            name,
            form: Form::Lead,
            neuromuscular: true,
            coordinates: vec![o.k_e, o.t_l_s, o.omega_nm_rad_s.ln(), o.zeta_nm.ln(), o.tau_e_s],
            element: c.transfer_function().unwrap().to_string(),
        }
    };
    vec![
        of_state("C1", OperatingState::s1()),
        of_state("C2", OperatingState::s2()),
        Person {
            name: "4/s, lag",
            form: Form::Lag,
            neuromuscular: false,
            // With K = .4 and T_I = 1 s, the crossover is 1.1 rad/s and the margin 32 deg. At this bandwidth a
            // neuromuscular system could not be identified, so the operator has none.
            coordinates: vec![0.4, 1.0, 0.18],
            element: "4/s".to_owned(),
        },
    ]
}

fn encode_values(values: &[f64]) -> String {
    BASE64.encode(&values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
}

fn decode_values(answer: &Value) -> Vec<f64> {
    let bytes = BASE64.decode(answer.as_str().unwrap().as_bytes()).unwrap();
    bytes
        .chunks_exact(8)
        .map(|eight| f64::from_le_bytes(eight.try_into().unwrap()))
        .collect()
}

fn variance(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64
}

/// Returns the task with u and e at each tick, for a remnant of the given standard deviation.
fn simulate_run(engine: &mut page::Engine, person: &Person, seed: u64, remnant: f64) -> (Task, Vec<f64>, Vec<f64>) {
    let condition = Condition {
        controlled_element: person.element.clone(),
        target: Some(Signal::default()),
        ..Condition::default()
    };
    let task = Task::new(&condition, 0, seed).unwrap();
    let operator = FamilyOperator::new(person.form, person.neuromuscular, &person.coordinates).unwrap();
    let transfer: ContinuousTransferFunction = operator.transfer_function().unwrap();
    let held = ZohSystem::new(transfer.num(), transfer.den(), 0.0, SampleTime::new(TICK_S).unwrap()).unwrap();
    let plant = Plant {
        a: held.transition_matrix().to_vec(),
        b: held.input_vector().to_vec(),
        c: held.output_row().to_vec(),
        d: held.direct_feedthrough(),
    };
    let a = (-TICK_S / REMNANT_TIME_CONSTANT_S).exp();
    let mut n = 0.0;
    let white = RunSeed {
        seed,
        cell: 7,
        replication: 0,
    }
    .white_noise(task.ticks);
    let noise: Vec<f64> = white
        .iter()
        .map(|w| {
            n = a * n + remnant * (1.0 - a * a).sqrt() * w;
            n
        })
        .collect();
    // An event takes effect at the next tick, which is one tick of the delay.
    let delay = (operator.tau_e_s() / TICK_S).round() as usize - 1;
    let answer = engine.request(
        &json!({"phases": task.phases, "ticks": task.ticks, "map": INPUT_MAP, "target": encode_values(&task.target),
        "operator": {"plant": plant, "delay": delay}, "noise": encode_values(&noise)}),
    );
    (task, decode_values(&answer["u"]), decode_values(&answer["e"]))
}

fn main() -> ExitCode {
    let number = |k: usize, default: u32| std::env::args().nth(k).map_or(default, |text| text.parse().unwrap());
    let (runs, seeds) = (number(1, 10_000), number(2, 100));
    let Some(mut engine) = page::Engine::start() else {
        println!("skipped: there is no node");
        return ExitCode::SUCCESS;
    };
    let differing = (1..=runs)
        .filter(|seed| !page::is_bit_identical(&mut engine, *seed))
        .count();
    println!("{differing} of {runs} runs of the page's plant differ from Rust in a bit");
    let mut wrong = differing > 0;
    println!("operator\tparameter\ttruth\tbias %\tits error %\tcoverage %\truns");
    for person in people() {
        let quiet = simulate_run(&mut engine, &person, 0, 0.0).1;
        let remnant = (REMNANT_SHARE * variance(&quiet[10_000..])).sqrt();
        let kinds = person.form.coordinates(person.neuromuscular);
        let mut found: Vec<Vec<(f64, f64)>> = vec![Vec::new(); kinds.len()];
        let mut lags = Vec::new();
        for seed in 1..=u64::from(seeds) {
            let (task, u, e) = simulate_run(&mut engine, &person, seed, remnant);
            let every = |signal: &[f64]| signal[task.run_in..].iter().copied().step_by(10).collect::<Vec<f64>>();
            let channel = |name: &str, signal: &[f64]| Channel::new(name, "", every(signal));
            let record = Record::new(SampleTime::AT_100_HZ, channel("e", &e), channel("u", &u)).unwrap();
            if let Lag::Known(lag) = Lag::of(record.clone()) {
                lags.push((lag.value, lag.standard_error.unwrap_or(f64::NAN)));
            }
            let estimator = FamilyEstimator {
                forms: vec![person.form],
                neuromuscular: person.neuromuscular,
                prior: OperatorPrior::none(),
                run_to_run: 0.0,
                ..FamilyEstimator::default()
            };
            let Ok(fit) = estimator.fit(&[record]) else { continue };
            for (index, kind) in found.iter_mut().zip(&kinds) {
                let estimate = fit.coordinate(0, *kind);
                if let Some(estimate) = estimate
                    && let Some(error) = estimate.standard_error
                {
                    index.push((estimate.value, error));
                }
            }
        }
        for ((kind, truth), all) in kinds.iter().zip(&person.coordinates).zip(&found) {
            let truth = if *kind == Coordinate::Delay {
                truth - 0.005
            } else {
                *truth
            };
            let n = all.len().max(1) as f64;
            let estimates: Vec<f64> = all.iter().map(|(value, _)| *value).collect();
            let bias = estimates.iter().sum::<f64>() / n - truth;
            let error = (variance(&estimates) / n).sqrt();
            let covered = all
                .iter()
                .filter(|(value, error)| (value - truth).abs() <= 1.96 * error)
                .count();
            // For a logarithm the difference is the relative error.
            let log = matches!(kind, Coordinate::LogOmega | Coordinate::LogZeta);
            let share = if log { 100.0 } else { 100.0 / truth.abs() };
            println!(
                "{}\t{}\t{truth:.4}\t{:.2}\t{:.2}\t{:.1}\t{}",
                person.name,
                kind.parameter(),
                bias * share,
                error * share,
                100.0 * covered as f64 / n,
                all.len()
            );
            wrong |= all.len() < seeds as usize;
        }
        let truth = kinds.iter().position(|kind| *kind == Coordinate::LagRate);
        let truth = truth.map(|index| 1.0 / person.coordinates[index]);
        let holds = |(value, error): &&(f64, f64)| truth.is_some_and(|t| (value - t).abs() <= 1.96 * error);
        println!(
            "{}\ta lag is reported in {} of {seeds} runs, {} of them within 1.96 standard errors of the truth",
            person.name,
            lags.len(),
            lags.iter().filter(holds).count()
        );
    }
    if wrong { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}
