//! The keys of a scenario file that describes an operator of the family.

use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

use super::keys::{FeedforwardTable, Number, RealisationKey, ScheduleTable};

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct FamilyFile {
    /// Form of the operator.
    #[schemars(with = "String")]
    pub(super) form: Spanned<String>,
    /// Whether the operator has neuromuscular dynamics. Default: true.
    #[serde(default = "default_true")]
    pub(super) neuromuscular: bool,
    pub(super) name: Option<String>,
    #[schemars(with = "Option<f64>")]
    pub(super) sample_time_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    pub(super) sampling_rate_hz: Option<Number>,
    #[schemars(with = "Option<f64>")]
    pub(super) measurement_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    pub(super) run_in_s: Option<Number>,
    pub(super) realisation: Option<RealisationKey>,
    pub(super) initial: FamilyStateTable,
    pub(super) last: Option<FamilyStateTable>,
    pub(super) schedule: Option<ScheduleTable>,
    pub(super) target: Option<ExcitationTable>,
    /// Response of the person to a displayed target.
    pub(super) feedforward: Option<FeedforwardTable>,
    /// Response of the person to the motion of the controlled element, its output.
    pub(super) motion: Option<FeedforwardTable>,
    pub(super) disturbance: Option<ExcitationTable>,
    #[serde(default)]
    pub(super) remnant: Vec<PartTable>,
    #[serde(default)]
    pub(super) stick: StickTable,
}

fn default_true() -> bool {
    true
}

#[derive(Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct FamilyStateTable {
    #[serde(rename = "K")]
    pub(super) k: Option<f64>,
    #[serde(rename = "K_over_T_I")]
    pub(super) k_over_t_i: Option<f64>,
    #[serde(rename = "K_I")]
    pub(super) k_i: Option<f64>,
    #[serde(rename = "K_d_s")]
    pub(super) k_d_s: Option<f64>,
    #[serde(rename = "K_m_s2")]
    pub(super) k_m_s2: Option<f64>,
    #[serde(rename = "K_m_rate_s")]
    pub(super) k_m_rate_s: Option<f64>,
    #[serde(rename = "T_L_s")]
    pub(super) t_l_s: Option<f64>,
    /// Lag time constant in s; `inf` makes the lag a pure integrator.
    #[serde(rename = "T_I_s")]
    pub(super) t_i_s: Option<f64>,
    pub(super) c_1_s: Option<f64>,
    pub(super) c_2_s2: Option<f64>,
    pub(super) alpha_rad_s: Option<f64>,
    pub(super) omega_nm_rad_s: Option<f64>,
    pub(super) zeta_nm: Option<f64>,
    pub(super) tau_e_s: Option<f64>,
    /// Transfer function in s, such as `90/(s(s+6))`, or `NUM/DEN` in descending powers of s, such as `90/1,6,0`.
    #[schemars(with = "Option<String>")]
    pub(super) controlled_element: Option<Spanned<String>>,
}

/// A multisine with prime multiples of the base frequency, or with given lines.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ExcitationTable {
    pub(super) period_s: Option<f64>,
    pub(super) largest_multiple: Option<u32>,
    pub(super) rms: Option<f64>,
    pub(super) lines: Option<Vec<LineTable>>,
    /// Selection of primes: `all`, or every other prime, `even` or `odd`, so that target and disturbance have no common
    /// frequencies.
    #[schemars(with = "Option<String>")]
    pub(super) interleaved: Option<Spanned<String>>,
    /// Whether new phases are drawn for each run. Default: true if no lines are given.
    pub(super) random_phases: Option<bool>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct LineTable {
    pub(super) amplitude: f64,
    pub(super) omega_rad_s: f64,
    #[serde(default)]
    pub(super) phase_rad: f64,
}

#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum ShapeKey {
    White,
    Lag,
    Resonance,
    Ar,
}

#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum FollowsKey {
    Control,
    Rate,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct PartTable {
    pub(super) shape: ShapeKey,
    /// Share of the variance of u; give either this or the gain.
    pub(super) share: Option<f64>,
    pub(super) gain: Option<f64>,
    /// Default: `gain`.
    pub(super) gain_last: Option<f64>,
    #[serde(rename = "T_n_s")]
    pub(super) t_n_s: Option<f64>,
    /// Order of a lag. Default: 1.
    pub(super) order: Option<usize>,
    pub(super) omega_rad_s: Option<f64>,
    pub(super) zeta: Option<f64>,
    pub(super) coefficients: Option<Vec<f64>>,
    pub(super) follows: Option<FollowsKey>,
    /// Default: 1.
    pub(super) follows_part: Option<f64>,
    /// Default: 1 s.
    pub(super) follows_memory_s: Option<f64>,
    pub(super) pulses_per_s: Option<f64>,
    /// Default: 1.
    pub(super) pulses_part: Option<f64>,
    pub(super) on_s: Option<f64>,
    pub(super) off_s: Option<f64>,
}

#[derive(Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub(super) struct StickTable {
    pub(super) bias: f64,
    pub(super) walk_per_root_s: f64,
    pub(super) offset_e: f64,
    pub(super) offset_u: f64,
}
