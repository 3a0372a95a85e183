//! Compares predicted errors with the scatter of simulated experiments, for a sample of the cases of `cargo xtask slow
//! design-errors`.
//!
//! With 200 experiments, the relative standard error of a standard deviation is 5 %; the limit of 15 % is three times
//! this value.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "common/simulated.rs"]
mod simulated;

use simulated::CASES;

const EXPERIMENT_COUNT: u64 = 200;

#[test]
fn scatter_matches_the_prediction() {
    // A target, a disturbance, and both.
    for case in [&CASES[1], &CASES[4], &CASES[10]] {
        for q in case.check_errors(EXPERIMENT_COUNT, 53) {
            println!(
                "{}: {} {:.3}, predicted {:.4}, {:.3} of it, off by {:.2}",
                case.name, q.name, q.value, q.predicted, q.ratio, q.off
            );
            assert_eq!(q.experiments as u64, EXPERIMENT_COUNT, "{}: {}", case.name, q.name);
            assert!((q.ratio - 1.0).abs() < 0.15, "{}: {} {}", case.name, q.name, q.ratio);
        }
    }
}
