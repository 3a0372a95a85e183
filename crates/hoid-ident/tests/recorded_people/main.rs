//! Refined instrumental variables on recorded people.
//!
//! The recordings lie in the directory that `HOID_HUMAN_DATA` names; without it the test says so and
//! passes.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]

use hoid_ident::{Estimator, InstrumentalVariable, Instruments, IvMethod};
use hoid_model::{Channel, Orders, Record, SampleTime, Structure};

/// The trials of a person and plant: e = r - y, paired with the u of the row behind it.
fn trials(cell: &str) -> Option<Vec<Record>> {
    let dir = std::env::var_os("HOID_HUMAN_DATA")?;
    let mut files: Vec<_> = std::fs::read_dir(dir)
        .ok()?
        .filter_map(|file| Some(file.ok()?.path()))
        .filter(|path| {
            path.file_name()
                .is_some_and(|name| name.to_string_lossy().starts_with(cell))
        })
        .collect();
    files.sort();
    Some(
        files
            .iter()
            .map(|path| trial(&std::fs::read_to_string(path).unwrap()))
            .collect(),
    )
}

fn trial(text: &str) -> Record {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let rows: Vec<Vec<f64>> = lines
        .map(|line| line.split(',').map(|cell| cell.trim().parse().unwrap()).collect())
        .filter(|row: &Vec<f64>| (5.0 - 1e-9..45.0 - 1e-9).contains(&row[0]))
        .collect();
    let column = |name: &str| {
        let at = names.iter().position(|n| n.trim() == name).unwrap();
        rows.iter().map(|row| row[at]).collect::<Vec<f64>>()
    };
    let (r, y, u, d) = (column("r"), column("y"), column("u"), column("d"));
    let n = rows.len() - 1;
    let e = r.iter().zip(&y).map(|(r, y)| r - y).take(n).collect();
    Record::new(
        SampleTime::new(1.0 / 60.0).unwrap(),
        Channel::new("e", "", e),
        Channel::new("u", "", u[1..].to_vec()),
    )
    .unwrap()
    .with_channel(Channel::new("d", "", d[..n].to_vec()))
    .unwrap()
}

#[test]
#[ignore = "prints the table of all cells; minutes"]
fn table_of_recorded_people() {
    let env = |n: &str| std::env::var(n).ok();
    let mut rows = 0;
    for cell in ["P03_fo", "P05_fo", "P09_fo", "P03_so", "P05_so", "P09_so"] {
        if env("CELL").is_some_and(|c| c != cell) {
            continue;
        }
        let Some(records) = trials(cell) else {
            eprintln!("skipped: HOID_HUMAN_DATA names no directory of recordings");
            return;
        };
        for (nb, nf) in [(2, 2), (3, 2), (4, 2), (3, 3), (4, 3)] {
            for nd in [4, 8, 12, 24] {
                if env("ORD").is_some_and(|c| c != format!("{nb},{nf},{nd}")) {
                    continue;
                }
                let orders = Orders {
                    nb,
                    nd,
                    nf,
                    nk: env("NK").map_or(10, |s| s.parse().unwrap()),
                    ..Orders::default()
                };
                let pem = Estimator::new(Structure::BoxJenkins, orders).fit(&records).unwrap();
                for instruments in [Instruments::External("d".to_owned()), Instruments::Simulated] {
                    if env("INS").is_some_and(|c| !instruments.to_string().contains(&c)) {
                        continue;
                    }
                    let began = std::time::Instant::now();
                    let estimator = InstrumentalVariable {
                        instruments: instruments.clone(),
                        ..InstrumentalVariable::new(IvMethod::RivBj, orders)
                    };
                    rows += 1;
                    match estimator.fit(&records) {
                        Ok(fit) => {
                            let distance = |w: f64| (fit.model().response(w) / pem.model().response(w) - 1.0).norm();
                            let z =
                                hoid_model::polynomial::roots(&hoid_model::polynomial_model::monic(fit.model().f()))
                                    .unwrap();
                            println!(
                                "{cell} {orders} {instruments}: {} {} {:.0} ms; loss / PEM {:.4}; from PEM {:.2} {:.2} {:.2}; se {} {:?}",
                                fit.termination().converged(),
                                fit.termination(),
                                1e3 * began.elapsed().as_secs_f64(),
                                fit.loss() / pem.loss(),
                                distance(0.63),
                                distance(2.0),
                                distance(5.0),
                                fit.covariance().is_some(),
                                z.iter()
                                    .map(|z| format!("{:.4}{:+.4}i", z.re, z.im))
                                    .collect::<Vec<_>>()
                            );
                        }
                        Err(error) => println!("{cell} {orders} {instruments}: {error}"),
                    }
                }
            }
        }
    }
    assert!(rows > 0);
}
