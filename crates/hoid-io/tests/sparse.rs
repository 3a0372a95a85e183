//! Topics logged at separate times in one table: `--sparse`.
#![allow(clippy::unwrap_used)]

mod common;

use std::collections::BTreeMap;

use common::{TestFolder, default_options};
use hoid_io::{QualityIssueKind, ReadOptions, Repair, SparseTreatment, Step, read_segments};

fn options_with(sparse: &[(&str, SparseTreatment)]) -> ReadOptions {
    ReadOptions {
        sparse: sparse.iter().map(|(name, how)| ((*name).to_owned(), *how)).collect(),
        ..default_options()
    }
}

/// A table at 100 Hz with u in every row and e in every third row from the second row on; e = 10 t and u = 1 - t.
fn table_with_sparse_e(rows: i32) -> String {
    let row = |k: i32| {
        let t = 0.01 * f64::from(k);
        let e = if k % 3 == 1 {
            format!("{:.1}", 10.0 * t)
        } else {
            String::new()
        };
        format!("{t:.4},{e},{:.2}\n", 1.0 - t)
    };
    "t,e,u\n".to_owned() + &(0..rows).map(row).collect::<String>()
}

#[test]
fn sparse_values_are_held() {
    let desk = TestFolder::new();
    let read = desk
        .read(table_with_sparse_e(30), &options_with(&[("e", SparseTreatment::Hold)]))
        .unwrap();
    // The record extends from the first value of e, in row 1, to the last one, in row 28.
    assert_eq!((read.record.len(), read.record.time_s(0)), (28, 0.01));
    for (k, e) in read.record.input().iter().enumerate() {
        let own = 1 + 3 * (k / 3);
        assert!((e - 0.1 * own as f64).abs() < 1e-12, "{k}: {e}");
    }
    assert_eq!(
        read.notes,
        ["1 row at the start and 1 at the end were cut: a sparse column has no values there"]
    );
    let [
        Step::Sparse {
            how: "hold",
            own: 10,
            rows: 18,
            longest_s,
            mean_age_s: Some(age),
            ..
        },
    ] = read.steps.as_slice()
    else {
        panic!("{:?}", read.steps);
    };
    // The held values have ages of 0, 1 and 2 rows; the age in the last row is 0.
    assert!(
        (longest_s - 0.03).abs() < 1e-12 && (age - 0.01 * 27.0 / 28.0).abs() < 1e-12,
        "{age}"
    );
    // A declared sparse column is not reported as a fault.
    assert!(
        read.quality_issues
            .iter()
            .all(|one| one.kind != QualityIssueKind::Missing)
    );
    let text = read.steps[0].to_string();
    assert!(
        text.starts_with("column e: 10 values recorded, 18 rows between them filled with the last value"),
        "{text}"
    );
}

#[test]
fn sparse_values_are_interpolated_or_rows_dropped() {
    let desk = TestFolder::new();
    let read = desk
        .read(
            table_with_sparse_e(30),
            &options_with(&[("e", SparseTreatment::Linear)]),
        )
        .unwrap();
    assert_eq!(read.record.len(), 28);
    for (k, e) in read.record.input().iter().enumerate() {
        assert!((e - 0.1 * (k + 1) as f64).abs() < 1e-12, "{k}: {e}");
    }
    let read = desk
        .read(table_with_sparse_e(30), &options_with(&[("e", SparseTreatment::Drop)]))
        .unwrap();
    assert_eq!(read.record.len(), 10);
    assert!((read.record.sample_time().s() - 0.03).abs() < 1e-12);
    for (k, (e, u)) in read.record.input().iter().zip(read.record.output()).enumerate() {
        let t = 0.01 + 0.03 * k as f64;
        assert!((e - 10.0 * t).abs() < 1e-12 && (u - (1.0 - t)).abs() < 1e-12, "{k}");
    }
    // The remaining rows must be evenly spaced.
    let uneven = table_with_sparse_e(30).replace("0.1000,1.0,", "0.1000,,");
    let refused = desk.error(&uneven, &options_with(&[("e", SparseTreatment::Drop)]));
    assert!(refused.contains("--resample"), "{refused}");
    let resampled = ReadOptions {
        repair: Repair {
            resample: true,
            fill: false,
        },
        ..options_with(&[("e", SparseTreatment::Drop)])
    };
    assert_eq!(desk.read(&uneven, &resampled).unwrap().record.len(), 10);
}

#[test]
fn held_value_before_the_span_is_used() {
    let desk = TestFolder::new();
    let options = ReadOptions {
        span_s: (Some(0.12), Some(0.2)),
        ..options_with(&[("e", SparseTreatment::Hold)])
    };
    let read = desk.read(table_with_sparse_e(30), &options).unwrap();
    assert_eq!((read.record.len(), read.record.time_s(0)), (8, 0.12));
    assert!(
        (read.record.input()[0] - 1.0).abs() < 1e-12,
        "{:?}",
        read.record.input()
    );
}

/// Two separate clocks at 50 and 40 Hz: the grid is that of the faster clock, as with `--fill`.
#[test]
fn topics_with_two_clocks_are_resampled() {
    let desk = TestFolder::new();
    let mut rows: Vec<(f64, bool)> = (0..50).map(|k| (0.02 * f64::from(k), true)).collect();
    rows.extend((0..40).map(|k| (0.013 + 0.025 * f64::from(k), false)));
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let row = |(t, is_e): (f64, bool)| match is_e {
        true => format!("{t:.3},{},\n", 10.0 * t),
        false => format!("{t:.3},,{}\n", 1.0 - t),
    };
    let text = "t,e,u\n".to_owned() + &rows.into_iter().map(row).collect::<String>();
    let resample = Repair {
        resample: true,
        fill: false,
    };
    let options = ReadOptions {
        repair: resample,
        ..options_with(&[("e", SparseTreatment::Linear), ("u", SparseTreatment::Hold)])
    };
    let read = desk.read(&text, &options).unwrap();
    assert!((read.record.sample_time().s() - 0.02).abs() < 1e-12);
    for k in 0..read.record.len() {
        let t = read.record.time_s(k);
        // The last value of u is also held on the grid, and not interpolated to the next value.
        let last = 0.013 + 0.025 * ((t - 0.013 + 1e-9) / 0.025).floor();
        let (e, u) = (read.record.input()[k], read.record.output()[k]);
        assert!(
            (e - 10.0 * t).abs() < 1e-12 && (u - (1.0 - last)).abs() < 1e-12,
            "{t}: {e} {u}"
        );
    }
    let names: Vec<&str> = read.steps.iter().map(Step::name).collect();
    assert_eq!(names, ["sparse", "sparse", "interpolate"]);
}

#[test]
fn error_names_the_missing_sparse_option() {
    let desk = TestFolder::new();
    let refused = desk.error(table_with_sparse_e(60), &default_options());
    assert!(
        refused.contains("--sparse e=hold") && refused.contains("--fill"),
        "{refused}"
    );
    let filled = ReadOptions {
        repair: Repair {
            resample: false,
            fill: true,
        },
        ..default_options()
    };
    let read = desk.read(table_with_sparse_e(60), &filled).unwrap();
    assert!(
        read.notes.iter().any(|note| note.contains("--sparse e=hold holds")),
        "{:?}",
        read.notes
    );
    // A column with a dropout is not sparse.
    let dropout = "t,e,u\n".to_owned()
        + &(0..60)
            .map(|k| format!("{k},{},1\n", if k == 9 { String::new() } else { k.to_string() }))
            .collect::<String>();
    assert!(!desk.error(dropout, &default_options()).contains("--sparse"));
}

#[test]
fn invalid_sparse_options_are_refused() {
    let desk = TestFolder::new();
    let refused = |text: &str, sparse: &[(&str, SparseTreatment)]| desk.error(text, &options_with(sparse));
    let text = table_with_sparse_e(30);
    for (text, name, words) in [
        (
            text.as_str(),
            "stick",
            "there is no column \"stick\", expected one of t, e, u",
        ),
        (text.as_str(), "t", "t is the time"),
        ("t,e,u\n0,,1\n1,,2\n2,,1\n", "e", "column e has no value in 3 rows"),
    ] {
        for how in SparseTreatment::ALL {
            let message = refused(text, &[(name, how)]);
            assert!(message.contains(words) && message.contains("sparse"), "{message}");
        }
    }
    let apart = refused(
        "t,e,u\n0,1,\n1,2,\n2,,1\n3,,2\n",
        &[("e", SparseTreatment::Hold), ("u", SparseTreatment::Hold)],
    );
    assert!(
        apart.contains("the columns e, u have no rows in common between their first and last values"),
        "{apart}"
    );
    assert!(
        "held"
            .parse::<SparseTreatment>()
            .unwrap_err()
            .to_string()
            .contains("hold, linear or drop")
    );
    // Text and infinite numbers do not count as missing values.
    for bad in ["lost", "inf"] {
        let corrupted = text.replace("0.1000,1.0,", &format!("0.1000,{bad},"));
        assert!(refused(&corrupted, &[("e", SparseTreatment::Hold)]).contains(bad));
    }
    // A column without missing values is reported.
    let read = desk
        .read(
            &text,
            &options_with(&[("e", SparseTreatment::Hold), ("u", SparseTreatment::Drop)]),
        )
        .unwrap();
    assert!(
        read.notes
            .iter()
            .any(|note| note.contains("column u has a value in every row")),
        "{:?}",
        read.notes
    );
}

#[test]
fn e_and_u_denote_input_and_output() {
    let desk = TestFolder::new();
    let text = table_with_sparse_e(300).replace("t,e,u", "t,error,stick");
    let options = ReadOptions {
        input: Some("error".parse().unwrap()),
        output: "stick".parse().unwrap(),
        ..options_with(&[("e", SparseTreatment::Linear)])
    };
    let read = desk.read(&text, &options).unwrap();
    assert_eq!(read.record.len(), 298);
    let twice = ReadOptions {
        sparse: BTreeMap::from([
            ("e".to_owned(), SparseTreatment::Hold),
            ("error".to_owned(), SparseTreatment::Hold),
        ]),
        ..options.clone()
    };
    assert!(desk.error(&text, &twice).contains("named twice"));
    desk.read(&text, &options).unwrap();
    let mask = [QualityIssueKind::Missing];
    let all = read_segments(&desk.path("run.csv"), &options, &Default::default(), &mask, 1.0).unwrap();
    assert_eq!(all.iter().map(|read| read.record.len()).collect::<Vec<_>>(), [298]);
}
