//! Options that several methods share.

use std::collections::BTreeMap;

use hoid_core::recursion::StablePolynomials;
use hoid_ident::{
    Constraint, settings,
    settings::{Bounds, Kind, Value},
};

use crate::{forgetting::ForgettingRule, memory::MemoryOptions};

/// Default delay of people who track, s.
pub(crate) const DEFAULT_DELAY_S: f64 = 0.2;

/// Limit on the growth of the variances of P for unexcited parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WindupGuard {
    /// No limit: equations 5.26 and 31 of the thesis unchanged.
    Off,
    /// The variances in P grow up to this multiple of their initial values.
    Bound(f64),
}

/// Parses `off`, or the bound as a number.
impl Value for WindupGuard {
    const KIND: Kind = Kind::NumberOrOff;

    fn read(text: &str) -> Result<Self, String> {
        match text.eq_ignore_ascii_case("off") {
            true => Ok(Self::Off),
            false => f64::read(text)
                .map(Self::Bound)
                .map_err(|_| "off, or the largest allowed multiple of the initial P, such as 1e4".to_owned()),
        }
    }

    fn text(&self) -> Option<String> {
        match self {
            Self::Off => Some("off".to_owned()),
            Self::Bound(multiple) => multiple.text(),
        }
    }

    fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Off => Vec::new(),
            Self::Bound(multiple) => vec![*multiple],
        }
    }
}

settings! {
    /// Options of the gain of a recursion in the kernel.
    pub struct GainOptions {
        /// Initial covariance P: X times the unit matrix, in units of the innovation variance (thesis: 0.1)
        #[setting(bounds(Bounds::PositiveFinite), default("from the start fit, else 1e6"))]
        pub covariance: Option<f64> = None,
        /// Limit on innovations, in standard deviations
        #[setting(bounds(Bounds::Positive))]
        pub limit: Option<f64> = None,
        /// Limit on the growth of each variance in P while its parameter is not excited, relative to the initial value;
        /// off: no limit
        #[setting(bounds(Bounds::AtLeast(1.0)), default("1e4 with a covariance or without a start fit, else 10 times \
                                                         the steady value of P with the excitation of that fit"))]
        pub windup_guard: Option<WindupGuard> = None,
    }
    groups {
        /// Memory lengths of the parameters.
        pub memories: MemoryOptions,
        /// Forgetting rule.
        pub forgetting: ForgettingRule,
    }
}

impl GainOptions {
    /// Returns the limit on innovations; infinite for a sliding window, whose sums contain every sample as recorded.
    pub fn limit_or(&self, default: f64) -> f64 {
        match self.forgetting {
            ForgettingRule::Window => f64::INFINITY,
            _ => self.limit.unwrap_or(default),
        }
    }

    /// Returns the guard against windup; `None` if it follows from the start. Unless it is given, it is off with the
    /// settings of the thesis: P at the start is given, P forgets exponentially, and innovations are not limited.
    pub fn windup_guard(&self, limit: f64) -> Option<WindupGuard> {
        let thesis_settings =
            self.covariance.is_some() && self.forgetting == ForgettingRule::Exponential && limit == f64::INFINITY;
        self.windup_guard.or(thesis_settings.then_some(WindupGuard::Off))
    }

    /// Removes the memories and drifts of parameters that are not known.
    pub fn retain(&mut self, known: &dyn Fn(&str) -> bool) {
        self.memories.memory_of.retain(|key, _| known(key));
        if let ForgettingRule::RandomWalk(drift) = &mut self.forgetting {
            drift.retain(|key, _| known(key));
        }
    }
}

settings! {
    /// Options for the stability of the polynomials.
    pub struct StabilityOptions {
        /// Polynomials kept stable: predictor (C and F), or noise (D too)
        pub stable: StablePolynomials = StablePolynomials::Predictor,
    }
}

settings! {
    /// Bounds of the operator's parameters.
    pub struct BoundOptions {
        /// Bounds of physical parameters, such as omega_nm=5..30,zeta_nm=0.1..2; either end may be omitted
        pub bound: BTreeMap<String, Constraint> = BTreeMap::new(),
    }
}

settings! {
    /// Options for tracking a delay.
    pub struct DelayOptions {
        /// Range in which tau_e is also tracked (physical: as a parameter; rpem, multiple-model: in whole samples)
        #[setting(name("track_delay"), unit("s"), bounds(Bounds::NonNegative), default("nk is fixed"))]
        pub track_delay_s: Option<(f64, f64)> = None,
    }
}
