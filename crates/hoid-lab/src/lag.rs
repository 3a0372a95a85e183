//! Estimation of the lag of the operator during a run.
//!
//! The recursion of the tracker assumes a fixed lag and therefore gives no information about T_I. Every 10 s, on a
//! separate thread, the samples of the measurement since the last declared change are therefore fitted as in
//! `hoid identify`: all forms of the operator are fitted, held-out data select the form, and its T_I is used if the
//! data determine it ([`hoid_analysis::identify`]). If the selected form has no lag, or if the interval of T_I includes
//! a pure integration, T_I is not determined and no value is reported.
//!
//! For an operator without a lag, a form with a short lag and a longer lead is sometimes selected: in 13 of 60 runs of
//! C1 and 2 of 20 runs of C2 (30 and 80 s long), with T_I up to 6.3 standard errors from zero. A true lag of 1 s is at
//! least 25 standard errors from zero. A lag is therefore reported only if it exceeds ten standard errors.

use std::{
    sync::mpsc::{Receiver, Sender, channel},
    thread,
};

use hoid_model::{Channel, Record, SampleTime, uncertainty::Estimate};
use hoid_track::Sample;

/// Minimum length of the data for a fit, and time between fits, s.
const MIN_SPAN_S: f64 = 40.0;
const FIT_INTERVAL_S: f64 = 10.0;
/// Minimum ratio of a reported lag to its standard error.
const MIN_SIGNIFICANCE: f64 = 10.0;

/// Result of the latest estimation of the lag.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Lag {
    /// No fit has been made yet.
    #[default]
    Waiting,
    /// The data do not determine the lag.
    NotDetermined,
    /// Estimate of T_I, s.
    Known(Estimate),
}

impl Lag {
    /// Estimates the lag from a record of an operator that does not change.
    pub fn of(record: Record) -> Self {
        let found = hoid_analysis::identify(&[record]);
        let parameter = found.ok().and_then(|found| {
            let all = &found.fit.operator(0).parameters;
            all.iter().find(|p| p.name == "T_I" && p.determined).cloned()
        });
        match parameter.map(|p| (p.value, p.standard_error)) {
            Some((value, Some(error))) if value.is_finite() && value > MIN_SIGNIFICANCE * error => {
                Self::Known(Estimate {
                    value,
                    standard_error: Some(error),
                })
            }
            _ => Self::NotDetermined,
        }
    }
}

/// Samples to fit, and the time of the first sample, s.
struct FitSamples {
    from_s: f64,
    record: Record,
}

/// Repeated fits of the lag during one run.
pub struct LagFits {
    spans: Sender<FitSamples>,
    found: Receiver<(f64, Lag)>,
    e: Vec<f64>,
    u: Vec<f64>,
    ts: SampleTime,
    /// Time of the first sample in memory, s.
    from_s: f64,
    /// Number of samples at the last fit.
    samples_at_fit: usize,
    /// True while a fit is in progress.
    busy: bool,
    last: Lag,
}

impl LagFits {
    /// Starts the thread, which ends when this value is dropped.
    pub fn new(ts: SampleTime) -> Self {
        let (spans, waiting) = channel::<FitSamples>();
        let (tell, found) = channel();
        thread::spawn(move || {
            while let Ok(span) = waiting.recv() {
                if tell.send((span.from_s, Lag::of(span.record))).is_err() {
                    break;
                }
            }
        });
        Self {
            spans,
            found,
            e: Vec::new(),
            u: Vec::new(),
            ts,
            from_s: 0.0,
            samples_at_fit: 0,
            busy: false,
            last: Lag::Waiting,
        }
    }

    /// Adds a sample of the measurement.
    pub fn push(&mut self, sample: Sample) {
        self.e.push(sample.e);
        self.u.push(sample.u);
    }

    /// Discards the samples before a change in the operator at the time `at_s`.
    pub fn discard_before(&mut self, at_s: f64) {
        let past = ((at_s - self.from_s) / self.ts.s())
            .ceil()
            .clamp(0.0, self.e.len() as f64) as usize;
        self.e.drain(..past);
        self.u.drain(..past);
        self.from_s += past as f64 * self.ts.s();
        (self.samples_at_fit, self.last) = (0, Lag::Waiting);
    }

    /// Returns the lag from the last completed fit, and starts the next fit if it is due.
    pub fn lag(&mut self) -> Lag {
        while let Ok((from_s, lag)) = self.found.try_recv() {
            self.busy = false;
            // The result of a fit to samples before a change is discarded.
            if from_s == self.from_s {
                self.last = lag;
            }
        }
        let samples = |seconds: f64| (seconds / self.ts.s()).round() as usize;
        let due = samples(MIN_SPAN_S).max(self.samples_at_fit.saturating_add(samples(FIT_INTERVAL_S)));
        if !self.busy
            && self.e.len() >= due
            && let Ok(record) = Record::new(
                self.ts,
                Channel::new("e", "", self.e.clone()),
                Channel::new("u", "", self.u.clone()),
            )
        {
            self.samples_at_fit = self.e.len();
            let from_s = self.from_s;
            self.busy = self.spans.send(FitSamples { from_s, record }).is_ok();
        }
        self.last
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::{FamilyOperator, Form, forcing::ForcingFunction, zoh_system::ZohSystem};
    use hoid_sim::RunSeed;

    use super::*;
    use crate::live::tests::c1_samples;

    const TS: SampleTime = SampleTime::AT_100_HZ;
    const LAG_S: f64 = 1.0;

    fn noise(samples: usize, seed: u64) -> Vec<f64> {
        let seed = RunSeed {
            seed,
            ..RunSeed::default()
        };
        seed.white_noise(samples)
    }

    /// Returns e and u of a gain of .4 with a lag, with the element 4/s and a first-order remnant.
    fn lagged_samples(seconds: f64, seed: u64) -> Vec<Sample> {
        let n = (seconds / TS.s()) as usize;
        let operator = FamilyOperator::new(Form::Lag, false, &[0.4 / LAG_S, 1.0 / LAG_S, 0.18]).unwrap();
        let transfer = operator.transfer_function().unwrap();
        let held = ZohSystem::new(transfer.num(), transfer.den(), 0.0, TS).unwrap();
        let (a, b, c) = (
            held.transition_matrix()[0],
            held.input_vector()[0],
            held.output_row()[0],
        );
        let target = ForcingFunction::reference().samples(0.0, TS, n);
        let (mut x, mut y, mut v) = (0.0, 0.0, 0.0);
        let mut answers = vec![0.0; 18];
        let decay = (-TS.s() / 0.06).exp();
        (target.iter().zip(noise(n, seed)))
            .map(|(f, white)| {
                let e = f - y;
                answers.push(c * x);
                x = a * x + b * e;
                v = decay * v + 0.02 * white;
                let u = answers[answers.len() - 19] + v;
                y += 4.0 * TS.s() * u;
                Sample { e, u, reference: None }
            })
            .collect()
    }

    fn record(samples: &[Sample]) -> Record {
        let all = |of: fn(&Sample) -> f64| samples.iter().map(of).collect::<Vec<f64>>();
        Record::new(
            TS,
            Channel::new("e", "", all(|s| s.e)),
            Channel::new("u", "", all(|s| s.u)),
        )
        .unwrap()
    }

    #[test]
    fn lag_is_found_in_sufficient_data() {
        let Lag::Known(found) = Lag::of(record(&lagged_samples(60.0, 1))) else {
            panic!("60 s of a lag of {LAG_S} s carry no information about it");
        };
        let error = found.standard_error.unwrap();
        assert!((found.value - LAG_S).abs() < 3.0 * error && error < 0.3, "{found}");
    }

    #[test]
    fn no_lag_is_reported_without_one() {
        // Without the limit of `MIN_SIGNIFICANCE`, a lag would be reported for the last three.
        for (seed, n) in [(1, 3000), (21, 3000), (31, 3000), (2, 8000)] {
            assert_eq!(
                Lag::of(record(&c1_samples(seed)[..n])),
                Lag::NotDetermined,
                "seed {seed}"
            );
        }
    }

    #[test]
    fn fits_follow_the_run_and_discard_data_before_a_change() {
        let mut fits = LagFits::new(TS);
        let samples = lagged_samples(60.0, 2);
        let (first, rest) = samples.split_at(3999);
        first.iter().for_each(|sample| fits.push(*sample));
        assert_eq!(fits.lag(), Lag::Waiting);
        assert!(!fits.busy, "a fit of less than {MIN_SPAN_S} s");
        rest.iter().for_each(|sample| fits.push(*sample));
        assert_eq!(fits.lag(), Lag::Waiting);
        assert!(fits.busy);
        // The fit in progress now refers to the operator before the change.
        fits.discard_before(50.0);
        assert_eq!((fits.e.len(), fits.from_s), (1000, 50.0));
        let answer = fits.found.recv().unwrap();
        assert_eq!(answer.0, 0.0);
        assert!(matches!(answer.1, Lag::Known(_)), "{answer:?}");
        assert_eq!(fits.last, Lag::Waiting);
    }
}
