//! Options that several methods share.

use std::collections::BTreeMap;

use hoid_core::recursion::Stable;
use hoid_ident::{Constraint, settings, settings::Bounds};

use crate::{forgetting::ForgettingRule, memory::MemoryOptions};

settings! {
    /// The gain of a recursion of the kernel.
    pub struct GainOptions {
        /// Covariance P at the start: X times the unit matrix, in units of the innovation variance
        /// (the reference text: 0.1)
        #[setting(bounds(Bounds::PositiveFinite), default("that of the start fit; 1e6 where there is none"))]
        pub covariance: Option<f64> = None,
        /// Standard deviations beyond which an innovation moves the estimate no further
        #[setting(bounds(Bounds::Positive))]
        pub limit: Option<f64> = None,
    }
    groups {
        /// Memories.
        pub memories: MemoryOptions,
        /// How it forgets.
        pub forgetting: ForgettingRule,
    }
}

impl GainOptions {
    /// The limit in use: none for a sliding window, whose sums hold every sample as it came.
    pub(crate) fn limit_or(&self, usual: f64) -> f64 {
        match self.forgetting {
            ForgettingRule::Window => f64::INFINITY,
            _ => self.limit.unwrap_or(usual),
        }
    }

    /// Leaves out what was said of parameters that are not known.
    pub(crate) fn retain(&mut self, known: &dyn Fn(&str) -> bool) {
        self.memories.memory_of.retain(|key, _| known(key));
        if let ForgettingRule::RandomWalk(drift) = &mut self.forgetting {
            drift.retain(|key, _| known(key));
        }
    }
}

settings! {
    /// Stability of the polynomials.
    pub struct StabilityOptions {
        /// Polynomials kept stable: predictor (C and F), or noise (D too)
        pub stable: Stable = Stable::Predictor,
    }
}

settings! {
    /// Bounds of the operator's parameters.
    pub struct BoundOptions {
        /// Bounds of physical parameters, as omega_nm=5..30,zeta_nm=0.1..2; an end may be left open
        pub bound: BTreeMap<String, Constraint> = BTreeMap::new(),
    }
}

settings! {
    /// A delay that is followed.
    pub struct DelayOptions {
        /// Follow the delay tau_e too, within this range: as a parameter by physical, in whole
        /// samples by adaptive
        #[setting(name("track_delay"), unit("s"), bounds(Bounds::NonNegative), default("nk stays"))]
        pub track_delay_s: Option<(f64, f64)> = None,
    }
}
