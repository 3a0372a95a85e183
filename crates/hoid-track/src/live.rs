//! A live recursion. Samples at a high rate are filtered and decimated; the warm-up collects samples for a start fit;
//! then the tracker runs.
//!
//! Rates above 200 Hz are decimated to about 100 Hz ([`Decimation::Auto`]), unless orders, delay or memory of the
//! request are in samples. The estimate then lags the last sample of the stream by [`Live::lag_s`].

use hoid_model::{Decimated, Decimation, Decimator, Orders, Record, SampleTime};

use crate::{
    Counts, LiveOutcome, Sample, Stage, TrackOptions, TrackPlan, TrackRequest, Tracker,
    seal::{sealed, unsealed},
};
use hoid_ident::{Choice, IdentError};

/// Default length of the warm-up of methods that have one, s.
pub const DEFAULT_WARM_UP_S: f64 = 20.0;
/// Longest warm-up, samples.
const MAX_WARM_UP_SAMPLES: f64 = 1e7;

/// Searches the open orders of a plan on the record of the warm-up.
pub type ChooseOrders<'a> = &'a dyn Fn(&TrackPlan, &Record) -> Result<(TrackOptions, Option<Choice>), IdentError>;

/// A live recursion.
#[derive(Debug)]
pub struct Live {
    plan: TrackPlan,
    /// Sample time of the stream.
    sample_time: SampleTime,
    /// Decimator of e, u and the external signal.
    decimator: Option<Decimator<3>>,
    stage: Stage,
}

impl Live {
    /// Builds the requested recursion for a stream with this sample time.
    ///
    /// # Errors
    /// [`IdentError`] for options that contradict each other, for a warm-up that is not a valid time, and for a
    /// two-sided method.
    pub fn new(
        asked: &TrackRequest,
        sample_time: SampleTime,
        decimation: Decimation,
        warm_up_s: f64,
    ) -> Result<Self, IdentError> {
        let decimation = if asked.counts_samples() {
            decimation.explicit_only()
        } else {
            decimation
        };
        let decimator = match decimation.factor(sample_time) {
            1 => None,
            factor => Some(Decimator::new(factor, sample_time, [true, false, false])?),
        };
        let tracked = decimator.as_ref().map_or(sample_time, Decimator::sample_time);
        Ok(Self {
            sample_time,
            decimator,
            ..Self::from_plan(asked.plan(tracked)?, warm_up_s)?
        })
    }

    /// Builds the recursion of a plan, at the rate of the plan.
    ///
    /// # Errors
    /// Same as [`Live::new`].
    pub fn from_plan(plan: TrackPlan, warm_up_s: f64) -> Result<Self, IdentError> {
        let bad = |option: &str, found: String, expected: &str| IdentError::BadOption {
            option: option.to_owned(),
            found,
            expected: expected.to_owned(),
        };
        if plan.options().method.requests_two_sided() {
            return Err(bad(
                "smooth",
                "a stream, which has no future samples".to_owned(),
                "a recording",
            ));
        }
        let sample_time = plan.sample_time();
        let samples = (warm_up_s / sample_time.s()).round();
        if !(1.0..=MAX_WARM_UP_SAMPLES).contains(&samples) {
            return Err(bad("warm_up", format!("{warm_up_s} s"), "1 to 10 million samples"));
        }
        Ok(Self {
            stage: Stage::new(plan.options(), samples as usize, sample_time)?,
            plan,
            sample_time,
            decimator: None,
        })
    }

    /// Starts from a record at the rate of the stream instead of a warm-up; returns the result of the search for open
    /// orders, if there was one.
    ///
    /// # Errors
    /// [`IdentError`] for a record of another rate, and the errors of the start fit.
    pub fn start_from(&mut self, record: Record) -> Result<Option<Choice>, IdentError> {
        if !record.sample_time().matches(self.sample_time) {
            return Err(IdentError::BadStart {
                reason: format!(
                    "the start record has a sample time of {} s, but the tracker has {} s; resample the record",
                    record.sample_time().s(),
                    self.sample_time.s()
                ),
            });
        }
        let record = match &self.decimator {
            Some(decimator) => record.decimated(decimator.applied_decimation().factor)?.0,
            None => record,
        };
        let (options, choice) = self.plan.choose(&record, &|| {})?;
        let mut tracker = Tracker::new(&options, Some(&record), record.sample_time())?;
        let reference = record.channel("f_t");
        for (k, u) in record.output().iter().enumerate() {
            let sample = Sample {
                e: record.input().get(k).copied().unwrap_or(0.0),
                u: *u,
                reference: reference.and_then(|r| r.get(k)).copied(),
            };
            tracker.update(sample, false);
        }
        self.stage = Stage::Tracking(Box::new(tracker));
        Ok(choice)
    }

    /// Takes a sample; NaN marks faulty or missing values. If `moves` is false, the tracker only updates its filters.
    /// `choose` searches open orders at the end of the warm-up.
    pub fn update(&mut self, sample: Sample, moves: bool, choose: ChooseOrders<'_>) -> LiveOutcome {
        let sample = match &mut self.decimator {
            None => sample,
            Some(decimator) => {
                let Some([e, u, f_t]) = decimator.push([sample.e, sample.u, sample.reference.unwrap_or(f64::NAN)])
                else {
                    return LiveOutcome {
                        between: true,
                        ..LiveOutcome::default()
                    };
                };
                Sample {
                    e,
                    u,
                    reference: Some(f_t).filter(|f| f.is_finite()),
                }
            }
        };
        let plan = &self.plan;
        self.stage.update(sample, moves, &|record| choose(plan, record))
    }

    /// Returns the plan, which has the sample time of the tracker.
    pub fn plan(&self) -> &TrackPlan {
        &self.plan
    }

    /// Returns the stage: warm-up or tracker.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// Returns the tracker; `None` during the warm-up.
    pub fn tracker(&self) -> Option<&Tracker> {
        match &self.stage {
            Stage::Tracking(tracker) => Some(tracker),
            Stage::Collecting(_) => None,
        }
    }

    /// Returns the counts of the recursion; during the warm-up, only its samples are counted.
    pub fn counts(&self) -> Counts {
        match &self.stage {
            Stage::Tracking(tracker) => tracker.counts(),
            Stage::Collecting(warm_up) => Counts {
                samples: warm_up.collected as u64,
                ..Counts::default()
            },
        }
    }

    /// Returns the sample time of the stream.
    pub fn sample_time(&self) -> SampleTime {
        self.sample_time
    }

    /// Returns the decimation, if there is one.
    pub fn decimation(&self) -> Option<Decimated> {
        self.decimator.as_ref().map(Decimator::applied_decimation)
    }

    /// Returns the time from the last sample that the tracker received to the last sample of the stream, s.
    pub fn lag_s(&self) -> f64 {
        let samples = self.decimator.as_ref().map_or(0, Decimator::lag_samples);
        samples as f64 * self.sample_time.s()
    }

    /// Returns the complete state as numbers, and the orders once there is a tracker, for [`Live::restore`]. The
    /// recursion does not change.
    pub fn save(&mut self) -> (Option<Orders>, Vec<f64>) {
        let (orders, mut numbers) = self.stage.save();
        if let Some(decimator) = &mut self.decimator {
            let of_stage = numbers.len();
            numbers.extend(decimator.saved_state());
            numbers.push(of_stage as f64);
            numbers = sealed(numbers);
        }
        (orders, numbers)
    }

    /// Restores the state that [`Live::save`] returned; the recursion must have been built from the same request.
    ///
    /// # Errors
    /// [`IdentError::BadStart`] for numbers of another recursion, and for numbers that were altered or truncated.
    pub fn restore(&mut self, orders: Option<Orders>, numbers: &[f64]) -> Result<(), IdentError> {
        let mut of_stage = numbers;
        if let Some(decimator) = &mut self.decimator {
            let wrong = || IdentError::BadStart {
                reason: "the saved tracker has a different rate, or was changed or truncated after it was saved; save \
                         it again"
                    .to_owned(),
            };
            let (length, all) = unsealed(numbers).and_then(<[f64]>::split_last).ok_or_else(wrong)?;
            let (stage, of_decimator) = all.split_at_checked(*length as usize).ok_or_else(wrong)?;
            if !decimator.restore(of_decimator) {
                return Err(wrong());
            }
            of_stage = stage;
        }
        self.stage = Stage::restore(&self.plan, orders, of_stage, self.plan.sample_time())?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::{
        Channel,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use super::*;
    use crate::Method;

    /// Returns the first seconds of a run of C1 at 1000 Hz, with each sample of the run repeated.
    fn fast_record(length_s: f64) -> Record {
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        let record = simulator.run(RunSeed::default(), false).unwrap();
        let record = record.span(0.0, length_s).unwrap();
        let held = |name: &str, values: &[f64]| {
            let values = values.iter().flat_map(|v| [*v; 10]).collect();
            Channel::new(name, "", values)
        };
        let (e, u) = (held("e", record.input()), held("u", record.output()));
        Record::new(SampleTime::new(0.001).unwrap(), e, u).unwrap()
    }

    fn samples(record: &Record) -> impl Iterator<Item = Sample> {
        let pairs = record.input().iter().zip(record.output());
        pairs.map(|(e, u)| Sample {
            e: *e,
            u: *u,
            reference: None,
        })
    }

    fn build_live(asked: &TrackRequest) -> Live {
        let ts = SampleTime::new(0.001).unwrap();
        Live::new(asked, ts, Decimation::Auto, DEFAULT_WARM_UP_S).unwrap()
    }

    fn choose(plan: &TrackPlan, record: &Record) -> Result<(TrackOptions, Option<Choice>), IdentError> {
        plan.choose(record, &|| {})
    }

    #[test]
    fn fast_stream_is_tracked_like_its_decimated_recording() {
        let record = fast_record(12.0);
        let mut live = build_live(&TrackRequest::default());
        let advanced = (samples(&record))
            .filter(|sample| !live.update(*sample, true, &choose).between)
            .count();
        assert!((live.lag_s() - 0.15).abs() < 0.02, "{}", live.lag_s());
        assert_eq!(live.decimation().map(|done| done.factor), Some(10));

        let (lower, _) = record.decimated(10).unwrap();
        let mut tracker = Tracker::new(live.plan().options(), None, lower.sample_time()).unwrap();
        for sample in samples(&lower).take(advanced) {
            tracker.update(sample, true);
        }
        assert!(advanced > 1100, "{advanced}");
        assert_eq!(live.tracker().unwrap().theta(), tracker.theta());
        assert_eq!(live.counts(), tracker.counts());
    }

    #[test]
    fn sample_based_settings_keep_the_rate() {
        assert!(build_live(&TrackRequest::of(Method::rpem())).decimation().is_none());
    }

    #[test]
    fn restored_stream_continues_between_decimated_samples() {
        let record = fast_record(6.0);
        let all: Vec<Sample> = samples(&record).collect();
        let (before, after) = all.split_at(3005);
        let mut first = build_live(&TrackRequest::default());
        for sample in before {
            first.update(*sample, true, &choose);
        }
        let (orders, numbers) = first.save();
        let mut second = build_live(&TrackRequest::default());
        second.restore(orders, &numbers).unwrap();
        for sample in after {
            let pair = [&mut first, &mut second].map(|live| live.update(*sample, true, &choose));
            assert_eq!(pair[0].between, pair[1].between);
            assert_eq!(pair[0].outcome, pair[1].outcome);
        }
        assert_eq!(first.tracker().unwrap().theta(), second.tracker().unwrap().theta());
        for wrong in [&numbers[1..], &numbers[..numbers.len() - 1], &[]] {
            assert!(second.restore(orders, wrong).is_err());
        }
    }

    /// Changes each number of the decimator in turn and seals the numbers again: no index or counter may end the
    /// process.
    #[test]
    fn decimator_restores_arbitrary_numbers_safely() {
        let record = fast_record(1.0);
        let all: Vec<Sample> = samples(&record).collect();
        for before in [100, 600] {
            let mut first = build_live(&TrackRequest::default());
            for sample in &all[..before] {
                first.update(*sample, true, &choose);
            }
            let (orders, numbers) = first.save();
            let (of_stage, numbers) = unsealed(&numbers).unwrap().split_last().unwrap();
            for at in *of_stage as usize..numbers.len() {
                for number in [0.0, 1e300, -1e300] {
                    let mut changed = numbers.to_vec();
                    changed[at] = number;
                    changed.push(*of_stage);
                    let mut restored = build_live(&TrackRequest::default());
                    if restored.restore(orders, &sealed(changed)).is_ok() {
                        for sample in &all[before..before + 300] {
                            restored.update(*sample, true, &choose);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn invalid_live_requests_are_refused() {
        let ts = SampleTime::new(0.01).unwrap();
        let asked = TrackRequest::default();
        for warm_up_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = Live::new(&asked, ts, Decimation::Off, warm_up_s).unwrap_err();
            assert!(error.to_string().contains("warm_up"), "{error}");
        }
        let mut live = build_live(&asked);
        let error = live.start_from(fast_record(2.0).decimated(10).unwrap().0).unwrap_err();
        assert!(error.to_string().contains("0.001 s"), "{error}");
    }
}
