//! Operator of the family over one sample.
//!
//! The operator is advanced exactly by one sample, for a held input ([`hoid_model::zoh_system`]); its response is
//! stored in a ring, from which it is taken after the whole samples of the delay `tau = l Ts + delta`. A delay that
//! changes has its value at the sample at which the response arrives. An operator without a neuromuscular part may have
//! a direct response to its input. With a held input this response would appear at one sample or at the next, so it is
//! computed from the input interpolated about `t - delta - Ts/2`, as in
//! [`FamilyOperator::zoh`](hoid_model::FamilyOperator::zoh).

use hoid_model::{Complex64, FamilyOperator, ModelError, SampleTime, zoh_system::ZohSystem};

/// Operator with its parameters at one instant.
#[derive(Debug, Clone)]
pub(crate) struct ZohOperator {
    system: ZohSystem,
    /// Weights of the inputs at k, k-1 and k-2 in the direct response.
    taps: [f64; 3],
    delay: usize,
    sample_time: SampleTime,
}

/// State of the operator between two samples.
#[derive(Debug, Clone)]
pub(crate) struct OperatorState {
    state: Vec<f64>,
    next: Vec<f64>,
    /// Inputs at k-1 and k-2.
    inputs: [f64; 2],
    /// Ring of responses, in which the response of sample k has the index k modulo the length.
    ring: Vec<f64>,
    k: usize,
}

/// Output of the operator at a sample before the input of that sample is known.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OperatorOutput {
    /// Response without the contribution of the current input, before the delay of whole samples.
    undelayed_response: f64,
    /// Known part of the response: after the delay of whole samples, without the contribution of the current input.
    pub delayed_response: f64,
    /// Factor by which the current input contributes.
    pub feedthrough: f64,
}

impl ZohOperator {
    /// Builds the operator with a delay of whole samples plus a fraction of a sample.
    pub fn new(
        operator: &FamilyOperator,
        (delay, late): (usize, f64),
        sample_time: SampleTime,
    ) -> Result<Self, ModelError> {
        let transfer = operator.transfer_function()?;
        let system = ZohSystem::new(transfer.num(), transfer.den(), late, sample_time)?;
        let mut taps = [0.0; 3];
        let late_by = late + 0.5;
        let (whole, part) = (late_by.floor(), late_by.fract());
        taps[whole as usize] = system.direct_feedthrough() * (1.0 - part);
        taps[whole as usize + 1] = system.direct_feedthrough() * part;
        Ok(Self {
            system,
            taps,
            delay,
            sample_time,
        })
    }

    /// Returns the number of whole samples of the delay.
    pub fn delay_samples(&self) -> usize {
        self.delay
    }

    /// Factor by which the current input contributes to the output.
    pub fn feedthrough(&self) -> f64 {
        if self.delay == 0 { self.taps[0] } else { 0.0 }
    }

    /// Returns the output of the operator at the next sample.
    #[inline]
    pub fn output(&self, state: &OperatorState) -> OperatorOutput {
        let [e1, e2] = state.inputs;
        let past = self.system.output(&state.state) + self.taps[1] * e1 + self.taps[2] * e2;
        let (known, tap) = if self.delay == 0 {
            (past, self.taps[0])
        } else {
            let mask = state.ring.len() - 1;
            (state.ring[state.k.wrapping_sub(self.delay) & mask], 0.0)
        };
        OperatorOutput {
            undelayed_response: past,
            delayed_response: known,
            feedthrough: tap,
        }
    }

    /// Takes the input of this sample and advances the operator by one sample.
    #[inline]
    pub fn advance(&self, state: &mut OperatorState, output: OperatorOutput, input: f64) {
        let mask = state.ring.len() - 1;
        state.ring[state.k & mask] = output.undelayed_response + self.taps[0] * input;
        state.k += 1;
        let [e1, _] = state.inputs;
        self.system.step(&state.state, input, e1, &mut state.next);
        std::mem::swap(&mut state.state, &mut state.next);
        state.inputs = [input, e1];
    }

    /// Returns the frequency response of the sampled operator; `None` if it does not exist at this frequency.
    pub fn response(&self, omega_rad_s: f64) -> Option<Complex64> {
        let backward = Complex64::from_polar(1.0, -omega_rad_s * self.sample_time.s());
        let [a, b, c] = self.taps;
        let operator = self.system.response(omega_rad_s)? + a + (b + c * backward) * backward;
        Some(operator * backward.powu(self.delay as u32))
    }
}

impl OperatorState {
    pub fn at_rest(held: &ZohOperator, longest_delay: usize) -> Self {
        let order = held.system.order();
        Self {
            state: vec![0.0; order],
            next: vec![0.0; order],
            inputs: [0.0; 2],
            ring: vec![0.0; (longest_delay + 1).next_power_of_two()],
            k: 0,
        }
    }

    /// Returns the state as numbers; the ring is rotated so that it starts at the next sample.
    pub fn state_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        let oldest = self.k & (self.ring.len() - 1);
        self.ring.rotate_left(oldest);
        self.k = 0;
        self.state.iter_mut().chain(&mut self.inputs).chain(&mut self.ring)
    }
}
