//! Estimates of `adaptive` for virtual people in their first seconds: available from the second second on, with valid
//! error bands.
#![allow(clippy::unwrap_used)]

use hoid_model::{Complex64, ContinuousTransferFunction, FamilyOperator, SampleTime};
use hoid_sim::people::{Person, Plant, Population, RemnantKind, Task};
use hoid_track::{Method, TrackOptions, Tracker};

/// Seconds at which the bands are counted, and frequencies in rad/s.
const TIMES_S: [f64; 5] = [1.5, 3.0, 5.5, 8.0, 20.0];
const FREQUENCIES_RAD_S: [f64; 3] = [1.0, 2.5, 4.0];

fn held_response(operator: &FamilyOperator, omega: f64, ts: SampleTime) -> Complex64 {
    let half = 0.5 * omega * ts.s();
    operator.response(omega) * Complex64::from_polar(half.sin() / half, -half)
}

/// Numbers of estimates whose gain and phase are within 1.96 standard errors of the truth.
struct CoverageCount {
    inside: f64,
    all: f64,
}

#[test]
fn bands_have_nominal_coverage_in_the_first_seconds() {
    let mut counts = TIMES_S.map(|_| CoverageCount { inside: 0.0, all: 0.0 });
    let mut loops = TIMES_S.map(|_| CoverageCount { inside: 0.0, all: 0.0 });
    for number in 0..45 {
        let (plant, kind) = (
            Plant::ALL[number as usize % 3],
            RemnantKind::ALL[number as usize / 3 % 5],
        );
        let person = Person::draw(&Population::default(), &Task::default(), plant, None, kind, 21, number).unwrap();
        let run = person.run(1).unwrap();
        let ts = run.record.sample_time();
        let element: ContinuousTransferFunction = plant.text().parse().unwrap();
        let options = TrackOptions {
            controlled_element: Some(element),
            ..TrackOptions::default_for(Method::adaptive(), 13)
        };
        let mut tracker = Tracker::new(&options, None, ts).unwrap();
        for k in 0..run.record.len() {
            tracker.step(run.record.input()[k], run.record.output()[k]);
            let t = run.record.time_s(k) - run.record.time_s(0);
            let Some(i) = TIMES_S.iter().position(|at| (t - at).abs() < 0.5 * ts.s()) else {
                continue;
            };
            for omega in FREQUENCIES_RAD_S {
                let response = tracker.response(omega).unwrap();
                let truth = held_response(&run.state.operator, omega, ts);
                let [re, im] = response.value;
                let off = (Complex64::new(re, im) / truth).arg().to_degrees();
                let gain = response.gain_db().value - 20.0 * truth.norm().log10();
                for (error, band) in [(gain, response.gain_db()), (off, response.phase_deg())] {
                    counts[i].all += 1.0;
                    counts[i].inside += f64::from(error.abs() < 1.96 * band.standard_error.unwrap());
                }
            }
            if let Some(Ok(found)) = tracker.open_loop() {
                let crossover = found.crossover_rad_s;
                let margin = found.phase_margin_deg;
                for (value, truth) in [(crossover, person.crossover_rad_s), (margin, person.phase_margin_deg)] {
                    loops[i].all += 1.0;
                    let error = (value.value - truth).abs();
                    loops[i].inside += f64::from(error < 1.96 * value.standard_error.unwrap());
                }
            }
        }
    }
    let shares = |of: &[CoverageCount; 5]| of.each_ref().map(|c| c.inside / c.all);
    println!(
        "response {:.2?}, loop {:.2?} of {:?}",
        shares(&counts),
        shares(&loops),
        loops.each_ref().map(|c| c.all)
    );
    // A share of 270 values in correlated groups of about six has a standard error of 3 to 4 %.
    for (share, at) in shares(&counts).into_iter().zip(TIMES_S) {
        assert!((0.85..=1.0).contains(&share), "{at} s: {share}");
    }
    // Before 8 s few estimates have a determined crossover.
    for (count, at) in loops.iter().zip(TIMES_S).skip(3) {
        assert!(count.all >= 30.0, "{at} s: {}", count.all);
        let share = count.inside / count.all;
        assert!((0.8..=1.0).contains(&share), "{at} s: {share}");
    }
}
