//! `hoid lab` in a program built without this feature.
#![cfg(not(feature = "lab"))]
#![allow(clippy::unwrap_used)]

mod common;

use common::failure_of;

#[test]
fn error_names_the_missing_feature() {
    let directory = tempfile::TempDir::new().unwrap();
    let (code, message) = failure_of(directory.path(), &["lab"]);
    assert_eq!(code, 2);
    assert!(message.contains("--features lab"), "{message}");
    assert!(!directory.path().join("hoid-lab").exists());
}
