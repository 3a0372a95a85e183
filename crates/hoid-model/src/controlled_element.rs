//! The controlled element.
//!
//! `H_CE(s) = K_c / (s (s + omega_b))` (eq. 4): approximately an integrator below the break frequency omega_b, and a
//! double integrator above it.

use crate::{ModelError, transfer_function::ContinuousTransferFunction};

/// Gain and break frequency of the controlled element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlledElement {
    /// Control gain K_c, deg/deg.
    pub k_c: f64,
    /// Break frequency omega_b, rad/s; 0 gives a double integrator, and a negative value gives an unstable element.
    pub omega_b_rad_s: f64,
}

impl ControlledElement {
    /// Returns H_CE(s).
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if a parameter is not finite.
    pub fn transfer_function(&self) -> Result<ContinuousTransferFunction, ModelError> {
        self.check()?;
        ContinuousTransferFunction::new(&[self.k_c], &[1.0, self.omega_b_rad_s, 0.0])
    }

    pub(crate) fn check(&self) -> Result<(), ModelError> {
        for (quantity, found) in [
            ("control gain K_c", self.k_c),
            ("break frequency omega_b in rad/s", self.omega_b_rad_s),
        ] {
            if !found.is_finite() {
                return Err(ModelError::OutOfRange {
                    quantity,
                    found,
                    expected: "a finite number",
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn response(k_c: f64, omega_b_rad_s: f64, omega: f64) -> crate::Complex64 {
        let element = ControlledElement { k_c, omega_b_rad_s };
        element.transfer_function().unwrap().response(omega)
    }

    #[test]
    fn break_frequency_separates_single_and_double_integrator() {
        // Asymptotes: K_c/omega_b / s far below omega_b, K_c / s^2 far above. The neglected term changes the magnitude
        // by the fraction (1e-4)^2/2.
        let low = response(90.0, 6.0, 6e-4);
        assert!((low.norm() * 6e-4 - 15.0).abs() < 1e-6);
        assert!((low.arg() + std::f64::consts::FRAC_PI_2).abs() < 2e-4);
        let high = response(90.0, 6.0, 6e4);
        assert!((high.norm() * 3.6e9 - 90.0).abs() < 1e-5);
        assert!((response(30.0, 0.0, 2.0) + 7.5).norm() < 1e-12);
    }

    #[test]
    fn non_finite_parameters_are_refused() {
        for (k_c, omega_b_rad_s) in [(f64::NAN, 1.0), (1.0, f64::INFINITY)] {
            assert!(ControlledElement { k_c, omega_b_rad_s }.transfer_function().is_err());
        }
    }
}
