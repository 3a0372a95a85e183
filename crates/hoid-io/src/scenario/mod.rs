//! Scenario files in TOML.
//!
//! A file names a condition C1-C6 and overrides some of its keys, or defines all keys itself. Names of keys include the
//! unit, times are relative to the start of the measurement, and an unknown key is an error.
//!
//! ```toml
//! condition = "C4"          # without it, tau_e_s and all keys of [initial] are required
//! realisation = "output"    # or "input"
//! tau_e_s = 0.3             # of both states
//!
//! [last]                    # the state after the change; [initial] has the same keys
//! K_e = 0.08
//! T_L_s = 1.0
//!
//! [schedule]
//! rate_per_s = 0.5          # G
//!
//! [remnant]
//! order = 2
//! noise_level = 0.2
//! ```
//!
//! | table | keys |
//! |---|---|
//! | (top) | `condition`, `name`, `sample_time_s`, `measurement_s`, `run_in_s`, `tau_e_s`, `realisation`, `disturbance_rms_deg` |
//! | `[initial]`, `[last]` | `K_e`, `T_L_s`, `omega_nm_rad_s`, `zeta_nm`, `tau_e_s`, `K_c`, `omega_b_rad_s` |
//! | `[schedule]` | `rate_per_s` (G), `midpoint_s` (t_M), `interval_s` (T, for changes back and forth) |
//! | `[remnant]` | `order`, `T_n_s`; `noise_level` and `noise_definition` ("response", "remnant"), or `K_n_initial_deg` and `K_n_last_deg` |
//! | `[[forcing]]` | `amplitude_deg`, `phase_rad`, and `omega_rad_s` or `cycles` (within `measurement_s`); `forcing = []` is a target at rest |
//! | `[feedforward]` | response to a displayed target: `form`, its gain, `T_L_s`, `T_I_s`, `tau_f_s`, `preview_s`; `[feedforward.last]` after the change |
//! | `[[disturbance]]` | disturbance at the input of the controlled element; keys as in `[[forcing]]` |
//!
//! A file with the key `form` describes an operator of the family with any controlled element ([`AnyScenario`]); the
//! module `family_keys` defines its keys.
//!
//! Missing keys have the values of the condition. In a file without a condition the parameters of `[last]` default to
//! those of `[initial]`, and all other keys to the values of C1.
//!
//! | module | contents |
//! |---|---|
//! | `reading` | [`read_scenario`]: reading of a scenario from a file or from text; the schemas of both kinds |
//! | `keys` | the keys of a scenario |
//! | `changes` | [`ScenarioChanges`]: options of `hoid simulate` and `pyhoid.simulate` |
//! | `condition` | conversion of the keys to a scenario; missing keys are taken from its condition |
//! | `family_keys` | the keys of a scenario of the operator family |
//! | `family` | conversion of the keys to a scenario of the operator family |
//! | `values` | checks of numbers against their [`Limits`](values::Limits), with the line in the file |
//! | `error` | [`ScenarioFileError`] |

mod changes;
mod condition;
mod error;
mod family;
mod family_keys;
#[cfg(test)]
mod family_tests;
mod keys;
mod reading;
mod values;

pub use changes::{ScenarioChangeError, ScenarioChanges};
pub use error::ScenarioFileError;
pub use keys::LIST_VALUED_KEYS;
pub use reading::{
    AnyScenario, family_scenario_schema, parse_any_scenario, parse_scenario, read_any_scenario, read_scenario,
    scenario_schema,
};

#[cfg(test)]
mod tests;
