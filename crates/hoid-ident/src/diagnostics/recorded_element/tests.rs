use std::f64::consts::TAU;

use hoid_model::{Channel, SampleTime};

use super::*;
use crate::diagnostics::whitened::random_number;

const TS_S: f64 = 0.02;

/// Simulates a loop around `gain/(s(s + lag))`. The person has a gain, a lead, a delay of 0.2 s, and noise. The target
/// is a sum of seven sines, the disturbance a sum of seven other sines; the disturbance is recorded if `recorded`.
fn simulate_loop(gain: f64, lag: f64, late: usize, recorded: bool, seed: u64) -> Record {
    let n = 3000;
    let mut seed = seed;
    let decay = (-lag * TS_S).exp();
    let sines = |k: usize, odd: usize| -> f64 {
        (0..7)
            .map(|i| (TAU * (2 * (3 * i + 2) + odd) as f64 * k as f64 / n as f64 + (i * i) as f64).sin())
            .sum()
    };
    let (mut position, mut rate, mut noise) = (0.0, 0.0, 0.0);
    let names = ["e", "u", "r", "d"];
    let mut signals: [Vec<f64>; 4] = Default::default();
    for k in 0..n {
        let (r, d) = (sines(k, 0), 0.3 * sines(k, 1));
        let e = r - position;
        noise = 0.9 * noise + 0.3 * random_number(&mut seed);
        let past = |lag: usize| k.checked_sub(lag).map_or(0.0, |k| signals[0][k]);
        let u = (12.0 * past(10) - 10.5 * past(11)) / 90.0 + 0.05 * noise;
        for (signal, value) in signals.iter_mut().zip([e, u, r, d]) {
            signal.push(value);
        }
        // These steps are exact for a held input: w' = -lag w + gain v, y' = w.
        let v = gain
            * k.checked_sub(late)
                .map_or(0.0, |k| signals[1][k] + 0.02 * signals[3][k]);
        let steady = v / lag;
        position += steady * TS_S + (rate - steady) * (1.0 - decay) / lag;
        rate = steady + (rate - steady) * decay;
    }
    let mut all = names
        .into_iter()
        .zip(signals)
        .map(|(name, values)| Channel::new(name, "", values));
    let (e, u) = (all.next().unwrap(), all.next().unwrap());
    let record = Record::new(SampleTime::new(TS_S).unwrap(), e, u).unwrap();
    all.take(if recorded { 2 } else { 1 })
        .fold(record, |record, channel| record.with_channel(channel).unwrap())
}

fn element(gain: f64, lag: f64) -> ContinuousTransferFunction {
    ContinuousTransferFunction::new(&[gain], &[1.0, lag, 0.0]).unwrap()
}

#[test]
fn element_of_the_loop_is_found_and_a_wrong_one_rejected() {
    for seed in 0..3 {
        let record = [simulate_loop(90.0, 6.0, 0, true, seed)];
        for given in [
            element(90.0, 6.0),
            element(45.0, 6.0),
            element(30.0, 0.2),
            element(-90.0, 6.0),
        ] {
            let found = recorded_element(&record, &given, None).unwrap();
            assert!(found.unexplained_share < 1e-4, "{found:?}");
            assert_eq!(found.element, element(90.0, 6.0), "{found:?}");
            assert_eq!(found.matches_given(), given == element(90.0, 6.0), "{found:?}");
            assert_eq!(found.finding(&given).is_none(), found.matches_given());
        }
    }
    // A given element of another order, an integrator alone, does not match.
    let integrator = ContinuousTransferFunction::new(&[15.0], &[1.0, 0.0]).unwrap();
    assert!(
        !recorded_element(&[simulate_loop(90.0, 6.0, 0, true, 1)], &integrator, None)
            .unwrap()
            .matches_given()
    );
}

#[test]
fn records_with_different_elements_give_no_element() {
    let records = [
        simulate_loop(30.0, 0.2, 0, true, 1),
        simulate_loop(30.0, 0.2, 0, true, 2),
    ];
    let found = recorded_element(&records, &element(30.0, 0.2), Some("r")).unwrap();
    assert!(
        found.matches_given() && found.element == element(30.0, 0.2),
        "{found:?}"
    );
    // No single element explains the signals of two records with different elements.
    let two = [
        simulate_loop(90.0, 6.0, 0, true, 1),
        simulate_loop(30.0, 0.2, 0, true, 2),
    ];
    assert_eq!(recorded_element(&two, &element(90.0, 6.0), None), None);
}

#[test]
fn delay_of_the_machine_is_found_with_its_element() {
    let record = [simulate_loop(60.0, 6.0, 5, true, 4)];
    let found = recorded_element(&record, &element(60.0, 6.0), None).unwrap();
    assert!(
        (found.delay_s - 0.1).abs() < 0.003 && found.matches_given(),
        "{found:?}"
    );
    let message = found.finding(&element(60.0, 6.0)).unwrap().message;
    assert!(
        message.starts_with("the recorded element is 60/(s^2 + 6s) with an additional delay of 100 ms:"),
        "{message}"
    );
    let given = element(60.0, 6.0).with_delay(0.1).unwrap();
    assert_eq!(recorded_element(&record, &given, None).unwrap().finding(&given), None);
    // A shift of one sample can be due to the recorder.
    let record = [simulate_loop(60.0, 6.0, 1, true, 4)];
    assert_eq!(
        recorded_element(&record, &element(60.0, 6.0), None)
            .unwrap()
            .finding(&element(60.0, 6.0)),
        None
    );
}

#[test]
fn missing_or_short_signals_give_no_element() {
    // The person responds to the disturbance, so u is not independent of it.
    let record = simulate_loop(90.0, 6.0, 0, false, 1);
    assert_eq!(recorded_element(&[record], &element(45.0, 6.0), None), None);
    let record = simulate_loop(90.0, 6.0, 0, true, 1);
    let short = record.span(0.0, 6.0).unwrap();
    assert_eq!(recorded_element(&[short], &element(90.0, 6.0), None), None);
    let rests = record.map_signals(|values| values.fill(0.0)).unwrap();
    assert_eq!(recorded_element(&[rests], &element(90.0, 6.0), None), None);
    assert_eq!(recorded_element(&[], &element(90.0, 6.0), None), None);
}
