//! Trials in one file become separate records, regardless of how they are marked.

#![allow(clippy::unwrap_used, reason = "a test may fail at any line, its helpers as well")]

mod common;

use common::{TestFolder, default_options};
use hoid_io::{IoError, Preparation, ReadOptions, ReadRecord, read_segments};

fn read_trials(text: &str, choice: Option<&str>) -> Result<Vec<ReadRecord>, IoError> {
    let desk = TestFolder::new();
    let path = desk.path("run.csv");
    std::fs::write(&path, text).unwrap();
    read_segments(&path, &by(choice), &Preparation::default(), &[], 0.0)
}

fn by(choice: Option<&str>) -> ReadOptions {
    ReadOptions {
        trial: choice.map(|choice| choice.parse().unwrap()),
        ..default_options()
    }
}

/// Three trials of 10, 12 and 14 rows; e counts all rows.
fn trial_text(header: &str, label: impl Fn(usize) -> String, restarts: bool) -> String {
    let mut row = 0;
    let mut text = format!("{header}\n");
    for trial in 0..3 {
        for k in 0..10 + 2 * trial {
            let t = if restarts { k } else { row };
            text += &format!("{}{:.2},{row},{}\n", label(trial), 0.02 * t as f64, 2 * row);
            row += 1;
        }
    }
    text
}

fn first_and_len(read: &[ReadRecord]) -> Vec<(f64, usize)> {
    read.iter()
        .map(|read| (read.record.input()[0], read.record.len()))
        .collect()
}

#[test]
fn trials_are_split_by_restarting_time_or_a_column() {
    let expected = [(0.0, 10), (10.0, 12), (22.0, 14)];
    let number = |trial: usize| format!("{},", trial + 1);
    let name = |trial: usize| format!("{},", ["a", "b", "a"][trial]);
    let counted = trial_text("trial,t,e,u", number, true);
    for (text, choice, labels) in [
        (
            trial_text("t,e,u", |_| String::new(), true),
            None,
            ["t 1", "t 2", "t 3"],
        ),
        (
            trial_text("t,e,u", |_| String::new(), true),
            Some("t"),
            ["t 1", "t 2", "t 3"],
        ),
        (counted.clone(), None, ["trial 1", "trial 2", "trial 3"]),
        (counted.clone(), Some("trial"), ["trial 1", "trial 2", "trial 3"]),
        (
            trial_text("trial,t,e,u", number, false),
            Some("trial"),
            ["trial 1", "trial 2", "trial 3"],
        ),
        (
            trial_text("block,t,e,u", name, false),
            Some("block"),
            ["block a", "block b", "block a (2)"],
        ),
    ] {
        let read = read_trials(&text, choice).unwrap();
        assert_eq!(first_and_len(&read), expected, "{choice:?}\n{text}");
        assert!(
            read.iter()
                .all(|read| (read.record.sample_time().s() - 0.02).abs() < 1e-12)
        );
        for (read, label) in read.iter().zip(labels) {
            assert_eq!(read.record.label(), format!("run ({label})"));
        }
        assert!(
            read[0]
                .notes
                .iter()
                .any(|note| note.starts_with("3 trials according to ")),
            "{:?}",
            read[0].notes
        );
    }
    // A single trial is requested, and then a trial that does not exist.
    assert_eq!(
        first_and_len(&read_trials(&counted, Some("trial=2")).unwrap()),
        [(10.0, 12)]
    );
    let message = |choice| read_trials(&counted, Some(choice)).unwrap_err().to_string();
    assert!(message("trial=4").contains("there is no trial trial=4; it has 1, 2, 3"));
    assert!(message("block").contains("no column \"block\""));
}

#[test]
fn several_trials_without_a_choice_are_refused() {
    let desk = TestFolder::new();
    let message = desk.error(trial_text("trial,t,e,u", |k| format!("{k},"), true), &default_options());
    assert!(
        message.contains("holds 3 trials according to trial: 0, 1, 2; read one of them with --trial trial=0"),
        "{message}"
    );
    // A clock that is set back by a row does not start a trial.
    let set: String = (0..40)
        .map(|k| format!("{:.2},{k},{k}\n", 0.02 * f64::from(k - 2 * i32::from(k > 20))))
        .collect();
    let message = desk.error(format!("t,e,u\n{set}"), &default_options());
    assert!(
        message.contains("expected increasing time") && message.contains("--drop-repeated"),
        "{message}"
    );
}
