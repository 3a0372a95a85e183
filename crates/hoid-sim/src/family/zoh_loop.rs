//! Simulation of the loop over one sample.
//!
//! At sample k, with the parameters at that time,
//!
//! `u = r(k - l) + m(k - l_m) + n`, `y = C x_p + D (u + d)`, `e = f - y`,
//!
//! where r is the response of the operator after the fractional part of the delay `tau = l Ts + delta`, m is likewise
//! the response to the motion y if the person feels it, and x_p is the state of the controlled element. The operator
//! ([`ZohOperator`]) and the element are then advanced exactly by one sample, for held inputs. If a direct response of
//! the operator and D form a loop within a sample, both equations are solved together.

use hoid_model::{
    Complex64, ModelError, SampleTime, family_scenario::FamilyState, feedforward::OperatorWithDelay,
    scenario::Realisation, zoh_system::ZohSystem,
};

use crate::zoh_operator::{OperatorOutput, OperatorState, ZohOperator};

/// Smallest accepted magnitude of `1 + D (Y - M)` within a sample.
const MIN_RETURN_DIFFERENCE: f64 = 1e-9;

/// Closed loop with its parameters at one instant.
#[derive(Debug, Clone)]
pub(super) struct ZohLoop {
    pub operator: ZohOperator,
    /// Response to the output of the element, which the person feels; `None` without motion.
    motion: Option<ZohOperator>,
    element: ZohSystem,
    element_input: f64,
    element_output: f64,
}

/// Inputs of the loop at a sample: target, disturbance, remnant.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Inputs {
    pub target: f64,
    pub disturbance: f64,
    pub remnant: f64,
}

/// Signals of the loop at a sample: error, control, output of the element.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Outputs {
    pub e: f64,
    pub u: f64,
    pub y: f64,
}

/// State of the loop between two samples.
pub(super) struct LoopState {
    operator: OperatorState,
    motion: Option<OperatorState>,
    element: Vec<f64>,
    next: Vec<f64>,
}

impl ZohLoop {
    /// Builds the loop with a delay of whole samples plus a fraction of a sample.
    pub fn new(
        state: &FamilyState,
        delay: (usize, f64),
        motion: Option<&OperatorWithDelay>,
        realisation: Realisation,
        sample_time: SampleTime,
    ) -> Result<Self, ModelError> {
        let p = &state.controlled_element;
        // The leading gain is kept separate, since the realisation determines whether a sudden change in this gain
        // makes y jump.
        let gain = p.num()[0];
        let num: Vec<f64> = p
            .num()
            .iter()
            .map(|c| if gain == 0.0 { *c } else { c / gain })
            .collect();
        let (element_input, element_output) = match realisation {
            Realisation::Input => (gain, 1.0),
            Realisation::Output => (1.0, gain),
        };
        let motion = motion.map(|(felt, delay)| ZohOperator::new(felt, *delay, sample_time));
        let held = Self {
            motion: motion.transpose()?,
            operator: ZohOperator::new(&state.operator, delay, sample_time)?,
            element: ZohSystem::new(&num, p.den(), 0.0, sample_time)?,
            element_input,
            element_output,
        };
        if held.return_difference().abs() < MIN_RETURN_DIFFERENCE {
            return Err(ModelError::UnstableLoop {
                reason: "operator and controlled element form an algebraic loop that has no solution".to_owned(),
            });
        }
        Ok(held)
    }

    fn element_feedthrough(&self) -> f64 {
        self.element_input * self.element_output * self.element.direct_feedthrough()
    }

    /// Returns `1 + D (Y - M)`, where D is the direct response of the element within a sample, and Y and M are those of
    /// the person to the error and to motion.
    fn return_difference(&self) -> f64 {
        let felt = self.motion.as_ref().map_or(0.0, ZohOperator::feedthrough);
        1.0 + self.element_feedthrough() * (self.operator.feedthrough() - felt)
    }

    /// Returns the longer of the delays of both responses, in whole samples.
    pub fn longest_delay(&self) -> usize {
        self.motion
            .as_ref()
            .map_or(0, ZohOperator::delay_samples)
            .max(self.operator.delay_samples())
    }

    /// True if u depends on the error of the same sample.
    pub fn has_direct_response(&self) -> bool {
        self.operator.feedthrough() != 0.0
    }

    /// Advances the loop by one sample and returns its signals at this sample.
    #[inline]
    pub fn step(&self, state: &mut LoopState, inputs: Inputs) -> Outputs {
        let output = self.operator.output(&state.operator);
        let OperatorOutput {
            delayed_response: known,
            feedthrough: tap,
            ..
        } = output;
        let direct = self.element_feedthrough();
        let of_state = self.element_output * self.element.output(&state.element);
        let (e, u) = match (&self.motion, &mut state.motion) {
            (Some(motion), Some(felt)) => {
                let answer = motion.output(felt);
                // y = f - e, so both direct responses depend on e.
                let known = known + answer.delayed_response + answer.feedthrough * inputs.target;
                let tap = tap - answer.feedthrough;
                let rest = inputs.target - of_state - direct * (known + inputs.remnant + inputs.disturbance);
                let e = rest / (1.0 + direct * tap);
                motion.advance(felt, answer, inputs.target - e);
                (e, known + tap * e + inputs.remnant)
            }
            _ => {
                let rest = inputs.target - of_state - direct * (known + inputs.remnant + inputs.disturbance);
                let e = if tap == 0.0 { rest } else { rest / (1.0 + direct * tap) };
                (e, known + tap * e + inputs.remnant)
            }
        };
        self.operator.advance(&mut state.operator, output, e);
        let driven = self.element_input * (u + inputs.disturbance);
        self.element.step(&state.element, driven, 0.0, &mut state.next);
        std::mem::swap(&mut state.element, &mut state.next);
        Outputs {
            e,
            u,
            y: inputs.target - e,
        }
    }

    /// Returns the frequency response to motion in the sampled loop; zero without motion, and `None` if the response
    /// does not exist at this frequency.
    pub fn motion_response(&self, omega_rad_s: f64) -> Option<Complex64> {
        match &self.motion {
            Some(motion) => motion.response(omega_rad_s),
            None => Some(Complex64::new(0.0, 0.0)),
        }
    }

    /// Returns the frequency responses of the operator and the element in the sampled loop; `None` if a response does
    /// not exist at this frequency.
    pub fn responses(&self, omega_rad_s: f64) -> Option<[Complex64; 2]> {
        let element = self.element.response(omega_rad_s)? + self.element.direct_feedthrough();
        Some([
            self.operator.response(omega_rad_s)?,
            element * self.element_input * self.element_output,
        ])
    }
}

impl LoopState {
    pub fn at_rest(held: &ZohLoop, longest_delay: usize) -> Self {
        let element = held.element.order();
        Self {
            operator: OperatorState::at_rest(&held.operator, longest_delay),
            motion: (held.motion.as_ref()).map(|motion| OperatorState::at_rest(motion, longest_delay)),
            element: vec![0.0; element],
            next: vec![0.0; element],
        }
    }
}
