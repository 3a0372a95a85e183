//! Instrumental variables on simulated records.
#![allow(clippy::unwrap_used)]

use hoid::{
    ident::{InstrumentalVariable, Instruments, IvMethod},
    model::{remnant_gain::NoiseDefinition, scenario::RemnantStrength},
    prelude::*,
};

fn nk() -> usize {
    if std::env::var("HARD").is_ok() { 6 } else { 29 }
}

fn runs(m0: usize, level: f64, n: u64) -> Vec<Record> {
    let mut scenario = Scenario::condition(Condition::C1);
    scenario.remnant.order = m0;
    if std::env::var("HARD").is_ok() {
        scenario.initial.operator.tau_e_s = 0.05;
        scenario.last = scenario.initial;
        scenario.remnant.time_constant_s = 0.3;
    }
    scenario.remnant.strength = RemnantStrength::Level {
        level,
        definition: NoiseDefinition::Response,
    };
    let simulator = Simulator::new(&scenario).unwrap();
    (0..n)
        .map(|replication| {
            let cell = (m0 as u64) << 8 | (level * 100.0).round() as u64;
            let stream = Stream {
                seed: 40,
                cell,
                replication,
            };
            simulator.run(stream, false).unwrap()
        })
        .collect()
}

fn external() -> Instruments {
    Instruments::External("f_t".to_owned())
}

fn iv(method: IvMethod, instruments: Instruments, nd: usize) -> InstrumentalVariable {
    let orders = method.structure().operator_orders(nk());
    let orders = Orders {
        nd: if method == IvMethod::RivBj { nd } else { 0 },
        ..orders
    };
    InstrumentalVariable {
        instruments,
        ..InstrumentalVariable::new(method, orders)
    }
}

#[test]
fn explore() {
    let n: u64 = std::env::var("RUNS").map_or(20, |v| v.parse().unwrap());
    let held = Scenario::condition(Condition::C1)
        .initial
        .operator
        .discretise(SampleTime::HUNDREDTH)
        .unwrap()
        .held;
    let truth = [held.b0, held.f1, 0.09, 0.4, 11.25, 0.35];
    for m0 in 1..=4 {
        for level in [0.1, 0.3] {
            let records = runs(m0, level, n);
            let mut show = |name: &str, fit: &dyn Fn(&Record) -> Result<Fit, hoid::ident::IdentError>| {
                let begin = std::time::Instant::now();
                let mut values: Vec<Vec<f64>> = vec![vec![]; 6];
                let mut ses: Vec<Vec<f64>> = vec![vec![]; 6];
                let (mut bad, mut nc, mut its, mut failed) = (0, 0, 0, 0);
                for r in &records {
                    let f = match fit(r) {
                        Ok(f) => f,
                        Err(e) => {
                            failed += 1;
                            println!("{e}");
                            continue;
                        }
                    };
                    bad += usize::from(!f.termination().converged());
                    its += f.termination().iterations;
                    let m = f.model();
                    let poles = if m.f().is_empty() { m.a() } else { m.f() };
                    let p = f.parameters();
                    let se = |n: &str| {
                        p.iter()
                            .find(|(x, _)| x == n)
                            .unwrap()
                            .1
                            .standard_error
                            .unwrap_or(f64::NAN)
                    };
                    match f.operator() {
                        Ok(o) => {
                            let e = [o.k_e, o.t_l_s, o.omega_nm_rad_s, o.zeta_nm];
                            values[0].push(m.b()[0]);
                            values[1].push(poles[0]);
                            ses[0].push(se("b0"));
                            ses[1].push(se(if m.f().is_empty() { "a1" } else { "f1" }));
                            for i in 0..4 {
                                values[2 + i].push(e[i].value);
                                ses[2 + i].push(e[i].standard_error.unwrap_or(f64::NAN));
                            }
                        }
                        Err(_) => nc += 1,
                    }
                }
                let time = begin.elapsed().as_secs_f64() * 1e3 / n as f64;
                print!("m0={m0} Pn={level} {name:16}");
                for i in 0..6 {
                    let k = values[i].len() as f64;
                    let mean = values[i].iter().sum::<f64>() / k;
                    let sd = (values[i].iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (k - 1.0)).sqrt();
                    let mut s = ses[i].clone();
                    s.sort_by(f64::total_cmp);
                    let med = s.get(s.len() / 2).copied().unwrap_or(f64::NAN);
                    let t = truth[i].abs();
                    print!(
                        " {:+6.2}±{:5.2}({:5.2})",
                        100.0 * (mean - truth[i]) / t,
                        100.0 * sd / t,
                        100.0 * med / t
                    );
                }
                println!(
                    "  unconv {bad} notconv {nc} err {failed} it {:.1} {time:.1} ms",
                    its as f64 / n as f64
                );
            };
            show("pem bj(1)", &|r| {
                Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(nk()))
                    .fit(std::slice::from_ref(r))
            });
            for (how, name) in [(Instruments::Simulated, "sim"), (external(), "f_t")] {
                for method in IvMethod::ALL {
                    if std::env::var("ONLY4").is_ok() && method != IvMethod::Iv4 {
                        continue;
                    }
                    show(&format!("{method} {name}"), &|r| {
                        iv(method, how.clone(), 1).fit(std::slice::from_ref(r))
                    });
                }
            }
        }
    }
}
