//! The recursive prediction-error method in the operator's parameters. The gradient with respect to these parameters is
//! the gradient with respect to the polynomial coefficients multiplied by the Jacobian of theta.

mod recursion;

use std::collections::BTreeMap;

use hoid_core::recursion::StablePolynomials;
use hoid_ident::{Constraint, IdentError, settings};
use hoid_model::{SampleTime, Structure};

use hoid_track::{
    BoundOptions, DelayOptions, GainOptions, GuardChoice, GuardOptions, Memory, StabilityOptions,
    building::{
        DEFAULT_LIMIT, MethodDescription, Plan, Recursion, RecursiveMethod, Setup, StartState, check_delay,
        check_operator_orders,
    },
};

settings! {
    /// Options of the recursion in physical parameters.
    pub struct PhysicalOptions {}
    groups {
        /// Options of the gain.
        pub gain: GainOptions,
        /// Polynomials that are kept stable.
        pub stability: StabilityOptions,
        /// Bounds of the parameters.
        pub bounds: BoundOptions,
        /// Range of a tracked delay.
        pub delay: DelayOptions,
        /// Options of the guard.
        pub guard: GuardOptions,
    }
}

impl RecursiveMethod for PhysicalOptions {
    fn description(&self) -> MethodDescription {
        MethodDescription {
            name: "physical",
            help: "recursive prediction-error method in the operator's parameters",
            source: "Ljung 1999, section 11.5, with the Jacobian of the exact hold",
            structures: &[Structure::BoxJenkins, Structure::OutputError, Structure::General],
            defaults: &[
                ("memory", "5s for K_e, 1.5s for K_e_dot, inf for the others"),
                ("limit", "5"),
            ],
        }
    }

    /// Parameters other than the gains hardly change within a run, so their memory is infinite.
    fn default_memory(&self, parameter: &str) -> Memory {
        match parameter {
            "K_e" => Memory::Seconds(5.0),
            "K_e_dot" => Memory::Seconds(1.5),
            _ => Memory::Infinite,
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), IdentError> {
        check_operator_orders("physical", setup)?;
        check_delay(&setup.orders)
    }

    fn build(
        &self,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        recursion::build(&Plan::new(setup, from, sample_time))
    }

    fn is_physical(&self) -> bool {
        true
    }

    fn gain(&self) -> Option<&GainOptions> {
        Some(&self.gain)
    }

    fn guard(&self) -> Option<GuardChoice> {
        self.guard.guard.or(Some(GuardChoice::Yes))
    }

    fn innovation_limit(&self) -> f64 {
        self.gain.limit_or(DEFAULT_LIMIT)
    }

    fn stable(&self) -> StablePolynomials {
        self.stability.stable
    }

    fn bounds(&self) -> BTreeMap<String, Constraint> {
        self.bounds.bound.clone()
    }

    fn track_delay_s(&self) -> Option<(f64, f64)> {
        self.delay.track_delay_s
    }

    fn delay_is_parameter(&self) -> bool {
        true
    }

    fn retain(&mut self, known: &dyn Fn(&str) -> bool) {
        self.gain.retain(known);
        self.bounds.bound.retain(|key, _| known(key));
    }
}
