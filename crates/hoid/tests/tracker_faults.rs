//! Faults in streams: a sample of the study `cargo xtask slow tracker-faults`, with seeds other than those with which
//! the limits of the guard were tuned.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "common/tracker_faults/mod.rs"]
mod tracker_faults;

use hoid::{
    prelude::*,
    track::{Method, TrackOptions},
};
use tracker_faults::{Effect, Fault, Reference, Run, Signal};

/// Returns runs in which the person does not change, and the trackers over these runs.
fn references(method: &Method, seeds: std::ops::Range<u64>, seconds: f64) -> Vec<(Run, Reference)> {
    seeds
        .map(|seed| {
            let remnant_order = 1 + (seed % 3) as usize;
            let run = Run::new(Condition::C1, remnant_order, seed, seconds);
            let orders = method.default_orders(29);
            let nd = orders.nd.max(remnant_order);
            let options = TrackOptions::new(method.clone(), method.default_structure(), Orders { nd, ..orders });
            let reference = Reference::new(&run, &options.with(&[("guard", "yes")]).unwrap());
            (run, reference)
        })
        .collect()
}

fn effects(references: &[(Run, Reference)], fault: &Fault, at_s: f64) -> Vec<Effect> {
    let of = |(run, reference): &(Run, Reference)| reference.effect(run, fault, at_s);
    references.iter().map(of).collect()
}

/// The specified limit is half a standard error.
#[test]
fn outlier_moves_no_parameter_by_half_a_standard_error() {
    use Signal::{E, U};
    for method in [hoid::survey::physical(), hoid::survey::multiple_model(), Method::rpem()] {
        let references = references(&method, 70..73, 120.0);
        for (signal, size, seconds, at_s) in [
            (E, 7.0, 0.0, 61.37),
            (E, 70.0, 0.05, 47.11),
            (E, -700.0, 0.1, 83.92),
            (U, -6.0, 0.0, 52.49),
            (U, 60.0, 0.05, 77.73),
            (U, -3000.0, 0.1, 44.04),
        ] {
            let fault = Fault::Outlier { signal, size, seconds };
            for effect in effects(&references, &fault, at_s) {
                println!("{method}: {fault}: {effect:?}");
                assert!(
                    effect.shift < 0.5 && effect.told && effect.held > 0,
                    "{method}: {fault}: {effect:?}"
                );
            }
        }
    }
}

#[test]
fn estimate_recovers_after_a_faulty_span() {
    for method in [hoid::survey::physical(), hoid::survey::multiple_model()] {
        let references = references(&method, 80..82, 200.0);
        for (fault, at_s) in [
            (
                Fault::Scaled {
                    factor: 1e6,
                    seconds: 50.0,
                },
                71.3,
            ),
            (Fault::Swapped { seconds: 80.0 }, 66.6),
            (Fault::Silence { seconds: 300.0 }, 93.1),
            (Fault::NoisySilence { seconds: 300.0 }, 93.1),
            (Fault::FrozenBoth { seconds: 30.0 }, 88.8),
            (Fault::MissingBoth { seconds: 40.0 }, 59.0),
        ] {
            for effect in effects(&references, &fault, at_s) {
                println!("{method}: {fault}: {effect:?}");
                let soon = effect.recovery_s.is_some_and(|s| s < 15.0);
                assert!(soon && effect.told, "{method}: {fault}: {effect:?}");
                assert!(
                    effect.restarts > 0 || effect.skipped > 0,
                    "{method}: {fault}: {effect:?}"
                );
            }
        }
    }
}

/// At most one sample in 1e5 is held back.
#[test]
fn clean_samples_are_not_held_back() {
    let (mut held, mut samples) = (0, 0);
    for (run, reference) in references(&hoid::survey::physical(), 90..99, 300.0) {
        assert_eq!(reference.restarts, 0, "{:?}", reference.events);
        held += reference.held;
        samples += run.e.len() as u64;
    }
    println!("{held} of {samples}");
    assert!(held * 100_000 <= samples, "{held} of {samples}");
}
