//! A sample of the cases of `cargo xtask slow hostile`: none panics.
#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
#[path = "../../hoid-cli/tests/common/draw.rs"]
mod draw;
#[path = "common/hostile.rs"]
mod hostile;
#[path = "common/person.rs"]
mod person;

use hostile::Hostile;

const CASES: u64 = 1500;

#[test]
fn what_nobody_says_or_saved_ends_nothing() {
    let mut hostile = Hostile::new();
    (0..CASES).for_each(|number| hostile.case(5, number));
}
