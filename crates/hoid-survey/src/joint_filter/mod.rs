//! Joint estimation of the state and the parameters, as published for time-varying human control, for comparison.
//!
//! The state of the neuromuscular system, p (its response to the delayed error) and v (the rate of p), is estimated
//! together with the drifting parameters:
//!
//! `X = [p, v, K_e, K_e_dot, omega_nm, zeta_nm]`, `u = K_e p + K_e_dot v + n`.
//!
//! The transition is the exact hold. With [`DividedDifferences`] at the poles multiplied by Ts, `R = omega^2 Ts Phi_1`,
//! `A = q Phi_2` and `m = e - p`,
//!
//! `p <- e - (1 - A) m + (R/omega^2) v`, `v <- R m + (1 - A - 2 zeta R/omega) v`.
//!
//! The parameters are modelled as a random walk, and the remnant as white noise in u and in the input of v. Neither
//! assumption holds for a coloured remnant in a closed loop, but the published estimators make both. [`ekf`] linearises
//! the model (A. Popovici, P. M. T. Zaal, D. M. Pool, *Dual extended Kalman filter for the identification of
//! time-varying human manual control behavior*, AIAA 2017-3666, with two alternating filters); [`ukf`] uses sigma
//! points (J. Rojer, D. M. Pool, M. M. van Paassen, M. Mulder, *UKF-based identification of time-varying manual control
//! behaviour*, IFAC-PapersOnLine 52-19 (2019)).
//!
//! The variances of both noises are proportional to the variance of the remnant in the start fit, `sigma^2` times the
//! sum of squares of the impulse response of 1/D. The drift of each parameter is proportional to its initial value. The
//! factors were tuned on conditions C3 and C5 with remnants of order 2 and 3, as for the method multiple-model.

mod belief;
mod ekf;
mod filter;
mod ukf;

use std::collections::BTreeMap;

use hoid_ident::{Constraint, IdentError, settings};
use hoid_model::{SampleTime, Structure};

use hoid_track::{
    BoundOptions, Memory,
    building::{MethodDescription, Recursion, RecursiveMethod, Setup, StartState},
};

use crate::known_noise::check_model_of_change;

use filter::JointFilter;

/// Implements the recursive method for the options of a filter; the two filters differ only in their descriptions and
/// in the function for one sample.
macro_rules! joint_filter {
    ($options:ident, $name:literal, $help:literal, $source:literal, $step:path) => {
        impl RecursiveMethod for $options {
            fn description(&self) -> MethodDescription {
                MethodDescription {
                    name: $name,
                    help: $help,
                    source: $source,
                    structures: &[Structure::BoxJenkins, Structure::OutputError, Structure::General],
                    defaults: &[],
                }
            }

            /// The memory length follows from the random walk of the parameters.
            fn default_memory(&self, _parameter: &str) -> Memory {
                Memory::Infinite
            }

            fn check(&self, setup: &Setup) -> Result<(), IdentError> {
                check_model_of_change($name, setup)
            }

            fn build(
                &self,
                setup: &Setup,
                from: &StartState,
                sample_time: SampleTime,
            ) -> Result<Box<dyn Recursion>, IdentError> {
                Ok(Box::new(JointFilter::new($step, setup, from, sample_time)?))
            }

            fn is_physical(&self) -> bool {
                true
            }

            fn models_change(&self) -> bool {
                true
            }

            fn memory_as_text(&self) -> Option<String> {
                Some("random walk of the parameters".to_owned())
            }

            fn bounds(&self) -> BTreeMap<String, Constraint> {
                self.bounds.bound.clone()
            }

            fn retain(&mut self, known: &dyn Fn(&str) -> bool) {
                self.bounds.bound.retain(|key, _| known(key));
            }
        }
    };
}

settings! {
    /// Options of the extended Kalman filter.
    pub struct EkfOptions {}
    groups {
        /// Bounds of the parameters.
        pub bounds: BoundOptions,
    }
}
settings! {
    /// Options of the unscented Kalman filter.
    pub struct UkfOptions {}
    groups {
        /// Bounds of the parameters.
        pub bounds: BoundOptions,
    }
}

joint_filter!(
    EkfOptions,
    "ekf",
    "extended Kalman filter that estimates state and parameters, for comparison",
    "Jazwinski 1970, section 8.3; after Popovici, Zaal and Pool 2017",
    ekf::step
);
joint_filter!(
    UkfOptions,
    "ukf",
    "unscented Kalman filter that estimates state and parameters, for comparison",
    "after Rojer, Pool, van Paassen and Mulder 2019",
    ukf::step
);

#[cfg(test)]
mod tests;
