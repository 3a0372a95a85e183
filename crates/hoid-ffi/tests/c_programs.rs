//! The examples in C and C++ are compiled by the available compiler and run without Rust. They give the same digits as
//! the tracker in Rust.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod common;

use std::{fs, path::PathBuf};

use hoid_ident::{NamedOrders, order_selection::Criterion};
use hoid_model::{Record, Structure, uncertainty::Estimate};
use hoid_track::{Method, StartSource, TrackOptions, TrackPlan, Tracker, search_ranges};
use tempfile::TempDir;

use common::{compile, compiler, example_path, lines, record, run, successful_output};

const ELEMENT: &str = "90/(s(s+6))";

fn compile_example(name: &str, with: &str, options: &[&str]) -> Option<(TempDir, PathBuf)> {
    let with = compiler(with)?;
    let folder = TempDir::new().unwrap();
    let program = folder.path().join("tracker");
    successful_output(&compile(&with, &example_path(name), &program, options));
    Some((folder, program))
}

/// Returns the value and the standard error of each estimate; NaN where there is none.
fn numbers(estimates: &[Option<Estimate>]) -> Vec<f64> {
    let pair = |e: &Option<Estimate>| {
        let value = e.map_or(f64::NAN, |e| e.value);
        let error = e.and_then(|e| e.standard_error).unwrap_or(f64::NAN);
        [value, error]
    };
    estimates.iter().flat_map(pair).collect()
}

/// Returns the expected output of the example, computed by the tracker in Rust.
fn expected_rows(record: &Record, options: &TrackOptions) -> Vec<Vec<f64>> {
    let mut tracker = Tracker::new(options, None, record.sample_time()).unwrap();
    let pairs = record.input().iter().zip(record.output());
    pairs
        .map(|(e, u)| {
            let outcome = tracker.step(*e, *u);
            let operator = tracker.operator().ok();
            let rows = operator.map(|operator| operator.rows().map(|(.., e)| Some(e)));
            let mut row = numbers(&rows.unwrap_or([None; 6]));
            let found = tracker.open_loop().and_then(Result::ok);
            row.extend(numbers(&[
                found.map(|found| found.crossover_rad_s),
                found.map(|found| found.phase_margin_deg),
            ]));
            row.push(outcome.innovation.unwrap_or(f64::NAN));
            row
        })
        .collect()
}

fn typical_options(record: &Record) -> TrackOptions {
    let (method, structure) = (Method::adaptive(), Structure::BoxJenkins);
    let ranges = search_ranges(&method, structure, &NamedOrders::new(), &[], record.sample_time()).unwrap();
    let options = TrackOptions::default_for(method, 29);
    let plan = TrackPlan::new(options, ranges, Criterion::Bic, record.sample_time()).unwrap();
    plan.options().clone()
}

fn assert_same_rows(found: &str, expected: &[Vec<f64>], columns: &[usize]) {
    let mut rows = 0;
    for (line, expected) in found.lines().zip(expected) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        assert_eq!(cells.len(), columns.len());
        for (cell, column) in cells.iter().zip(columns) {
            let other = expected[*column];
            assert!(
                cell.to_bits() == other.to_bits() || cell.is_nan() && other.is_nan(),
                "row {rows}, column {column}: {cell} {other}"
            );
        }
        rows += 1;
    }
    assert_eq!(rows, expected.len());
}

#[test]
fn c_example_matches_rust() {
    let Some((_folder, program)) = compile_example("tracker.c", "cc", &["-std=c11", "-pedantic"]) else {
        return;
    };
    let record = record();
    let with_element = TrackOptions {
        controlled_element: Some(ELEMENT.parse().unwrap()),
        ..typical_options(&record)
    };
    let expected_rows = expected_rows(&record, &with_element);
    let options = format!("{{\"controlled_element\": \"{ELEMENT}\"}}");
    let all: Vec<usize> = (0..17).collect();
    // The tracker is saved, freed and restored in the middle of the run.
    let output = run(&program, &["adaptive", "0.01", &options, "4000"], &lines(&record));
    assert_same_rows(&successful_output(&output), &expected_rows, &all);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(message.contains("after 8192 samples, 0 skipped"), "{message}");
}

/// The S-function is compiled with a substitute for Simulink's header, because Simulink itself is not available.
#[test]
fn s_function_matches_rust() {
    let stubs = format!("-I{}/tests/stubs", env!("CARGO_MANIFEST_DIR"));
    let Some((_folder, program)) = compile_example("simulink/sfun_hoid.c", "cc", &["-std=c11", &stubs]) else {
        return;
    };
    let record = record();
    let rows = expected_rows(&record, &typical_options(&record));
    let output = run(&program, &["adaptive", "0.01", ""], &lines(&record));
    assert_same_rows(&successful_output(&output), &rows, &(0..17).collect::<Vec<_>>());
    let refused = run(&program, &["kalman", "0.01", ""], "");
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && message.contains("adaptive"), "{message}");
}

/// The module is compiled with a substitute for DUECA's headers, because DUECA itself is not available.
#[test]
fn dueca_module_matches_rust() {
    let stubs = format!("-I{}/tests/stubs/dueca", env!("CARGO_MANIFEST_DIR"));
    let Some((_folder, program)) = compile_example("../tests/stubs/dueca/drive.cpp", "c++", &["-std=c++14", &stubs])
    else {
        return;
    };
    let record = record();
    let rows = expected_rows(&record, &typical_options(&record));
    let found = successful_output(&run(&program, &[], &lines(&record)));
    assert_same_rows(&found, &rows, &[0, 1, 2, 3, 6, 8, 10]);
}

#[test]
fn c_example_reports_a_change() {
    let Some((_folder, program)) = compile_example("tracker.c", "cc", &["-std=c11"]) else {
        return;
    };
    let record = record();
    let options = r#"{"nk": 29, "nd": 1, "warm_up": 20}"#;
    let output = run(&program, &["multiple-model", "0.01", options], &lines(&record));
    assert_eq!(successful_output(&output).lines().count(), record.len());
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    // The task changes at 40.96 s.
    let place = |line: &str| line.strip_prefix("sample ")?.split(':').next()?.parse::<usize>().ok();
    let declared: Vec<usize> = message.lines().filter_map(place).collect();
    assert!(declared.iter().any(|k| (4096..5000).contains(k)), "{message}");
    assert!(declared.iter().all(|k| *k >= 4096), "{message}");
}

#[test]
fn cpp_example_matches_rust() {
    let Some((_folder, program)) = compile_example("tracker.cpp", "c++", &["-std=c++14"]) else {
        return;
    };
    let record = record();
    let options = TrackOptions {
        start: StartSource::Span(None),
        ..typical_options(&record)
    };
    let rows = expected_rows(&record, &options);
    let found = successful_output(&run(&program, &["adaptive", "0.01"], &lines(&record)));
    // Rows without an operator contain only the innovation.
    let lines: Vec<&str> = found.lines().collect();
    assert_eq!(lines.len(), rows.len());
    let columns: Vec<usize> = (0..12).chain([16]).collect();
    let first = lines.iter().position(|line| line.contains(',')).unwrap();
    assert_same_rows(&lines[first..].join("\n"), &rows[first..], &columns);
    assert_same_rows(&lines[..first].join("\n"), &rows[..first], &[16]);
}

#[test]
fn c_example_is_clean_under_sanitizers() {
    let sanitizers = ["-std=c11", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
    let Some(with) = compiler("cc") else { return };
    let folder = TempDir::new().unwrap();
    let trial = folder.path().join("trial.c");
    fs::write(&trial, "int main(void) { return 0; }\n").unwrap();
    let program = folder.path().join("tracker");
    let has = compile(&with, &trial, &program, &sanitizers).status.success();
    if !has || !run(&program, &[], "").status.success() {
        eprintln!("skipped: {with} has no address and undefined-behaviour sanitizer");
        return;
    }
    successful_output(&compile(&with, &example_path("tracker.c"), &program, &sanitizers));
    let record = record();
    let input = lines(&record);
    successful_output(&run(&program, &["adaptive", "0.01", "{}", "1000"], &input));
    successful_output(&run(
        &program,
        &["rpem", "0.01", "{\"nk\": 29, \"nd\": 1}", "1000"],
        &input,
    ));
    // A refused method gives exit status 1 and a message, without a report from the sanitizer.
    let refused = run(&program, &["kalman", "0.01"], "");
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(1));
    assert!(
        message.contains("adaptive") && !message.contains("Sanitizer"),
        "{message}"
    );
}
