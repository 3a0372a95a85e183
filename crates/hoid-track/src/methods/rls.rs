//! Recursive least squares for structures that are linear in theta (L. Ljung, *System
//! Identification*, 1999, section 11.2).

use hoid_ident::{IdentError, settings};
use hoid_model::{SampleTime, Structure};

use crate::{
    guard::{GuardChoice, GuardOptions},
    kernel::{Kernel, Plan},
    memory::Memory,
    method::{MethodDescription, RecursiveMethod, invalid_option},
    recursion::Recursion,
    setup::Setup,
    shared_options::{GainOptions, WindupGuard},
    start::StartState,
};

settings! {
    /// Options of recursive least squares.
    pub struct RlsOptions {}
    groups {
        /// Options of the gain.
        pub gain: GainOptions,
        /// Option of the guard.
        pub guard: GuardOptions,
    }
}

/// The default of the guard against windup, as text.
const DEFAULT_WINDUP_GUARD_TEXT: &str =
    "off for arx with a covariance and exponential forgetting (the recursion of the thesis), else as for physical";

impl RecursiveMethod for RlsOptions {
    fn description(&self) -> MethodDescription {
        MethodDescription {
            name: "rls",
            help: "recursive least squares",
            source: "Ljung 1999, section 11.2; the thesis, section III",
            structures: &[Structure::Arx, Structure::Fir],
            defaults: &[
                ("memory", "2.56s"),
                ("limit", "inf"),
                ("guard", "no"),
                ("windup_guard", DEFAULT_WINDUP_GUARD_TEXT),
            ],
        }
    }

    /// Returns 256 samples at 100 Hz, as in the thesis.
    fn default_memory(&self, _parameter: &str) -> Memory {
        Memory::Seconds(2.56)
    }

    fn check(&self, setup: &Setup) -> Result<(), IdentError> {
        let o = &setup.orders;
        if setup.structure.is_linear() && o.nc == 0 && o.nd == 0 && o.nf == 0 && o.nb > 0 {
            return Ok(());
        }
        Err(invalid_option(
            "the structure of rls",
            format!("{} with {o}", setup.structure),
            "arx or fir; use rpem for structures with C, D or F",
        ))
    }

    fn build(
        &self,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        Plan::new(setup, from, sample_time).build(Kernel::LeastSquares)
    }

    fn supports_further_input(&self) -> bool {
        true
    }

    fn gain(&self) -> Option<&GainOptions> {
        Some(&self.gain)
    }

    /// The windup guard is off for ARX models with the settings of the thesis.
    fn windup_guard(&self, structure: Structure) -> Option<WindupGuard> {
        match structure {
            Structure::Arx => self.gain.windup_guard(self.innovation_limit()),
            _ => self.gain.windup_guard,
        }
    }

    fn guard(&self) -> Option<GuardChoice> {
        self.guard.guard
    }

    /// Innovations are not limited by default, as in the thesis.
    fn innovation_limit(&self) -> f64 {
        self.gain.limit_or(f64::INFINITY)
    }

    fn retain(&mut self, known: &dyn Fn(&str) -> bool) {
        self.gain.retain(known);
    }
}
