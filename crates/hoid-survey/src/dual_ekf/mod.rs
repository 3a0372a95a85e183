//! Two alternating extended Kalman filters: one for the state with the parameters held constant, one for the parameters
//! with the state held constant (E. A. Wan and A. T. Nelson, *Dual extended Kalman filter methods*, chapter 5 of S.
//! Haykin (ed.), *Kalman Filtering and Neural Networks*, 2001; for human operators: A. Popovici, P. M. T. Zaal and D.
//! M. Pool, *Dual extended Kalman filter for the identification of time-varying human manual control behavior*, AIAA
//! 2017).
//!
//! The state `x = [y_0, y_1, .., n]` consists of the neuromuscular position and rate, and the remnant as an AR(1)
//! process:
//!
//! `x(k) = A(w) x(k-1) + B(w) e(k - nk) + w_x`, `u = C(w) x`, `C = [K_e, K_e_dot, 1]`,
//!
//! where A and B follow from the exact hold. The parameters `w = [K_e, K_e_dot, omega_nm, zeta_nm]` are a random walk.
//! At each sample the parameters are predicted (they stay constant, P_w grows), the state is predicted with these
//! parameters, and the innovation `eps = u - C x` corrects both the state and the parameters. The parameters are
//! corrected along the total derivative `h = d(C x)/dw`, which includes the dependence of the state on the parameters:
//!
//! `D(k|k-1) = A D(k-1|k-1) + (dA/dw) x + (dB/dw) e`, `h = C D(k|k-1) + (dC/dw) x`, `D(k|k) = D(k|k-1) - g h`, where g
//! is the gain of the state filter, whose dependence on w is neglected.
//!
//! A joint filter ([`crate::joint_filter`]) also estimates the covariance between the state and the parameters, which
//! two alternating filters neglect. By default the delay is a whole number of samples, as in all other methods. If
//! `pade` is 1 to 3, the delay is a further parameter and may change or differ from a multiple of the sample time. It
//! is represented by the Padé approximation of this order ([`super::pade`]), as in the source and in the discussion of
//! the thesis. The states of the approximation lie between y_1 and n.

mod filters;
mod pade;

use std::collections::BTreeMap;

use hoid_core::{
    delay::DelayLine,
    state::{State, visit_all},
};
use hoid_ident::{Constraint, IdentError, settings, settings::Bounds};
use hoid_model::{
    Record, SampleTime, Structure,
    uncertainty::{Estimate, OperatorEstimate},
};
use hoid_track::{
    BoundOptions, Memory, Sample,
    building::{
        Delay, MethodDescription, OPERATOR_PARAMETER_COUNT, Recursion, RecursiveMethod, ReportedModel, Setup,
        StartState, StepOutcome, invalid_option, physical_bounds,
    },
};
use nalgebra::{DMatrix, DVector};

use crate::known_noise::{check_first_order, lead_time};
use filters::{Filters, MAX_PARAMETERS};

const NAME: &str = "dual-ekf";
/// Range of the delay if it is estimated with a Padé approximation, s.
const DELAY_RANGE_S: (f64, f64) = (0.05, 0.6);
/// Smallest initial standard error of each parameter, relative to its value, if the delay is estimated.
const MIN_RELATIVE_ERROR: f64 = 0.1;

settings! {
    /// Options of the two filters.
    pub struct DualEkfOptions {
        /// Drift of K_e and K_e_dot per root second, relative to their start
        #[setting(bounds(Bounds::NonNegative))]
        pub gain_drift: f64 = 0.1,
        /// Drift of omega_nm and zeta_nm per root second, relative to their start
        #[setting(bounds(Bounds::NonNegative))]
        pub nms_drift: f64 = 0.005,
        /// Drift of tau_e per root second, relative to its start, with a Padé approximation
        #[setting(bounds(Bounds::NonNegative))]
        pub delay_drift: f64 = 0.02,
        /// Noise added to e at the input of the neuromuscular system, relative to the size of e
        #[setting(bounds(Bounds::NonNegative))]
        pub state_noise: f64 = 0.1,
        /// Root mean square of e
        #[setting(bounds(Bounds::NonNegative), default("from the record, or from the stream so far"))]
        pub error_size: Option<f64> = None,
        /// Order of the Padé approximation of the delay, 1 to 3; 0 for whole samples
        pub pade: usize = 0,
    }
    groups {
        /// Bounds of the parameters.
        pub bounds: BoundOptions,
    }
}

impl RecursiveMethod for DualEkfOptions {
    fn description(&self) -> MethodDescription {
        MethodDescription {
            name: NAME,
            help: "two alternating extended Kalman filters, one for the state and one for the parameters, for \
                   comparison",
            source: "Wan and Nelson 2001; Popovici, Zaal and Pool 2017",
            structures: &[Structure::BoxJenkins, Structure::General],
            defaults: &[],
        }
    }

    /// The memory length follows from the random walk of the parameters.
    fn default_memory(&self, _parameter: &str) -> Memory {
        Memory::Infinite
    }

    fn default_nd(&self) -> Option<usize> {
        Some(1)
    }

    fn check(&self, setup: &Setup) -> Result<(), IdentError> {
        check_first_order(NAME, setup)?;
        if self.pade > pade::MAX_ORDER {
            return Err(invalid_option(
                "the order of the Padé approximation",
                self.pade.to_string(),
                &format!("0 to {}", pade::MAX_ORDER),
            ));
        }
        Ok(())
    }

    fn build(
        &self,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        Ok(Box::new(DualEkf::new(self, setup, from, sample_time)?))
    }

    fn is_physical(&self) -> bool {
        true
    }

    fn models_change(&self) -> bool {
        true
    }

    fn memory_as_text(&self) -> Option<String> {
        Some("random walk of the parameters".to_owned())
    }

    fn bounds(&self) -> BTreeMap<String, Constraint> {
        self.bounds.bound.clone()
    }

    fn track_delay_s(&self) -> Option<(f64, f64)> {
        (self.pade > 0).then_some(DELAY_RANGE_S)
    }

    fn prepare(&mut self, record: &Record) {
        let e = record.input();
        if self.error_size.is_none() && !e.is_empty() {
            self.error_size = Some((e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64).sqrt());
        }
    }

    fn retain(&mut self, known: &dyn Fn(&str) -> bool) {
        self.bounds.bound.retain(|key, _| known(key));
    }
}

/// The recursion of the two filters.
struct DualEkf {
    filters: Filters,
    first: Filters,
    bounds: [[f64; 2]; MAX_PARAMETERS],
    delay: DelayLine<Vec<f64>>,
    reported: ReportedModel,
    /// Noise added to e, relative to the root mean square of e. `power` is the mean square of e, either given or
    /// computed from the samples so far.
    state_noise: f64,
    has_given_variance: bool,
    power: f64,
    samples: f64,
    /// Predicted innovation variance at the last sample.
    expected: f64,
    restarts: u64,
}

impl DualEkf {
    fn new(
        own: &DualEkfOptions,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Self, IdentError> {
        if !from.from_fit {
            return Err(IdentError::BadStart {
                reason: "dual-ekf needs the noise model of a batch fit; start it from the fit of a span".to_owned(),
            });
        }
        let (ts, width) = (sample_time.s(), from.values.len());
        let mut values = from.values[..OPERATOR_PARAMETER_COUNT].to_vec();
        let mut errors: Vec<f64> = (0..OPERATOR_PARAMETER_COUNT)
            .map(|i| (from.variance * from.spread[i * width + i]).max(0.0).sqrt())
            .collect();
        let mut drifts = vec![own.gain_drift, own.gain_drift, own.nms_drift, own.nms_drift];
        if own.pade > 0 {
            values.push((setup.orders.nk as f64 - 1.0) * ts);
            errors.push(0.0);
            drifts.push(own.delay_drift);
        }
        // The standard errors of the start fit apply to its fixed delay; if the delay is estimated, the other
        // parameters are less certain.
        let least = if own.pade > 0 { MIN_RELATIVE_ERROR } else { 0.0 };
        let power = own.error_size.map_or(0.0, |size| size * size);
        let (n, p) = (3 + own.pade, values.len());
        let of = |value: fn(f64, f64, f64) -> f64| {
            DVector::from_fn(p, |i, _| {
                value(values[i], errors[i].max(least * values[i].abs()), drifts[i])
            })
        };
        let filters = Filters {
            sample_time,
            d1: from.values[OPERATOR_PARAMETER_COUNT],
            pade: own.pade,
            innovation_variance: from.variance,
            input_noise_variance: own.state_noise * own.state_noise * power,
            x: DVector::zeros(n),
            p: DMatrix::identity(n, n) * power,
            w: of(|value, _, _| value),
            p_w: DMatrix::from_diagonal(&of(|_, error, _| error * error)),
            walk: of(|value, _, drift| (drift * value).powi(2)) * ts,
            slope: DMatrix::zeros(n, p),
        };
        let [k_e, k_e_dot, omega, zeta] = physical_bounds::<OPERATOR_PARAMETER_COUNT>(setup, sample_time)?;
        // With a Padé approximation the filters contain the delay, except for the one sample of the hold.
        let late = if own.pade == 0 { setup.orders.nk } else { 1 };
        Ok(Self {
            first: filters.clone(),
            filters,
            bounds: [
                k_e,
                k_e_dot,
                omega,
                zeta,
                [DELAY_RANGE_S.0.max(ts), DELAY_RANGE_S.1.max(ts)],
            ],
            delay: DelayLine::new(vec![0.0; late]),
            reported: ReportedModel::new(from, setup.orders.nk, sample_time),
            state_noise: own.state_noise,
            has_given_variance: own.error_size.is_some(),
            power,
            samples: 0.0,
            expected: from.variance,
            restarts: 0,
        })
    }

    fn predict(&mut self, e: f64) {
        if !self.has_given_variance {
            self.samples += 1.0;
            self.power += (e * e - self.power) / self.samples;
            self.filters.input_noise_variance = self.state_noise * self.state_noise * self.power;
        }
        let e = self.delay.step(e);
        self.filters.predict(e);
    }

    fn take(&mut self, sample: Sample, moves: bool) -> StepOutcome {
        self.predict(sample.e);
        let [innovation, expected] = self.filters.correct(sample.u, moves);
        let mut shortened = moves && self.filters.clamp_parameters(&self.bounds);
        if self.filters.is_valid() && expected.is_finite() {
            self.expected = expected;
        } else {
            self.filters = self.first.clone();
            self.power = 0.0;
            self.samples = 0.0;
            self.restarts += 1;
            shortened = true;
        }
        self.reported.set_operator(self.eta());
        StepOutcome { innovation, shortened }
    }

    fn eta(&self) -> [f64; OPERATOR_PARAMETER_COUNT] {
        std::array::from_fn(|i| self.filters.w[i])
    }

    fn eta_covariance(&self) -> [[f64; OPERATOR_PARAMETER_COUNT]; OPERATOR_PARAMETER_COUNT] {
        std::array::from_fn(|i| std::array::from_fn(|j| self.filters.p_w[(i, j)]))
    }
}

impl State for DualEkf {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let own = &mut self.filters;
        let parts: &mut [&mut dyn State] = &mut [
            &mut own.input_noise_variance,
            &mut own.x.as_mut_slice(),
            &mut own.p.as_mut_slice(),
            &mut own.w.as_mut_slice(),
            &mut own.p_w.as_mut_slice(),
            &mut own.slope.as_mut_slice(),
            &mut self.delay,
            &mut self.reported,
            &mut self.power,
            &mut self.samples,
            &mut self.expected,
            &mut self.restarts,
        ];
        visit_all(parts, each);
        // Numbers that the caller restored or changed must also lie within the bounds.
        self.filters.clamp_parameters(&self.bounds);
    }
}

impl Recursion for DualEkf {
    fn step(&mut self, sample: Sample) -> StepOutcome {
        self.take(sample, true)
    }

    fn step_without_update(&mut self, sample: Sample) -> StepOutcome {
        self.take(sample, false)
    }

    fn bridge(&mut self, sample: Sample) {
        self.predict(sample.e);
    }

    fn theta(&self) -> &[f64] {
        self.reported.theta()
    }

    fn covariance(&self, into: &mut [f64]) -> bool {
        self.reported.covariance(&self.eta_covariance(), into);
        true
    }

    fn innovation_variance(&self) -> f64 {
        self.expected
    }

    fn delay(&self) -> Option<Delay> {
        let tau = *self.filters.w.get(OPERATOR_PARAMETER_COUNT)?;
        Some(Delay {
            nk: self.filters.sample_time.nk(tau),
            tau_e_s: Estimate::with_variance(
                tau,
                self.filters.p_w[(OPERATOR_PARAMETER_COUNT, OPERATOR_PARAMETER_COUNT)],
            ),
        })
    }

    fn operator(&self) -> Option<OperatorEstimate> {
        let (eta, c) = (self.eta(), self.eta_covariance());
        let operator = self.reported.operator(eta, &c, lead_time(eta, &c));
        Some(match self.delay() {
            Some(Delay { tau_e_s, .. }) => OperatorEstimate { tau_e_s, ..operator },
            None => operator,
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::{Condition, Scenario};
    use hoid_sim::{RunSeed, Simulator};
    use hoid_track::{Method, StartSource, TrackOptions, track};

    use super::*;

    fn run(condition: Condition, level: f64, replication: u64) -> Record {
        let mut scenario = Scenario::condition(condition);
        scenario.remnant.order = 1;
        if let hoid_model::scenario::RemnantStrength::Level { level: of, .. } = &mut scenario.remnant.strength {
            *of = level;
        }
        let seed = RunSeed {
            seed: 101,
            cell: 0,
            replication,
        };
        Simulator::new(&scenario).unwrap().run(seed, false).unwrap()
    }

    fn options(own: DualEkfOptions, span_s: (f64, f64), nk: usize) -> TrackOptions {
        TrackOptions {
            start: StartSource::Span(Some(span_s)),
            ..TrackOptions::default_for(Method::from(own), nk)
        }
    }

    #[test]
    fn gains_after_a_change_are_close_on_average() {
        const RUN_COUNT: u64 = 8;
        let mut mean = [0.0; 2];
        for replication in 0..RUN_COUNT {
            let record = run(Condition::C4, 0.1, replication);
            let trace = track(&record, &options(DualEkfOptions::default(), (0.0, 30.72), 29), 100).unwrap();
            let operator = trace.operator(64).unwrap();
            mean[0] += operator.k_e_dot.value / 0.084 / RUN_COUNT as f64;
            mean[1] += operator.omega_nm_rad_s.value / 11.25 / RUN_COUNT as f64;
        }
        // The standard errors of the means are 3 % and 1 %.
        assert!((mean[0] - 1.0).abs() < 0.12 && (mean[1] - 1.0).abs() < 0.1, "{mean:?}");
    }

    /// A filter with the delay as a parameter corrects a delay that is wrong by two samples.
    #[test]
    fn delay_in_pade_form_is_tracked() {
        let record = run(Condition::C1, 0.01, 0).span(0.0, 30.72).unwrap();
        let own = DualEkfOptions {
            pade: 3,
            ..DualEkfOptions::default()
        };
        let trace = track(&record, &options(own.clone(), (0.0, 10.24), 27), 100).unwrap();
        let delay = |row: usize| trace.operator(row).unwrap().tau_e_s.value;
        assert!((delay(4) - 0.26).abs() < 1e-9, "it stays until the start span ends");
        // The estimated delay is within one sample of the true value.
        assert!((delay(29) - 0.28).abs() < 0.01, "{}", delay(29));
        let many = DualEkfOptions { pade: 4, ..own };
        let refused = track(&record, &options(many, (0.0, 10.24), 27), 100).unwrap_err();
        assert!(refused.to_string().contains("Padé"), "{refused}");
    }
}
