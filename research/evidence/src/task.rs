//! Scenarios and runs that the studies share.

use hoid_model::{
    remnant_gain::NoiseDefinition,
    scenario::{Condition, Realisation, RemnantStrength, Scenario},
};
use rayon::prelude::*;

/// End of the start fit, s.
pub const START_S: f64 = 30.72;
/// Time of the change, s.
pub const CHANGE_S: f64 = 40.96;

/// Scenario of a condition with K_c in the output matrix, as in the thesis.
pub fn scenario(condition: Condition, remnant_order: usize, level: f64) -> Scenario {
    let mut scenario = Scenario::condition(condition);
    scenario.remnant.order = remnant_order;
    scenario.remnant.strength = RemnantStrength::Level {
        level,
        definition: NoiseDefinition::Response,
    };
    scenario.realisation = Realisation::Output;
    scenario
}

/// Computes the results of all runs on all cores and returns them in the order of the runs.
pub fn on_all_cores<T: Send>(runs: usize, one: impl Fn(u64) -> T + Sync) -> Vec<T> {
    (0..runs).into_par_iter().map(|r| one(r as u64)).collect()
}

/// Median of the values that are not NaN.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.filter(|v| !v.is_nan()).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
