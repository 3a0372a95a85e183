//! Table 3 of the thesis, and the operators before and after the change.

use super::run_selection::{mean_and_median, select, subjects};
use crate::{
    experiment::{EvaluatedRun, procedure::RunOutcome},
    reproduction::{
        item::{Item, ItemOutput},
        table_builder::TableBuilder,
    },
};

/// Table 3: delays and time constants of the remnant, one row for each run.
pub(super) fn delays(item: &Item, runs: &[EvaluatedRun], conditions: &[String]) -> ItemOutput {
    let simulated = runs.iter().any(|run| run.outcome.truth.is_some());
    let (texts, numbers) = if simulated {
        (&["subject", "run"][..], &["nk_true", "nk_ARX", "nk_BJ", "T_n_BJ"][..])
    } else {
        (
            &["subject", "condition", "run"][..],
            &[
                "nk_ARX",
                "nk_BJ",
                "T_n_BJ",
                "nk_ARX_first",
                "nk_ARX_last",
                "nk_BJ_first",
                "nk_BJ_last",
            ][..],
        )
    };
    let mut data = TableBuilder::new(texts, numbers);
    for condition in conditions {
        for subject in subjects(runs, condition) {
            for run in select(runs, subject, condition) {
                let found = &run.outcome;
                let [arx, bj] = found.nk.map(|nk| nk as f64);
                match &found.truth {
                    Some(truth) => data.add_row(&[subject, &run.key.run], &[truth.nk as f64, arx, bj, found.t_n_s]),
                    None => {
                        let [of_arx, of_bj] = found.nk_by_span.map(|spans| spans.map(|nk| nk as f64));
                        data.add_row(
                            &[subject, condition, &run.key.run],
                            &[arx, bj, found.t_n_s, of_arx[0], of_arx[1], of_bj[0], of_bj[1]],
                        );
                    }
                }
            }
        }
    }
    data.build(&item.title).into()
}

/// Table of the operators of the people in each condition, by estimator and span.
pub(super) fn operators(item: &Item, runs: &[EvaluatedRun], conditions: &[String]) -> ItemOutput {
    let mut data = TableBuilder::new(
        &["condition", "subject", "estimator", "span"],
        &["runs", "determined", "K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm"],
    );
    for condition in conditions {
        for subject in subjects(runs, condition) {
            let own = select(runs, subject, condition);
            for (estimator, method, is_batch) in [
                ("OLS", 0, true),
                ("PEM", 1, true),
                ("RLS", 0, false),
                ("RPEM", 1, false),
            ] {
                for (span, name) in ["first", "last"].into_iter().enumerate() {
                    let of_runs: Vec<[f64; 5]> = own
                        .iter()
                        .map(|run| match is_batch {
                            true => run.outcome.batch[method][span].operator,
                            false => final_medians(&run.outcome, method, span),
                        })
                        .collect();
                    let determined = of_runs.iter().filter(|of| of[0].is_finite()).count();
                    let share = determined as f64 / of_runs.len() as f64;
                    let [k_e, t_l, k_e_dot, omega, zeta] =
                        [0, 1, 2, 3, 4].map(|i| mean_and_median(of_runs.iter().map(|of| of[i]))[1]);
                    data.add_row(
                        &[condition, subject, estimator, name],
                        &[own.len() as f64, share, k_e, t_l, k_e_dot, omega, zeta],
                    );
                }
            }
        }
    }
    data.build(&item.title).into()
}

/// Returns the medians of a recursive estimate over the second half of a span.
fn final_medians(outcome: &RunOutcome, method: usize, span: usize) -> [f64; 5] {
    let (from_s, to_s) = outcome.spans_s[span];
    let course = &outcome.traces[method];
    let within: Vec<&[f64; 5]> = (course.times_s.iter().zip(&course.states))
        .filter(|(t, _)| (0.5 * (from_s + to_s)..to_s).contains(*t))
        .map(|(_, state)| &state.operator)
        .collect();
    [0, 1, 2, 3, 4].map(|i| mean_and_median(within.iter().map(|operator| operator[i]))[1])
}
