//! Recursive estimates: sample by sample, over a record or live.
//!
//! | module | what it holds |
//! |---|---|
//! | `options` | what is to be tracked, and how |
//! | `start` | where a recursion starts: batch fit, theta, nothing |
//! | `gain` | the way of forgetting |
//! | `kernel` | RLS, RPEM and the physical recursion of the real-time kernel |
//! | `adaptive`, `change` | the bank of hypotheses of the real-time kernel, and the changes that it declares |
//! | `reported`, `smooth` | what a recursion with a noise model that stays reports; the two-sided estimate of a recorded run |
//! | `fused` | least squares with the poles of RPEM |
//! | `joint` | extended and unscented Kalman filter of state and parameters |
//! | `window`, `predictor` | the batch fit over a sliding window |
//! | `refined`, `laguerre`, `forgetting` | recursive refined instrumental variable |
//! | `plan` | orders that are still open, searched on the start span |
//! | `live` | the warm-up of a stream, then its tracker |
//! | `saved` | a tracker as numbers, to go on elsewhere |
//! | `trace`, `columns` | the estimate at every sample |
//!
//! **A recursion starts with what is known.** By default it is the batch fit of the first third of a record, with the covariance of that
//! fit; until the end of that span the filters follow and the estimate stays, so that no sample counts twice and the error bars hold. With
//! the text's own start, `P_0 = 0.1 I` (eq. 38, 5.41, 5.55), the estimate moves from the first sample on.
//!
//! **Samples that are not as they should be** never reach the filters. A value is a fault when it is not a finite number or larger than
//! [`TrackOptions::largest`]. An error e is then replaced by the last good one, an output u by the one-step prediction, and the estimate
//! stays at that sample. Each is counted.

mod adaptive;
mod change;
mod columns;
mod forgetting;
mod fused;
mod gain;
mod joint;
mod kernel;
mod laguerre;
mod live;
mod options;
mod past;
mod plan;
mod predictor;
mod refined;
mod reported;
mod saved;
mod smooth;
mod start;
mod trace;
mod window;

use hoid_core::{recursion::Step, state::State};
use hoid_model::{
    NotConvertible, Record, SampleTime,
    uncertainty::{Estimate, OperatorEstimate},
};

pub use change::{Change, ErrorThreshold};
pub use columns::{Columns, value_of};
pub use live::{Choose, Live, LiveOutcome, WarmUp};
pub use options::{ForgettingRule, Memory, Method, StartAt, StartCovariance, TrackOptions};
pub use plan::{TrackPlan, narrowed};
pub use trace::{OPERATOR_COLUMNS, Trace};

/// Regressor and stability of the recursions, options of the kernel.
pub use hoid_core::{predictor::Regressor, recursion::Stable};

use fused::FusedRecursion;
use joint::JointRecursion;
use refined::{RefinedRecursion, RefinedStart};
use start::StartState;
use trace::{operator_of, pack, packed_len, polynomial_orders};
use window::WindowRecursion;

use crate::{Estimator, Fit, IdentError, instrumental::FORCING_CHANNEL};

/// One sample of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Tracking error.
    pub e: f64,
    /// Control output.
    pub u: f64,
    /// External signal f_t, where it is known.
    pub reference: Option<f64>,
}

/// What a recursion says of a sample that it has taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Taken {
    /// A-priori innovation.
    pub innovation: f64,
    /// True when stability or a bound made the step shorter.
    pub shortened: bool,
}

impl From<Step> for Taken {
    fn from(step: Step) -> Self {
        Self {
            innovation: step.innovation,
            shortened: step.shortened,
        }
    }
}

/// A recursive method. Samples are finite and not too large.
pub(crate) trait Recursion: State + Send + Sync {
    /// Takes a sample: filters and estimate move on.
    fn step(&mut self, sample: Sample) -> Taken;
    /// Takes a sample into the filters alone; the estimate stays.
    fn follow(&mut self, sample: Sample) -> Taken;
    /// As `follow`, where the output is missing and the one-step prediction takes its place.
    fn bridge(&mut self, sample: Sample);
    /// theta in the order of [`hoid_model::Orders::parameter_names`].
    fn theta(&self) -> &[f64];
    /// Covariance of theta by rows; false when there is none yet.
    fn covariance(&self, into: &mut [f64]) -> bool;
    /// Innovation variance as tracked.
    fn innovation_variance(&self) -> f64;
    /// Logarithm of the odds of a recent change, where the recursion has them.
    fn change_odds(&self) -> Option<f64> {
        None
    }
    /// The change that was declared at the last sample.
    fn change(&self) -> Option<Change> {
        None
    }
    /// Number of fits that failed, and why the last did, for methods that fit.
    fn failures(&self) -> Option<(usize, String)> {
        None
    }
    /// The operator, where it is what the recursion estimates.
    fn operator(&self) -> Option<OperatorEstimate> {
        None
    }
}

/// Samples that were not as they should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Samples given.
    pub samples: u64,
    /// Samples with a fault in e or u, at which the estimate stayed.
    pub skipped: u64,
    /// Steps that stability or a bound made shorter.
    pub shortened: u64,
}

/// What a tracker says of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// A-priori innovation; `None` at a skipped sample.
    pub innovation: Option<f64>,
    /// True when e or u was a fault.
    pub skipped: bool,
    /// True when stability or a bound made the step shorter.
    pub shortened: bool,
}

/// A recursive estimate that takes one sample at a time.
pub struct Tracker {
    options: TrackOptions,
    sample_time: SampleTime,
    recursion: Box<dyn Recursion>,
    last_e: f64,
    counts: Counts,
    start: StartState,
}

impl std::fmt::Debug for Tracker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tracker")
            .field("options", &self.options)
            .field("theta", &self.theta())
            .field("counts", &self.counts)
            .finish_non_exhaustive()
    }
}

impl Tracker {
    /// A tracker with filters at rest. `span` is the record of the start fit; without it the tracker starts from theta or from
    /// nothing, as the options say.
    ///
    /// # Errors
    /// [`IdentError`] when options contradict each other, or the start fit fails.
    pub fn new(options: &TrackOptions, span: Option<&Record>, sample_time: SampleTime) -> Result<Self, IdentError> {
        Self::from_fit(options, span, None, sample_time)
    }

    /// As [`Tracker::new`], with the fit of the span where it is known.
    fn from_fit(
        options: &TrackOptions,
        span: Option<&Record>,
        known: Option<&Fit>,
        sample_time: SampleTime,
    ) -> Result<Self, IdentError> {
        options.check()?;
        let start = StartState::new(options, span, known, sample_time)?;
        Ok(Self {
            recursion: recursion(options, &start, sample_time)?,
            options: options.clone(),
            sample_time,
            last_e: 0.0,
            counts: Counts::default(),
            start,
        })
    }

    /// Takes a sample.
    pub fn step(&mut self, e: f64, u: f64) -> Outcome {
        self.take(Sample { e, u, reference: None }, true)
    }

    /// Takes a sample, with the external signal where it is known. With `update` false only the filters follow.
    pub fn take(&mut self, sample: Sample, update: bool) -> Outcome {
        self.counts.samples += 1;
        let sound = |v: f64| v.abs() <= self.options.largest;
        let (e_sound, u_sound) = (sound(sample.e), sound(sample.u));
        let sample = Sample {
            e: if e_sound { sample.e } else { self.last_e },
            reference: sample.reference.filter(|r| sound(*r)),
            ..sample
        };
        self.last_e = sample.e;
        let skipped = !(e_sound && u_sound);
        if !u_sound {
            self.recursion.bridge(sample);
            self.counts.skipped += 1;
            return Outcome {
                innovation: None,
                skipped,
                shortened: false,
            };
        }
        let taken = if update && !skipped {
            self.recursion.step(sample)
        } else {
            self.recursion.follow(sample)
        };
        self.counts.skipped += u64::from(skipped);
        self.counts.shortened += u64::from(taken.shortened);
        Outcome {
            innovation: (!skipped).then_some(taken.innovation),
            skipped,
            shortened: taken.shortened,
        }
    }

    /// theta in the order of [`Tracker::parameter_names`].
    pub fn theta(&self) -> &[f64] {
        self.recursion.theta()
    }

    /// Names of the coefficients.
    pub fn parameter_names(&self) -> Vec<String> {
        polynomial_orders(&self.options).parameter_names()
    }

    /// Covariance of theta by rows; `None` while there is none.
    pub fn covariance(&self) -> Option<Vec<f64>> {
        let p = self.theta().len();
        let mut covariance = vec![0.0; p * p];
        self.recursion.covariance(&mut covariance).then_some(covariance)
    }

    /// Each coefficient with its standard error.
    pub fn parameters(&self) -> Vec<Estimate> {
        let p = self.theta().len();
        let covariance = self.covariance();
        let of = |(i, &value): (usize, &f64)| match &covariance {
            Some(c) => Estimate::with_variance(value, c[i * p + i]),
            None => Estimate::fixed(value),
        };
        self.theta().iter().enumerate().map(of).collect()
    }

    /// The operator with standard errors.
    ///
    /// # Errors
    /// [`NotConvertible`] with the reason.
    pub fn operator(&self) -> Result<OperatorEstimate, NotConvertible> {
        match self.recursion.operator() {
            Some(operator) if operator.t_l_s.value.is_finite() => Ok(operator),
            Some(_) => Err(NotConvertible::ZeroGain),
            None => operator_of(
                self.options.structure,
                self.options.orders,
                self.sample_time,
                self.theta(),
                self.covariance().as_deref(),
            ),
        }
    }

    /// Logarithm of the odds that the person changed within the last four seconds, by [`Method::Adaptive`].
    pub fn change_odds(&self) -> Option<f64> {
        self.recursion.change_odds()
    }

    /// The change that was declared at the last sample, if one was.
    pub fn change(&self) -> Option<Change> {
        self.recursion.change()
    }

    /// Innovation variance as tracked.
    pub fn innovation_variance(&self) -> f64 {
        self.recursion.innovation_variance()
    }

    /// Samples that were not as they should be.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Number of fits that failed, and why the last did, for the method window.
    pub fn failures(&self) -> Option<(usize, String)> {
        self.recursion.failures()
    }

    /// The batch fit that the tracker started from.
    pub fn start(&self) -> Option<&Fit> {
        self.start.fit.as_ref()
    }

    /// The options.
    pub fn options(&self) -> &TrackOptions {
        &self.options
    }
}

/// The recursion that the options ask for.
fn recursion(
    options: &TrackOptions,
    start: &StartState,
    sample_time: SampleTime,
) -> Result<Box<dyn Recursion>, IdentError> {
    let covariance: Vec<f64> = start.spread.iter().map(|s| s * start.variance).collect();
    match options.method {
        Method::Window => {
            let estimator = Estimator {
                search: options.search,
                ..Estimator::new(options.structure, options.orders)
            };
            let window = options.window.samples(sample_time)?;
            let known = match options.start {
                StartAt::Nothing => None,
                _ => Some((start.values.as_slice(), start.from_fit.then_some(covariance.as_slice()))),
            };
            let recursion = WindowRecursion::new(estimator, sample_time, window, options.every, known)?;
            Ok(Box::new(recursion))
        }
        Method::Refined => {
            if !start.from_fit {
                return Err(IdentError::BadStart {
                    reason: "rriv makes its instruments with a model; start it from the batch fit of a span".to_owned(),
                });
            }
            let from = RefinedStart {
                theta: &start.values,
                covariance: &covariance,
                innovation_variance: start.variance,
                samples: start.residuals as usize,
            };
            let lambda = options
                .memories()?
                .into_iter()
                .map(|m| m.lambda(sample_time))
                .collect::<Result<Vec<f64>, _>>()?;
            let recursion = RefinedRecursion::new(options.orders, from, &lambda, options.instruments.is_some())?;
            Ok(Box::new(recursion))
        }
        Method::Adaptive => adaptive::build(options, start, sample_time),
        Method::Fused => Ok(Box::new(FusedRecursion::new(options, start, sample_time)?)),
        Method::Ekf | Method::Ukf => Ok(Box::new(JointRecursion::new(options, start, sample_time)?)),
        _ => kernel::build(options, start, sample_time),
    }
}

/// Tracks a record: the estimate after every `every`-th sample.
///
/// # Errors
/// [`IdentError`] when the options contradict each other or the record, or the start fit fails.
pub fn track(record: &Record, options: &TrackOptions, every: usize) -> Result<Trace, IdentError> {
    track_from(record, options, every, None)
}

/// As [`track`], from a fit that is known: that of [`TrackOptions::start_estimator`] to the start span. Several methods that start from the
/// same fit need it only once.
///
/// # Errors
/// As [`track`].
pub fn track_from(
    record: &Record,
    options: &TrackOptions,
    every: usize,
    start: Option<&Fit>,
) -> Result<Trace, IdentError> {
    trace::check_every(every)?;
    options.check()?;
    let sample_time = record.sample_time();
    if options.structure.has_input() && record.input_channel().is_none() {
        return Err(IdentError::NoInput {
            structure: options.structure.to_string(),
            label: record.label().to_owned(),
        });
    }
    let (span, end_s) = match options.start_span(record) {
        Some((from, to)) => (Some(record.span(from, to)?), to),
        None => (None, f64::NEG_INFINITY),
    };
    let mut options = options.clone();
    if options.method == Method::Refined && options.instruments.is_none() && record.channel(FORCING_CHANNEL).is_some() {
        options.instruments = Some(FORCING_CHANNEL.to_owned());
    }
    let options = &options;
    let reference = match &options.instruments {
        None => None,
        Some(name) => Some(record.channel(name).ok_or_else(|| {
            IdentError::NoChannel {
                channel: name.clone(),
                label: record.label().to_owned(),
                available: record
                    .channels()
                    .map(|c| c.name.as_str())
                    .collect::<Vec<_>>()
                    .join(", "),
            }
        })?),
    };
    let mut tracker = Tracker::from_fit(options, span.as_ref(), start, sample_time)?;
    let known = span.is_some() && options.covariance == StartCovariance::OfFit;
    let from_s = options
        .update_from_s
        .unwrap_or(if known { end_s } else { f64::NEG_INFINITY })
        .max(record.time_s(0));
    let p = polynomial_orders(options).parameters();
    let rows = record.len().div_ceil(every);
    let mut trace = Trace {
        options: options.clone(),
        sample_time,
        times_s: Vec::with_capacity(rows),
        theta: Vec::with_capacity(rows * p),
        covariance: Vec::with_capacity(rows * packed_len(p)),
        operator: Vec::new(),
        innovation: Vec::with_capacity(rows),
        innovation_variance: Vec::with_capacity(rows),
        shortened: Vec::with_capacity(rows),
        change_odds: Vec::new(),
        changes: Vec::new(),
        counts: Counts::default(),
        start: tracker.start.fit.clone(),
        failures: None,
        every,
        averaged: 1,
        updated_from_s: from_s,
    };
    let (input, output) = (record.input(), record.output());
    let mut covariance = vec![0.0; p * p];
    // Half a sample, so that rounding of the times does not decide.
    let first_update = from_s - sample_time.s() / 2.0;
    for k in 0..record.len() {
        let t = record.time_s(k);
        let sample = Sample {
            e: input.get(k).copied().unwrap_or(0.0),
            u: output[k],
            reference: reference.map(|r| r[k]),
        };
        let outcome = tracker.take(sample, t >= first_update);
        if let Some(change) = tracker.change() {
            trace.changes.push((t, change));
        }
        if (k + 1) % every != 0 && k + 1 != record.len() {
            continue;
        }
        trace.times_s.push(t);
        trace.theta.extend_from_slice(tracker.theta());
        if !tracker.recursion.covariance(&mut covariance) {
            covariance.fill(f64::NAN);
        }
        pack(&covariance, p, &mut trace.covariance);
        trace.operator.extend(tracker.recursion.operator());
        trace.innovation.push(outcome.innovation.unwrap_or(f64::NAN));
        trace.innovation_variance.push(tracker.innovation_variance());
        trace.shortened.push(tracker.counts.shortened);
        trace.change_odds.extend(tracker.change_odds());
    }
    trace.counts = tracker.counts;
    trace.failures = tracker.failures();
    if options.smooth {
        smooth::smooth(record, &mut trace, &tracker.start)?;
    }
    Ok(trace)
}
