//! Number of samples by which the control was recorded later than the output of the controlled element.
//!
//! At the lines of the excitation the output is `Y = H (U + D)` if the disturbance enters with the control, or
//! `Y = H U + D` if it is added to the output. A staircase control reaches the output half a sample late, and one that
//! was recorded N samples late is moved back by them:
//!
//! ```text
//! Y - b D = g H exp(-j omega Ts/2) (U exp(j omega N Ts) + a D)
//! ```
//!
//! The integer N and the case (a, b) that leave the smallest share of the power of the output unexplained by a real
//! gain g are chosen; nothing is reported if none explains it.

use std::f64::consts::TAU;

use hoid_model::{Complex64, ContinuousTransferFunction, Record};

use super::periods::Periods;

/// Common names of the output of the controlled element.
const OUTPUTS: [&str; 4] = ["y", "output", "position", "x"];
/// Largest share of the power of the output that a case may leave unexplained.
const UNEXPLAINED: f64 = 0.02;
/// Possible lags of a recorder in samples: the delay of a person is longer.
const SAMPLES: [i32; 8] = [-2, -1, 0, 1, 2, 3, 4, 5];

/// Lag of the recorded control.
#[derive(Debug, Clone, PartialEq)]
pub struct Lag {
    /// In samples.
    pub samples: f64,
    /// In s.
    pub seconds: f64,
    /// Description of how it was found.
    pub words: String,
}

/// Points at which a disturbance enters: name, and its share at the control and at the output.
const CASES: [(&str, f64, f64); 5] = [
    ("no disturbance", 0.0, 0.0),
    ("the excitation added to the control", 1.0, 0.0),
    ("the excitation taken from the control", -1.0, 0.0),
    ("the excitation added to the output", 0.0, 1.0),
    ("the excitation taken from the output", 0.0, -1.0),
];

/// Returns the lag of the control, from the controlled element, or the reason why it is unknown: no column contains
/// the output of the element, or no case explains it.
pub(super) fn of_control(
    record: &Record,
    found: &Periods,
    element: &ContinuousTransferFunction,
) -> Result<Lag, String> {
    let Some(name) = OUTPUTS.into_iter().find(|name| record.channel(name).is_some()) else {
        return Err(format!(
            "no column holds the output of the controlled element; it would be called {}",
            OUTPUTS.join(", ")
        ));
    };
    let unknown = || format!("the lines of {name} and the control cannot be compared");
    let (case, late, left) = best(record, found, element, name).ok_or_else(unknown)?;
    if left >= UNEXPLAINED {
        return Err(format!(
            "{name} does not follow the controlled element: {:.0} % of its power at the lines is left; look for its sign, its units, and \
             the column of the disturbance",
            100.0 * left
        ));
    }
    Ok(Lag {
        samples: f64::from(late),
        seconds: f64::from(late) * record.sample_time().s(),
        words: format!(
            "at the lines {name} follows the controlled element with {case}, the control {late} samples late; {:.2} % of its power is left",
            100.0 * left
        ),
    })
}

/// Returns the case and the number of samples that explain most of the output, and the unexplained share of its power.
fn best(
    record: &Record,
    found: &Periods,
    element: &ContinuousTransferFunction,
    name: &str,
) -> Option<(&'static str, i32, f64)> {
    let span = record.span(found.span_s.0, found.span_s.1).ok()?;
    let at_lines = |values: &[f64]| coefficients(values, found);
    let (y, u) = (at_lines(span.channel(name)?), at_lines(span.output()));
    let d = at_lines(span.channel(&found.channel)?);
    let omega = found.excitation.omega_rad_s();
    let ts = span.sample_time().s();
    let tried = CASES
        .iter()
        .flat_map(|case| SAMPLES.map(move |late| (case, late)))
        .filter_map(|(case, late)| {
            let (name, at_control, at_output) = *case;
            let turn = |k: usize, samples: f64| Complex64::from_polar(1.0, omega[k] * ts * samples);
            let input: Vec<Complex64> = (0..omega.len())
                .map(|k| {
                    element.response(omega[k]) * turn(k, -0.5) * (u[k] * turn(k, f64::from(late)) + d[k] * at_control)
                })
                .collect();
            let output: Vec<Complex64> = (0..omega.len()).map(|k| y[k] - d[k] * at_output).collect();
            Some((name, late, unexplained(&input, &output)?))
        });
    tried.min_by(|a, b| a.2.total_cmp(&b.2))
}

/// Fourier coefficients at the lines.
fn coefficients(values: &[f64], found: &Periods) -> Vec<Complex64> {
    let n = values.len() as f64;
    let periods = ((found.span_s.1 - found.span_s.0) / found.period_s).round();
    let of = |harmonic: &usize| {
        let step = TAU * *harmonic as f64 * periods / n;
        let sum: Complex64 = values
            .iter()
            .enumerate()
            .map(|(k, v)| Complex64::from_polar(*v, -step * k as f64))
            .sum();
        sum / n
    };
    found.excitation.harmonics().iter().map(of).collect()
}

/// Share of the power of the output that the input times a real gain leaves unexplained.
fn unexplained(input: &[Complex64], output: &[Complex64]) -> Option<f64> {
    let cross: f64 = input.iter().zip(output).map(|(x, y)| (x.conj() * y).re).sum();
    let power = |all: &[Complex64]| all.iter().map(|x| x.norm_sqr()).sum::<f64>();
    let gain = cross / power(input);
    let left: f64 = input.iter().zip(output).map(|(x, y)| (y - x * gain).norm_sqr()).sum();
    let share = left / power(output);
    share.is_finite().then_some(share)
}

#[cfg(test)]
mod tests {
    use hoid_ident::frequency::Excitation;
    use hoid_model::{Channel, SampleTime};

    use super::*;

    /// y = (u + d) / s for a staircase u, with u recorded some samples late.
    fn integrated(late: usize) -> (Record, Periods) {
        let (ts, n) = (0.02_f64, 1000_usize);
        let harmonics = [1_usize, 3, 7, 12];
        let sum = |k: usize, shift: f64| {
            let of = |h: &usize| (TAU * *h as f64 * k as f64 / 500.0 + shift * *h as f64).sin();
            harmonics.iter().map(of).sum::<f64>()
        };
        let (u, d): (Vec<f64>, Vec<f64>) = (0..n).map(|k| (sum(k, 1.3), sum(k, 0.2))).unzip();
        let mut y = vec![0.0; n];
        // Over whole periods the sum of both is 0: y is periodic too.
        for k in 1..n {
            y[k] = y[k - 1] + ts * (u[k - 1] + d[k - 1]);
        }
        let recorded: Vec<f64> = (0..n).map(|k| u[(k + n - late) % n]).collect();
        let channel = |name: &str, values: Vec<f64>| Channel::new(name, "", values);
        let record = Record::new(
            SampleTime::new(ts).unwrap(),
            channel("e", y.clone()),
            channel("u", recorded),
        )
        .unwrap()
        .with_channel(channel("y", y))
        .unwrap()
        .with_channel(channel("d", d))
        .unwrap();
        let found = Periods {
            channel: "d".to_owned(),
            period_s: 10.0,
            span_s: (0.0, 20.0),
            excitation: Excitation::of_harmonics(&harmonics, 10.0).unwrap(),
            words: String::new(),
        };
        (record, found)
    }

    #[test]
    fn a_control_that_was_recorded_late_is_found() {
        let element: ContinuousTransferFunction = "1/s".parse().unwrap();
        for late in [0, 1, 2] {
            let (record, found) = integrated(late);
            let lag = of_control(&record, &found, &element).unwrap();
            assert_eq!(lag.samples, late as f64, "{}", lag.words);
            assert!(lag.words.contains("added to the control"), "{}", lag.words);
        }
    }

    #[test]
    fn another_element_explains_nothing() {
        let (record, found) = integrated(1);
        let element: ContinuousTransferFunction = "1/(s^2+0.01s)".parse().unwrap();
        let why = of_control(&record, &found, &element).unwrap_err();
        assert!(why.contains("y does not follow"), "{why}");
        let without = Record::new(
            record.sample_time(),
            record.input_channel().unwrap().clone(),
            record.output_channel().clone(),
        );
        let why = of_control(&without.unwrap(), &found, &element).unwrap_err();
        assert!(why.contains("no column holds"), "{why}");
    }
}
