//! Stages of a live recursion: the warm-up for the start fit, then the tracker.

use std::collections::VecDeque;

use hoid_core::state::{State, visit_all};
use hoid_model::{Channel, Orders, Record, SampleTime};

use crate::{
    Outcome, Sample, StartSource, TrackOptions, TrackPlan, Tracker,
    idle::idle_head,
    seal::{sealed, unsealed},
};
use hoid_ident::{Choice, IdentError};

/// Chooses the options for a record of the warm-up; also returns the result of the search for orders, if there was one.
pub type ChooseOptions<'a> = &'a dyn Fn(&Record) -> Result<(TrackOptions, Option<Choice>), IdentError>;

/// After a failed fit, the warm-up is extended by its length divided by this number.
const RETRY_DIVISOR: usize = 4;
/// Maximum number of samples that an extended warm-up keeps, as a multiple of the length of the warm-up.
const MAX_KEPT_LENGTHS: usize = 2;
/// Position of the number of kept samples among the numbers of a saved warm-up.
const COUNT_INDEX: usize = 4;
/// Longest run of faulty samples within a warm-up (in s); after a longer one the warm-up restarts.
const LONGEST_FAULT_S: f64 = 1.0;

/// Stage of a live recursion.
#[derive(Debug)]
pub enum Stage {
    /// The samples of the start fit are being collected.
    Collecting(WarmUp),
    /// The tracker is running.
    Tracking(Box<Tracker>),
}

/// Result of a sample of a live recursion.
#[derive(Debug, Default)]
pub struct LiveOutcome {
    /// Outcome of the tracker; `None` if the tracker did not receive a sample.
    pub outcome: Option<Outcome>,
    /// Options of the tracker and result of the search for orders, if the warm-up ended at this sample.
    pub started: Option<(TrackOptions, Option<Choice>)>,
    /// True if no sample of the decimated stream was completed, so the recursion did not advance.
    pub between: bool,
}

impl Stage {
    /// Builds a recursion. It starts at once if it needs no start fit, otherwise after a warm-up of a given number of
    /// samples.
    ///
    /// # Errors
    /// [`IdentError`] for a start that cannot be used.
    pub fn new(options: &TrackOptions, warm_up: usize, sample_time: SampleTime) -> Result<Self, IdentError> {
        Ok(match options.start {
            StartSource::Span(_) if !options.method.is_self_starting() => {
                Self::Collecting(WarmUp::new(warm_up, sample_time))
            }
            _ => Self::Tracking(Box::new(Tracker::new(options, None, sample_time)?)),
        })
    }

    /// Returns the complete state as numbers, and the orders once there is a tracker, for [`Stage::restore`]. The
    /// recursion does not change.
    pub fn save(&mut self) -> (Option<Orders>, Vec<f64>) {
        match self {
            Self::Tracking(tracker) => (Some(tracker.options().orders), tracker.save()),
            Self::Collecting(warm_up) => (None, warm_up.save()),
        }
    }

    /// Restores a recursion from its plan and the state that [`Stage::save`] returned.
    ///
    /// # Errors
    /// [`IdentError::BadStart`] for numbers of another recursion, and for numbers that were altered or truncated; the
    /// errors of [`Tracker::new`].
    pub fn restore(
        plan: &TrackPlan,
        orders: Option<Orders>,
        numbers: &[f64],
        sample_time: SampleTime,
    ) -> Result<Self, IdentError> {
        let Some(orders) = orders else {
            let warm_up = WarmUp::restore(sample_time, numbers).ok_or_else(|| IdentError::BadStart {
                reason: "the saved warm-up was changed or truncated after it was saved; save it again".to_owned(),
            })?;
            return Ok(Self::Collecting(warm_up));
        };
        let tracker = Tracker::restore(&plan.with_orders(orders), sample_time, numbers)?;
        Ok(Self::Tracking(Box::new(tracker)))
    }

    /// Takes a sample; NaN marks faulty or missing values. If `moves` is false, the tracker only updates its filters.
    /// The start fit is made at the last sample of the warm-up, with the options that `choose` returns for the record
    /// of the warm-up.
    pub fn update(&mut self, sample: Sample, moves: bool, choose: ChooseOptions<'_>) -> LiveOutcome {
        let warm_up = match self {
            Self::Tracking(tracker) => {
                return LiveOutcome {
                    outcome: Some(tracker.update(sample, moves)),
                    ..LiveOutcome::default()
                };
            }
            Self::Collecting(warm_up) => warm_up,
        };
        warm_up.collect(sample);
        if warm_up.collected < warm_up.needed {
            return LiveOutcome::default();
        }
        if warm_up.exclude_idle_head() {
            return LiveOutcome::default();
        }
        match warm_up.start(choose) {
            Ok((tracker, choice)) => {
                let options = tracker.options().clone();
                *self = Self::Tracking(Box::new(tracker));
                LiveOutcome {
                    started: Some((options, choice)),
                    ..LiveOutcome::default()
                }
            }
            Err(error) => {
                let more = (warm_up.length / RETRY_DIVISOR).max(1);
                warm_up.needed = warm_up.collected.saturating_add(more);
                warm_up.trouble = Some(error.to_string());
                LiveOutcome::default()
            }
        }
    }
}

/// Samples that are collected for the start fit.
#[derive(Debug)]
pub struct WarmUp {
    length: usize,
    sample_time: SampleTime,
    samples: VecDeque<Sample>,
    /// Number of samples since the collection started.
    pub collected: usize,
    /// Number of collected samples at which the fit is tried next.
    pub needed: usize,
    /// Reason why the last start fit failed or the collection restarted.
    pub trouble: Option<String>,
    /// Number of consecutive faulty samples up to the last sample.
    faulty: usize,
}

impl State for WarmUp {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(
            &mut [
                &mut self.length,
                &mut self.collected,
                &mut self.needed,
                &mut self.faulty,
            ],
            each,
        );
        let mut kept = self.samples.len();
        kept.visit(each);
        let nothing = Sample {
            e: 0.0,
            u: 0.0,
            reference: None,
        };
        self.samples
            .resize(kept.min(MAX_KEPT_LENGTHS.saturating_mul(self.length)), nothing);
        for sample in &mut self.samples {
            let mut known = sample.reference.is_some();
            let mut reference = sample.reference.unwrap_or(f64::NAN);
            visit_all(&mut [&mut sample.e, &mut sample.u, &mut known, &mut reference], each);
            sample.reference = known.then_some(reference);
        }
    }
}

impl WarmUp {
    /// Returns the warm-up as numbers, for [`WarmUp::restore`], but without the reason for the last failure.
    pub fn save(&mut self) -> Vec<f64> {
        let mut numbers = Vec::new();
        self.visit(&mut |number| numbers.push(*number));
        sealed(numbers)
    }

    /// Restores a warm-up from the numbers that [`WarmUp::save`] returned. `None` for other numbers, and for numbers
    /// that were altered or truncated.
    pub fn restore(sample_time: SampleTime, numbers: &[f64]) -> Option<Self> {
        let mut warm_up = Self::new(0, sample_time);
        let numbers = unsealed(numbers)?;
        // Memory for the samples is allocated before they are read; there cannot be more samples than numbers.
        numbers.get(COUNT_INDEX).filter(|kept| **kept <= numbers.len() as f64)?;
        let mut left = numbers.iter();
        let mut lacking = false;
        warm_up.visit(&mut |number| match left.next() {
            Some(saved) => *number = *saved,
            None => lacking = true,
        });
        (!lacking && left.next().is_none()).then_some(warm_up)
    }

    fn new(length: usize, sample_time: SampleTime) -> Self {
        Self {
            length,
            sample_time,
            samples: VecDeque::new(),
            collected: 0,
            needed: length,
            trouble: None,
            faulty: 0,
        }
    }

    /// Takes a sample. The collection starts with a sound sample and restarts after a long fault.
    fn collect(&mut self, sample: Sample) {
        let sound = sample.e.is_finite() && sample.u.is_finite();
        self.faulty = if sound { 0 } else { self.faulty.saturating_add(1) };
        if self.samples.is_empty() && !sound {
            return;
        }
        if self.faulty as f64 * self.sample_time.s() > LONGEST_FAULT_S {
            *self = Self::new(self.length, self.sample_time);
            self.trouble = Some(format!(
                "more than {LONGEST_FAULT_S} s of faulty samples: the warm-up was restarted"
            ));
            return;
        }
        if self.samples.len() >= MAX_KEPT_LENGTHS.saturating_mul(self.length) {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
        self.collected = self.collected.saturating_add(1);
    }

    /// Excludes the idle head of the collected samples and extends the warm-up by as many samples; returns false if
    /// there is no idle head.
    fn exclude_idle_head(&mut self) -> bool {
        let Ok(record) = self.record() else { return false };
        let idle = idle_head(&record);
        if idle == 0 {
            return false;
        }
        self.samples.drain(..idle.min(self.samples.len()));
        self.needed = self.collected.saturating_add(idle);
        self.trouble = Some(format!(
            "neither e nor u moved for {:.1} s: this span is excluded, and the warm-up continues",
            idle as f64 * self.sample_time.s()
        ));
        true
    }

    /// Builds the tracker with the batch fit of the collected samples and with settled filters.
    fn start(&self, choose: ChooseOptions<'_>) -> Result<(Tracker, Option<Choice>), IdentError> {
        let record = self.record()?;
        let (options, choice) = choose(&record)?;
        let mut tracker = Tracker::new(&options, Some(&record), self.sample_time)?;
        for sample in &self.samples {
            tracker.update(*sample, false);
        }
        Ok((tracker, choice))
    }

    /// Returns the collected samples as a record; a faulty value is replaced by the last good value.
    fn record(&self) -> Result<Record, IdentError> {
        let channel = |name: &str, of: fn(&Sample) -> f64| {
            let mut last = self.samples.iter().map(of).find(|v| v.is_finite()).unwrap_or(0.0);
            let values = self.samples.iter().map(|s| {
                let v = of(s);
                last = if v.is_finite() { v } else { last };
                last
            });
            Channel::new(name, "", values.collect())
        };
        let (input, output) = (channel("e", |s| s.e), channel("u", |s| s.u));
        let record = Record::new(self.sample_time, input, output)?.labelled("of the warm-up");
        if self.samples.iter().any(|s| s.reference.is_none()) {
            return Ok(record);
        }
        let reference = channel("f_t", |s| s.reference.unwrap_or(f64::NAN));
        Ok(record.with_channel(reference)?)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn restored_warm_up_samples_are_limited() {
        let sample_time = SampleTime::new(0.01).unwrap();
        let mut warm_up = WarmUp::new(100, sample_time);
        let sample = Sample {
            e: 1.0,
            u: 2.0,
            reference: Some(3.0),
        };
        (0..3).for_each(|_| warm_up.collect(sample));
        let numbers = warm_up.save();
        assert_eq!(WarmUp::restore(sample_time, &numbers).unwrap().save(), numbers);
        // The number of kept samples is changed, and the numbers are sealed again: memory for 1e15 samples would end
        // the process.
        for kept in [4.0, 1e15, f64::INFINITY, f64::NAN] {
            let mut changed = unsealed(&numbers).unwrap().to_vec();
            (changed[0], changed[COUNT_INDEX]) = (1e15, kept);
            assert!(WarmUp::restore(sample_time, &sealed(changed)).is_none());
        }
        // A warm-up length of any size is accepted, although it may never be reached.
        let mut changed = unsealed(&numbers).unwrap().to_vec();
        changed[0] = f64::INFINITY;
        let mut restored = WarmUp::restore(sample_time, &sealed(changed)).unwrap();
        restored.collect(sample);
        assert_eq!(restored.samples.len(), 4);
    }
}
