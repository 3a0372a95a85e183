//! The operator and the plant between two samples, with the history of the error.
//!
//! The steps are at most a millisecond long. The delay is read from the history at any fraction of a step: a held error
//! enters each step with its mean over that step, a continuous error with its values interpolated between the steps.

use super::{
    case::{Case, Forcing, Sampling},
    operator::{Canonical, Operator, Plant},
};

/// Longest step, s.
const STEP_S: f64 = 0.001;

/// An operator with its polynomials.
pub(super) struct OperatorPolynomials {
    pub operator: Operator,
    pub numerator: Vec<f64>,
    denominator: Vec<f64>,
}

impl OperatorPolynomials {
    pub fn of(operator: Operator) -> Self {
        Self {
            operator,
            numerator: operator.numerator(),
            denominator: operator.denominator(),
        }
    }
}

/// States of the operator and the plant, and the history of the error.
pub(super) struct LoopState {
    pub operator: Canonical,
    pub plant: Canonical,
    element: Plant,
    sampling: Sampling,
    disturbed: bool,
    ts: f64,
    /// Number of integration steps per sample.
    steps: usize,
    /// Past errors: of each sample if the error is held, otherwise of each step.
    errors: Vec<f64>,
}

impl LoopState {
    pub fn new(case: &Case, ts: f64, total: usize) -> Self {
        let steps = (ts / STEP_S - 1e-9).ceil().max(1.0) as usize;
        let each = if case.sampling == Sampling::Held { 1 } else { steps };
        Self {
            operator: Canonical::at_rest(),
            plant: Canonical::at_rest(),
            element: case.plant,
            sampling: case.sampling,
            disturbed: case.forcing == Forcing::Disturbance,
            ts,
            steps,
            errors: Vec::with_capacity(total * each),
        }
    }

    /// Advances from sample k to the next. `error` and `control` are values at its start, `excitation` and `noise`
    /// values at its start and end.
    #[allow(clippy::too_many_arguments)]
    pub fn sample(
        &mut self,
        now: &OperatorPolynomials,
        shadows: &mut [(Operator, Canonical)],
        k: usize,
        error: f64,
        control: f64,
        excitation: [f64; 2],
        noise: [f64; 2],
        stick: &dyn Fn(f64) -> f64,
    ) {
        let h = self.ts / self.steps as f64;
        let element = self.element.denominator();
        let between = |ends: [f64; 2], i: usize| ends[0] + (ends[1] - ends[0]) * i as f64 / self.steps as f64;
        let mut u = control;
        for i in 0..self.steps {
            let [f, d] = if self.disturbed { [0.0, 1.0] } else { [1.0, 0.0] };
            match self.sampling {
                Sampling::Held if i == 0 => self.errors.push(error),
                Sampling::Held => {}
                Sampling::Continuous => self.errors.push(f * between(excitation, i) - self.plant.x[0]),
            }
            let place = (k * self.steps + i) as f64;
            let input = self.input(place - now.operator.tau_e_s / h);
            self.operator.advance(&now.denominator, input, h);
            for (operator, state) in shadows.iter_mut() {
                let input = self.input(place - operator.tau_e_s / h);
                state.advance(&operator.denominator(), input, h);
            }
            let next = match self.sampling {
                Sampling::Held => control,
                Sampling::Continuous => stick(self.operator.output(&now.numerator) + between(noise, i + 1)),
            };
            let force = match self.sampling {
                Sampling::Held => [d * excitation[0]; 2],
                Sampling::Continuous => [d * between(excitation, i), d * between(excitation, i + 1)],
            };
            let ends = [u + force[0], next + force[1]];
            self.plant
                .advance(element, [ends[0], 0.5 * (ends[0] + ends[1]), ends[1]], h);
            u = next;
        }
    }

    /// Returns the input of the operator at the start, middle and end of the step that starts at `place`, in steps.
    fn input(&self, place: f64) -> [f64; 3] {
        match self.sampling {
            Sampling::Held => [self.mean_held_error(place); 3],
            Sampling::Continuous => [0.0, 0.5, 1.0].map(|part| self.interpolated_error(place + part)),
        }
    }

    /// Returns the mean of the held error over the step that starts at `place`, in steps.
    fn mean_held_error(&self, place: f64) -> f64 {
        let n = self.steps as f64;
        let (first, last) = (place / n, (place + 1.0) / n);
        let value = |sample: f64| {
            if sample < 0.0 {
                0.0
            } else {
                self.errors.get(sample as usize).copied().unwrap_or(0.0)
            }
        };
        // The tolerance assigns a position at a sample boundary to the boundary in spite of rounding errors.
        let edge = (first + 1.0 - 1e-9).floor();
        if edge >= last || edge <= first {
            return value(first + 1e-9);
        }
        let part = (edge - first) * n;
        part * value(first) + (1.0 - part) * value(edge)
    }

    /// Returns the continuous error at `place`, in steps, by linear interpolation.
    fn interpolated_error(&self, place: f64) -> f64 {
        if place < 0.0 {
            return 0.0;
        }
        let i = place as usize;
        let value = |i: usize| self.errors.get(i).copied().unwrap_or(0.0);
        value(i) + (value(i + 1) - value(i)) * (place - i as f64)
    }
}
