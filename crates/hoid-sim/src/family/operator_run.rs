//! Operator of a scenario of the family alone, sample by sample, for a loop that is closed elsewhere.
//!
//! Simulates `u = r(k - l) + n` as [`FamilySimulator`] does in a loop, with the same random numbers, and with the
//! remnant as strong as in the loop of the scenario. A loop that responds to u like the controlled element of the
//! scenario therefore gives a bit-identical run. The offsets of the recorder in e and u (`offset_e`, `offset_u`) are
//! not part of the operator, nor are the responses to a displayed target and to motion, which belong to the loop. The
//! control at a sample must not depend on the error of the same sample.

use super::{FamilySimulator, remnant_run::RemnantRun, zoh_loop::ZohLoop};
use crate::{RunSeed, SimError, operator_run::saved_sample, zoh_operator::OperatorState};

/// Running operator of a scenario of the family.
#[derive(Debug, Clone)]
pub struct FamilyOperatorRun {
    simulator: FamilySimulator,
    operator: OperatorState,
    remnant: RemnantRun,
    /// Index of the next sample, and remnant at that sample.
    k: usize,
    n: f64,
}

impl FamilyOperatorRun {
    /// Starts an operator at rest before the sample at `start_s`, in s relative to the start of the measurement. The
    /// part of the run-in before `start_s` is omitted, and its random numbers are skipped.
    ///
    /// # Errors
    /// [`SimError::DirectResponse`] if the control depends on the error of the same sample.
    pub fn new(simulator: FamilySimulator, run: RunSeed, start_s: f64) -> Result<Self, SimError> {
        let scenario = simulator.scenario.scenario();
        let ts_s = scenario.sample_time.s();
        if (0..simulator.sample_count()).any(|k| simulator.loop_at(k).has_direct_response()) {
            return Err(SimError::DirectResponse {
                scenario: scenario.name.clone(),
                tau_e_s: scenario
                    .initial
                    .operator
                    .tau_e_s()
                    .min(scenario.last.operator.tau_e_s()),
                half_a_sample_s: 0.5 * ts_s,
            });
        }
        let after_run_in = (start_s / ts_s).round() as isize;
        let k = simulator.scenario.run_in_samples().saturating_add_signed(after_run_in);
        let mut remnant = RemnantRun::new(&simulator.scenario, &simulator.remnants, run);
        Ok(Self {
            operator: OperatorState::at_rest(&simulator.loop_at(0).operator, simulator.longest_delay()),
            n: remnant.next(&simulator.scenario, &simulator.remnants, k),
            remnant,
            k,
            simulator,
        })
    }

    fn current_loop(&self) -> &ZohLoop {
        self.simulator.loop_at(self.k)
    }

    /// Returns the control u of the next sample in deg.
    pub fn control(&self) -> f64 {
        self.current_loop().operator.output(&self.operator).delayed_response + self.n
    }

    /// Returns the remnant n of the next sample in deg, including the bias and the random walk of the stick.
    pub fn remnant(&self) -> f64 {
        self.n
    }

    /// Takes the error e of the sample in deg and advances by one sample.
    pub fn push(&mut self, e: f64) {
        let held = &self.simulator.loop_at(self.k).operator;
        let answer = held.output(&self.operator);
        held.advance(&mut self.operator, answer, e);
        let (scenario, remnants) = (&self.simulator.scenario, &self.simulator.remnants);
        self.remnant
            .update_control(scenario, remnants, self.k, answer.delayed_response + self.n);
        self.k += 1;
        self.n = self.remnant.next(scenario, remnants, self.k);
    }

    /// Returns the state as numbers.
    pub fn saved_state(&mut self) -> Vec<f64> {
        let own_state = [self.k as f64, self.n];
        own_state
            .into_iter()
            .chain(self.state_mut().map(|number| *number))
            .collect()
    }

    /// Restores the state that [`FamilyOperatorRun::saved_state`] returned for an operator with the same scenario and
    /// run, so it continues with bit-identical results. Returns false, without any change, if the numbers belong to
    /// another operator.
    pub fn restore(&mut self, saved: &[f64]) -> bool {
        let Some((&[k, n], rest)) = saved.split_first_chunk::<2>() else {
            return false;
        };
        let is_ours = rest.len() == self.state_mut().count();
        let Some(k) = saved_sample(k).filter(|_| is_ours) else {
            return false;
        };
        (self.k, self.n) = (k, n);
        self.state_mut().zip(rest).for_each(|(number, saved)| *number = *saved);
        true
    }

    fn state_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        self.operator.state_mut().chain(self.remnant.state_mut())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::{
        ContinuousTransferFunction, FamilyOperator, FamilyScenario, FamilyState, Form, SampleTime,
        family_scenario::{
            DependenceSignal, Intermittence, MultiSine, Pulses, RemnantPart, RemnantShape, SignalDependence, Stick,
        },
        schedule::Schedule,
    };

    use super::*;

    const SEED: RunSeed = RunSeed {
        seed: 5,
        cell: 0,
        replication: 2,
    };

    fn state(form: Form, neuromuscular: bool, coordinates: &[f64], element: [&[f64]; 2]) -> FamilyState {
        FamilyState {
            operator: FamilyOperator::new(form, neuromuscular, coordinates).unwrap(),
            controlled_element: ContinuousTransferFunction::new(element[0], element[1]).unwrap(),
        }
    }

    fn task(state: FamilyState) -> FamilyScenario {
        let mut scenario = FamilyScenario::new(state, SampleTime::new(0.01).unwrap());
        scenario.disturbance = MultiSine::default().excitation().unwrap();
        scenario.measurement_s = 10.0;
        scenario.run_in_s = 2.0;
        scenario
    }

    /// Returns a scenario in which the gain and the delay change, with every kind of remnant and a random walk of the
    /// stick.
    fn scenario_with_all_remnants() -> FamilyScenario {
        let person = |k: f64, tau_e_s: f64| [k, 0.5, 3.0, 11.0_f64.ln(), 0.25_f64.ln(), tau_e_s];
        let of = |k, tau_e_s| state(Form::LeadLag, true, &person(k, tau_e_s), [&[1.0], &[1.0, 0.0]]);
        let mut scenario = task(of(4.0, 0.18));
        scenario.last = of(3.0, 0.22);
        scenario.schedule = Schedule::Sigmoid {
            rate_per_s: 2.0,
            midpoint_s: 4.0,
        };
        let lag = RemnantShape::Lag {
            time_constant_s: 0.1,
            order: 2,
        };
        let following = |follows| SignalDependence {
            signal: follows,
            share: 0.7,
            memory_s: 0.5,
        };
        scenario.remnant = vec![
            RemnantPart {
                signal_dependence: Some(following(DependenceSignal::Control)),
                ..RemnantPart::new(lag, 0.1)
            },
            RemnantPart {
                signal_dependence: Some(following(DependenceSignal::Rate)),
                ..RemnantPart::new(RemnantShape::White, 0.02)
            },
            RemnantPart {
                pulses: Some(Pulses {
                    share: 0.4,
                    rate_per_s: 3.0,
                }),
                ..RemnantPart::new(
                    RemnantShape::Ar {
                        coefficients: vec![-0.8, 0.1],
                    },
                    0.05,
                )
            },
            RemnantPart {
                intermittence: Some(Intermittence { on_s: 1.5, off_s: 1.0 }),
                ..RemnantPart::new(
                    RemnantShape::Resonance {
                        omega_rad_s: 11.0,
                        zeta: 0.2,
                    },
                    0.03,
                )
            },
        ];
        scenario.stick = Stick {
            bias: 0.1,
            walk_per_root_s: 0.02,
            ..Stick::default()
        };
        scenario
    }

    /// Returns a scenario whose operator is only a gain with a delay of this number of samples.
    fn gain_scenario(samples: f64) -> FamilyScenario {
        let mut scenario = task(state(Form::Gain, false, &[1.5, 0.01 * samples], [&[1.0], &[1.0, 0.0]]));
        scenario.remnant = vec![RemnantPart::new(RemnantShape::White, 0.1)];
        scenario
    }

    /// Driven by the recorded error of a run, including the run-in, the operator reproduces the control of that run bit
    /// for bit.
    #[test]
    fn operator_run_reproduces_the_control_of_the_simulator() {
        let integrating = state(Form::Lag, false, &[1.5, 0.0, 0.1437], [&[1.0], &[1.0]]);
        for scenario in [
            scenario_with_all_remnants(),
            gain_scenario(0.7),
            gain_scenario(1.0),
            gain_scenario(5.3),
            task(integrating),
        ] {
            let simulator = FamilySimulator::new(&scenario).unwrap();
            let record = simulator.run(SEED, true).unwrap();
            let mut operator = FamilyOperatorRun::new(simulator, SEED, record.time_s(0)).unwrap();
            let remnant = record.channel("n").unwrap();
            for (k, e) in record.input().iter().enumerate() {
                assert_eq!(operator.control().to_bits(), record.output()[k].to_bits(), "{k}");
                assert_eq!(operator.remnant().to_bits(), remnant[k].to_bits(), "{k}");
                operator.push(*e);
            }
        }
    }

    /// A saved state continues in another operator, also after the end of its scenario.
    #[test]
    fn restored_operator_continues_bit_identically() {
        let new =
            || FamilyOperatorRun::new(FamilySimulator::new(&scenario_with_all_remnants()).unwrap(), SEED, 0.0).unwrap();
        let mut first = new();
        let e = |k: usize| (0.1 * k as f64).sin();
        (0..1300).for_each(|k| first.push(e(k)));
        let saved = first.saved_state();
        let mut second = new();
        assert!(second.restore(&saved));
        for k in 1300..1500 {
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
        for length in [0, 1, 2, saved.len() - 1] {
            assert!(!second.restore(&saved[..length]));
        }
        assert_eq!(second.saved_state(), before);
    }

    #[test]
    fn scenario_continues_after_its_end() {
        let mut scenario = gain_scenario(5.3);
        let long = FamilySimulator::new(&scenario).unwrap();
        scenario.measurement_s = 1.0;
        let short = FamilySimulator::new(&scenario).unwrap();
        let samples = short.sample_count() + 500;
        let mut of = [long, short].map(|simulator| FamilyOperatorRun::new(simulator, SEED, -2.0).unwrap());
        for k in 0..samples {
            assert_eq!(of[0].control().to_bits(), of[1].control().to_bits(), "{k}");
            of.iter_mut().for_each(|operator| operator.push((0.1 * k as f64).sin()));
        }
    }

    #[test]
    fn operator_with_delay_below_the_minimum_is_refused() {
        let of =
            |samples: f64| FamilyOperatorRun::new(FamilySimulator::new(&gain_scenario(samples)).unwrap(), SEED, 0.0);
        let refused = of(0.3).unwrap_err();
        assert!(matches!(refused, SimError::DirectResponse { .. }), "{refused}");
        assert!(refused.to_string().contains("0.003 s") && refused.to_string().contains("0.005 s"));
        assert!(of(0.5).is_ok());
    }
}
