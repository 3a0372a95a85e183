//! An operator in state s1 of the thesis, and a prior of changes in the operator.

use hoid_survey::kernel::multiple_model::prior::{ChangePrior, DelayPrior};

/// Sample time, s.
pub const TS: f64 = 0.01;
/// K_e, K_e_dot, omega_nm and zeta_nm of s1.
pub const S1: [f64; 4] = [0.09, 0.036, 11.25, 0.35];

/// Returns the prior at 100 Hz.
pub fn prior_with_delay(delay: DelayPrior) -> ChangePrior {
    ChangePrior {
        sample_time: TS,
        bounds: [
            [f64::NEG_INFINITY, f64::INFINITY],
            [f64::NEG_INFINITY, f64::INFINITY],
            [0.5, 150.0],
            [0.02, 5.0],
        ],
        birth_interval: 32,
        hazard: TS / 60.0,
        gain_jump: [0.22, 0.5],
        gain_drift: 0.0005,
        transient_drift: [0.005, 0.02, 0.02, 0.02],
        transient_time_constant: 300.0,
        neuromuscular_jump: [0.25, 0.4],
        neuromuscular_every: 4,
        neuromuscular_odds: 0.3,
        crossover: 2.0,
        residuals_after_change: 100.0,
        pruning_age: 128,
        outlier_limit: 5.0,
        change_window: 400,
        settling_time: 50,
        log_odds_threshold: 4.0,
        delay,
    }
}

/// Returns a diagonal covariance.
pub fn diagonal(d: [f64; 4]) -> [[f64; 4]; 4] {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { d[i] } else { 0.0 }))
}
