//! Compares the errors that `hoid design` predicts with the scatter of simulated experiments
//! (`tests/common/simulated.rs`).
//!
//! ```sh
//! cargo xtask slow design-errors [EXPERIMENTS] [SEED] [IDENTIFIED]
//! ```
//!
//! If the target is displayed, `IDENTIFIED` experiments (none by default) are also identified as by `hoid identify`:
//! both responses by prediction error and at the lines, with the forms of the design and without a prior.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../tests/common/simulated.rs"]
mod simulated;

use std::env;

use hoid_design::experiment::ExperimentDesign;
use hoid_ident::family::{ChannelRole, FamilyEstimator, Intersample, OperatorPrior, SeenChannel};
use hoid_model::{FamilyScenario, Record};
use simulated::{CASES, Case, CheckedQuantity, Responses};

fn main() {
    let number = |i: usize, otherwise: u64| env::args().nth(i).map_or(otherwise, |text| text.parse().unwrap());
    let (experiments, seed, identified) = (number(1, 200), number(2, 1), number(3, 0));
    let (mut within, mut all) = (0, 0);
    // Each case has a different realisation of the remnant.
    for (case, seed) in CASES.iter().zip((seed..).step_by(1000)) {
        let found = case.check_errors(experiments, seed);
        let held = found.iter().filter(|q| is_within(q)).count();
        (within, all) = (within + held, all + found.len());
        print(case, "at the lines", &found);
        if identified > 0 {
            print(case, "identified", &case.check_errors_with(identified, seed, identify));
        }
    }
    println!(
        "{within} of {all} within 10 %; of {experiments} experiments the ratio has an error of {:.1} %",
        100.0 / (2.0 * experiments as f64).sqrt()
    );
}

fn is_within(q: &CheckedQuantity) -> bool {
    (q.ratio - 1.0).abs() <= 0.1
}

fn print(case: &Case, how: &str, found: &[CheckedQuantity]) {
    println!(
        "{}, {how}: {} of {} s, remnant {:?}; {} experiments",
        case.name, case.runs, case.length_s, case.remnant, found[0].experiments
    );
    for q in found {
        let mark = if is_within(q) { "" } else { " *" };
        println!(
            "  {:12} {:9.4}  predicted {:.4}  scatter/predicted {:.3}  mean off by {:+.2}{mark}",
            q.name, q.value, q.predicted, q.ratio, q.off
        );
    }
}

fn identify(
    truth: &Responses,
    records: &[Record],
    _: &ExperimentDesign,
    scenario: &FamilyScenario,
) -> Option<Responses> {
    let seen = scenario.feedforward.as_ref().map(|seen| SeenChannel {
        preview_s: seen.preview_s,
        forms: vec![seen.operator.form()],
        ..SeenChannel::new("f_t", ChannelRole::Feedforward)
    });
    let excitation = ["d", "f_t"]
        .into_iter()
        .find(|name| records.iter().all(|record| record.channel(name).is_some()));
    let estimator = FamilyEstimator {
        forms: vec![truth.feedback.form()],
        prior: OperatorPrior::none(),
        intersample: Intersample::Zoh,
        channels: seen.into_iter().collect(),
        excitation: excitation.map(str::to_owned),
        ..FamilyEstimator::default()
    };
    let fit = estimator.fit(records).ok()?;
    Some(Responses {
        feedback: fit.operator(0).operator.clone(),
        target: match fit.channels.first() {
            Some(channel) => Some(channel.response.as_ref()?.operator.clone()),
            None => None,
        },
    })
}
