//! Examination of a file, and its report.
#![allow(clippy::unwrap_used)]

use std::{f64::consts::TAU, fs, path::PathBuf};

use hoid_analysis::{AnalysisError, ExaminationOptions, FileExamination, Reading};
use tempfile::TempDir;

/// A record of 25 s with a target of period 10 s from 2 s to 22 s, and the output y = u/s of a control that is recorded
/// one sample late.
fn write_record(header: &str, columns: impl Fn(f64, f64, f64, f64) -> String) -> (TempDir, PathBuf) {
    let (ts, n) = (0.02, 1250);
    let sum = |t: f64, phase: f64| {
        let of = |h: f64| (TAU * h * t / 10.0 + phase * h).sin();
        [1.0, 3.0, 7.0, 12.0].map(of).iter().sum::<f64>()
    };
    let u: Vec<f64> = (0..n).map(|k| sum(k as f64 * ts, 1.3)).collect();
    let mut y = vec![0.0; n];
    for k in 1..n {
        y[k] = y[k - 1] + ts * u[k - 1];
    }
    let mut text = format!("{header}\n");
    for k in 0..n {
        let t = k as f64 * ts;
        let r = if (100..1100).contains(&k) { sum(t, 0.2) } else { 0.0 };
        text.push_str(&columns(t, r, y[k], u[k.saturating_sub(1)]));
        text.push('\n');
    }
    let directory = TempDir::new().unwrap();
    let path = directory.path().join("run.csv");
    fs::write(&path, text).unwrap();
    (directory, path)
}

fn record_row(t: f64, r: f64, y: f64, u: f64) -> String {
    format!("{t},{r},{y},{u}")
}

#[test]
fn columns_periods_and_lag_are_found() {
    let (_directory, path) = write_record("Time (s),Target,y,Stick [V]", record_row);
    let known = ExaminationOptions {
        controlled_element: Some(("1/s".to_owned(), "1/s".parse().unwrap())),
        ..ExaminationOptions::default()
    };
    let look = FileExamination::at(&path, &known).unwrap();
    assert_eq!(look.units(), [("Stick [V]", "V")]);
    let seen = look.summary.as_ref().unwrap();
    assert_eq!(seen.periods.as_ref().unwrap().span_s, (2.0, 22.0));
    let lag = seen.lag.as_ref().unwrap().as_ref().unwrap();
    assert_eq!((lag.samples, lag.seconds), (1.0, 0.02));
    let advice = look.advice().unwrap();
    assert_eq!(
        advice.command("identify", "my run.csv"),
        "hoid identify 'my run.csv' --input Target-y --output 'Stick [V]' --from 2 --to 22 --offset u=1 \
         --excitation Target --controlled-element 1/s"
    );
    // Values given by the user are not searched for.
    let known = ExaminationOptions {
        excitation: Some("none".to_owned()),
        from_s: Some(5.0),
        offset_samples: Some(0.0),
        ..known
    };
    let look = FileExamination::at(&path, &known).unwrap();
    let advice = look.advice().unwrap();
    assert_eq!(
        (advice.from_s, advice.to_s, advice.late_samples),
        (Some(5.0), None, None)
    );
    assert!(look.summary.unwrap().lag.is_none());
}

#[test]
fn unreadable_record_still_gives_column_advice() {
    let (_directory, path) = write_record("t,r,y,u", |t, r, y, u| {
        if (7.0..7.1).contains(&t) {
            format!("{t},{r},,{u}")
        } else {
            record_row(t, r, y, u)
        }
    });
    let look = FileExamination::at(&path, &ExaminationOptions::default()).unwrap();
    assert!(look.summary.as_ref().unwrap_err().to_string().contains("--fill"));
    assert_eq!(look.advice().unwrap().arguments(), ["--input", "r-y", "--output", "u"]);
    fs::write(&path, "a,b\n1,2\n").unwrap();
    assert!(
        FileExamination::at(&path, &ExaminationOptions::default())
            .unwrap()
            .advice()
            .is_none()
    );
    fs::write(&path, "").unwrap();
    assert!(FileExamination::at(&path, &ExaminationOptions::default()).is_err());
}

#[test]
fn error_suggests_other_columns() {
    let (_directory, path) = write_record("t,r,y,u", record_row);
    let refused = |reading: &Reading| reading.read_file(&path, |_, _| ()).unwrap_err();
    let default = Reading::default();
    let AnalysisError::OtherColumns(others) = refused(&default) else {
        panic!("no other columns");
    };
    assert_eq!((others.input.as_deref(), others.output.as_str()), (Some("r-y"), "u"));
    let words = others.to_string();
    assert!(
        words.ends_with("It looks like e = r-y and u = u: input=\"r-y\", output=\"u\""),
        "{words}"
    );
    assert_eq!(
        others.command(["track", "run.csv", "--input=e", "--output", "u", "--out", "t.csv"].map(str::to_owned)),
        "hoid track run.csv --out t.csv --input r-y --output u"
    );
    // A name given by the user is kept.
    let mut typed = Reading::default();
    typed.options.output = "stick".parse().unwrap();
    assert!(matches!(refused(&typed), AnalysisError::Io(_)));
}
