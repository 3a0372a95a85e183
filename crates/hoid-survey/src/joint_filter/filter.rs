//! The recursion of the joint filter of the state and the parameters: start, bounds and restarts.

use hoid_core::{
    bounds::clamp,
    delay::DelayLine,
    state::{State, visit_all},
};
use hoid_ident::IdentError;
use hoid_model::{SampleTime, uncertainty::OperatorEstimate};

use hoid_track::{
    Sample,
    building::{OPERATOR_PARAMETER_COUNT, Recursion, ReportedModel, Setup, StartState, StepOutcome, physical_bounds},
};

use crate::known_noise::lead_time;

use super::belief::{AugmentedState, ETA_START, Model, N};

/// Function that processes a sample and returns the innovation and its predicted variance.
pub(super) type Update = fn(&Model, &mut AugmentedState, f64, f64) -> [f64; 2];

/// Ratio of the assumed variance of n to the variance of the remnant. The ratio exceeds one because a coloured remnant
/// is less informative than a white one of equal variance.
const OUTPUT_NOISE_RATIO: f64 = 10.0;
/// Variance per second of the noise that drives v in addition to the error, as a multiple of the variance of the
/// remnant divided by `(g/omega)^2`, where g and omega are as in [`GAIN_DRIFT`].
const STATE_NOISE_RATIO: f64 = 10.0;
/// Standard deviations of the drift of K_e and K_e_dot in one second, in units of `g = sqrt(K_e^2 + omega^2 K_e_dot^2)`
/// and `g/omega`, where omega is the crossover frequency.
const GAIN_DRIFT: [f64; 2] = [0.02, 0.05];
/// Crossover frequency, rad/s.
const CROSSOVER_RAD_S: f64 = 2.0;
/// Standard deviation of the drift of omega_nm and zeta_nm in one second, relative to their values.
const NEUROMUSCULAR_DRIFT: f64 = 0.003;
/// Largest variance of a parameter, as a multiple of the square of its initial value.
const MAX_VARIANCE_RATIO: f64 = 25.0;
/// Length of the computed impulse response of 1/D, samples.
const RESPONSE_SAMPLES: usize = 1000;

/// The recursion of a joint filter.
pub(crate) struct JointFilter {
    update: Update,
    model: Model,
    belief: AugmentedState,
    first: AugmentedState,
    bounds: [[f64; 2]; OPERATOR_PARAMETER_COUNT],
    delay: DelayLine<Vec<f64>>,
    reported: ReportedModel,
    /// Predicted innovation variance at the last sample.
    expected: f64,
    restarts: u64,
}

impl JointFilter {
    /// Creates the filter from the batch fit of the start span.
    ///
    /// # Errors
    /// [`IdentError::BadStart`] if the start is not a batch fit.
    pub(super) fn new(
        update: Update,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Self, IdentError> {
        if !from.from_fit {
            return Err(IdentError::BadStart {
                reason: "ekf and ukf need the noise level of a batch fit; start them from the fit of a span".to_owned(),
            });
        }
        let width = from.values.len();
        let mut belief = AugmentedState {
            x: [0.0; N],
            p: [[0.0; N]; N],
        };
        for i in 0..OPERATOR_PARAMETER_COUNT {
            belief.x[ETA_START + i] = from.values[i];
            for j in 0..OPERATOR_PARAMETER_COUNT {
                belief.p[ETA_START + i][ETA_START + j] = from.variance * from.spread[i * width + j];
            }
        }
        let model = model(&belief.x, from, sample_time);
        Ok(Self {
            update,
            model,
            first: belief,
            belief,
            bounds: physical_bounds::<OPERATOR_PARAMETER_COUNT>(setup, sample_time)?,
            delay: DelayLine::new(vec![0.0; setup.orders.nk]),
            reported: ReportedModel::new(from, setup.orders.nk, sample_time),
            expected: from.variance,
            restarts: 0,
        })
    }

    /// Keeps the parameters within their bounds and limits their variances; restarts if a number is not finite. Returns
    /// true after a restart or if a parameter was changed.
    fn limit_estimate(&mut self) -> bool {
        let mut cut = false;
        let sound =
            self.belief.x.iter().all(|x| x.is_finite()) && self.belief.p.iter().flatten().all(|p| p.is_finite());
        if !sound {
            self.belief = self.first;
            self.restarts += 1;
            return true;
        }
        for (i, bounds) in self.bounds.into_iter().enumerate() {
            let x = &mut self.belief.x[ETA_START + i];
            let bounded = clamp(*x, bounds);
            cut |= bounded != *x;
            *x = bounded;
            let largest = MAX_VARIANCE_RATIO * self.first.x[ETA_START + i].powi(2);
            let variance = self.belief.p[ETA_START + i][ETA_START + i];
            if variance > largest && largest > 0.0 {
                let shrink = (largest / variance).sqrt();
                for j in 0..N {
                    self.belief.p[ETA_START + i][j] *= shrink;
                    self.belief.p[j][ETA_START + i] *= shrink;
                }
            }
        }
        cut
    }

    fn eta(&self) -> [f64; OPERATOR_PARAMETER_COUNT] {
        std::array::from_fn(|i| self.belief.x[ETA_START + i])
    }

    fn eta_covariance(&self) -> [[f64; OPERATOR_PARAMETER_COUNT]; OPERATOR_PARAMETER_COUNT] {
        std::array::from_fn(|i| std::array::from_fn(|j| self.belief.p[ETA_START + i][ETA_START + j]))
    }
}

fn model(x: &[f64; N], from: &StartState, sample_time: SampleTime) -> Model {
    let ts = sample_time.s();
    let remnant = from.variance * sum_of_squares(&from.values[OPERATOR_PARAMETER_COUNT..]);
    let [_, _, k_e, k_e_dot, omega, zeta] = *x;
    let g = (k_e * k_e + (CROSSOVER_RAD_S * k_e_dot).powi(2)).sqrt();
    let gain = [GAIN_DRIFT[0] * g, GAIN_DRIFT[1] * g / CROSSOVER_RAD_S];
    Model {
        ts,
        drift: [
            0.0,
            STATE_NOISE_RATIO * remnant * (CROSSOVER_RAD_S / g).powi(2) * ts,
            gain[0] * gain[0] * ts,
            gain[1] * gain[1] * ts,
            (NEUROMUSCULAR_DRIFT * omega).powi(2) * ts,
            (NEUROMUSCULAR_DRIFT * zeta).powi(2) * ts,
        ],
        noise: OUTPUT_NOISE_RATIO * remnant,
    }
}

/// Returns the sum of squares of the impulse response of 1/D.
pub(super) fn sum_of_squares(d: &[f64]) -> f64 {
    let mut response = vec![0.0; RESPONSE_SAMPLES];
    response[0] = 1.0;
    hoid_core::filter::divide_in_place(d, &mut response);
    let sum: f64 = response.iter().map(|h| h * h).sum();
    if sum.is_finite() { sum } else { 1.0 }
}

impl State for JointFilter {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let parts: &mut [&mut dyn State] = &mut [
            &mut self.belief,
            &mut self.delay,
            &mut self.reported,
            &mut self.expected,
            &mut self.restarts,
        ];
        visit_all(parts, each);
    }
}

impl Recursion for JointFilter {
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let e = self.delay.step(sample.e);
        let [innovation, expected] = (self.update)(&self.model, &mut self.belief, e, sample.u);
        self.expected = expected;
        let shortened = self.limit_estimate();
        self.reported.set_operator(self.eta());
        StepOutcome { innovation, shortened }
    }

    fn step_without_update(&mut self, sample: Sample) -> StepOutcome {
        let e = self.delay.step(sample.e);
        self.belief.x = self.model.transition(&self.belief.x, e);
        if !(self.belief.x[0].is_finite() && self.belief.x[1].is_finite()) {
            (self.belief.x[0], self.belief.x[1]) = (0.0, 0.0);
            self.restarts += 1;
        }
        StepOutcome {
            innovation: sample.u - Model::output(&self.belief.x),
            shortened: false,
        }
    }

    fn bridge(&mut self, sample: Sample) {
        self.step_without_update(sample);
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

    fn operator(&self) -> Option<OperatorEstimate> {
        let (eta, c) = (self.eta(), self.eta_covariance());
        Some(self.reported.operator(eta, &c, lead_time(eta, &c)))
    }
}
