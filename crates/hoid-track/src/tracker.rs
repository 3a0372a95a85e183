//! A recursive estimate that takes one sample at a time.

use hoid_core::guard::reference::ReferenceModel;
use hoid_ident::{
    Fit, IdentError,
    family::{KnownResponse, LoopShape},
};
use hoid_model::{
    Complex64, ContinuousTransferFunction, Finding, NotConvertible, Orders, Record, SampleTime,
    uncertainty::{Estimate, OperatorEstimate},
};

use crate::{
    change::Change,
    guard::{Guard, GuardDecision, GuardEvent},
    open_loop::{NoCrossover, OpenLoop},
    options::TrackOptions,
    outcome::{Counts, Outcome},
    recursion::{Recursion, Sample},
    response::Response,
    setup::StartSource,
    start::StartState,
    stationary::{RecursionCall, StationaryWatch},
    trace::operator_from_theta,
};

/// Frequency at which the sign of a response is examined, rad/s.
const SIGN_CHECK_RAD_S: f64 = 0.5;
/// Frequencies (in rad/s) at which the error of the response is examined, and the standard error in dB below which a
/// response counts as known.
const ERROR_CHECK_RAD_S: [f64; 3] = [1.0, 2.0, 4.0];
const MAX_KNOWN_ERROR_DB: f64 = 2.0;
/// Range of the phase of people's responses at [`SIGN_CHECK_RAD_S`] (in deg): a lag and a delay give -110, two leads
/// 70.
const PHASE_RANGE_DEG: (f64, f64) = (-120.0, 75.0);
/// Smallest distance, in standard errors, of an implausible phase from the range of people's phases.
const IMPLAUSIBLE_DISTANCE: f64 = 2.0;
/// Quantile of the normal distribution for 95 %.
const NORMAL_QUANTILE: f64 = 1.96;

/// A recursive estimate that takes one sample at a time.
pub struct Tracker {
    pub(crate) options: TrackOptions,
    pub(crate) sample_time: SampleTime,
    pub(crate) recursion: Box<dyn Recursion>,
    pub(crate) guard: Option<Box<Guard>>,
    pub(crate) stationary: Option<Box<StationaryWatch>>,
    /// True if the last sample updated the estimate.
    pub(crate) moved: bool,
    pub(crate) last_e: f64,
    pub(crate) counts: Counts,
    pub(crate) start: StartState,
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
    /// Builds a tracker with filters at rest. `span` is the record of the start fit. Without it, the tracker starts
    /// from given coefficients or without knowledge, as the options require.
    ///
    /// # Errors
    /// [`IdentError`] if options contradict each other, or the start fit fails.
    pub fn new(options: &TrackOptions, span: Option<&Record>, sample_time: SampleTime) -> Result<Self, IdentError> {
        Self::from_fit(options, span, None, sample_time)
    }

    /// Like [`Tracker::new`], with the fit of the start span if it is known.
    pub(crate) fn from_fit(
        options: &TrackOptions,
        span: Option<&Record>,
        known: Option<&Fit>,
        sample_time: SampleTime,
    ) -> Result<Self, IdentError> {
        options.check_at(sample_time)?;
        let setup = options.setup()?;
        let start = StartState::new(&setup, span, known, sample_time)?;
        let mut recursion = options.method.build(&setup, &start, sample_time)?;
        Ok(Self {
            guard: build_guard(options, &mut *recursion, span, sample_time),
            stationary: build_stationary_watch(options, sample_time),
            moved: false,
            recursion,
            options: options.clone(),
            sample_time,
            last_e: 0.0,
            counts: Counts::default(),
            start,
        })
    }

    /// Takes a sample. The number of operations is bounded, regardless of the values and of the length of the run. On a
    /// PC at 100 samples per second, `adaptive` takes 33 us in the median and 86 us at the 99 % quantile; without
    /// replays (`replay` of 0) it takes 0.5 and 22 us, and `rpem` takes 0.1 and 0.2 us.
    pub fn step(&mut self, e: f64, u: f64) -> Outcome {
        self.update(Sample { e, u, reference: None }, true)
    }

    /// Takes a sample, with the external signal if it is known. If `moves` is false, only the filters are updated.
    pub fn update(&mut self, sample: Sample, moves: bool) -> Outcome {
        self.counts.samples = self.counts.samples.saturating_add(1);
        let sound = |v: f64| v.abs() <= self.options.largest;
        let (e_sound, u_sound) = (sound(sample.e), sound(sample.u));
        if let Some(guard) = &mut self.guard {
            let sample = Sample {
                e: if e_sound { sample.e } else { f64::NAN },
                u: if u_sound { sample.u } else { f64::NAN },
                reference: sample.reference.filter(|r| sound(*r)),
            };
            let before = guard.restart_count();
            let guarded = guard.process(&mut *self.recursion, sample, moves);
            self.counts.restarts = self
                .counts
                .restarts
                .saturating_add(guard.restart_count().saturating_sub(before));
            return self.guarded_outcome(guarded, !(e_sound && u_sound));
        }
        let sample = Sample {
            e: if e_sound { sample.e } else { self.last_e },
            reference: sample.reference.filter(|r| sound(*r)),
            ..sample
        };
        self.last_e = sample.e;
        let skipped = !(e_sound && u_sound);
        let act = match (u_sound, moves && e_sound) {
            (false, _) => RecursionCall::Bridge,
            (true, true) => RecursionCall::Step,
            (true, false) => RecursionCall::Follow,
        };
        let GuardDecision { outcome, held } = match &mut self.stationary {
            Some(stationary) => stationary.process(&mut *self.recursion, sample, act),
            None => GuardDecision {
                outcome: act.on(&mut *self.recursion, sample),
                held: false,
            },
        };
        self.moved = act == RecursionCall::Step && !held;
        let taken = outcome.filter(|_| !skipped && !held);
        let shortened = outcome.is_some_and(|outcome| outcome.shortened);
        self.counts.skipped = self.counts.skipped.saturating_add(u64::from(skipped));
        self.counts.held = self.counts.held.saturating_add(u64::from(held && !skipped));
        self.counts.shortened = self.counts.shortened.saturating_add(u64::from(shortened));
        Outcome {
            innovation: taken.map(|taken| taken.innovation),
            skipped,
            held: held && !skipped,
            shortened,
        }
    }

    /// Updates the counts and returns the outcome of a sample that a guard or the watch for constant signals has
    /// examined.
    #[inline]
    fn guarded_outcome(&mut self, guarded: GuardDecision, skipped: bool) -> Outcome {
        let taken = guarded.outcome.filter(|_| !guarded.held);
        let shortened = taken.is_some_and(|taken| taken.shortened);
        self.moved = taken.is_some();
        self.counts.skipped = self.counts.skipped.saturating_add(u64::from(skipped));
        self.counts.held = self.counts.held.saturating_add(u64::from(guarded.held && !skipped));
        self.counts.shortened = self.counts.shortened.saturating_add(u64::from(shortened));
        Outcome {
            innovation: taken.map(|taken| taken.innovation),
            skipped,
            held: guarded.held && !skipped,
            shortened,
        }
    }

    /// Returns the event that the guard reported at the last sample.
    pub fn event(&self) -> Option<GuardEvent> {
        let of_guard = self.guard.as_ref().and_then(|guard| guard.event());
        of_guard.or_else(|| self.stationary.as_ref()?.event())
    }

    /// True while the estimate stays constant, because of the guard or because the samples carry no information.
    pub fn is_paused(&self) -> bool {
        let of_guard = self.guard.as_ref().is_some_and(|guard| guard.is_paused());
        of_guard
            || self
                .stationary
                .as_ref()
                .is_some_and(|stationary| stationary.is_paused())
    }

    /// Returns the time since the last restart by the guard (in s); `None` if there was none.
    pub fn time_since_restart_s(&self) -> Option<f64> {
        self.guard.as_ref()?.time_since_restart_s()
    }

    /// Returns theta in the order of [`Tracker::parameter_names`].
    pub fn theta(&self) -> &[f64] {
        self.recursion.theta()
    }

    /// Returns the names of the coefficients.
    pub fn parameter_names(&self) -> Vec<String> {
        self.options.coefficient_names()
    }

    /// Returns the covariance of theta by rows; `None` while there is none.
    pub fn covariance(&self) -> Option<Vec<f64>> {
        let p = self.theta().len();
        let mut covariance = vec![0.0; p.saturating_mul(p)];
        self.recursion.covariance(&mut covariance).then_some(covariance)
    }

    /// True once there is an estimate. A method that starts without a fit has one only after informative samples.
    pub fn has_estimate(&self) -> bool {
        !self.options.method.is_self_starting() || self.covariance().is_some()
    }

    /// Returns each coefficient with its standard error.
    pub fn parameters(&self) -> Vec<Estimate> {
        let theta = self.theta();
        let Some(covariance) = self.covariance() else {
            return theta.iter().copied().map(Estimate::fixed).collect();
        };
        let variances = covariance.iter().step_by(theta.len().saturating_add(1));
        let pairs = theta.iter().zip(variances);
        pairs
            .map(|(value, variance)| Estimate::with_variance(*value, *variance))
            .collect()
    }

    /// Returns the operator with standard errors.
    ///
    /// # Errors
    /// [`NotConvertible`] with the reason.
    pub fn operator(&self) -> Result<OperatorEstimate, NotConvertible> {
        match self.recursion.operator() {
            Some(operator) if operator.t_l_s.value.is_finite() => Ok(operator),
            Some(_) => Err(NotConvertible::ZeroGain),
            None => {
                let covariance = self.covariance();
                let (theta, covariance) = self.options.first_input_part(self.theta(), covariance.as_deref());
                operator_from_theta(
                    self.options.structure,
                    self.options.orders,
                    self.recursion.delay().as_ref(),
                    self.sample_time,
                    theta,
                    covariance.as_deref(),
                )
            }
        }
    }

    /// Returns the orders of the polynomials, with the current delay.
    fn orders(&self) -> Orders {
        let orders = self.options.polynomial_orders();
        let delay = self.recursion.delay();
        delay.map_or(orders, |delay| Orders { nk: delay.nk, ..orders })
    }

    /// Returns the response of the estimate at a frequency in rad/s; `None` while there is no estimate.
    pub fn response(&self, omega_rad_s: f64) -> Option<Response> {
        if self.options.method.is_self_starting() {
            return self.recursion.response(omega_rad_s);
        }
        let orders = self.orders();
        let covariance = self.covariance();
        let ts = self.sample_time;
        let (theta, whole) = self.options.first_input_part(self.theta(), covariance.as_deref());
        let whole = whole.as_deref();
        Some(Response::from_polynomials(&orders, theta, whole, omega_rad_s, ts))
    }

    /// Returns the crossover and phase margin with the controlled element of the options; `None` without a controlled
    /// element.
    pub fn open_loop(&self) -> Option<Result<OpenLoop, NoCrossover>> {
        let element = self.options.controlled_element.as_ref()?;
        let whole = |omega: f64| self.response(omega);
        if self.options.method.is_self_starting() {
            let value = |omega: f64| self.recursion.response_value(omega);
            return Some(OpenLoop::of(value, whole, element, self.sample_time));
        }
        let orders = self.orders();
        let value = |omega: f64| {
            let alone = Response::polynomial_response_value(&orders, self.theta(), omega, self.sample_time);
            Some(alone)
        };
        Some(OpenLoop::of(value, whole, element, self.sample_time))
    }

    /// True if the method has a basis with more forms than gain and lead, and determines the current response within 2
    /// dB at one of the frequencies [`ERROR_CHECK_RAD_S`]: gain and lead may then be undetermined.
    pub(crate) fn response_is_known(&self) -> bool {
        let known = |omega: &f64| {
            let gain = self
                .response(*omega)
                .and_then(|response| response.gain_db().standard_error);
            gain.is_some_and(|error| error < MAX_KNOWN_ERROR_DB)
        };
        self.options.method.basis_lag_s().is_some() && ERROR_CHECK_RAD_S.iter().any(known)
    }

    /// Returns every crossing of the current open loop with the controlled element of the options; `None` without a
    /// controlled element or without an estimate.
    pub(crate) fn open_loop_shape(&self) -> Option<LoopShape> {
        let element = self.options.controlled_element.as_ref()?;
        self.response(1.0)?;
        Some(self.loop_shape(element))
    }

    fn loop_shape(&self, element: &ContinuousTransferFunction) -> LoopShape {
        let known = |omega: f64| {
            let unknown = KnownResponse {
                value: Complex64::new(f64::NAN, f64::NAN),
                relative: None,
            };
            self.response(omega).map_or(unknown, |response| KnownResponse {
                value: Complex64::new(response.value[0], response.value[1]),
                relative: response.relative_covariance(),
            })
        };
        LoopShape::of(known, element, self.sample_time)
    }

    /// Returns the finding that the current response is implausible for a person. With a controlled element, the loop
    /// that it forms with the response is examined ([`LoopShape::finding`]); without a controlled element, the sign of
    /// the response at low frequencies.
    pub(crate) fn response_finding(&self) -> Option<Finding> {
        if let Some(element) = &self.options.controlled_element {
            let reach = match self.open_loop()? {
                Ok(found) => NORMAL_QUANTILE * found.phase_margin_deg.standard_error.unwrap_or(0.0),
                Err(NoCrossover::NeverFalls) => 0.0,
                Err(_) => return None,
            };
            return self.loop_shape(element).finding(reach);
        }
        let phase = self.response(SIGN_CHECK_RAD_S)?.phase_deg();
        let reach = IMPLAUSIBLE_DISTANCE * phase.standard_error?;
        let (farthest, most) = PHASE_RANGE_DEG;
        let ahead = if phase.value < farthest {
            phase.value + 360.0
        } else {
            phase.value
        };
        let backwards = ahead - reach > most && ahead + reach < farthest + 360.0;
        backwards.then(|| {
            Finding::warning(
                "sign",
                format!(
                    "the response at {SIGN_CHECK_RAD_S} rad/s has a phase of {:.0} deg: the person would increase the error; \
                     reverse the sign of e or u, or, if the controlled element has a negative gain, give it with \
                     --controlled-element",
                    phase.value
                ),
            )
        })
    }

    /// Returns the evidence of a recent change, as [`Change::odds`]; `None` for methods other than `adaptive` and
    /// `multiple-model`.
    pub fn change_odds(&self) -> Option<f64> {
        self.recursion.change_odds()
    }

    /// Returns the change that was declared at the last sample, if there was one.
    pub fn change(&self) -> Option<Change> {
        if !self.moved {
            return None;
        }
        self.recursion.change()
    }

    /// Returns the last declared change if its parameters were estimated again at the last sample: with two inputs, the
    /// first data after a change hardly show which response changed. Its delay counts from the declaration; its odds
    /// are those of the last sample.
    pub fn revised_change(&self) -> Option<Change> {
        self.recursion.revised_change().filter(|_| self.moved)
    }

    /// Returns the tracked innovation variance.
    pub fn innovation_variance(&self) -> f64 {
        self.recursion.innovation_variance()
    }

    /// Returns the counts of faulty samples.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Returns the number of failed fits and the reason for the last failure, for the method `window`.
    pub fn failures(&self) -> Option<(usize, String)> {
        self.recursion.failures()
    }

    /// Returns the batch fit of the start span.
    pub fn start(&self) -> Option<&Fit> {
        self.start.fit.as_ref()
    }

    /// Returns the options.
    pub fn options(&self) -> &TrackOptions {
        &self.options
    }
}

fn largest_nk(options: &TrackOptions, sample_time: SampleTime) -> usize {
    let tracked = options.method.track_delay_s();
    let latest = tracked.map_or(0.0, |(_, high)| high / sample_time.s());
    options.orders.nk.max((latest.ceil() as usize).saturating_add(1))
}

/// Builds the watch for constant signals; `None` if the option `guard` is given, whether yes or no.
pub(crate) fn build_stationary_watch(options: &TrackOptions, sample_time: SampleTime) -> Option<Box<StationaryWatch>> {
    if options.method.guard().is_some() {
        return None;
    }
    StationaryWatch::new(largest_nk(options, sample_time), sample_time).map(Box::new)
}

/// Builds the guard of a recursion at its start; `None` if the options do not require one.
pub(crate) fn build_guard(
    options: &TrackOptions,
    recursion: &mut dyn Recursion,
    span: Option<&Record>,
    sample_time: SampleTime,
) -> Option<Box<Guard>> {
    let method = &options.method;
    if !method.is_guarded() {
        return None;
    }
    let nk = largest_nk(options, sample_time);
    let mut guard = Guard::new(recursion, nk, span, sample_time);
    let o = options.orders;
    if matches!(options.start, StartSource::Span(_))
        && !method.is_self_starting()
        && method.track_delay_s().is_none()
        && let Some(model) = ReferenceModel::new([o.na, o.nb, o.nc, o.nd, o.nf], recursion.theta())
    {
        guard.compare_with(model, o.nk);
    }
    Some(Box::new(guard))
}
