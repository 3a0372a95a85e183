//! A network of a single linear layer that learns the equalization parameters, as section 2.4 of the
//! reference text describes that of its reference [14]. The rule: B. Widrow and M. E. Hoff,
//! *Adaptive switching circuits*, IRE WESCON 1960.
//!
//! The inputs are the discretised pilot model with unit equalization: y_0 and y_1, the responses of
//! the neuromuscular part to the delayed error and to its rate, each over its size s_i on the start
//! span. One neuron weighs them,
//!
//! `u^(k) = w_0 y_0(k)/s_0 + w_1 y_1(k)/s_1`, `w_i <- w_i + (Ts/T) (y_i/s_i) (u - u^)`,
//!
//! and `K_e = w_0/s_0`, `K_e_dot = w_1/s_1`. A signal and its rate are orthogonal over time and the
//! inputs have unit power, so that each weight forgets with the time constant T. Neuromuscular part,
//! delay and first weights are those of the Box-Jenkins fit of the start span, and what does not
//! belong to the equalization stays.

use hoid_ident::{settings, settings::Bounds};
use hoid_model::OperatorParameters;

use super::{
    comparator::{About, Comparator, Followed, Task},
    start::Start,
    unit_responses::unit_responses,
};
use crate::ThesisError;

const NAME: &str = "linear-network";

settings! {
    /// Options of the linear network.
    pub struct LinearNetwork {
        /// Time constant T with which a weight is learned
        #[setting(unit("s"), bounds(Bounds::PositiveFinite))]
        pub learning: f64 = 4.0,
    }
}

/// The neuron.
struct Neuron {
    /// Sizes of the inputs.
    sizes: [f64; 2],
    weights: [f64; 2],
    /// Ts/T.
    rate: f64,
}

impl Neuron {
    fn new(gains: [f64; 2], sizes: [f64; 2], rate: f64) -> Self {
        Self {
            sizes,
            weights: [gains[0] * sizes[0], gains[1] * sizes[1]],
            rate,
        }
    }

    fn learn(&mut self, y: [f64; 2], u: f64) {
        let x = [y[0] / self.sizes[0], y[1] / self.sizes[1]];
        let error = u - self.weights[0] * x[0] - self.weights[1] * x[1];
        for (weight, x) in self.weights.iter_mut().zip(x) {
            *weight += self.rate * x * error;
        }
    }

    /// K_e and K_e_dot.
    fn gains(&self) -> [f64; 2] {
        [self.weights[0] / self.sizes[0], self.weights[1] / self.sizes[1]]
    }
}

impl Comparator for LinearNetwork {
    fn about(&self) -> About {
        About {
            name: NAME,
            help: "single linear layer that learns K_e and K_e_dot behind a known neuromuscular part",
            source: "the reference text, section 2.4; Widrow and Hoff 1960",
            told: "",
        }
    }

    fn follow(&self, task: &Task<'_>) -> Result<Followed, ThesisError> {
        let (e, u) = task.signals(NAME, task.nk)?;
        let ts = task.record.sample_time();
        let start = Start::of(task)?.operator.parameters();
        let [y_0, y_1] = unit_responses(e, start.omega_nm_rad_s, start.zeta_nm, task.nk, ts);
        let span = |signal: &[f64]| {
            let within = (0..e.len()).filter(|k| (task.start_s.0..task.start_s.1).contains(&task.record.time_s(*k)));
            let squares: Vec<f64> = within.map(|k| signal[k] * signal[k]).collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        let sizes = [span(&y_0), span(&y_1)];
        let mut neuron = Neuron::new([start.k_e, start.k_e_dot()], sizes, ts.s() / self.learning);
        let (mut found, mut asked) = (Followed::default(), task.at.iter().peekable());
        for k in 0..e.len() {
            neuron.learn([y_0[k], y_1[k]], u[k]);
            while asked.next_if(|at| **at == k).is_some() {
                let [k_e, k_e_dot] = neuron.gains();
                let operator = OperatorParameters {
                    k_e,
                    t_l_s: k_e_dot / k_e,
                    ..start
                };
                found.push(task, Some(operator))?;
            }
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::Condition;

    use super::{super::tests::*, *};

    #[test]
    fn a_weight_is_learned_with_its_time_constant() {
        // y_0 = cos, y_1 = sin, both of size 1/sqrt(2): orthogonal. K_e goes from 1 to 2.
        let size = 0.5f64.sqrt();
        let mut neuron = Neuron::new([1.0, 0.3], [size, size], 0.01 / 4.0);
        for k in 0..400 {
            // Four periods in the 4 s of one time constant.
            let (y_1, y_0) = (std::f64::consts::TAU * 0.01 * f64::from(k)).sin_cos();
            neuron.learn([y_0, y_1], 2.0 * y_0 + 0.3 * y_1);
        }
        let [k_e, k_e_dot] = neuron.gains();
        // Averaged over a period the rule is its differential equation, up to (Ts/T).
        assert!((2.0 - k_e - (-1.0f64).exp()).abs() < 0.01, "{k_e}");
        assert!((k_e_dot - 0.3).abs() < 0.03, "{k_e_dot}");
    }

    #[test]
    fn gains_after_a_change_are_near_the_truth_on_average() {
        let mut sums = [0.0; 2];
        const RUNS: u64 = 8;
        for replication in 0..RUNS {
            let run = Run::replication(Condition::C4, 1, 0.1, replication);
            let found = LinearNetwork::default().follow(&run.task()).unwrap();
            let operator = found.operator[1].unwrap();
            sums[0] += operator.k_e / 0.07 / RUNS as f64;
            sums[1] += operator.k_e_dot() / 0.084 / RUNS as f64;
        }
        // The loop biases a direct fit without a noise model; standard error of the mean 3 %.
        assert!((sums[1] - 1.0).abs() < 0.25, "{sums:?}");
    }

    #[test]
    fn a_record_without_an_operator_is_refused() {
        let silent = record_of(&[0.0; 4000], &[1.0; 4000]);
        assert!(
            LinearNetwork::default()
                .follow(&task_of(&silent, &[3999], &[1.0]))
                .is_err()
        );
        let short = record_of(&[1.0; 20], &[1.0; 20]);
        assert!(LinearNetwork::default().follow(&task_of(&short, &[9], &[1.0])).is_err());
    }
}
