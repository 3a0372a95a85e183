//! A network with a single linear layer that learns the equalization parameters, as section 2.4 of the thesis describes
//! for its reference [14]. The learning rule is that of B. Widrow and M. E. Hoff, *Adaptive switching circuits*, IRE
//! WESCON 1960.
//!
//! The inputs are the outputs of the discretised pilot model with unit equalization: y_0 and y_1, the responses of the
//! neuromuscular part to the delayed error and to its rate. Each input is divided by its size s_i, which is its root
//! mean square so far. One neuron weights both inputs,
//!
//! `u^(k) = w_0 y_0(k)/s_0 + w_1 y_1(k)/s_1`, `w_i <- w_i + (Ts/T) (y_i/s_i) (u - u^)`,
//!
//! and `K_e = w_0/s_0`, `K_e_dot = w_1/s_1`. A signal and its rate are orthogonal over time and the inputs have unit
//! power, so each weight forgets with the time constant T. The neuromuscular part, the delay and the initial weights
//! are taken from the Box-Jenkins fit of the start span; parameters outside the equalization stay constant. The rule
//! gives no covariance.

use hoid_core::{
    delay::DelayLine,
    state::{State, visit_all},
};
use hoid_ident::{IdentError, settings, settings::Bounds};
use hoid_model::{
    SampleTime, Structure,
    second_order::ZohStates,
    uncertainty::{Estimate, OperatorEstimate},
};
use hoid_track::{
    Memory, Sample,
    building::{
        MethodDescription, OPERATOR_PARAMETER_COUNT, Recursion, RecursiveMethod, ReportedModel, Setup, StartState,
        StepOutcome, limit_magnitude,
    },
};

use crate::known_noise::check_first_order;

const NAME: &str = "linear-network";

settings! {
    /// Options of the linear network.
    pub struct LinearNetworkOptions {
        /// Time constant for learning a weight
        #[setting(unit("s"), bounds(Bounds::PositiveFinite))]
        pub learning: f64 = 4.0,
    }
}

impl RecursiveMethod for LinearNetworkOptions {
    fn description(&self) -> MethodDescription {
        MethodDescription {
            name: NAME,
            help: "single linear layer that learns K_e and K_e_dot after a known neuromuscular part, for comparison",
            source: "the thesis, section 2.4; Widrow and Hoff 1960",
            structures: &[Structure::BoxJenkins, Structure::General],
            defaults: &[],
        }
    }

    /// The memory length follows from the time constant of learning.
    fn default_memory(&self, _parameter: &str) -> Memory {
        Memory::Infinite
    }

    fn default_nd(&self) -> Option<usize> {
        Some(1)
    }

    fn check(&self, setup: &Setup) -> Result<(), IdentError> {
        check_first_order(NAME, setup)
    }

    fn build(
        &self,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        if !from.from_fit {
            return Err(IdentError::BadStart {
                reason: "linear-network needs the neuromuscular part of a batch fit; start it from the fit of a span"
                    .to_owned(),
            });
        }
        let [k_e, k_e_dot, omega, zeta] = std::array::from_fn(|i| from.values[i]);
        let gains = [k_e, k_e_dot];
        Ok(Box::new(LinearNetwork {
            neuron: Neuron {
                gains,
                squares: [0.0; 2],
                samples: 0.0,
                rate: sample_time.s() / self.learning,
            },
            first: gains,
            nms: [omega, zeta],
            zoh: ZohStates::new(2.0 * zeta * omega, omega * omega, sample_time),
            state: [0.0; 2],
            delay: DelayLine::new(vec![0.0; setup.orders.nk]),
            reported: ReportedModel::new(from, setup.orders.nk, sample_time),
            variance: from.variance,
            restarts: 0,
        }))
    }

    fn is_physical(&self) -> bool {
        true
    }

    fn models_change(&self) -> bool {
        true
    }

    fn memory_as_text(&self) -> Option<String> {
        Some(format!(
            "weights are learned with a time constant of {} s",
            self.learning
        ))
    }
}

/// The linear neuron.
#[derive(Debug, Clone)]
struct Neuron {
    /// K_e and K_e_dot: the weights divided by the sizes of the inputs.
    gains: [f64; 2],
    /// Mean squares of the inputs over all samples so far; `samples` is the number of these samples.
    squares: [f64; 2],
    samples: f64,
    /// Learning rate per sample, Ts/T.
    rate: f64,
}

hoid_core::state!([] Neuron { gains, squares, samples });

impl Neuron {
    fn update_squares(&mut self, y: [f64; 2]) {
        self.samples += 1.0;
        for (square, y) in self.squares.iter_mut().zip(y) {
            *square = limit_magnitude(*square + (y * y - *square) / self.samples.max(1.0));
        }
    }

    fn error(&self, y: [f64; 2], u: f64) -> f64 {
        u - self.gains[0] * y[0] - self.gains[1] * y[1]
    }

    fn update_weights(&mut self, y: [f64; 2], error: f64) {
        for ((gain, y), square) in self.gains.iter_mut().zip(y).zip(self.squares) {
            if square > 0.0 {
                *gain += self.rate * y / square * error;
            }
        }
    }
}

/// The recursion of the linear network.
struct LinearNetwork {
    neuron: Neuron,
    first: [f64; 2],
    nms: [f64; 2],
    zoh: ZohStates,
    /// y_0 and y_1 divided by omega^2.
    state: [f64; 2],
    delay: DelayLine<Vec<f64>>,
    reported: ReportedModel,
    variance: f64,
    restarts: u64,
}

impl State for LinearNetwork {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let parts: &mut [&mut dyn State] = &mut [
            &mut self.neuron,
            &mut self.state,
            &mut self.delay,
            &mut self.reported,
            &mut self.restarts,
        ];
        visit_all(parts, each);
    }
}

impl LinearNetwork {
    /// Processes a sample of the error. Returns y_0 and y_1.
    fn responses(&mut self, e: f64) -> [f64; 2] {
        let square = self.nms[0] * self.nms[0];
        self.state = self.zoh.step(self.state, self.delay.step(e));
        let y = self.state.map(|x| limit_magnitude(square * x));
        self.neuron.update_squares(y);
        y
    }

    fn eta(&self) -> [f64; OPERATOR_PARAMETER_COUNT] {
        let ([k_e, k_e_dot], [omega, zeta]) = (self.neuron.gains, self.nms);
        [k_e, k_e_dot, omega, zeta]
    }
}

impl Recursion for LinearNetwork {
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let y = self.responses(sample.e);
        let innovation = self.neuron.error(y, sample.u);
        self.neuron.update_weights(y, innovation);
        let shortened = !self.neuron.gains.iter().all(|gain| gain.is_finite());
        if shortened {
            self.neuron.gains = self.first;
            self.restarts += 1;
        }
        self.reported.set_operator(self.eta());
        StepOutcome { innovation, shortened }
    }

    fn step_without_update(&mut self, sample: Sample) -> StepOutcome {
        let y = self.responses(sample.e);
        StepOutcome {
            innovation: self.neuron.error(y, sample.u),
            shortened: false,
        }
    }

    fn bridge(&mut self, sample: Sample) {
        self.responses(sample.e);
    }

    fn theta(&self) -> &[f64] {
        self.reported.theta()
    }

    fn covariance(&self, _into: &mut [f64]) -> bool {
        false
    }

    fn innovation_variance(&self) -> f64 {
        self.variance
    }

    fn operator(&self) -> Option<OperatorEstimate> {
        let eta = self.eta();
        let none = [[f64::NAN; OPERATOR_PARAMETER_COUNT]; OPERATOR_PARAMETER_COUNT];
        let operator = self.reported.operator(eta, &none, [eta[1] / eta[0], f64::NAN]);
        let known = |value: f64| Estimate::fixed(value);
        Some(OperatorEstimate {
            k_e: known(eta[0]),
            t_l_s: known(eta[1] / eta[0]),
            k_e_dot: known(eta[1]),
            omega_nm_rad_s: known(eta[2]),
            zeta_nm: known(eta[3]),
            ..operator
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::{
        OperatorParameters,
        scenario::{Condition, RemnantStrength, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};
    use hoid_track::{Method, StartSource, TrackOptions, track};

    use super::*;

    #[test]
    fn weight_converges_with_its_time_constant() {
        // y_0 = cos and y_1 = sin have a mean square of 1/2 and are orthogonal. K_e changes from 1 to 2.
        let mut neuron = Neuron {
            gains: [1.0, 0.3],
            squares: [0.5; 2],
            samples: 0.0,
            rate: 0.01 / 4.0,
        };
        for k in 0..400 {
            // There are four periods in the 4 s of one time constant.
            let (y_1, y_0) = (std::f64::consts::TAU * 0.01 * f64::from(k)).sin_cos();
            let error = neuron.error([y_0, y_1], 2.0 * y_0 + 0.3 * y_1);
            neuron.update_weights([y_0, y_1], error);
        }
        let [k_e, k_e_dot] = neuron.gains;
        // Averaged over a period, the rule equals its differential equation, except for terms of order Ts/T.
        assert!((2.0 - k_e - (-1.0f64).exp()).abs() < 0.01, "{k_e}");
        assert!((k_e_dot - 0.3).abs() < 0.03, "{k_e_dot}");
    }

    /// y_0 and y_1 weighted by K_e and K_e_dot give the response of the held operator.
    #[test]
    fn weighted_inputs_sum_to_the_held_operator() {
        let operator = OperatorParameters {
            k_e: 0.07,
            t_l_s: 1.2,
            omega_nm_rad_s: 11.25,
            zeta_nm: 0.35,
            tau_e_s: 0.28,
        };
        let discrete = operator.discretise(SampleTime::AT_100_HZ).unwrap();
        let (held, nk) = (discrete.zoh, discrete.nk);
        let e: Vec<f64> = (0..300)
            .map(|k| (0.07 * f64::from(k)).sin() + f64::from(k % 7))
            .collect();
        let mut u = vec![0.0; e.len()];
        let states = ZohStates::new(2.0 * 0.35 * 11.25, 11.25 * 11.25, SampleTime::AT_100_HZ);
        let mut state = [0.0; 2];
        for k in 0..e.len() {
            let at = |signal: &[f64], lag: usize| if k >= lag { signal[k - lag] } else { 0.0 };
            u[k] = held.b0 * at(&e, nk) + held.b1 * at(&e, nk + 1) - held.f1 * at(&u, 1) - held.f2 * at(&u, 2);
            state = states.step(state, at(&e, nk));
            let [y_0, y_1] = state.map(|x| 11.25 * 11.25 * x);
            let found = operator.k_e * y_0 + operator.k_e_dot() * y_1;
            assert!((u[k] - found).abs() < 1e-12, "{k}: {} {found}", u[k]);
        }
    }

    #[test]
    fn gains_after_a_change_are_close_on_average() {
        const RUN_COUNT: u64 = 8;
        let mut scenario = Scenario::condition(Condition::C4);
        scenario.remnant.order = 1;
        if let RemnantStrength::Level { level, .. } = &mut scenario.remnant.strength {
            *level = 0.1;
        }
        let simulator = Simulator::new(&scenario).unwrap();
        let options = TrackOptions {
            start: StartSource::Span(Some((0.0, 30.72))),
            ..TrackOptions::default_for(Method::from(LinearNetworkOptions::default()), 29)
        };
        let mut mean = 0.0;
        for replication in 0..RUN_COUNT {
            let seed = RunSeed {
                seed: 101,
                cell: 0,
                replication,
            };
            let trace = track(&simulator.run(seed, false).unwrap(), &options, 100).unwrap();
            mean += trace.operator(64).unwrap().k_e_dot.value / 0.084 / RUN_COUNT as f64;
        }
        // The loop biases a direct fit without a noise model; the standard error of the mean is 3 %.
        assert!((mean - 1.0).abs() < 0.25, "{mean}");
    }
}
