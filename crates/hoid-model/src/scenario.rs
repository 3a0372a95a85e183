//! Scenarios: operator, controlled element, remnant, and their change.
//!
//! This module defines the two states of adaptation (Table 2) and the six conditions (Table 4.4) of the thesis:
//!
//! | condition | operator and controlled element | transition rate G |
//! |---|---|---|
//! | C1 | s1 throughout | - |
//! | C2 | s2 throughout | - |
//! | C3, C4 | s1 to s2 at 40.96 s | 0.5, 100 1/s |
//! | C5, C6 | s2 to s1 at 40.96 s | 0.5, 100 1/s |
//!
//! The gains, time constants and frequencies of the operator and the controlled element and the remnant gain K_n follow
//! one sigmoid (eq. 5); the remnant time constant is constant. The delay is constant in the conditions of the thesis;
//! if it changes, it follows the same sigmoid, in steps of one sample. The remnant gain of each state is the gain that
//! gives the required noise level in that state (eq. 43 or A.17).

use num_complex::Complex64;

use crate::{
    Feedforward, ModelError, OperatorParameters, SampleTime,
    controlled_element::ControlledElement,
    feedforward::OperatorWithDelay,
    forcing::{ForcingFunction, REFERENCE_PERIOD_S},
    remnant::RemnantFilter,
    remnant_gain::{NoiseDefinition, SpectralLine, remnant_gain},
    schedule::Schedule,
};

/// Longest run, in samples: 11 days at 100 Hz. With this limit, a time with a wrong exponent causes an error message
/// instead of exhausting the memory.
const MAX_SAMPLES: usize = 100_000_000;

/// A state of adaptation: the operator and the controlled element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OperatingState {
    /// Operator in this state.
    pub operator: OperatorParameters,
    /// Controlled element in this state.
    pub controlled_element: ControlledElement,
}

impl OperatingState {
    /// Returns state s1 of Table 2: nearly a single integrator, crossover 1.56 rad/s.
    pub fn s1() -> Self {
        Self {
            operator: OperatorParameters {
                k_e: 0.09,
                t_l_s: 0.4,
                omega_nm_rad_s: 11.25,
                zeta_nm: 0.35,
                tau_e_s: 0.28,
            },
            controlled_element: ControlledElement {
                k_c: 90.0,
                omega_b_rad_s: 6.0,
            },
        }
    }

    /// Returns state s2 of Table 2: nearly a double integrator, crossover 2.75 rad/s.
    pub fn s2() -> Self {
        let s1 = Self::s1();
        Self {
            operator: OperatorParameters {
                k_e: 0.07,
                t_l_s: 1.2,
                ..s1.operator
            },
            controlled_element: ControlledElement {
                k_c: 30.0,
                omega_b_rad_s: 0.2,
            },
        }
    }
}

/// The conditions of the thesis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Condition {
    C1,
    C2,
    C3,
    C4,
    C5,
    C6,
}

crate::named_choice!(Condition, "condition", 6, {
    C1 => "C1",
    C2 => "C2",
    C3 => "C3",
    C4 => "C4",
    C5 => "C5",
    C6 => "C6",
});

/// Strength of the remnant, given as a noise level or as a gain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RemnantStrength {
    /// Noise level, from which the gain is computed in each state.
    Level {
        /// Noise level P_n.
        level: f64,
        /// Definition of P_n.
        definition: NoiseDefinition,
    },
    /// Gain K_n itself, before and after the change.
    Gain {
        /// K_n before the change.
        initial: f64,
        /// K_n after the change.
        last: f64,
    },
}

impl RemnantStrength {
    /// Returns this strength with another level, another definition of the level, or both. `None` if a definition is
    /// given without a level and this strength is a gain.
    pub fn with_level(self, level: Option<f64>, definition: Option<NoiseDefinition>) -> Option<Self> {
        match (self, level, definition) {
            (same, None, None) => Some(same),
            (Self::Level { level, definition }, new_level, new_definition) => Some(Self::Level {
                level: new_level.unwrap_or(level),
                definition: new_definition.unwrap_or(definition),
            }),
            (Self::Gain { .. }, Some(level), definition) => Some(Self::Level {
                level,
                definition: definition.unwrap_or_default(),
            }),
            (Self::Gain { .. }, None, Some(_)) => None,
        }
    }
}

/// The remnant of the operator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RemnantSetting {
    /// Order m of the remnant filter, 1 to 4.
    pub order: usize,
    /// Time constant T_n, s.
    pub time_constant_s: f64,
    /// Strength of the remnant.
    pub strength: RemnantStrength,
}

impl Default for RemnantSetting {
    /// Returns a remnant of first order with T_n = 0.06 s and the noise level P_n = 0.1.
    fn default() -> Self {
        Self {
            order: 1,
            time_constant_s: 0.06,
            strength: RemnantStrength::Level {
                level: 0.1,
                definition: NoiseDefinition::Response,
            },
        }
    }
}

/// Position of K_c in the state-space form of the controlled element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Realisation {
    /// In the input matrix: the output x is continuous when K_c jumps.
    #[default]
    Input,
    /// In the output matrix, as in the controllable canonical form of the thesis: x jumps when K_c jumps.
    Output,
}

crate::named_choice!(Realisation, "realisation", 2, { Input => "input", Output => "output" });

/// One task: operator, controlled element, remnant, forcing function and change over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Name of the task in tables and file names.
    pub name: String,
    /// State before the change.
    pub initial: OperatingState,
    /// State after the change.
    pub last: OperatingState,
    /// Course of the change over time.
    pub schedule: Schedule,
    /// Target signal.
    pub forcing: ForcingFunction,
    /// Response of u to the displayed target; `None` if the display shows only the error. Its neuromuscular system is
    /// that of the operator.
    pub feedforward: Option<Feedforward>,
    /// Disturbance d at the input of the controlled element, held over each sample; without sinusoids, there is no
    /// disturbance.
    pub disturbance: ForcingFunction,
    /// Remnant.
    pub remnant: RemnantSetting,
    /// Time between two samples. Default 0.01 s.
    pub sample_time: SampleTime,
    /// Measurement time T_m, s. Default 81.92 s.
    pub measurement_s: f64,
    /// Run-in t_0 before the measurement, s. Default 10 s.
    pub run_in_s: f64,
    /// Position of K_c in the state-space form of the controlled element.
    pub realisation: Realisation,
}

/// True parameters of a scenario at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueParameters {
    /// Operator.
    pub operator: OperatorParameters,
    /// Controlled element.
    pub controlled_element: ControlledElement,
    /// Remnant gain K_n.
    pub k_n: f64,
    /// Remnant time constant T_n, s.
    pub t_n_s: f64,
}

/// A validated scenario, with the precomputed quantities of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct ResolvedScenario {
    scenario: Scenario,
    k_n: [f64; 2],
    delay_samples: [usize; 2],
    run_in_samples: usize,
    measurement_samples: usize,
}

impl Scenario {
    /// Returns the scenario of a condition of the thesis, with the default remnant.
    pub fn condition(condition: Condition) -> Self {
        let (s1, s2) = (OperatingState::s1(), OperatingState::s2());
        let (initial, last, rate) = match condition {
            Condition::C1 => (s1, s1, None),
            Condition::C2 => (s2, s2, None),
            Condition::C3 => (s1, s2, Some(0.5)),
            Condition::C4 => (s1, s2, Some(100.0)),
            Condition::C5 => (s2, s1, Some(0.5)),
            Condition::C6 => (s2, s1, Some(100.0)),
        };
        Self {
            name: condition.to_string(),
            initial,
            last,
            schedule: rate.map_or(Schedule::Constant, |rate_per_s| Schedule::Sigmoid {
                rate_per_s,
                midpoint_s: REFERENCE_PERIOD_S / 2.0,
            }),
            forcing: ForcingFunction::reference(),
            feedforward: None,
            disturbance: ForcingFunction::default(),
            remnant: RemnantSetting::default(),
            // 0.01 s is the sample time of the thesis.
            sample_time: SampleTime::AT_100_HZ,
            measurement_s: REFERENCE_PERIOD_S,
            run_in_s: 10.0,
            realisation: Realisation::default(),
        }
    }

    /// Returns the remnant gain of a state: `given` if the strength is a gain, otherwise the gain for the required
    /// noise level.
    ///
    /// # Errors
    /// As [`remnant_gain`].
    pub fn remnant_gain_of(&self, state: &OperatingState, given: f64) -> Result<f64, ModelError> {
        self.remnant_gain_in(state, *state == self.last && *state != self.initial, given)
    }

    fn remnant_gain_in(&self, state: &OperatingState, is_last: bool, given: f64) -> Result<f64, ModelError> {
        let RemnantStrength::Level { level, definition } = self.remnant.strength else {
            return Ok(given);
        };
        remnant_gain(
            level,
            definition,
            self.remnant.order,
            self.remnant.time_constant_s,
            &state.operator.transfer_function()?,
            &state.controlled_element.transfer_function()?,
            &self.equivalent_lines(state, is_last)?,
            self.sample_time,
        )
    }

    /// Returns the lines of a target that would cause the same variance of u in a compensatory loop without a
    /// disturbance: with the responses B to the error and F to the target, and the element P, `u = B/(1 + B P) ((1 +
    /// F/B) f_t - P d)`.
    fn equivalent_lines(&self, state: &OperatingState, is_last: bool) -> Result<Vec<SpectralLine>, ModelError> {
        let mut lines = self.forcing.lines();
        let operator = state.operator.transfer_function()?;
        let scaled = |line: &SpectralLine, by: f64| SpectralLine {
            // The ratio is infinite if the response to the error is zero; such a loop has no noise level.
            amplitude: if by.is_finite() {
                line.amplitude * by
            } else {
                line.amplitude
            },
            ..*line
        };
        if let Some(seen) = self.feedforward_of(state)? {
            let of = match &seen.last {
                Some(last) if is_last => last,
                _ => &seen.operator,
            };
            for line in &mut lines {
                let ahead = Complex64::from_polar(1.0, line.omega_rad_s * seen.preview_s);
                let ratio = of.response(line.omega_rad_s) * ahead / operator.response(line.omega_rad_s);
                *line = scaled(line, (1.0 + ratio).norm());
            }
        }
        let element = state.controlled_element.transfer_function()?;
        let disturbed = self.disturbance.lines();
        lines.extend((disturbed.iter()).map(|line| scaled(line, element.response(line.omega_rad_s).norm())));
        Ok(lines)
    }

    /// Returns the response to the target with the neuromuscular system of a state.
    fn feedforward_of(&self, state: &OperatingState) -> Result<Option<Feedforward>, ModelError> {
        let Some(seen) = &self.feedforward else { return Ok(None) };
        if !seen.operator.has_neuromuscular() {
            return Err(ModelError::Operator {
                reason: "the response to the target has no neuromuscular dynamics; expected those of the response to \
                         the error"
                    .to_owned(),
            });
        }
        let OperatorParameters {
            omega_nm_rad_s,
            zeta_nm,
            ..
        } = state.operator;
        Ok(Some(seen.with_neuromuscular(omega_nm_rad_s, zeta_nm)?))
    }

    /// Returns the remnant gain of a state for an order and a noise level other than those of the scenario.
    ///
    /// # Errors
    /// As [`remnant_gain`].
    pub fn remnant_gain_for(
        &self,
        state: &OperatingState,
        order: usize,
        level: f64,
        definition: NoiseDefinition,
    ) -> Result<f64, ModelError> {
        let mut scenario = self.clone();
        scenario.remnant.order = order;
        scenario.remnant.strength = RemnantStrength::Level { level, definition };
        scenario.remnant_gain_of(state, 0.0)
    }

    /// Checks the scenario and computes the quantities that a simulation needs.
    ///
    /// # Errors
    /// [`ModelError`], which names the parameter.
    pub fn resolve(&self) -> Result<ResolvedScenario, ModelError> {
        self.schedule.check()?;
        let samples = |quantity: &'static str, time_s: f64| {
            self.sample_time.whole_samples(time_s).ok_or(ModelError::OutOfRange {
                quantity,
                found: time_s,
                expected: "zero or more, and a whole number of samples",
            })
        };
        let measurement_samples = samples("measurement time T_m in s", self.measurement_s)?;
        if measurement_samples == 0 {
            return Err(ModelError::OutOfRange {
                quantity: "measurement time T_m in s",
                found: self.measurement_s,
                expected: "at least one sample",
            });
        }
        let run_in_samples = samples("run-in time t_0 in s", self.run_in_s)?;
        if run_in_samples + measurement_samples > MAX_SAMPLES {
            return Err(ModelError::OutOfRange {
                quantity: "run-in and measurement time in s",
                found: self.run_in_s + self.measurement_s,
                expected: "at most 1e8 samples; shorten the run or use a longer sample time",
            });
        }
        let mut delay_samples = [0; 2];
        for (delay, state) in delay_samples.iter_mut().zip([&self.initial, &self.last]) {
            *delay = state.operator.discretise(self.sample_time)?.nk - 1;
            state.controlled_element.check()?;
            if let Some(seen) = self.feedforward_of(state)? {
                seen.check(&self.schedule, self.sample_time)?;
                if self.forcing.sinusoids().is_empty() {
                    return Err(ModelError::Operator {
                        reason: "the person responds to a target, but the target is at rest; expected a target with \
                             sinusoids, or no response to the target"
                            .to_owned(),
                    });
                }
            }
        }
        let given = match self.remnant.strength {
            RemnantStrength::Gain { initial, last } => [initial, last],
            RemnantStrength::Level { .. } => [0.0; 2],
        };
        let k_n = [
            self.remnant_gain_in(&self.initial, false, given[0])?,
            self.remnant_gain_in(&self.last, true, given[1])?,
        ];
        for gain in k_n {
            RemnantFilter::new(gain, self.remnant.time_constant_s, self.remnant.order)?;
        }
        Ok(ResolvedScenario {
            scenario: self.clone(),
            k_n,
            delay_samples,
            run_in_samples,
            measurement_samples,
        })
    }
}

impl ResolvedScenario {
    /// Returns the scenario from which the quantities were computed.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Returns the operator delay tau_e in samples before and after the change.
    pub fn delay_samples(&self) -> [usize; 2] {
        self.delay_samples
    }

    /// Returns the operator delay tau_e in samples at time `t_s`, rounded to the nearest integer.
    pub fn delay_samples_at(&self, t_s: f64) -> usize {
        let [initial, last] = self.delay_samples;
        self.scenario.schedule.value(initial as f64, last as f64, t_s).round() as usize
    }

    /// Number of samples of the run-in, before t = 0.
    pub fn run_in_samples(&self) -> usize {
        self.run_in_samples
    }

    /// Number of samples of the measurement.
    pub fn measurement_samples(&self) -> usize {
        self.measurement_samples
    }

    /// True if the response to the target or its neuromuscular system changes over time.
    pub fn feedforward_changes(&self) -> bool {
        let Scenario { initial, last, .. } = &self.scenario;
        let muscles = |state: &OperatingState| (state.operator.omega_nm_rad_s, state.operator.zeta_nm);
        let seen = self.scenario.feedforward.as_ref();
        self.scenario.schedule != Schedule::Constant
            && seen.is_some_and(|seen| seen.last.is_some() || muscles(initial) != muscles(last))
    }

    /// Returns the response to the target at time `t_s`, with its delay as a number of whole samples and a fraction of
    /// a sample; `None` if the person does not see the target.
    ///
    /// # Errors
    /// As [`Feedforward::at`].
    pub fn feedforward_at(&self, t_s: f64) -> Result<Option<OperatorWithDelay>, ModelError> {
        let Some(seen) = &self.scenario.feedforward else {
            return Ok(None);
        };
        let operator = self.parameters_at(t_s).operator;
        let muscles = (operator.omega_nm_rad_s, operator.zeta_nm);
        let Scenario {
            schedule, sample_time, ..
        } = &self.scenario;
        Ok(Some(seen.at(t_s, schedule, *sample_time, Some(muscles))?))
    }

    /// Returns the true parameters at time `t_s`; t = 0 is the start of the measurement.
    pub fn parameters_at(&self, t_s: f64) -> TrueParameters {
        let Scenario {
            initial,
            last,
            schedule,
            remnant,
            ..
        } = &self.scenario;
        let between = |a: f64, b: f64| schedule.value(a, b, t_s);
        let (a, b) = (&initial.operator, &last.operator);
        let (c, d) = (&initial.controlled_element, &last.controlled_element);
        TrueParameters {
            operator: OperatorParameters {
                k_e: between(a.k_e, b.k_e),
                t_l_s: between(a.t_l_s, b.t_l_s),
                omega_nm_rad_s: between(a.omega_nm_rad_s, b.omega_nm_rad_s),
                zeta_nm: between(a.zeta_nm, b.zeta_nm),
                tau_e_s: if a.tau_e_s == b.tau_e_s {
                    a.tau_e_s
                } else {
                    self.delay_samples_at(t_s) as f64 * self.scenario.sample_time.s()
                },
            },
            controlled_element: ControlledElement {
                k_c: between(c.k_c, d.k_c),
                omega_b_rad_s: between(c.omega_b_rad_s, d.omega_b_rad_s),
            },
            k_n: between(self.k_n[0], self.k_n[1]),
            t_n_s: remnant.time_constant_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_follow_the_table() {
        let gain = |c: Condition, t: f64| Scenario::condition(c).resolve().unwrap().parameters_at(t).operator.k_e;
        for (condition, start, end) in [
            (Condition::C1, 0.09, 0.09),
            (Condition::C2, 0.07, 0.07),
            (Condition::C3, 0.09, 0.07),
            (Condition::C4, 0.09, 0.07),
            (Condition::C5, 0.07, 0.09),
            (Condition::C6, 0.07, 0.09),
        ] {
            // At both ends of the run, the slow sigmoid deviates by e^-20 from its final values.
            assert!((gain(condition, 0.0) - start).abs() < 1e-9, "{condition}");
            assert!((gain(condition, 81.92) - end).abs() < 1e-9, "{condition}");
            assert_eq!(condition.to_string().parse::<Condition>().unwrap(), condition);
        }
        assert_eq!("c4".parse::<Condition>().unwrap(), Condition::C4);
        assert!("C7".parse::<Condition>().is_err());
    }

    #[test]
    fn remnant_gain_matches_the_noise_level_of_each_state() {
        // Expected K_n for m = 1 and P_n = 0.1 in s1 and s2.
        let c4 = Scenario::condition(Condition::C4).resolve().unwrap();
        assert!((c4.parameters_at(0.0).k_n - 0.07636).abs() < 5e-6);
        assert!((c4.parameters_at(81.92).k_n - 0.13971).abs() < 5e-6);
        assert_eq!(
            (c4.delay_samples(), c4.run_in_samples(), c4.measurement_samples()),
            ([28; 2], 1000, 8192)
        );
    }

    #[test]
    fn delay_follows_the_sigmoid_in_whole_samples() {
        let mut scenario = Scenario::condition(Condition::C3);
        scenario.last.operator.tau_e_s = 0.34;
        let resolved = scenario.resolve().unwrap();
        assert_eq!(resolved.delay_samples(), [28, 34]);
        assert_eq!([0.0, 40.96, 81.92].map(|t| resolved.delay_samples_at(t)), [28, 31, 34]);
        for k in 0..8192 {
            let p = resolved.parameters_at(0.01 * f64::from(k));
            // The gain and the delay have completed the same share of their change, to within half a sample of the six
            // by which the delay changes.
            let share = (p.operator.k_e - 0.09) / (0.07 - 0.09);
            let samples = p.operator.tau_e_s / 0.01;
            assert!((samples - samples.round()).abs() < 1e-9);
            assert!((samples - 28.0 - 6.0 * share).abs() < 0.5 + 1e-9, "{k}");
        }
    }

    #[test]
    fn invalid_scenarios_are_refused() {
        let refused = |change: fn(&mut Scenario)| {
            let mut scenario = Scenario::condition(Condition::C4);
            change(&mut scenario);
            scenario.resolve().unwrap_err().to_string()
        };
        assert!(refused(|s| s.measurement_s = 0.0).contains("T_m"));
        assert!(refused(|s| s.measurement_s = f64::NAN).contains("T_m"));
        assert!(refused(|s| s.run_in_s = -1.0).contains("t_0"));
        assert!(refused(|s| s.measurement_s = 8.192e10).contains("1e8 samples"));
        assert!(refused(|s| s.initial.operator.tau_e_s = 0.285).contains("tau_e"));
        assert!(refused(|s| s.last.operator.tau_e_s = 0.205).contains("tau_e"));
        assert!(refused(|s| s.initial.operator.omega_nm_rad_s = 0.0).contains("omega_nm"));
        assert!(refused(|s| s.remnant.order = 5).contains("order"));
        assert!(refused(|s| s.remnant.time_constant_s = 0.0).contains("T_n"));
        assert!(
            refused(|s| {
                s.remnant.strength = RemnantStrength::Gain {
                    initial: f64::NAN,
                    last: 0.1,
                };
            })
            .contains("K_n")
        );
        assert!(refused(|s| s.last.controlled_element.k_c = f64::INFINITY).contains("K_c"));
    }
}
