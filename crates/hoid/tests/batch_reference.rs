//! Batch fits on simulated runs compared with independently computed values: medians of the relative error of ARX and
//! Box-Jenkins fits in C1, 100 runs per cell, nk = 29.
#![allow(clippy::unwrap_used)]

use hoid::{model::remnant_gain::NoiseDefinition, model::scenario::RemnantStrength, prelude::*};

const RUN_COUNT: u64 = 100;
const NK: usize = 29;

fn scenario(condition: Condition, m0: usize, level: f64) -> Scenario {
    let mut scenario = Scenario::condition(condition);
    scenario.remnant.order = m0;
    scenario.remnant.strength = RemnantStrength::Level {
        level,
        definition: NoiseDefinition::Response,
    };
    scenario
}

fn records(condition: Condition, m0: usize, level: f64) -> Vec<Record> {
    let simulator = Simulator::new(&scenario(condition, m0, level)).unwrap();
    (0..RUN_COUNT)
        .map(|replication| {
            let cell = (m0 as u64) << 8 | (level * 100.0).round() as u64;
            simulator
                .run(
                    RunSeed {
                        seed: 2024,
                        cell,
                        replication,
                    },
                    false,
                )
                .unwrap()
        })
        .collect()
}

/// True `[f1, f2, b0, b1]` (or a1, a2).
fn truth(condition: Condition) -> [f64; 4] {
    let d = Scenario::condition(condition)
        .initial
        .operator
        .discretise(SampleTime::AT_100_HZ)
        .unwrap()
        .zoh;
    [d.f1, d.f2, d.b0, d.b1]
}

/// Quantile of a sample by linear interpolation.
fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = q * (sorted.len() - 1) as f64;
    let (low, part) = (at.floor() as usize, at.fract());
    sorted[low] + part * (sorted[(low + 1).min(sorted.len() - 1)] - sorted[low])
}

/// Median with its standard error: 1.253 times the standard deviation (here from the quartiles)
/// over the square root of n.
fn median(values: &[f64]) -> (f64, f64) {
    let spread = (quantile(values, 0.75) - quantile(values, 0.25)) / 1.349;
    (quantile(values, 0.5), 1.253 * spread / (values.len() as f64).sqrt())
}

struct Cell {
    /// Relative errors in %, one row per fit.
    a1: Vec<f64>,
    b0: Vec<f64>,
    omega_nm: Vec<f64>,
    zeta: Vec<f64>,
    not_convertible: usize,
    loss: Vec<f64>,
    d1: Vec<f64>,
}

fn fit_all(structure: Structure, records: &[Record], condition: Condition) -> Cell {
    let [f1, _, b0, _] = truth(condition);
    let mut cell = Cell {
        a1: vec![],
        b0: vec![],
        omega_nm: vec![],
        zeta: vec![],
        not_convertible: 0,
        loss: vec![],
        d1: vec![],
    };
    for record in records {
        let fit = Estimator::new(structure, structure.operator_orders(NK))
            .fit(std::slice::from_ref(record))
            .unwrap();
        assert!(fit.termination().converged());
        let m = fit.model();
        let poles = if structure == Structure::Arx { m.a() } else { m.f() };
        cell.a1.push(100.0 * (poles[0] / f1 - 1.0));
        cell.b0.push(100.0 * (m.b()[0] / b0 - 1.0));
        cell.loss.push(fit.loss());
        cell.d1.extend(m.d().first());
        match fit.operator() {
            Ok(o) => {
                cell.omega_nm.push(100.0 * (o.omega_nm_rad_s.value / 11.25 - 1.0));
                cell.zeta.push(100.0 * (o.zeta_nm.value / 0.35 - 1.0));
            }
            Err(_) => cell.not_convertible += 1,
        }
    }
    cell
}

/// m0, P_n; for ARX a1, b0, and omega_nm and zeta (`None` if most runs cannot be converted); for Box-Jenkins the bounds
/// of b0, omega_nm and zeta.
type Row = (usize, f64, (f64, f64, Option<(f64, f64)>), [f64; 3]);

const EXPECTED: [Row; 8] = [
    (1, 0.1, (-53.0, 805.0, None), [2.0, 1.0, 2.0]),
    (1, 0.3, (-55.0, 1000.0, None), [3.0, 2.0, 3.0]),
    (2, 0.1, (-3.2, 50.0, Some((21.0, 48.0))), [3.0, 2.0, 3.0]),
    (2, 0.3, (-3.8, 68.0, Some((30.0, 49.0))), [4.0, 2.0, 4.0]),
    (3, 0.1, (1.5, -22.0, Some((-9.0, -31.0))), [3.0, 1.0, 2.0]),
    (3, 0.3, (2.2, -33.0, Some((-13.0, -46.0))), [6.0, 3.0, 4.0]),
    (4, 0.1, (1.9, -32.0, Some((-15.0, -36.0))), [4.0, 1.0, 2.0]),
    (4, 0.3, (3.0, -54.0, Some((-25.0, -60.0))), [7.0, 2.0, 4.0]),
];

#[test]
fn medians_agree_with_the_expected_values() {
    let mut failures = Vec::new();
    for (m0, level, (a1, b0, physical), bounds) in EXPECTED {
        let records = records(Condition::C1, m0, level);
        let arx = fit_all(Structure::Arx, &records, Condition::C1);
        let bj = fit_all(Structure::BoxJenkins, &records, Condition::C1);
        println!(
            "m0={m0} Pn={level}: ARX a1 {:+.1} b0 {:+.0} omega {:+.1} zeta {:+.1} ({} not convertible)  BJ a1 {:+.3} b0 {:+.2} \
             omega {:+.2} zeta {:+.2} (spread b0 {:.1} omega {:.1} zeta {:.1}) loss {:.3e} d1 {:.3}",
            median(&arx.a1).0,
            median(&arx.b0).0,
            median(&arx.omega_nm).0,
            median(&arx.zeta).0,
            arx.not_convertible,
            median(&bj.a1).0,
            median(&bj.b0).0,
            median(&bj.omega_nm).0,
            median(&bj.zeta).0,
            median(&bj.b0).1 * 8.0,
            median(&bj.omega_nm).1 * 8.0,
            median(&bj.zeta).1 * 8.0,
            median(&bj.loss).0,
            median(&bj.d1).0,
        );
        let mut check = |name: &str, values: &[f64], expected: f64, printed: f64| {
            let (found, error) = median(values);
            // Both medians are from 100 runs, and the expected median is rounded as printed.
            let allowed = 4.0 * 2f64.sqrt() * error + printed;
            if (found - expected).abs() > allowed {
                failures.push(format!(
                    "m0={m0} Pn={level} {name}: {found:.2}, expected {expected} +- {allowed:.2}"
                ));
            }
        };
        check("ARX a1", &arx.a1, a1, if m0 == 1 { 1.0 } else { 0.1 });
        check("ARX b0", &arx.b0, b0, if m0 == 1 { 10.0 } else { 1.0 });
        match physical {
            Some((omega, zeta)) => {
                check("ARX omega_nm", &arx.omega_nm, omega, 1.0);
                check("ARX zeta", &arx.zeta, zeta, 1.0);
            }
            None if arx.not_convertible <= 80 => {
                failures.push(format!(
                    "m0={m0} Pn={level}: only {} ARX fits do not convert",
                    arx.not_convertible
                ));
            }
            None => {}
        }
        if bj.not_convertible > 0 {
            failures.push(format!(
                "m0={m0} Pn={level}: {} BJ fits do not convert",
                bj.not_convertible
            ));
        }
        for (name, values, bound) in [
            ("a1", &bj.a1, 0.5),
            ("b0", &bj.b0, bounds[0]),
            ("omega_nm", &bj.omega_nm, bounds[1]),
            ("zeta", &bj.zeta, bounds[2]),
        ] {
            let (found, error) = median(values);
            if found.abs() > bound + 2.0 * error {
                failures.push(format!(
                    "m0={m0} Pn={level} BJ {name}: {found:.2} +- {error:.2}, bound {bound}"
                ));
            }
        }
        if m0 == 1 {
            let expected = if level == 0.1 { 1.37e-4 } else { 5.3e-4 };
            let loss = median(&bj.loss).0;
            if (loss / expected - 1.0).abs() > 0.01 {
                failures.push(format!("Pn={level} BJ loss {loss:.3e}, expected {expected:.2e}"));
            }
            let d1 = median(&bj.d1);
            if (d1.0 + 0.846).abs() > 0.0005 + 4.0 * d1.1 {
                failures.push(format!("Pn={level} BJ d1 {:.4}, expected -0.846", d1.0));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn only_a_start_from_rest_biases_the_gains() {
    let [_, _, b0, _] = truth(Condition::C1);
    let records = records(Condition::C1, 1, 0.1);
    let errors = |initial_state: InitialState| -> Vec<f64> {
        let structure = Structure::BoxJenkins;
        let estimator = Estimator {
            initial_state: Some(initial_state),
            ..Estimator::new(structure, structure.operator_orders(NK))
        };
        let relative = |r: &Record| 100.0 * (estimator.fit(std::slice::from_ref(r)).unwrap().model().b()[0] / b0 - 1.0);
        records.iter().map(relative).collect()
    };
    let (zero, estimated) = (
        median(&errors(InitialState::Zero)),
        median(&errors(InitialState::Estimate)),
    );
    println!("median error of b0 in %: {zero:.2?} from rest, {estimated:.2?} with estimated states");
    // The record starts while the system is in motion. An independent study found -4.5 %.
    assert!(
        zero.0 < -2.0 && estimated.0.abs() < 3.0 * estimated.1,
        "{zero:?} {estimated:?}"
    );
}

#[test]
fn noise_free_ols_returns_the_parameters() {
    for condition in [Condition::C1, Condition::C2] {
        let simulator = Simulator::new(&scenario(condition, 1, 0.0)).unwrap();
        let record = simulator.run(RunSeed::default(), false).unwrap();
        let fit = Estimator::new(Structure::Arx, Structure::Arx.operator_orders(NK))
            .fit(&[record])
            .unwrap();
        let [f1, f2, b0, b1] = truth(condition);
        for (found, expected) in fit.model().theta().iter().zip([f1, f2, b0, b1]) {
            assert!((found - expected).abs() < 1e-9, "{condition}: {found} and {expected}");
        }
    }
}

#[test]
fn noise_free_box_jenkins_is_exact() {
    let simulator = Simulator::new(&scenario(Condition::C1, 1, 0.0)).unwrap();
    let record = simulator.run(RunSeed::default(), false).unwrap();
    let fit = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(NK))
        .fit(&[record])
        .unwrap();
    let o = fit.operator().unwrap();
    assert!(
        (o.k_e.value - 0.09).abs() < 1e-6 && (o.zeta_nm.value - 0.35).abs() < 1e-6,
        "{o:?} {:?}",
        fit.termination()
    );
    assert!(fit.covariance().is_none(), "{:?}", fit.termination());
}

#[test]
fn default_starts_reach_the_minimum_from_the_truth() {
    let (mut fits, mut worse) = (0, 0);
    for condition in [Condition::C1, Condition::C2] {
        let [f1, f2, b0, b1] = truth(condition);
        for m0 in 1..=4 {
            for level in [0.1, 0.3] {
                let mut here = 0;
                for record in records(condition, m0, level) {
                    let own = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(NK));
                    let d1 = -(-0.01_f64 / 0.06).exp();
                    let from_truth = Estimator {
                        start: Some(vec![b0, b1, d1, f1, f2]),
                        ..own.clone()
                    };
                    let record = [record];
                    let (ours, theirs) = (own.fit(&record).unwrap(), from_truth.fit(&record).unwrap());
                    fits += 1;
                    here += usize::from(ours.loss() > theirs.loss() * (1.0 + 1e-6));
                }
                if here > 0 {
                    println!("{condition} m0={m0} Pn={level}: {here} of {RUN_COUNT} end above");
                }
                worse += here;
            }
        }
    }
    println!("{worse} of {fits} fits from own starts end above the minimum reached from the truth");
    // At most 0.5 % of the fits may be worse.
    assert!(worse * 200 <= fits, "{worse} of {fits}");
}
