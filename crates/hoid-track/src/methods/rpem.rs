//! The recursive prediction-error method for every structure (L. Ljung, *System Identification*,
//! 1999, section 11.5).

use hoid_core::{predictor::Regressor, recursion::StablePolynomials};
use hoid_ident::{IdentError, settings};
use hoid_model::{SampleTime, Structure};

use crate::{
    delay_bank::DelayBank,
    guard::{GuardChoice, GuardOptions},
    kernel::{Kernel, Plan},
    memory::Memory,
    method::{MethodDescription, RecursiveMethod, invalid_option},
    recursion::Recursion,
    setup::Setup,
    shared_options::{DelayOptions, GainOptions, StabilityOptions, WindupGuard},
    start::StartState,
};

settings! {
    /// Options of the recursive prediction-error method.
    pub struct RpemOptions {
        /// Filters for psi: gradient (D/(C F) as one filter), cascade (1/F, then D/C; for comparison), or pseudo-linear
        /// (none: extended least squares)
        pub regressor: Regressor = Regressor::Gradient,
    }
    groups {
        /// Options of the gain.
        pub gain: GainOptions,
        /// Options for the stability of the polynomials.
        pub stability: StabilityOptions,
        /// Options for tracking a delay.
        pub delay: DelayOptions,
        /// Option of the guard.
        pub guard: GuardOptions,
    }
}

/// Default limit on an innovation in the update, in standard deviations.
pub const DEFAULT_LIMIT: f64 = 5.0;

impl RecursiveMethod for RpemOptions {
    fn description(&self) -> MethodDescription {
        MethodDescription {
            name: "rpem",
            help: "recursive prediction-error method, for every structure",
            source: "Ljung 1999, section 11.5; the thesis, section III",
            structures: &Structure::ALL,
            defaults: &[
                ("memory", "2.56s for b, 20.48s for the others"),
                ("limit", "5"),
                ("guard", "no"),
                (
                    "windup_guard",
                    "off for bj with a covariance, exponential forgetting and limit inf (the recursion of the thesis), else as for physical",
                ),
            ],
        }
    }

    fn default_memory(&self, parameter: &str) -> Memory {
        short_memory_for_b(parameter)
    }

    fn check(&self, setup: &Setup) -> Result<(), IdentError> {
        match setup.track_delay_s {
            Some(_) if !setup.structure.has_input() => Err(invalid_option(
                "the range of the delay",
                format!("a range with the structure {}, which has no input", setup.structure),
                "a structure with an input, such as bj",
            )),
            _ => Ok(()),
        }
    }

    fn build(
        &self,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        let build = |setup: &Setup| Plan::new(setup, from, sample_time).build(Kernel::PredictionError(self.regressor));
        match setup.track_delay_s {
            None => build(setup),
            Some(range_s) => Ok(Box::new(DelayBank::new(setup, range_s, sample_time, build)?)),
        }
    }

    fn supports_further_input(&self) -> bool {
        true
    }

    fn gain(&self) -> Option<&GainOptions> {
        Some(&self.gain)
    }

    /// The windup guard is off for Box-Jenkins models with the settings of the thesis.
    fn windup_guard(&self, structure: Structure) -> Option<WindupGuard> {
        match structure {
            Structure::BoxJenkins => self.gain.windup_guard(self.innovation_limit()),
            _ => self.gain.windup_guard,
        }
    }

    fn guard(&self) -> Option<GuardChoice> {
        self.guard.guard
    }

    fn innovation_limit(&self) -> f64 {
        self.gain.limit_or(DEFAULT_LIMIT)
    }

    fn track_delay_s(&self) -> Option<(f64, f64)> {
        self.delay.track_delay_s
    }

    fn stable(&self) -> StablePolynomials {
        self.stability.stable
    }

    fn retain(&mut self, known: &dyn Fn(&str) -> bool) {
        self.gain.retain(known);
    }
}

/// Short memory for B, which follows the gains, and long memories for the other polynomials.
pub fn short_memory_for_b(parameter: &str) -> Memory {
    if parameter.starts_with('b') {
        Memory::Seconds(2.56)
    } else {
        Memory::Seconds(20.48)
    }
}
