//! A tracker over a run with a fault, compared with the tracker over the run without the fault.

use hoid::{
    model::{remnant_gain::NoiseDefinition, scenario::RemnantStrength},
    prelude::*,
    track::{GuardEvent, Sample, StartSource, TrackOptions, Tracker},
};

use super::faults::Fault;

/// Length of the start span, s.
const START_SPAN_S: f64 = 30.72;
/// Number of samples between two comparisons of the estimate.
const COMPARISON_INTERVAL: usize = 20;
/// Number of consecutive comparisons that span more than a second.
const LASTING_COMPARISONS: usize = 6;

/// A run of one person that lasts some minutes.
pub struct Run {
    pub e: Vec<f64>,
    pub u: Vec<f64>,
    pub start: Record,
}

impl Run {
    pub fn new(condition: Condition, remnant_order: usize, seed: u64, seconds: f64) -> Self {
        let mut scenario = Scenario::condition(condition);
        scenario.remnant.order = remnant_order;
        scenario.remnant.strength = RemnantStrength::Level {
            level: 0.1,
            definition: NoiseDefinition::Response,
        };
        scenario.measurement_s = seconds;
        let seed = RunSeed {
            seed,
            ..RunSeed::default()
        };
        let record = Simulator::new(&scenario).unwrap().run(seed, false).unwrap();
        Self {
            e: record.input().to_vec(),
            u: record.output().to_vec(),
            start: record.span(0.0, START_SPAN_S).unwrap(),
        }
    }

    /// Processes all samples a number of times.
    #[allow(dead_code)]
    pub fn process_repeatedly(&self, options: &TrackOptions, times: u64) {
        let mut tracker = Tracker::new(options, Some(&self.start), self.start.sample_time()).unwrap();
        for _ in 0..times {
            for (e, u) in self.e.iter().zip(&self.u) {
                tracker.step(*e, *u);
            }
        }
        assert!(tracker.theta().iter().all(|t| t.is_finite()));
    }

    fn per_second(&self) -> f64 {
        1.0 / self.start.sample_time().s()
    }
}

/// Estimate at a sample: K_e, K_e_dot, omega_nm, zeta_nm with standard errors.
type Estimate = [[f64; 2]; 4];

fn estimate(tracker: &Tracker) -> Option<Estimate> {
    let operator = tracker.operator().ok()?;
    let all = [
        operator.k_e,
        operator.k_e_dot,
        operator.omega_nm_rad_s,
        operator.zeta_nm,
    ];
    Some(all.map(|e| [e.value, e.standard_error.unwrap_or(f64::NAN)]))
}

/// The tracker over the run without a fault.
pub struct Reference {
    options: TrackOptions,
    /// Estimates at every [`COMPARISON_INTERVAL`]-th sample.
    estimates: Vec<Option<Estimate>>,
    innovation: f64,
    pub held: u64,
    pub restarts: u64,
    /// Events of the guard in the run without a fault.
    pub events: Vec<GuardEvent>,
}

/// Effect of a fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effect {
    /// Largest difference from the estimate without the fault that lasts for more than a second, evaluated from one
    /// second after the fault on, in standard errors of the estimate without the fault.
    pub shift: f64,
    /// Time after the fault from which the difference is at most twice the larger standard error; `None` if this never
    /// happens.
    pub recovery_s: Option<f64>,
    pub held: u64,
    pub skipped: u64,
    pub restarts: u64,
    /// True if the guard reported an event during or after the fault.
    pub told: bool,
}

impl Reference {
    /// Tracks the run without a fault. `options` determine the guard of the compared method; the reference has no
    /// guard.
    pub fn new(run: &Run, options: &TrackOptions) -> Self {
        let options = TrackOptions {
            start: StartSource::Span(Some((0.0, START_SPAN_S))),
            ..options.clone()
        };
        let bare = options.clone().with(&[("guard", "no")]).unwrap();
        let mut reference = Self {
            options,
            estimates: Vec::new(),
            innovation: 0.0,
            held: 0,
            restarts: 0,
            events: Vec::new(),
        };
        let mut tracker = Tracker::new(&bare, Some(&run.start), run.start.sample_time()).unwrap();
        reference.innovation = tracker.innovation_variance().sqrt();
        let estimates = sampled_estimates(&mut tracker, run, &run.e, &run.u, &mut |_, _| {});
        reference.estimates = estimates;
        // The same run is tracked with the guard, to count the actions of the guard without faults.
        let mut guarded = Tracker::new(&reference.options, Some(&run.start), run.start.sample_time()).unwrap();
        let mut events = Vec::new();
        sampled_estimates(&mut guarded, run, &run.e, &run.u, &mut |_, t| events.extend(t.event()));
        reference.events = events;
        (reference.held, reference.restarts) = (guarded.counts().held, guarded.counts().restarts);
        reference
    }

    /// Returns the effect of a fault at a time.
    pub fn effect(&self, run: &Run, fault: &Fault, at_s: f64) -> Effect {
        let per_second = run.per_second();
        let at = (at_s * per_second) as usize;
        let (mut e, mut u) = (run.e.clone(), run.u.clone());
        let end = fault.insert(&mut e, &mut u, at, per_second, self.innovation);
        let inserted = e.len() - run.e.len();
        let mut tracker = Tracker::new(&self.options, Some(&run.start), run.start.sample_time()).unwrap();
        let mut told = false;
        let estimates = sampled_estimates(&mut tracker, run, &e, &u, &mut |k, t| {
            told |= t.event().is_some() && k + 1 >= at;
        });
        let (mut shift, mut last_far) = (0.0_f64, None);
        let mut lately = [[0.0; 4]; LASTING_COMPARISONS];
        for (n, found) in estimates.iter().enumerate() {
            let k = (n + 1) * COMPARISON_INTERVAL - 1;
            if k < end {
                continue;
            }
            let clean = k
                .checked_sub(inserted)
                .and_then(|k| self.estimates[(k + 1) / COMPARISON_INTERVAL - 1]);
            let Some(clean) = clean else { continue };
            let mut far = found.is_none();
            lately.rotate_left(1);
            lately[LASTING_COMPARISONS - 1] = [f64::INFINITY; 4];
            for (i, (a, b)) in found.iter().flatten().zip(&clean).enumerate() {
                let distance = (a[0] - b[0]).abs();
                if k as f64 >= end as f64 + per_second {
                    lately[LASTING_COMPARISONS - 1][i] = distance / b[1];
                } else {
                    lately[LASTING_COMPARISONS - 1][i] = 0.0;
                }
                shift = shift.max(lately.iter().map(|of| of[i]).fold(f64::INFINITY, f64::min));
                far |= distance.is_nan() || distance > 2.0 * a[1].max(b[1]);
            }
            if far {
                last_far = Some(n);
            }
        }
        let recovered = match last_far {
            None => Some(0.0),
            Some(n) if n + 1 == estimates.len() => None,
            Some(n) => Some(((n + 2) * COMPARISON_INTERVAL - end) as f64 / per_second),
        };
        let counts = tracker.counts();
        Effect {
            shift,
            recovery_s: recovered,
            held: counts.held,
            skipped: counts.skipped,
            restarts: counts.restarts,
            told,
        }
    }
}

fn sampled_estimates(
    tracker: &mut Tracker,
    run: &Run,
    e: &[f64],
    u: &[f64],
    each: &mut dyn FnMut(usize, &Tracker),
) -> Vec<Option<Estimate>> {
    let start = run.start.len();
    let mut all = Vec::with_capacity(e.len() / COMPARISON_INTERVAL);
    for k in 0..e.len() {
        let sample = Sample {
            e: e[k],
            u: u[k],
            reference: None,
        };
        tracker.update(sample, k >= start);
        each(k, tracker);
        if (k + 1) % COMPARISON_INTERVAL == 0 {
            all.push(estimate(tracker));
        }
    }
    all
}
