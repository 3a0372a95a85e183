//! Parameters of virtual people estimated by `adaptive`: within their errors, or reported as undetermined.
#![allow(clippy::unwrap_used)]

use hoid_model::uncertainty::Estimate;
use hoid_sim::people::{Person, Plant, Population, RemnantKind, Task};
use hoid_track::{Method, TrackOptions, Tracker};

const PERSON_COUNT: u64 = 45;
/// Times in s: in the first second of an estimate, during the trials from other starting points, and after them.
const TIMES_S: [f64; 3] = [2.0, 15.0, 30.0];

#[test]
fn poles_and_delay_are_within_their_errors() {
    let mut beyond = TIMES_S.map(|_| [0.0; 3]);
    let mut inside = TIMES_S.map(|_| [0.0; 3]);
    let mut people = 0.0;
    for number in 0..PERSON_COUNT {
        let (plant, kind) = (
            Plant::ALL[number as usize % 3],
            RemnantKind::ALL[number as usize / 3 % 5],
        );
        let person = Person::draw(&Population::default(), &Task::default(), plant, None, kind, 31, number).unwrap();
        let run = person.run(1).unwrap();
        let ts = run.record.sample_time();
        let operator = &run.state.operator;
        let Some((omega, zeta)) = operator.neuromuscular_parameters() else {
            continue;
        };
        people += 1.0;
        let mut tracker = Tracker::new(&TrackOptions::default_for(Method::adaptive(), 13), None, ts).unwrap();
        for k in 0..run.record.len() {
            tracker.step(run.record.input()[k], run.record.output()[k]);
            let t = run.record.time_s(k) - run.record.time_s(0);
            let Some(at) = TIMES_S.iter().position(|at| (t - at).abs() < 0.5 * ts.s()) else {
                continue;
            };
            let Ok(found) = tracker.operator() else { continue };
            let z = |e: Estimate, truth: f64| (e.value - truth).abs() / e.standard_error.unwrap();
            let all = [
                z(found.omega_nm_rad_s, omega),
                z(found.zeta_nm, zeta),
                z(found.tau_e_s, operator.tau_e_s()),
            ];
            for (i, z) in all.into_iter().enumerate() {
                beyond[at][i] += f64::from(z > 4.0);
                inside[at][i] += f64::from(z < 1.96);
            }
        }
    }
    println!("{people} people, beyond four errors {beyond:?}, within 1.96 {inside:?}");
    for (beyond, inside) in beyond.iter().zip(&inside) {
        for (beyond, inside) in beyond.iter().zip(inside) {
            assert!(*beyond <= 1.0, "{beyond} beyond four standard errors");
            assert!(*inside > 0.75 * people, "{inside} of {people} within 1.96");
        }
    }
}
