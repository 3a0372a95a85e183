//! Simulation of the loop over one sample.
//!
//! At sample k, with the parameters at that time,
//!
//! `u = r(k - l) + n`, `y = C x_p + D (u + d)`, `e = f - y`,
//!
//! where r is the response of the operator after the fractional part of the delay `tau = l Ts + delta`, and x_p the
//! state of the controlled element. Operator and element are then advanced exactly by one sample, for held inputs
//! ([`hoid_model::held_system`]). An operator without a neuromuscular part may have a direct response to e. With a held
//! error this response would appear at one sample or at the next, so it is computed from the error interpolated about
//! `t - delta - Ts/2`, as in [`FamilyOperator::zoh`](hoid_model::FamilyOperator::zoh). If the direct response and D
//! form a loop within a sample, both equations are solved together.

use hoid_model::{
    ModelError, SampleTime, family_scenario::FamilyState, held_system::HeldSystem, scenario::Realisation,
};

use hoid_model::Complex64;

/// Smallest accepted magnitude of `1 + D Y` within a sample.
const SMALLEST: f64 = 1e-9;

/// Closed loop with its parameters at one instant.
#[derive(Debug, Clone)]
pub(super) struct HeldLoop {
    operator: HeldSystem,
    /// Weights of e(k), e(k-1), e(k-2) in the direct response.
    taps: [f64; 3],
    delay: usize,
    element: HeldSystem,
    element_input: f64,
    element_output: f64,
    sample_time: SampleTime,
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
    element: Vec<f64>,
    next: Vec<f64>,
}

/// State of the operator between two samples.
#[derive(Debug, Clone)]
pub(super) struct OperatorState {
    state: Vec<f64>,
    next: Vec<f64>,
    /// Errors e(k-1) and e(k-2).
    errors: [f64; 2],
    /// Ring of responses, in which the response of sample k has the index k modulo the length.
    ring: Vec<f64>,
    k: usize,
}

/// Output of the operator at a sample before the error of that sample is known.
#[derive(Debug, Clone, Copy)]
pub(super) struct OperatorOutput {
    /// Response without the contribution of the current error, before the delay of whole samples.
    past: f64,
    /// Known part of u: the response after the delay of whole samples, without the contribution of the current error.
    pub known: f64,
    /// Factor by which the current error contributes to u.
    tap: f64,
}

impl HeldLoop {
    /// Builds the loop with a delay of whole samples plus a fraction of a sample.
    pub fn new(
        state: &FamilyState,
        (delay, late): (usize, f64),
        realisation: Realisation,
        sample_time: SampleTime,
    ) -> Result<Self, ModelError> {
        let transfer = state.operator.transfer_function()?;
        let operator = HeldSystem::new(transfer.num(), transfer.den(), late, sample_time)?;
        let mut taps = [0.0; 3];
        let late_by = late + 0.5;
        let (whole, part) = (late_by.floor(), late_by.fract());
        taps[whole as usize] = operator.direct() * (1.0 - part);
        taps[whole as usize + 1] = operator.direct() * part;
        let p = &state.controlled_element;
        // The leading gain is kept separate, since the realisation determines whether a sudden change of this gain
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
        let held = Self {
            operator,
            taps,
            delay,
            element: HeldSystem::new(&num, p.den(), 0.0, sample_time)?,
            element_input,
            element_output,
            sample_time,
        };
        if held.return_difference().abs() < SMALLEST {
            return Err(ModelError::UnstableLoop {
                reason: "the direct parts of operator and controlled element cancel within a sample".to_owned(),
            });
        }
        Ok(held)
    }

    /// Returns the number of whole samples of the delay.
    pub fn delay(&self) -> usize {
        self.delay
    }

    fn element_direct(&self) -> f64 {
        self.element_input * self.element_output * self.element.direct()
    }

    /// Returns `1 + D Y`, where D and Y are the direct responses of element and operator within a sample.
    fn return_difference(&self) -> f64 {
        1.0 + self.element_direct() * if self.delay == 0 { self.taps[0] } else { 0.0 }
    }

    /// True if u depends on the error of the same sample.
    pub fn has_direct_response(&self) -> bool {
        self.delay == 0 && self.taps[0] != 0.0
    }

    /// Returns the output of the operator at the next sample.
    #[inline]
    pub fn output(&self, state: &OperatorState) -> OperatorOutput {
        let [e1, e2] = state.errors;
        let past = self.operator.output(&state.state) + self.taps[1] * e1 + self.taps[2] * e2;
        let (known, tap) = if self.delay == 0 {
            (past, self.taps[0])
        } else {
            let mask = state.ring.len() - 1;
            (state.ring[state.k.wrapping_sub(self.delay) & mask], 0.0)
        };
        OperatorOutput { past, known, tap }
    }

    /// Takes the error of this sample and advances the operator by one sample.
    #[inline]
    pub fn advance_operator(&self, state: &mut OperatorState, output: OperatorOutput, e: f64) {
        let mask = state.ring.len() - 1;
        state.ring[state.k & mask] = output.past + self.taps[0] * e;
        state.k += 1;
        let [e1, _] = state.errors;
        self.operator.step(&state.state, e, e1, &mut state.next);
        std::mem::swap(&mut state.state, &mut state.next);
        state.errors = [e, e1];
    }

    /// Advances the loop by one sample and returns its signals at this sample.
    #[inline]
    pub fn step(&self, state: &mut LoopState, inputs: Inputs) -> Outputs {
        let output = self.output(&state.operator);
        let OperatorOutput { known, tap, .. } = output;
        let direct = self.element_direct();
        let of_state = self.element_output * self.element.output(&state.element);
        let rest = inputs.target - of_state - direct * (known + inputs.remnant + inputs.disturbance);
        let e = if tap == 0.0 { rest } else { rest / (1.0 + direct * tap) };
        let u = known + tap * e + inputs.remnant;
        self.advance_operator(&mut state.operator, output, e);
        let driven = self.element_input * (u + inputs.disturbance);
        self.element.step(&state.element, driven, 0.0, &mut state.next);
        std::mem::swap(&mut state.element, &mut state.next);
        Outputs {
            e,
            u,
            y: inputs.target - e,
        }
    }

    /// Returns the frequency responses of operator and element in the sampled loop; `None` if a response does not exist
    /// at this frequency.
    pub fn responses(&self, omega_rad_s: f64) -> Option<[Complex64; 2]> {
        let backward = Complex64::from_polar(1.0, -omega_rad_s * self.sample_time.s());
        let [a, b, c] = self.taps;
        let operator = self.operator.response(omega_rad_s)? + a + (b + c * backward) * backward;
        let element = self.element.response(omega_rad_s)? + self.element.direct();
        Some([
            operator * backward.powu(self.delay as u32),
            element * self.element_input * self.element_output,
        ])
    }
}

impl LoopState {
    pub fn at_rest(held: &HeldLoop, longest_delay: usize) -> Self {
        let element = held.element.order();
        Self {
            operator: OperatorState::at_rest(held, longest_delay),
            element: vec![0.0; element],
            next: vec![0.0; element],
        }
    }
}

impl OperatorState {
    pub fn at_rest(held: &HeldLoop, longest_delay: usize) -> Self {
        let order = held.operator.order();
        Self {
            state: vec![0.0; order],
            next: vec![0.0; order],
            errors: [0.0; 2],
            ring: vec![0.0; (longest_delay + 1).next_power_of_two()],
            k: 0,
        }
    }

    /// Returns the state as numbers; the ring is rotated so that it starts at the next sample.
    pub fn numbers(&mut self) -> impl Iterator<Item = &mut f64> {
        let oldest = self.k & (self.ring.len() - 1);
        self.ring.rotate_left(oldest);
        self.k = 0;
        self.state.iter_mut().chain(&mut self.errors).chain(&mut self.ring)
    }
}
