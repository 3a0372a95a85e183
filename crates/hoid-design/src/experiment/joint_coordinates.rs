//! The joint coordinates of both responses of a person: first those of the response B to the error, then those of the
//! response F to the target. The neuromuscular system of F is the same as that of B and is not repeated.
//!
//! A line of the target with the amplitude X contributes `E` to e and `U = B E + F X + N` to u. The derivative of U
//! with respect to a coordinate is `dB E + dF X`, where the second term is absent at a line of the disturbance. At a
//! line of the target, the part of U due to B is determined by the lines of the disturbance (M. M. van Paassen and M.
//! Mulder, *Identification of Human Operator Control Behaviour in Multiple-Loop Tracking Tasks*, IFAC 1998).

use hoid_model::{
    Complex64, FamilyOperator, operator_family::Coordinate, operator_family::NamedParameter, static_names::interned,
};
use nalgebra::{DMatrix, DVector};

use super::Task;

/// Returns the name of a parameter of F: its name in the operator with the suffix `_f`.
fn target_parameter_name(parameter: &NamedParameter) -> &'static str {
    let name = match parameter.name {
        "K_d" | "K_e" => "K".to_owned(),
        "tau_e" => "tau".to_owned(),
        other => other.to_owned(),
    };
    interned(&format!("{name}_f")).unwrap_or(parameter.name)
}

/// A parameter, the crossover or the margin, with its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Quantity {
    pub name: &'static str,
    pub unit: &'static str,
    pub value: f64,
    /// Derivatives with respect to the joint coordinates.
    pub gradient: DVector<f64>,
    /// Unit of the accepted error: the value of the quantity, or one.
    pub scale: f64,
    /// Size to which the variation is relative, and the error if all parameters have the same weight: the value; for
    /// the phase margin its derivative with respect to the logarithm of the gain.
    pub size: f64,
}

impl Quantity {
    /// Creates a quantity whose errors are relative to its value.
    fn relative(parameter: &NamedParameter, name: &'static str, gradient: DVector<f64>) -> Self {
        let scale = parameter.value.abs();
        Self {
            name,
            unit: parameter.unit,
            value: parameter.value,
            gradient,
            scale,
            size: scale,
        }
    }
}

/// Number of the joint coordinates, and positions of the coordinates of F among them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct JointCoordinates {
    pub count: usize,
    target_coordinates: Vec<usize>,
}

impl JointCoordinates {
    pub fn of(task: &Task) -> Self {
        let feedback = &task.state.operator;
        let known = feedback.form().coordinates(feedback.has_neuromuscular());
        let mut count = known.len();
        let mut index = |coordinate: Coordinate| {
            let common = matches!(coordinate, Coordinate::LogOmega | Coordinate::LogZeta);
            let found = known.iter().position(|c| common && *c == coordinate);
            found.unwrap_or_else(|| {
                count += 1;
                count - 1
            })
        };
        let of_target = task.feedforward.as_ref().map_or_else(Vec::new, |seen| {
            let own = seen.operator.form().coordinates(seen.operator.has_neuromuscular());
            own.into_iter().map(&mut index).collect()
        });
        Self {
            count,
            target_coordinates: of_target,
        }
    }

    /// Converts a gradient with respect to the coordinates of B to one with respect to the joint coordinates.
    pub fn feedback(&self, own: &[f64]) -> DVector<f64> {
        DVector::from_fn(self.count, |k, _| own.get(k).copied().unwrap_or(0.0))
    }

    /// Converts a gradient with respect to the coordinates of F to one with respect to the joint coordinates.
    fn target(&self, own: &[f64]) -> DVector<f64> {
        let mut all = DVector::zeros(self.count);
        self.target_coordinates.iter().zip(own).for_each(|(k, g)| all[*k] = *g);
        all
    }

    /// Returns `dB E + dF X` for all joint coordinates.
    pub fn derivatives(
        &self,
        (of_error, error): (&[Complex64], Complex64),
        (of_target, target): (&[Complex64], Complex64),
    ) -> DVector<Complex64> {
        let mut all = DVector::from_element(self.count, Complex64::default());
        of_error.iter().enumerate().for_each(|(k, g)| all[k] += g * error);
        let own = self.target_coordinates.iter().zip(of_target);
        own.for_each(|(k, g)| all[*k] += g * target);
        all
    }

    /// Returns the parameters of both responses.
    pub fn parameters(&self, task: &Task) -> Vec<Quantity> {
        let feedback = &task.state.operator;
        let mut all: Vec<Quantity> = feedback
            .named_gradients()
            .iter()
            .map(|(p, gradient)| Quantity::relative(p, p.name, self.feedback(gradient)))
            .collect();
        let Some(seen) = &task.feedforward else { return all };
        let common = |p: &NamedParameter| matches!(p.coordinate, Some(Coordinate::LogOmega | Coordinate::LogZeta));
        for (p, gradient) in &seen.operator.named_gradients() {
            if common(p) && feedback.has_neuromuscular() {
                continue;
            }
            let mut one = Quantity::relative(p, target_parameter_name(p), self.target(gradient));
            if p.coordinate == Some(Coordinate::Delay) {
                // Relative to the present target the delay may be zero, so its error is absolute, in s.
                one.value -= seen.preview_s;
                one.scale = 1.0;
                one.size = feedback.tau_e_s();
            }
            all.push(one);
        }
        all
    }

    /// Returns the covariance of the coordinates of B, row by row.
    pub fn feedback_covariance(&self, covariance: &DMatrix<f64>, operator: &FamilyOperator) -> Vec<f64> {
        covariance_block(covariance, &(0..operator.coordinates().len()).collect::<Vec<_>>())
    }

    /// Returns the covariance of the coordinates of F, row by row.
    pub fn feedforward_covariance(&self, covariance: &DMatrix<f64>) -> Vec<f64> {
        covariance_block(covariance, &self.target_coordinates)
    }
}

fn covariance_block(covariance: &DMatrix<f64>, indices: &[usize]) -> Vec<f64> {
    let pairs = indices.iter().flat_map(|&a| indices.iter().map(move |&b| (a, b)));
    pairs.map(|pair| covariance[pair]).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::family_scenario::Display;

    use super::*;
    use crate::experiment::{Remnant, feedforward, typical_operator::population};

    fn task() -> Task {
        let state = population(&"90/(s(s+6))".parse().unwrap(), None).unwrap().0.state;
        Task {
            feedforward: Some(feedforward::typical_target_response(&state, Display::Preview).unwrap()),
            state,
            remnant: Remnant::default(),
        }
    }

    /// Returns the task with one joint coordinate changed by `by`.
    fn with_moved_coordinate(task: &Task, joint: &JointCoordinates, index: usize, by: f64) -> Task {
        let change = |operator: &FamilyOperator, indices: &[usize]| {
            let x = operator.coordinates().iter().zip(indices);
            let x: Vec<f64> = x.map(|(x, k)| if *k == index { x + by } else { *x }).collect();
            FamilyOperator::new(operator.form(), operator.has_neuromuscular(), &x).unwrap()
        };
        let own: Vec<usize> = (0..task.state.operator.coordinates().len()).collect();
        let mut other = task.clone();
        other.state.operator = change(&task.state.operator, &own);
        let seen = other.feedforward.as_mut().unwrap();
        seen.operator = change(&seen.operator, &joint.target_coordinates);
        other
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        let task = task();
        let joint = JointCoordinates::of(&task);
        // K, omega_nm, zeta_nm and tau_e of B; K_d, T_L and the delay of F. Both share one neuromuscular system.
        assert_eq!(
            (joint.count, joint.target_coordinates.as_slice()),
            (7, &[4, 5, 1, 2, 6][..])
        );
        let (error, target) = (Complex64::new(0.7, -0.4), Complex64::new(-0.2, 1.1));
        for omega in [0.5, 3.0, 12.0] {
            let answer = |task: &Task| {
                let seen = &task.feedforward.as_ref().unwrap().operator;
                task.state.operator.response(omega) * error + seen.response(omega) * target
            };
            let b = task.state.operator.response_and_gradient(omega);
            let f = task.feedforward.as_ref().unwrap().operator.response_and_gradient(omega);
            let found = joint.derivatives((&b.gradient, error), (&f.gradient, target));
            for k in 0..joint.count {
                let step = 1e-6;
                let [up, down] = [step, -step].map(|by| answer(&with_moved_coordinate(&task, &joint, k, by)));
                let slope = (up - down) / (2.0 * step);
                assert!(
                    (found[k] - slope).norm() < 1e-6 * (1.0 + slope.norm()),
                    "{omega} {k}: {} {slope}",
                    found[k]
                );
            }
        }
    }

    #[test]
    fn parameter_gradients_agree_with_finite_differences() {
        let task = task();
        let joint = JointCoordinates::of(&task);
        let all = joint.parameters(&task);
        let names: Vec<&str> = all.iter().map(|q| q.name).collect();
        assert_eq!(names, ["K", "omega_nm", "zeta_nm", "tau_e", "K_f", "T_L_f", "tau_f"]);
        for (i, quantity) in all.iter().enumerate() {
            for k in 0..joint.count {
                let step = 1e-6;
                let of = |by: f64| joint.parameters(&with_moved_coordinate(&task, &joint, k, by))[i].value;
                let slope = (of(step) - of(-step)) / (2.0 * step);
                assert!(
                    (quantity.gradient[k] - slope).abs() < 1e-6 * (1.0 + slope.abs()),
                    "{names:?} {i} {k}"
                );
            }
        }
        // With preview, F anticipates the target, and the error of its delay is absolute (in s).
        let tau = all.last().unwrap();
        assert!(tau.value < 0.0 && tau.scale == 1.0);
    }
}
