//! Recorded people in a manual tracking task: the open-loop crossover of the identified model is compared with the
//! describing function.
//!
//! The recordings are not part of the project. Their directory is given by the environment variable `HOID_HUMAN_DATA`;
//! if it is not set, the test reports this and passes.
#![allow(clippy::unwrap_used)]

use std::{env, path::PathBuf};

use hoid::{
    ident::order_selection::Criterion,
    io::{ReadOptions, read_record},
    model::{
        ContinuousTransferFunction,
        margins::{MANUAL_CONTROL_RANGE_RAD_S, margins},
    },
    prelude::*,
};

/// Person, plant, crossover in rad/s by Fourier coefficients at the disturbance lines, averaged
/// over ten trials (published with the recordings; computed independently).
const CROSSOVERS_RAD_S: [(&str, &str, f64); 6] = [
    ("P03", "fo", 1.99),
    ("P03", "so", 1.21),
    ("P05", "fo", 3.95),
    ("P05", "so", 3.23),
    ("P09", "fo", 2.94),
    ("P09", "so", 2.63),
];

fn trials(directory: &PathBuf, person: &str, plant: &str) -> Vec<Record> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(directory)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            path.file_name()
                .unwrap()
                .to_string_lossy()
                .starts_with(&format!("{person}_{plant}_"))
        })
        .collect();
    files.sort();
    let options = ReadOptions {
        input: Some("r-y".parse().unwrap()),
        // The span contains two periods of the disturbance after the ramp.
        span_s: (Some(5.0), Some(45.0)),
        ..ReadOptions::default()
    };
    files
        .iter()
        .map(|file| read_record(file, &options).unwrap().record)
        .collect()
}

#[test]
fn crossover_agrees_with_the_describing_function() {
    let Some(directory) = env::var_os("HOID_HUMAN_DATA").map(PathBuf::from) else {
        println!("skipped: HOID_HUMAN_DATA does not name the directory of the recordings");
        return;
    };
    let mut failures = Vec::new();
    for (person, plant, expected) in CROSSOVERS_RAD_S {
        let records = trials(&directory, person, plant);
        assert_eq!(records.len(), 10, "{person} {plant}");
        assert!(records.iter().all(|r| r.len() == 2400));
        let structure = Structure::BoxJenkins;
        // A subset of the delays and orders that `hoid identify` searches; people require a noise model of high order.
        let mut ranges = OrderRanges::from(structure.operator_orders(1));
        ranges.nk = 9..=21;
        ranges.nd = 7..=8;
        let template = Estimator::new(structure, structure.operator_orders(1));
        let fit = choose_orders(&template, &ranges, Criterion::Bic, &records).unwrap().fit;
        let denominator: &[f64] = if plant == "fo" { &[1.0, 0.0] } else { &[1.0, 1.0, 0.0] };
        let element = ContinuousTransferFunction::new(&[1.0], denominator).unwrap();
        let nyquist = fit.model().sample_time().nyquist_rad_s();
        let found = margins(
            |omega| fit.model().response(omega) * element.response(omega),
            (MANUAL_CONTROL_RANGE_RAD_S.0, nyquist),
        );
        let crossover = found.crossover_rad_s.unwrap();
        println!(
            "{person} {plant}: {} crossover {crossover:.3}, expected {expected}",
            fit.orders()
        );
        if (crossover / expected - 1.0).abs() > 0.12 {
            failures.push(format!(
                "{person} {plant}: crossover {crossover:.3}, expected {expected}"
            ));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
