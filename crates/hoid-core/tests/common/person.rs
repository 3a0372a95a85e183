//! A person in state s1 of the reference text, and what the bank of hypotheses supposes of him.

use hoid_core::adaptive::{Suppositions, delays::Delays};

/// Sample time, s.
pub const TS: f64 = 0.01;
/// K_e, K_e_dot, omega_nm and zeta_nm of s1.
pub const S1: [f64; 4] = [0.09, 0.036, 11.25, 0.35];

/// What is supposed, at 100 Hz.
pub fn suppositions(delays: Delays) -> Suppositions {
    Suppositions {
        sample_time: TS,
        bounds: [
            [f64::NEG_INFINITY, f64::INFINITY],
            [f64::NEG_INFINITY, f64::INFINITY],
            [0.5, 150.0],
            [0.02, 5.0],
        ],
        spacing: 32,
        hazard: TS / 60.0,
        jump: [0.22, 0.5],
        drift: 0.0005,
        unrest: [0.005, 0.02, 0.02, 0.02],
        unrest_for: 300.0,
        neuromuscular: [0.25, 0.4],
        whole_every: 4,
        whole_odds: 0.3,
        crossover: 2.0,
        doubt: 100.0,
        protected: 128,
        limit: 5.0,
        recent: 400,
        settled: 50,
        threshold: 4.0,
        delays,
    }
}

/// A diagonal covariance.
pub fn diagonal(d: [f64; 4]) -> [[f64; 4]; 4] {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { d[i] } else { 0.0 }))
}
