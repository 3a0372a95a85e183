//! The numbers of `research/notes/evidence-tables.md` that take too long for a test.
//!
//! `cargo run --release -p hoid-evidence --example evidence -- coverage|efficiency|starts|delay [RUNS]`
//!
//! `cargo run --release -p hoid-evidence --example evidence -- speed [RUNS] [PYTHON]` compares the times of the
//! Box-Jenkins fit and of the same fit in SciPy; PYTHON is an interpreter that has numpy and scipy, `python3` by
//! default.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../../../crates/hoid/tests/common/textbook.rs"]
mod textbook;

use hoid::{
    ident::{GreyBox, OrderRanges, choose_orders, order_selection::Criterion},
    model::{
        remnant::RemnantDiscretisation,
        remnant_gain::NoiseDefinition,
        scenario::{OperatingState, RemnantStrength},
    },
    prelude::*,
};
use textbook::Truth;

const NK: usize = 29;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let runs = arguments.get(1).map(|n| n.parse().unwrap());
    match arguments.first().map(String::as_str) {
        Some("coverage") => {
            print_textbook_coverage(runs.unwrap_or(2000));
            print_closed_loop_coverage(runs.unwrap_or(2000));
        }
        Some("efficiency") => print_closed_loop_coverage(runs.unwrap_or(2000)),
        Some("starts") => compare_starts(runs.unwrap_or(100)),
        Some("delay") => print_delay_choice(runs.unwrap_or(100)),
        Some("speed") => compare_speed(runs.unwrap_or(50), arguments.get(2).map_or("python3", String::as_str)),
        _ => println!("coverage, efficiency, starts, delay or speed, and a number of runs"),
    }
}

fn simulator(condition: Condition, remnant_order: usize, noise_level: f64) -> Simulator {
    let mut scenario = Scenario::condition(condition);
    scenario.remnant.order = remnant_order;
    scenario.remnant.strength = RemnantStrength::Level {
        level: noise_level,
        definition: NoiseDefinition::Response,
    };
    Simulator::new(&scenario).unwrap()
}

fn run(simulator: &Simulator, cell: u64, replication: u64) -> Record {
    let run_seed = RunSeed {
        seed: 2000,
        cell,
        replication,
    };
    simulator.run(run_seed, false).unwrap()
}

/// Estimates of one quantity over the runs.
#[derive(Default)]
struct EstimateTally {
    name: String,
    truth: f64,
    values: Vec<f64>,
    bounds: Vec<f64>,
    inside: usize,
    without: usize,
}

#[derive(Default)]
struct Tallies(Vec<EstimateTally>);

impl Tallies {
    /// Adds an estimate, and its variance by the Cramer-Rao bound (not a number if it is not
    /// requested).
    fn add(&mut self, name: &str, estimate: Estimate, truth: f64, bound: f64) {
        let at = match self.0.iter().position(|t| t.name == name) {
            Some(at) => at,
            None => {
                self.0.push(EstimateTally {
                    name: name.to_owned(),
                    truth,
                    ..EstimateTally::default()
                });
                self.0.len() - 1
            }
        };
        let tally = &mut self.0[at];
        let Some(error) = estimate.standard_error else {
            tally.without += 1;
            return;
        };
        tally.values.push(estimate.value - truth);
        tally.bounds.push(bound);
        tally.inside += usize::from((estimate.value - truth).abs() < 1.959_964 * error);
    }

    fn print(&mut self) {
        println!("  quantity     median bias   spread       coverage   variance / CRB");
        for tally in &mut self.0 {
            let n = tally.values.len() as f64;
            let mean = tally.values.iter().sum::<f64>() / n;
            let variance = tally.values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
            let bound = tally.bounds.iter().sum::<f64>() / n;
            tally.values.sort_by(f64::total_cmp);
            let percent = |x: f64| 100.0 * x / tally.truth.abs();
            println!(
                "  {:10} {:+10.2} % {:10.2} %   {:8.3}   {:8.3}   {}",
                tally.name,
                percent(tally.values[tally.values.len() / 2]),
                percent(variance.sqrt()),
                tally.inside as f64 / n,
                variance / bound,
                if tally.without > 0 {
                    format!("({} without a standard error)", tally.without)
                } else {
                    String::new()
                }
            );
        }
    }
}

fn print_textbook_coverage(runs: u64) {
    for structure in Structure::ALL {
        let truth = Truth::of(structure);
        let mut tallies = Tallies::default();
        for seed in 0..runs {
            let record = truth.record(400, 0.5, 10_000 + seed);
            let fit = Estimator::new(structure, truth.orders()).fit(&[record]).unwrap();
            for ((name, estimate), value) in fit.parameters().into_iter().zip(truth.theta()) {
                tallies.add(&name, estimate, value, f64::NAN);
            }
        }
        println!("{structure}, open loop, 400 samples, {runs} runs");
        tallies.print();
    }
}

fn print_closed_loop_coverage(runs: u64) {
    for (condition, state) in [
        (Condition::C1, OperatingState::s1()),
        (Condition::C2, OperatingState::s2()),
    ] {
        let simulator = simulator(condition, 1, 0.1);
        let held = state.operator.discretise(SampleTime::AT_100_HZ).unwrap().zoh;
        let theta = [held.b0, held.b1, -(-0.01_f64 / 0.06).exp(), held.f1, held.f2];
        let o = state.operator;
        let bj = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(NK));
        // No step is made from the true parameters: the covariance is the Cramer-Rao bound of this record.
        let mut at_truth = bj.clone();
        at_truth.start = Some(theta.to_vec());
        at_truth.search.max_iterations = 0;
        let (mut box_jenkins, mut grey) = (Tallies::default(), Tallies::default());
        let (mut grey_failed, mut bj_failed) = (0, 0);
        for replication in 0..runs {
            let record = [run(&simulator, condition as u64, replication)];
            let k_n = record[0].channel("K_n").unwrap()[0];
            let fit = bj.fit(&record).unwrap();
            let bound = at_truth.fit(&record).unwrap();
            for (i, (name, estimate)) in fit.parameters().into_iter().enumerate() {
                box_jenkins.add(&name, estimate, theta[i], bound.covariance().unwrap()[i * 6]);
            }
            let variance = |e: &Estimate| e.standard_error.map_or(f64::NAN, |s| s * s);
            match (fit.operator(), bound.operator()) {
                (Ok(found), Ok(bound)) => {
                    let truths = [o.k_e, o.t_l_s, o.k_e_dot(), o.omega_nm_rad_s, o.zeta_nm];
                    for (((name, _, e), (_, _, b)), truth) in found.rows().iter().zip(bound.rows()).zip(truths) {
                        box_jenkins.add(name, *e, truth, variance(&b));
                    }
                }
                _ => bj_failed += 1,
            }
            if let (Ok(found), Ok(bound)) = (
                fit.remnant(RemnantDiscretisation::ZeroOrderHold),
                bound.remnant(RemnantDiscretisation::ZeroOrderHold),
            ) {
                box_jenkins.add("T_n", found.t_n_s, 0.06, variance(&bound.t_n_s));
                box_jenkins.add("K_n", found.k_n, k_n, variance(&bound.k_n));
            }
            match GreyBox::new(1..=1).fit(&record) {
                Ok(fit) => {
                    if let Ok(found) = fit.operator(0) {
                        let truths = [o.k_e, o.t_l_s, o.k_e_dot(), o.omega_nm_rad_s, o.zeta_nm, o.tau_e_s];
                        for ((name, _, e), truth) in found.rows().iter().zip(truths) {
                            grey.add(name, *e, truth, variance(e));
                        }
                    }
                    if let Some(r) = fit.remnant(0) {
                        grey.add("T_n", r.t_n_s, 0.06, variance(&r.t_n_s));
                        grey.add("K_n", r.k_n, k_n, variance(&r.k_n));
                    }
                }
                Err(_) => grey_failed += 1,
            }
        }
        println!(
            "{condition:?}, m0 = 1, P_n = .1, BJ(m* = 1), {runs} runs; bound at the truth; {bj_failed} not convertible"
        );
        box_jenkins.print();
        println!("{condition:?}, grey box; bound at the estimates; {grey_failed} failed");
        grey.print();
    }
}

/// Table 6.1: every initial condition leads to the same minimum.
fn compare_starts(runs: u64) {
    let gains = [0.075, 0.05, 0.1];
    let poles = [[-1.912, 0.924], [-1.812, 0.824], [-1.962, 0.974]];
    for m0 in 1..=4 {
        let simulator = simulator(Condition::C1, m0, 0.1);
        let orders = Orders {
            nd: m0,
            ..Structure::BoxJenkins.operator_orders(NK)
        };
        let mut missed = [0; 10];
        for replication in 0..runs {
            let record = [run(&simulator, 60 + m0 as u64, replication)];
            let fit = |start: Option<Vec<f64>>| {
                let estimator = Estimator {
                    start,
                    ..Estimator::new(Structure::BoxJenkins, orders)
                };
                estimator.fit(&record).map_or(f64::INFINITY, |f| f.loss())
            };
            let mut losses = vec![fit(None)];
            for gain in gains {
                for [f1, f2] in poles {
                    let mut theta = vec![gain, -gain];
                    theta.extend(vec![0.0; m0]);
                    theta.extend([f1, f2]);
                    losses.push(fit(Some(theta)));
                }
            }
            let best = losses.iter().copied().fold(f64::INFINITY, f64::min);
            for (count, loss) in missed.iter_mut().zip(&losses) {
                *count += u32::from(*loss > best * (1.0 + 1e-6));
            }
        }
        println!("m0 = {m0}, {runs} runs: other minima from own start, base, IC2.., by gains then poles: {missed:?}");
    }
}

/// Share of runs in which the loss is smallest at the true delay.
fn print_delay_choice(runs: u64) {
    for m0 in 1..=4 {
        for noise_level in [0.01, 0.1, 0.3] {
            let simulator = simulator(Condition::C1, m0, noise_level);
            let mut found = [0; 2];
            let mut near = [0; 2];
            for replication in 0..runs {
                let record = [run(&simulator, 100 + m0 as u64, replication)];
                for (i, structure) in [Structure::Arx, Structure::BoxJenkins].into_iter().enumerate() {
                    let mut ranges = OrderRanges::from(structure.operator_orders(NK));
                    ranges.nk = 20..=40;
                    if structure == Structure::BoxJenkins {
                        ranges.nd = m0..=m0;
                    }
                    let template = Estimator::new(structure, structure.operator_orders(NK));
                    let choice = choose_orders(&template, &ranges, Criterion::Loss, &record).unwrap();
                    let nk = choice.fit.orders().nk;
                    found[i] += u32::from(nk == NK);
                    near[i] += u32::from(nk.abs_diff(NK) <= 1);
                }
            }
            let share = |n: u32| 100.0 * f64::from(n) / runs as f64;
            println!(
                "m0 = {m0}, P_n = {noise_level}: nk = 29 found by ARX {:.0} %, BJ {:.0} %; within one sample ARX {:.0} %, BJ {:.0} %",
                share(found[0]),
                share(found[1]),
                share(near[0]),
                share(near[1])
            );
        }
    }
}

/// Compares the Box-Jenkins fit without a start with the same fit in SciPy, in one session on one thread; the smallest
/// time of each counts.
fn compare_speed(runs: u64, python: &str) {
    let record = [run(&simulator(Condition::C1, 1, 0.1), 0, 0)];
    let estimator = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(NK));
    let fastest = |estimator: &Estimator| {
        let time = |_| {
            let begin = std::time::Instant::now();
            let fit = estimator.fit(&record).unwrap();
            (begin.elapsed().as_secs_f64(), fit.loss())
        };
        (0..runs).map(time).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
    };
    let (ours, loss) = fastest(&estimator);
    let mut zero = estimator.clone();
    zero.initial_state = Some(InitialState::Zero);
    let (ours_zero, loss_zero) = fastest(&zero);
    println!("hoid, initial states estimated: {:.3} ms, loss {loss:.6e}", 1e3 * ours);
    println!(
        "hoid, zeros before the record:  {:.3} ms, loss {loss_zero:.6e}",
        1e3 * ours_zero
    );
    let file = std::env::temp_dir().join("hoid-evidence-speed.csv");
    let rows = record[0].input().iter().zip(record[0].output());
    let text: String = rows.map(|(e, u)| format!("{e},{u}\n")).collect();
    std::fs::write(&file, text).unwrap();
    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../crates/hoid/benches/peers/scipy_bj.py"
    );
    let found = std::process::Command::new(python)
        .args([script, file.to_str().unwrap(), &runs.to_string()])
        .envs([("OMP_NUM_THREADS", "1"), ("OPENBLAS_NUM_THREADS", "1")])
        .output();
    let printed = found
        .map(|o| String::from_utf8_lossy(&o.stdout).into_owned())
        .unwrap_or_default();
    let parts: Vec<&str> = printed.split_whitespace().collect();
    let Some(theirs) = parts.first().and_then(|t| t.parse::<f64>().ok()) else {
        println!("{python} with numpy and scipy is missing: no comparison");
        return;
    };
    println!(
        "SciPy, zeros before the record: {:.3} ms, loss {} (scipy {}, numpy {})",
        1e3 * theirs,
        parts[1],
        parts[2],
        parts[3]
    );
    println!(
        "SciPy / hoid: {:.1} (states estimated), {:.1} (zeros as SciPy)",
        theirs / ours,
        theirs / ours_zero
    );
}
