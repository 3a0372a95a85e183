//! A small sample of the study of the error bars of people: `cargo xtask slow people-coverage`.
#![allow(clippy::unwrap_used)]

// The study uses the other parts of this module.
#[allow(dead_code)]
#[path = "common/people_coverage/mod.rs"]
mod people_coverage;

use people_coverage::{
    fits::{Outcome, Variant, fit_person},
    tables::{Proportion, QUANTITIES, coverage, median, values_of_quantity},
};
use rayon::prelude::*;

const SEED: u64 = 2026;

fn given_form(excitation: bool) -> Variant {
    Variant {
        excitation,
        form_given: true,
    }
}

fn sample_outcomes(people: std::ops::Range<u64>, variant: Variant) -> Vec<Outcome> {
    people
        .into_par_iter()
        .flat_map_iter(|number| fit_person(SEED, number, &[variant]).unwrap())
        .collect()
}

#[test]
fn intervals_cover_the_truth_of_virtual_people() {
    // People 0 to 5 have only one or two runs each, and person 6 a few more, so the test is short.
    let all = sample_outcomes(0..7, given_form(true));
    let of: Vec<&Outcome> = all.iter().collect();
    let each = QUANTITIES.map(|name| coverage(&values_of_quantity(&of, name)));
    let share = Proportion {
        of: each.iter().map(|s| s.of).sum(),
        all: each.iter().map(|s| s.all).sum(),
    };
    assert!(all.iter().all(|o| o.found.is_ok()));
    // The expected share is 95 % of about fifty intervals; the nine intervals of a person are far from independent of
    // each other.
    assert!(share.all >= 40 && share.percent() >= 80.0, "{}", share.text());
    let off = median(all.iter().map(|o| o.found.as_ref().unwrap().response_error)).unwrap();
    assert!(off < 0.3, "{off}");
}

/// If the form is selected without lines, a wrong form must not appear to be the only one: either the true form has a
/// weight, or the intervals of determined quantities contain the true values.
#[test]
fn intervals_cover_the_truth_with_form_selection() {
    let variant = Variant {
        excitation: false,
        form_given: false,
    };
    let all = sample_outcomes(60_000..60_012, variant);
    let found: Vec<_> = all.iter().map(|o| o.found.as_ref().unwrap()).collect();
    let determined = found.iter().flat_map(|f| &f.quantities).filter(|q| q.determined);
    let held: Vec<bool> = determined.filter_map(|q| q.contains_truth()).collect();
    let share = Proportion::count(held.iter().copied());
    assert!(share.all >= 25 && share.percent() >= 88.0, "{}", share.text());
    let settled = |f: &people_coverage::fits::FitOutcome| !f.kinds.iter().any(|kind| kind == "form");
    let wrong = (found.iter().zip(&all)).filter(|(f, o)| f.form != o.true_form && settled(f));
    assert!(wrong.count() <= 2);
}

#[test]
fn samples_do_not_depend_on_the_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found: Vec<_> = pool
            .install(|| sample_outcomes(0..3, given_form(false)))
            .into_iter()
            .map(|o| o.found)
            .collect();
        format!("{found:?}")
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn shares_have_standard_errors() {
    let share = Proportion::count([true, true, true, false]);
    assert_eq!((share.of, share.all, share.percent()), (3, 4, 75.0));
    // A share of 100 % also has a standard error.
    assert!(Proportion { of: 100, all: 100 }.standard_error_percent() > 1.0);
    assert_eq!(Proportion::default().text(), "–");
    assert_eq!(median([3.0, f64::NAN, 1.0, 2.0]), Some(2.0));
}
