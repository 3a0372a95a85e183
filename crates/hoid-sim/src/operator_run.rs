//! Operator of a scenario alone, sample by sample, for a loop that is closed elsewhere.
//!
//! Simulates `u = y(k - tau_e/Ts) + n` as [`Simulator`] does in a loop, with the same random numbers. A loop that
//! responds to u like the controlled element of the scenario therefore gives a bit-identical run. The control at a
//! sample does not depend on the error of the same sample, since the operator holds e over a sample before it responds.
//! The response to a displayed target is not part of it: the target belongs to the loop that is closed elsewhere.

use crate::{RunSeed, Simulator, cascade::HIGHEST_ORDER};

/// Largest accepted index of a sample in a saved state: eight hours at 1 kHz. The random numbers up to this sample are
/// drawn again, and an invalid larger index must not exhaust the memory.
const MAX_SAMPLES: f64 = 3e7;

/// Returns the index of the next sample from a saved state; `None` if it is not valid.
pub(crate) fn saved_sample(k: f64) -> Option<usize> {
    ((0.0..=MAX_SAMPLES).contains(&k) && k.fract() == 0.0).then_some(k as usize)
}

/// Running operator of a scenario of the thesis.
#[derive(Debug, Clone)]
pub struct OperatorRun {
    simulator: Simulator,
    run: RunSeed,
    /// White noise of the remnant, from the first sample of the run-in.
    noise: Vec<f64>,
    operator: [f64; 2],
    remnant: [f64; HIGHEST_ORDER],
    /// Ring of the last responses, in which the response of sample k has the index k modulo the length.
    memory: Vec<f64>,
    /// Index of the next sample.
    k: usize,
}

impl OperatorRun {
    /// Starts an operator at rest before the sample at `start_s`, in s relative to the start of the measurement. The
    /// part of the run-in before `start_s` is omitted, and its random numbers are skipped.
    pub fn new(simulator: Simulator, run: RunSeed, start_s: f64) -> Self {
        let scenario = simulator.scenario();
        let after_run_in = (start_s / scenario.scenario().sample_time.s()).round() as isize;
        let k = scenario.run_in_samples().saturating_add_signed(after_run_in);
        let mut run = Self {
            noise: run.white_noise(simulator.sample_count()),
            run,
            operator: [0.0; 2],
            remnant: [0.0; HIGHEST_ORDER],
            memory: vec![0.0; (simulator.longest_delay() + 1).next_power_of_two()],
            k,
            simulator,
        };
        run.store_response();
        run
    }

    /// Returns the control u of the next sample in deg.
    pub fn control(&self) -> f64 {
        let m = self.matrices();
        let response = self.memory[self.k.wrapping_sub(m.delay) & (self.memory.len() - 1)];
        response + self.remnant()
    }

    /// Returns the remnant n of the next sample in deg.
    pub fn remnant(&self) -> f64 {
        self.matrices().k_n * self.remnant[self.simulator.cascade.order() - 1]
    }

    /// Takes the error e of the sample in deg and advances by one sample.
    pub fn push(&mut self, e: f64) {
        self.operator = self.matrices().operator.step(self.operator, e);
        let white = self.next_white_noise();
        self.remnant = match self.simulator.cascade.order() {
            1 => self.filtered_noise::<1>(white),
            2 => self.filtered_noise::<2>(white),
            3 => self.filtered_noise::<3>(white),
            _ => self.filtered_noise::<HIGHEST_ORDER>(white),
        };
        self.k += 1;
        self.store_response();
    }

    /// Returns the state as numbers.
    pub fn saved_state(&self) -> Vec<f64> {
        let mut numbers = vec![self.k as f64];
        numbers.extend(self.operator);
        numbers.extend(self.remnant);
        numbers.extend(&self.memory);
        numbers
    }

    /// Restores the state that [`OperatorRun::saved_state`] returned for an operator with the same scenario and run, so
    /// it continues with bit-identical results. Returns false, without any change, if the numbers belong to another
    /// operator.
    pub fn restore(&mut self, numbers: &[f64]) -> bool {
        let Some(([k], rest)) = numbers.split_first_chunk::<1>() else {
            return false;
        };
        let Some((operator, rest)) = rest.split_first_chunk::<2>() else {
            return false;
        };
        let Some((remnant, memory)) = rest.split_first_chunk::<HIGHEST_ORDER>() else {
            return false;
        };
        let Some(k) = saved_sample(*k).filter(|_| memory.len() == self.memory.len()) else {
            return false;
        };
        (self.k, self.operator, self.remnant) = (k, *operator, *remnant);
        self.memory.copy_from_slice(memory);
        true
    }

    /// Stores the response of the next sample in the ring.
    fn store_response(&mut self) {
        let [of_output, of_rate] = self.matrices().operator_output;
        let last = self.memory.len() - 1;
        self.memory[self.k & last] = of_output * self.operator[0] + of_rate * self.operator[1];
    }

    fn matrices(&self) -> crate::simulator::Matrices {
        let all = &self.simulator.matrices;
        all[self.k.min(all.len() - 1)]
    }

    /// Returns the white noise of the next sample. The noise continues after the end of the scenario.
    fn next_white_noise(&mut self) -> f64 {
        if self.k >= self.noise.len() {
            self.noise = self.run.white_noise(2 * self.k + 1);
        }
        self.noise[self.k]
    }

    fn filtered_noise<const M: usize>(&self, white: f64) -> [f64; HIGHEST_ORDER] {
        let mut sections: [f64; M] = [0.0; M];
        sections.copy_from_slice(&self.remnant[..M]);
        let mut next = [0.0; HIGHEST_ORDER];
        next[..M].copy_from_slice(&self.simulator.cascade.step(sections, white));
        next
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::{Condition, Scenario};

    use super::*;

    /// For the error of a run from its run-in on, the control of the operator is bit-identical to the control of the
    /// run, for every order of the remnant and through a change in the task.
    #[test]
    fn operator_run_reproduces_the_control_of_the_simulator() {
        for (condition, order) in [
            (Condition::C1, 1),
            (Condition::C4, 2),
            (Condition::C6, 3),
            (Condition::C4, 4),
        ] {
            let mut scenario = Scenario::condition(condition);
            scenario.remnant.order = order;
            let simulator = Simulator::new(&scenario).unwrap();
            let seed = RunSeed {
                seed: 5,
                ..RunSeed::default()
            };
            let record = simulator.run(seed, true).unwrap();
            let mut operator = OperatorRun::new(simulator, seed, record.time_s(0));
            let remnant = record.channel("n").unwrap();
            for (k, e) in record.input().iter().enumerate() {
                assert_eq!(
                    operator.control().to_bits(),
                    record.output()[k].to_bits(),
                    "{condition} {k}"
                );
                assert_eq!(operator.remnant().to_bits(), remnant[k].to_bits());
                operator.push(*e);
            }
        }
    }

    /// A saved state continues in another operator, also after the end of its scenario.
    #[test]
    fn restored_operator_continues_bit_identically() {
        let mut scenario = Scenario::condition(Condition::C4);
        scenario.measurement_s = 1.0;
        let new = || OperatorRun::new(Simulator::new(&scenario).unwrap(), RunSeed::default(), 0.0);
        let mut first = new();
        let e = |k: usize| (0.1 * k as f64).sin();
        (0..700).for_each(|k| first.push(e(k)));
        let saved = first.saved_state();
        let mut second = new();
        assert!(second.restore(&saved));
        for k in 700..900 {
            assert_eq!(first.control().to_bits(), second.control().to_bits(), "{k}");
            first.push(e(k));
            second.push(e(k));
        }
        let before = second.saved_state();
        let mut other = saved.clone();
        for k in [-1.0, 0.5, f64::NAN, 1e300] {
            other[0] = k;
            assert!(!second.restore(&other));
        }
        for length in [0, 1, 3, saved.len() - 1] {
            assert!(!second.restore(&saved[..length]));
        }
        assert_eq!(second.saved_state(), before);
    }

    #[test]
    fn scenario_continues_after_its_end() {
        let mut scenario = Scenario::condition(Condition::C4);
        let long = Simulator::new(&scenario).unwrap();
        scenario.measurement_s = 1.0;
        let short = Simulator::new(&scenario).unwrap();
        let samples = short.sample_count() + 500;
        let seed = RunSeed::default();
        let mut of = [long, short].map(|simulator| {
            let start_s = -(simulator.scenario().run_in_samples() as f64) * 0.01;
            OperatorRun::new(simulator, seed, start_s)
        });
        for k in 0..samples {
            let e = (0.1 * k as f64).sin();
            // The task changes long after both start times.
            assert!((of[0].control() - of[1].control()).abs() < 1e-3, "{k}");
            of.iter_mut().for_each(|operator| operator.push(e));
        }
        // A start time before the run-in is treated as the start of the run-in.
        let simulator = Simulator::new(&scenario).unwrap();
        assert_eq!(OperatorRun::new(simulator, seed, -1e9).k, 0);
    }
}
