//! A sample of the cases of `cargo xtask slow hostile`, none of which may panic.
#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
#[path = "../../hoid-cli/tests/common/draw.rs"]
mod draw;
#[path = "common/hostile.rs"]
mod hostile;
#[path = "common/person.rs"]
mod person;
#[path = "common/texts.rs"]
mod texts;

use hoid_lab::{
    Config,
    config::{Condition, Signal},
    session::Session,
};
use hostile::HostileTest;
use person::Person;
use serde_json::json;

const CASE_COUNT: u64 = 1500;
/// Cases that failed in the past: a preview of eleven days, and more samples held back than the ring buffer contains.
const REGRESSION_CASES: [u64; 2] = [6025, 66_758];

#[test]
fn hostile_messages_and_files_do_not_stop_the_server() {
    let mut hostile = HostileTest::new();
    (0..CASE_COUNT).for_each(|number| hostile.run_case(5, number));
    REGRESSION_CASES
        .into_iter()
        .for_each(|number| hostile.run_case(2026, number));
}

/// A page requests a run, continues with a session whose plan is shorter, and tries to start the run there.
#[test]
fn run_requested_in_another_session_does_not_start() {
    let dir = tempfile::tempdir().unwrap();
    let config = |runs: usize| Config {
        condition: vec![Condition {
            target: Some(Signal::default()),
            measurement_s: 0.3,
            run_in_s: 0.2,
            runs,
            ..Condition::default()
        }],
        ..Config::default()
    };
    Session::create(dir.path(), &config(1), "P02", false).unwrap();
    let mut person = Person::start_session(dir.path(), config(2));
    person.start_next_run(1).unwrap();
    person.track(1, 0..500).unwrap();
    person.finish(1).unwrap();
    person.send(json!({"type": "next"})).unwrap();
    person
        .send(json!({"type": "resume", "session": "sub-P02/ses-01"}))
        .unwrap();
    let message = person.send(person::begin_message(2)).unwrap_err();
    assert!(message.contains("run 2 was not requested"), "{message}");
    // The next run of that session can start.
    person.start_next_run(1).unwrap();
}
