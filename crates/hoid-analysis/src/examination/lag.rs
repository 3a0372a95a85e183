//! Number of samples by which the control was recorded later than the error. With a known controlled element it follows
//! from the delay between u and e in the recorded loop ([`recorded_element`]).

use hoid_ident::diagnostics::recorded_element;
use hoid_model::numbers::count_with_noun;
use hoid_model::{ContinuousTransferFunction, Record};

/// Lag of the recorded control.
#[derive(Debug, Clone, PartialEq)]
pub struct Lag {
    /// Lag in samples.
    pub samples: f64,
    /// Lag in s.
    pub seconds: f64,
    /// Description of the evidence.
    pub evidence: String,
}

/// Returns the lag of the control, or the reason why it is unknown: a signal of the loop was not recorded, or the loop
/// contains another controlled element.
pub(super) fn control_lag(
    record: &Record,
    excitation: Option<&str>,
    element: &ContinuousTransferFunction,
) -> Result<Lag, String> {
    let Some(found) = recorded_element(std::slice::from_ref(record), element, excitation) else {
        return Err(
            "no single controlled element explains e from u: a target or a disturbance was not recorded, the record \
             is short, or the element changes"
                .to_owned(),
        );
    };
    if !found.matches_given() {
        return Err(found
            .finding(element)
            .map_or_else(String::new, |finding| finding.message));
    }
    let ts_s = record.sample_time().s();
    // Adding 0.0 converts -0.0 to 0.0.
    let samples = (-found.delay_s / ts_s).round() + 0.0;
    Ok(Lag {
        samples,
        seconds: samples * ts_s,
        evidence: format!(
            "e follows from u through the controlled element if the control is {} late; {:.2} % of the power is \
             unexplained",
            count_with_noun(samples, "sample"),
            100.0 * found.unexplained_share
        ),
    })
}

#[cfg(test)]
mod tests {
    use hoid_model::{Channel, SampleTime};

    use super::*;

    /// Returns a loop around `y = (u + d) / s` with noise in u, which is recorded `late` samples late.
    fn integrator_loop(late: usize) -> Record {
        let (ts, n) = (0.02_f64, 2000_usize);
        let (mut y, mut noise, mut state) = (0.0, 0.0, 7_u64);
        let mut all: [Vec<f64>; 3] = Default::default();
        for k in 0..n {
            let t = ts * k as f64;
            let d = (0.7 * t).sin() + (2.1 * t + 1.0).sin() + (4.3 * t + 2.0).sin();
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            noise = 0.95 * noise + 0.3 * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
            let u = 2.0 * k.checked_sub(10).map_or(0.0, |k| all[0][k]) + noise;
            for (signal, value) in all.iter_mut().zip([-y, u, d]) {
                signal.push(value);
            }
            y += ts * (u + d);
        }
        let [e, u, d] = all;
        let recorded = (0..n).map(|k| k.checked_sub(late).map_or(0.0, |k| u[k])).collect();
        let channel = |name: &str, values: Vec<f64>| Channel::new(name, "", values);
        Record::new(SampleTime::new(ts).unwrap(), channel("e", e), channel("u", recorded))
            .unwrap()
            .with_channel(channel("d", d))
            .unwrap()
    }

    #[test]
    fn recording_lag_of_the_control_is_found() {
        let element: ContinuousTransferFunction = "1/s".parse().unwrap();
        for late in [0, 1, 2] {
            let lag = control_lag(&integrator_loop(late), Some("d"), &element).unwrap();
            assert_eq!(lag.samples, late as f64, "{}", lag.evidence);
        }
    }

    #[test]
    fn wrong_element_and_missing_signal_are_reported() {
        let record = integrator_loop(1);
        let why = control_lag(&record, None, &"1/(s^2+0.01s)".parse().unwrap()).unwrap_err();
        assert!(why.contains("the recorded element is 1/s"), "{why}");
        let without = Record::new(
            record.sample_time(),
            record.input_channel().unwrap().clone(),
            record.output_channel().clone(),
        );
        let why = control_lag(&without.unwrap(), None, &"1/s".parse().unwrap()).unwrap_err();
        assert!(why.contains("was not recorded"), "{why}");
    }
}
