//! Tests whether the output of a record is the output of the machine instead of the control.
//!
//! The error of a tracking task is `e = r - y`. If u is the output y of the machine by mistake, `u = r - e` at every
//! sample, up to units and signs: a regression of u on e and a recorded target r leaves no residual, and r contributes
//! to u. A control signal of a person follows r and e with a delay and contains a remnant.

use hoid_model::{Finding, Record};
use hoid_numerics::statistics::mean;

use super::other_inputs::TARGET_CHANNELS;

/// Largest RMS of the residual relative to the RMS of u: files may round their values.
const MAX_RESIDUAL_SHARE: f64 = 1e-3;
/// Smallest RMS of the part of u that is proportional to the target, relative to the RMS of u.
const MIN_TARGET_SHARE: f64 = 0.05;

/// Returns a warning if u is a combination of e and a recorded target at every sample of a record.
pub fn machine_output_finding(records: &[Record]) -> Option<Finding> {
    let target = |record: &Record| {
        let is_cause = |name: &&str| record.other_channel(name).is_some_and(|r| is_combination(record, r));
        TARGET_CHANNELS.into_iter().find(is_cause)
    };
    let (record, name) = records.iter().find_map(|record| Some((record, target(record)?)))?;
    let output = &record.output_channel().name;
    Some(Finding::warning(
        "machine-output",
        format!(
            "{output} is a combination of the error and {name} at each sample, as the output of the machine is, \
             expected the control of a person: check --output"
        ),
    ))
}

/// True if `u = a e + b r + c` at every sample, with a contribution of r.
fn is_combination(record: &Record, r: &[f64]) -> bool {
    let centred = |x: &[f64]| -> Vec<f64> {
        let level = mean(x);
        x.iter().map(|v| v - level).collect()
    };
    let [e, r, u] = [record.input(), r, record.output()].map(centred);
    let sum = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let [ee, er, rr, eu, ru, uu] = [(&e, &e), (&e, &r), (&r, &r), (&e, &u), (&r, &u), (&u, &u)].map(|(x, y)| sum(x, y));
    let determinant = ee * rr - er * er;
    // Negated so that NaN and constant signals give no finding.
    if !(determinant > 1e-9 * ee * rr && uu > 0.0) {
        return false;
    }
    let (a, b) = ((rr * eu - er * ru) / determinant, (ee * ru - er * eu) / determinant);
    let residual = e.iter().zip(&r).zip(&u).map(|((e, r), u)| (u - a * e - b * r).powi(2));
    residual.sum::<f64>() < MAX_RESIDUAL_SHARE.powi(2) * uu && b * b * rr > MIN_TARGET_SHARE.powi(2) * uu
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::{Channel, SampleTime};

    use super::*;

    fn record(u: impl Fn(f64, f64, usize) -> f64) -> Record {
        let r: Vec<f64> = (0..2000)
            .map(|k| (0.011 * k as f64).sin() + (0.037 * k as f64).cos())
            .collect();
        let e: Vec<f64> = (0..2000)
            .map(|k| (0.011 * k as f64 + 0.8).sin() - 0.3 * (0.05 * k as f64).sin())
            .collect();
        let u: Vec<f64> = (0..2000).map(|k| u(e[k], r[k], k)).collect();
        Record::new(
            SampleTime::new(0.01).unwrap(),
            Channel::new("e", "deg", e),
            Channel::new("u", "deg", u),
        )
        .unwrap()
        .with_channel(Channel::new("r", "deg", r))
        .unwrap()
    }

    #[test]
    fn output_of_the_machine_is_found_in_any_unit() {
        let rounded = |x: f64| (x * 1e4).round() / 1e4;
        for record in [record(|e, r, _| r - e), record(|e, r, _| rounded(57.3 * (e - r) + 2.0))] {
            let found = machine_output_finding(&[record]).unwrap();
            assert!(
                found.message.contains("u is a combination of the error and r"),
                "{}",
                found.message
            );
        }
    }

    #[test]
    fn control_and_constant_signals_are_no_output_of_the_machine() {
        let noisy = record(|e, r, k| r - e + 0.01 * (1.7 * k as f64).sin());
        let gain = record(|e, _, _| 2.0 * e);
        let constant = record(|_, _, _| 1.0);
        assert_eq!(machine_output_finding(&[noisy, gain, constant]), None);
    }
}
