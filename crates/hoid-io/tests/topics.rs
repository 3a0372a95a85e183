//! Topics that were written one after the other into one table.

#![allow(clippy::unwrap_used, reason = "a test may fail at any line, its helpers as well")]

mod common;

use common::{TestFolder, default_options};
use hoid_io::{ReadOptions, SparseTreatment};

/// A table of two topics with e every `step_e` and u every `step_u` hundredths of a second.
fn table(step_e: usize, step_u: usize) -> String {
    let stamp = |k: usize| format!("{},{}", 1_700_000_000 + k / 100, k % 100 * 10_000_000);
    let e = (0..300).step_by(step_e).map(|k| format!("{},/error,{k},\n", stamp(k)));
    let u = (0..300)
        .step_by(step_u)
        .map(|k| format!("{},/stick,,{}\n", stamp(k), 2 * k));
    format!("secs,nsecs,topic,e,u\n{}", e.chain(u).collect::<String>())
}

#[test]
fn topics_with_the_same_times_are_joined() {
    let read = TestFolder::new().read(table(1, 1), &default_options()).unwrap();
    assert_eq!((read.record.len(), read.record.sample_time().s()), (300, 0.01));
    assert_eq!(read.record.input()[299], 299.0);
    assert_eq!(read.record.output()[299], 598.0);
    assert!(
        read.notes.iter().any(|note| note.contains("joined by t as topics")),
        "{:?}",
        read.notes
    );
}

#[test]
fn topics_with_two_rates_need_sparse() {
    let desk = TestFolder::new();
    let message = desk.error(table(5, 1), &default_options());
    assert!(
        message.contains("column e: the value is missing") && message.contains("--sparse e=hold"),
        "{message}"
    );
    let options = ReadOptions {
        sparse: [(String::from("e"), SparseTreatment::Linear)].into_iter().collect(),
        ..default_options()
    };
    let record = desk.read(table(5, 1), &options).unwrap().record;
    assert_eq!(record.len(), 296);
    assert_eq!((record.input()[7], record.output()[7]), (7.0, 14.0));
}

#[test]
fn trials_are_not_joined_as_topics() {
    let desk = TestFolder::new();
    let trial = |first: i32| {
        (0..20)
            .map(|k| format!("{:.2},{},{k}\n", 0.02 * f64::from(k), first + k))
            .collect::<String>()
    };
    let message = desk.error(format!("t,e,u\n{}{}", trial(0), trial(7)), &default_options());
    assert!(message.contains("2 trials according to t"), "{message}");
    // A table with only one topic, or without any value, is not joined.
    for text in ["t,e,u\n0,1,\n1,2,\n0,1,\n1,2,\n", "t,e,u\n1,,\n0,,\n"] {
        let message = desk.error(text, &default_options());
        assert!(!message.contains("joined"), "{message}");
    }
}
