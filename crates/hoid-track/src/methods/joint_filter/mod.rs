//! Joint estimation of state and parameters, as the literature on time-varying human control has it: for comparison.
//!
//! The state of the neuromuscular system, p (its response to the delayed error) and v (the rate of p), is estimated together with the parameters, which drift:
//!
//! `X = [p, v, K_e, K_e_dot, omega_nm, zeta_nm]`, `u = K_e p + K_e_dot v + n`.
//!
//! The transition is the exact hold. With [`DividedDifferences`] at the poles times Ts, `R = omega^2 Ts Phi_1`, `A = q Phi_2` and `m = e - p`,
//!
//! `p <- e - (1 - A) m + (R/omega^2) v`, `v <- R m + (1 - A - 2 zeta R/omega) v`;
//!
//! the parameters make a random walk, the remnant is taken to be white noise in u and in the drive of v. Neither is true of a coloured remnant in a closed loop; it is what the
//! published estimators suppose. [`ekf`] linearises (A. Popovici, P. M. T. Zaal, D. M. Pool, *Dual extended Kalman filter for the identification of
//! time-varying human manual control behavior*, AIAA 2017-3666, there with two filters that take turns), [`ukf`] sends points through
//! (J. Rojer, D. M. Pool, M. M. van Paassen, M. Mulder, *UKF-based identification of time-varying manual control behaviour*, IFAC-PapersOnLine 52-19 (2019)).
//!
//! The noise of both is in proportion to the variance of the remnant of the start fit, `sigma^2` times the power of the impulse response of 1/D, and the drift in proportion to
//! the start values; the factors were set on conditions C3 and C5 with remnants of order 2 and 3, as those of the method adaptive were.

mod ekf;
mod ukf;

use hoid_core::{
    adaptive::prior::OPERATOR,
    delay::DelayLine,
    divided_differences::DividedDifferences,
    state::{State, visit_all},
};
use hoid_model::{SampleTime, uncertainty::OperatorEstimate};

use crate::{
    options::{Method, TrackOptions},
    recursion::{Recursion, Sample, StepOutcome},
    reported::Reported,
    start::{self, StartState},
};
use hoid_ident::IdentError;

/// Length of X.
const N: usize = 6;
/// First parameter in X.
const ETA: usize = 2;
/// Covariance of X by rows.
type Matrix = [[f64; N]; N];

/// Variance of n over that of the remnant: a coloured remnant tells less than a white one of the same variance.
const OUTPUT_NOISE: f64 = 10.0;
/// Variance of what drives v beside the error within one second, over that of the remnant seen through K_e_dot.
const STATE_NOISE: f64 = 10.0;
/// Drift of K_e and K_e_dot in one second, in units of `g = sqrt(K_e^2 + omega^2 K_e_dot^2)` and `g/omega` at the crossover omega.
const GAIN_DRIFT: [f64; 2] = [0.02, 0.05];
/// The crossover, rad/s.
const CROSSOVER_RAD_S: f64 = 2.0;
/// Drift of omega_nm and zeta_nm in one second, as a share of them.
const NEUROMUSCULAR_DRIFT: f64 = 0.003;
/// Largest variance of a parameter, as a multiple of the square of its start.
const LARGEST_VARIANCE: f64 = 25.0;
/// Samples of the impulse response of 1/D.
const RESPONSE: usize = 1000;

/// Estimate and covariance of X.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Belief {
    x: [f64; N],
    p: Matrix,
}

hoid_core::state!([] Belief { x, p });

/// The model.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Model {
    ts: f64,
    /// Variance of what is added to each element of X in a sample, and of n.
    drift: [f64; N],
    noise: f64,
}

/// Phi and its derivatives: the two entries that all follow from, with respect to omega and zeta.
struct Hold {
    /// `1 - A`, `R/omega^2`, R, `1 - A - 2 zeta R/omega`.
    values: [f64; 4],
    by_omega: [f64; 4],
    by_zeta: [f64; 4],
}

impl Hold {
    fn at(omega: f64, zeta: f64, t: f64) -> Self {
        let d = DividedDifferences::at(-2.0 * zeta * omega * t, omega * omega * t * t);
        let s_zeta = -2.0 * omega * t;
        let rest = 1.0 - d.product * d.phi2;
        let rate = omega * omega * t * d.phi1;
        let rest_by = [-omega * t * t * d.phi1, -d.product * d.phi2_slope * s_zeta];
        let rate_by = [
            omega * t * (d.phi0() + d.phi1),
            omega * omega * t * d.phi1_slope() * s_zeta,
        ];
        let square = omega * omega;
        let by = |i: usize| {
            let (omega_by, zeta_by) = if i == 0 { (1.0, 0.0) } else { (0.0, 1.0) };
            [
                rest_by[i],
                rate_by[i] / square - 2.0 * rate / (square * omega) * omega_by,
                rate_by[i],
                rest_by[i]
                    - 2.0 * zeta * rate_by[i] / omega
                    - 2.0 * rate * (zeta_by / omega - zeta * omega_by / square),
            ]
        };
        Self {
            values: [rest, rate / square, rate, rest - 2.0 * zeta * rate / omega],
            by_omega: by(0),
            by_zeta: by(1),
        }
    }
}

impl Model {
    fn transition(&self, x: &[f64; N], e: f64) -> [f64; N] {
        let [a, b, c, d] = Hold::at(x[4], x[5], self.ts).values;
        let (m, v) = (e - x[0], x[1]);
        [e - a * m + b * v, c * m + d * v, x[2], x[3], x[4], x[5]]
    }

    fn jacobian(&self, x: &[f64; N], e: f64) -> Matrix {
        let hold = Hold::at(x[4], x[5], self.ts);
        let [a, b, c, d] = hold.values;
        let (m, v) = (e - x[0], x[1]);
        let mut f = [[0.0; N]; N];
        for (i, row) in f.iter_mut().enumerate().skip(ETA) {
            row[i] = 1.0;
        }
        let by = |h: &[f64; 4]| [-h[0] * m + h[1] * v, h[2] * m + h[3] * v];
        let (omega, zeta) = (by(&hold.by_omega), by(&hold.by_zeta));
        f[0] = [a, b, 0.0, 0.0, omega[0], zeta[0]];
        f[1] = [-c, d, 0.0, 0.0, omega[1], zeta[1]];
        f
    }

    fn output(x: &[f64; N]) -> f64 {
        x[2] * x[0] + x[3] * x[1]
    }

    fn output_gradient(x: &[f64; N]) -> [f64; N] {
        [x[2], x[3], x[0], x[1], 0.0, 0.0]
    }
}

/// The recursion.
pub(crate) struct JointRecursion {
    unscented: bool,
    model: Model,
    belief: Belief,
    first: Belief,
    bounds: [[f64; 2]; OPERATOR],
    delay: DelayLine<Vec<f64>>,
    reported: Reported,
    /// Innovation variance as expected at the last sample.
    expected: f64,
    restarts: u64,
}

impl JointRecursion {
    /// From the batch fit of the start span.
    ///
    /// # Errors
    /// [`IdentError::BadStart`] without a fit.
    pub(crate) fn new(options: &TrackOptions, from: &StartState, sample_time: SampleTime) -> Result<Self, IdentError> {
        let unscented = options.method == Method::Ukf;
        if !from.from_fit {
            return Err(IdentError::BadStart {
                reason: "ekf and ukf need the noise level of a batch fit; start them from the fit of a span".to_owned(),
            });
        }
        let width = from.values.len();
        let mut belief = Belief {
            x: [0.0; N],
            p: [[0.0; N]; N],
        };
        for i in 0..OPERATOR {
            belief.x[ETA + i] = from.values[i];
            for j in 0..OPERATOR {
                belief.p[ETA + i][ETA + j] = from.variance * from.spread[i * width + j];
            }
        }
        let model = model(&belief.x, from, sample_time);
        Ok(Self {
            unscented,
            model,
            first: belief,
            belief,
            bounds: start::physical_bounds::<OPERATOR>(options, sample_time)?,
            delay: DelayLine::new(vec![0.0; options.orders.nk]),
            reported: Reported::new(from, options.orders.nk, sample_time),
            expected: from.variance,
            restarts: 0,
        })
    }

    /// Keeps the parameters within their bounds and what is known of them within reason; true where that changed something.
    fn hold(&mut self) -> bool {
        let mut cut = false;
        let sound =
            self.belief.x.iter().all(|x| x.is_finite()) && self.belief.p.iter().flatten().all(|p| p.is_finite());
        if !sound {
            self.belief = self.first;
            self.restarts += 1;
            return true;
        }
        for (i, [low, high]) in self.bounds.into_iter().enumerate() {
            let x = &mut self.belief.x[ETA + i];
            let within = x.clamp(low, high);
            cut |= within != *x;
            *x = within;
            let largest = LARGEST_VARIANCE * self.first.x[ETA + i].powi(2);
            let variance = self.belief.p[ETA + i][ETA + i];
            if variance > largest && largest > 0.0 {
                let shrink = (largest / variance).sqrt();
                for j in 0..N {
                    self.belief.p[ETA + i][j] *= shrink;
                    self.belief.p[j][ETA + i] *= shrink;
                }
            }
        }
        cut
    }

    fn eta(&self) -> [f64; OPERATOR] {
        std::array::from_fn(|i| self.belief.x[ETA + i])
    }

    fn of_eta(&self) -> [[f64; OPERATOR]; OPERATOR] {
        std::array::from_fn(|i| std::array::from_fn(|j| self.belief.p[ETA + i][ETA + j]))
    }
}

fn model(x: &[f64; N], from: &StartState, sample_time: SampleTime) -> Model {
    let ts = sample_time.s();
    let remnant = from.variance * power(&from.values[OPERATOR..]);
    let [_, _, k_e, k_e_dot, omega, zeta] = *x;
    let g = (k_e * k_e + (CROSSOVER_RAD_S * k_e_dot).powi(2)).sqrt();
    let gain = [GAIN_DRIFT[0] * g, GAIN_DRIFT[1] * g / CROSSOVER_RAD_S];
    Model {
        ts,
        drift: [
            0.0,
            STATE_NOISE * remnant * (CROSSOVER_RAD_S / g).powi(2) * ts,
            gain[0] * gain[0] * ts,
            gain[1] * gain[1] * ts,
            (NEUROMUSCULAR_DRIFT * omega).powi(2) * ts,
            (NEUROMUSCULAR_DRIFT * zeta).powi(2) * ts,
        ],
        noise: OUTPUT_NOISE * remnant,
    }
}

/// Power of the impulse response of 1/D.
fn power(d: &[f64]) -> f64 {
    let mut response = vec![0.0; RESPONSE];
    response[0] = 1.0;
    hoid_core::filter::divide_in_place(d, &mut response);
    let sum: f64 = response.iter().map(|h| h * h).sum();
    if sum.is_finite() { sum } else { 1.0 }
}

impl State for JointRecursion {
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

impl Recursion for JointRecursion {
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let e = self.delay.step(sample.e);
        let [innovation, expected] = if self.unscented {
            ukf::step(&self.model, &mut self.belief, e, sample.u)
        } else {
            ekf::step(&self.model, &mut self.belief, e, sample.u)
        };
        self.expected = expected;
        let shortened = self.hold();
        self.reported.set(self.eta());
        StepOutcome { innovation, shortened }
    }

    fn follow(&mut self, sample: Sample) -> StepOutcome {
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
        self.follow(sample);
    }

    fn theta(&self) -> &[f64] {
        self.reported.theta()
    }

    fn covariance(&self, into: &mut [f64]) -> bool {
        self.reported.covariance(&self.of_eta(), into);
        true
    }

    fn innovation_variance(&self) -> f64 {
        self.expected
    }

    fn operator(&self) -> Option<OperatorEstimate> {
        let (eta, c) = (self.eta(), self.of_eta());
        let t_l = eta[1] / eta[0];
        let of_ratio = c[1][1] - 2.0 * t_l * c[0][1] + t_l * t_l * c[0][0];
        let lead = [t_l, of_ratio.max(0.0) / (eta[0] * eta[0])];
        Some(self.reported.operator(eta, &c, lead))
    }
}

#[cfg(test)]
mod tests;
