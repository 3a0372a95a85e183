//! The state of a tracker as numbers, so it can continue elsewhere: in another process, or after a restart.
//!
//! The numbers are the start, from which gains and bounds are computed, all numbers that change ([`hoid_core::state`]),
//! and a seal that detects damage. A restored tracker continues with identical results, but does not contain the start
//! fit.

use hoid_core::state::{State, visit_all};
use hoid_model::SampleTime;

use crate::{
    Counts, Tracker,
    options::TrackOptions,
    seal::{sealed, unsealed},
    start::StartState,
    tracker::{build_guard, build_stationary_watch},
};
use hoid_ident::IdentError;

impl State for Tracker {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(
            &mut [
                &mut self.last_e,
                &mut self.counts.samples,
                &mut self.counts.skipped,
                &mut self.counts.shortened,
                &mut *self.recursion,
            ],
            each,
        );
        if let Some(guard) = &mut self.guard {
            visit_all(
                &mut [
                    &mut self.counts.held,
                    &mut self.counts.restarts,
                    &mut self.moved,
                    &mut **guard,
                ],
                each,
            );
        }
        if let Some(stationary) = &mut self.stationary {
            visit_all(&mut [&mut self.counts.held, &mut self.moved, &mut **stationary], each);
        }
    }
}

impl State for StartState {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(
            &mut [
                &mut self.values.as_mut_slice(),
                &mut self.covariance.as_mut_slice(),
                &mut self.spread.as_mut_slice(),
                &mut self.variance,
                &mut self.residuals,
                &mut self.from_fit,
            ],
            each,
        );
    }
}

impl Tracker {
    /// Returns the tracker as numbers, for [`Tracker::restore`]. The tracker does not change.
    pub fn save(&mut self) -> Vec<f64> {
        let mut numbers = Vec::new();
        let mut save = |number: &mut f64| numbers.push(*number);
        self.start.visit(&mut save);
        self.visit(&mut save);
        sealed(numbers)
    }

    /// Restores a tracker from its options and the numbers that [`Tracker::save`] returned.
    ///
    /// # Errors
    /// [`IdentError::BadStart`] for numbers of another tracker, and for numbers that were altered or truncated; the
    /// errors of [`Tracker::new`].
    pub fn restore(options: &TrackOptions, sample_time: SampleTime, numbers: &[f64]) -> Result<Self, IdentError> {
        options.check_at(sample_time)?;
        let wrong = || IdentError::BadStart {
            reason: "the state was saved by a tracker with other options; use the same options, or save it again"
                .to_owned(),
        };
        let numbers = unsealed(numbers).ok_or_else(|| IdentError::BadStart {
            reason: "the saved tracker was changed or truncated after it was saved; save it again".to_owned(),
        })?;
        let p = options.parameter_names().len();
        let square = p.saturating_mul(p);
        let mut start = StartState {
            values: vec![0.0; p],
            covariance: vec![0.0; square],
            spread: vec![0.0; square],
            variance: 0.0,
            residuals: 0.0,
            from_fit: false,
            fit: None,
        };
        let mut left = numbers.iter();
        let mut lacking = false;
        let mut restore = |number: &mut f64| match left.next() {
            Some(saved) => *number = *saved,
            None => lacking = true,
        };
        start.visit(&mut restore);
        let mut recursion = options.method.build(&options.setup()?, &start, sample_time)?;
        let mut tracker = Self {
            guard: build_guard(options, &mut *recursion, None, sample_time),
            stationary: build_stationary_watch(options, sample_time),
            moved: false,
            recursion,
            options: options.clone(),
            sample_time,
            last_e: 0.0,
            counts: Counts::default(),
            start,
        };
        tracker.visit(&mut restore);
        if lacking || left.next().is_some() {
            return Err(wrong());
        }
        Ok(tracker)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::{Condition, Scenario};
    use hoid_sim::{RunSeed, Simulator};

    use super::*;
    use crate::{Method, TrackOptions};

    /// Changes each number in turn and seals the numbers again: no index, length or difference of counters may end the
    /// process.
    fn check_arbitrary_numbers(method: Method, with: &[(&str, &str)], saved_at: usize, to: usize) {
        let simulator = Simulator::new(&Scenario::condition(Condition::C4)).unwrap();
        let record = simulator.run(RunSeed::default(), false).unwrap();
        let span = record.span(0.0, 20.0).unwrap();
        let options = TrackOptions::default_for(method, 29).with(with).unwrap();
        let mut tracker = Tracker::new(&options, Some(&span), record.sample_time()).unwrap();
        // The tracker is saved within a gap in the samples.
        let step = |tracker: &mut Tracker, k: usize| {
            let gap = (2300..2360).contains(&k);
            tracker.step(record.input()[k], if gap { f64::NAN } else { record.output()[k] })
        };
        for k in 2000..saved_at {
            step(&mut tracker, k);
        }
        let numbers = tracker.save();
        for at in 0..numbers.len() - 1 {
            for number in [0.0, 1e18] {
                let mut changed = numbers[..numbers.len() - 1].to_vec();
                changed[at] = number;
                let restored = Tracker::restore(&options, record.sample_time(), &sealed(changed));
                let Ok(mut restored) = restored else { continue };
                for k in saved_at..to {
                    step(&mut restored, k);
                }
                assert!(restored.time_since_restart_s().is_none_or(|s| s < 1e18), "number {at}");
            }
        }
    }

    #[test]
    fn guard_restores_arbitrary_numbers_safely() {
        check_arbitrary_numbers(Method::rpem(), &[("guard", "yes")], 2350, 2600);
    }

    #[test]
    fn delay_bank_restores_arbitrary_numbers_safely() {
        check_arbitrary_numbers(Method::rpem(), &[("track_delay", "0.28..0.3")], 2050, 2060);
    }

    #[test]
    fn window_restores_arbitrary_numbers_safely() {
        let with = [("forgetting", "window"), ("memory", "40")];
        check_arbitrary_numbers(Method::rpem(), &with, 2030, 2100);
    }
}
