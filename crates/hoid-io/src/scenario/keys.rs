//! The keys of a scenario file.

use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

pub(super) type Number = Spanned<f64>;

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    #[schemars(with = "Option<String>")]
    pub(super) condition: Option<Spanned<String>>,
    pub(super) name: Option<String>,
    #[schemars(with = "Option<f64>")]
    pub(super) sample_time_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    pub(super) measurement_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    pub(super) run_in_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    pub(super) tau_e_s: Option<Number>,
    pub(super) realisation: Option<RealisationKey>,
    #[serde(default)]
    pub(super) initial: StateTable,
    pub(super) last: Option<StateTable>,
    pub(super) schedule: Option<ScheduleTable>,
    #[serde(default)]
    pub(super) remnant: RemnantTable,
    pub(super) forcing: Option<Vec<SinusoidTable>>,
    /// Response of the person to a displayed target.
    pub(super) feedforward: Option<FeedforwardTable>,
    /// Disturbance at the input of the controlled element.
    pub(super) disturbance: Option<Vec<SinusoidTable>>,
    /// Root mean square of the disturbance, deg; without lines in `disturbance`, ten lines between those of the target
    /// of the thesis.
    #[schemars(with = "Option<f64>")]
    pub(super) disturbance_rms_deg: Option<Number>,
}

/// Keys whose value is a list; for these, a list in a study plan is a single value and not several alternatives.
pub const LIST_VALUED_KEYS: [&str; 2] = ["forcing", "disturbance"];

/// Response to a target or to motion; it includes the neuromuscular system of the operator.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct FeedforwardTable {
    /// Form of the response: `gain`, `lead`, `lag`, `derivative`, `derivative-lead` ...
    #[schemars(with = "String")]
    pub(super) form: Spanned<String>,
    #[serde(rename = "K")]
    pub(super) k: Option<f64>,
    #[serde(rename = "K_over_T_I")]
    pub(super) k_over_t_i: Option<f64>,
    #[serde(rename = "K_d_s")]
    pub(super) k_d_s: Option<f64>,
    /// Gain of the semicircular canals for an angle, s^2.
    #[serde(rename = "K_m_s2")]
    pub(super) k_m_s2: Option<f64>,
    /// Gain of the semicircular canals for an angular rate, s.
    #[serde(rename = "K_m_rate_s")]
    pub(super) k_m_rate_s: Option<f64>,
    #[serde(rename = "T_L_s")]
    pub(super) t_l_s: Option<f64>,
    #[serde(rename = "T_I_s")]
    pub(super) t_i_s: Option<f64>,
    /// Delay relative to the present input, s; at least `-preview_s`.
    #[serde(default)]
    pub(super) tau_f_s: f64,
    /// Time by which the target is displayed ahead, s. Default: zero.
    #[schemars(with = "Option<f64>")]
    pub(super) preview_s: Option<Number>,
    /// Values after the change; missing values are those before it.
    pub(super) last: Option<FeedforwardLastTable>,
}

/// Response to a target after the change of the scenario.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct FeedforwardLastTable {
    #[serde(rename = "K")]
    pub(super) k: Option<f64>,
    #[serde(rename = "K_over_T_I")]
    pub(super) k_over_t_i: Option<f64>,
    #[serde(rename = "K_d_s")]
    pub(super) k_d_s: Option<f64>,
    /// Gain of the semicircular canals for an angle, s^2.
    #[serde(rename = "K_m_s2")]
    pub(super) k_m_s2: Option<f64>,
    /// Gain of the semicircular canals for an angular rate, s.
    #[serde(rename = "K_m_rate_s")]
    pub(super) k_m_rate_s: Option<f64>,
    #[serde(rename = "T_L_s")]
    pub(super) t_l_s: Option<f64>,
    #[serde(rename = "T_I_s")]
    pub(super) t_i_s: Option<f64>,
    pub(super) tau_f_s: Option<f64>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum RealisationKey {
    Input,
    Output,
}

#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum DefinitionKey {
    Response,
    Remnant,
}

#[derive(Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct StateTable {
    #[serde(rename = "K_e")]
    #[schemars(with = "Option<f64>")]
    pub(super) k_e: Option<Number>,
    #[serde(rename = "T_L_s")]
    #[schemars(with = "Option<f64>")]
    pub(super) t_l_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    pub(super) omega_nm_rad_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    pub(super) zeta_nm: Option<Number>,
    #[schemars(with = "Option<f64>")]
    pub(super) tau_e_s: Option<Number>,
    #[serde(rename = "K_c")]
    #[schemars(with = "Option<f64>")]
    pub(super) k_c: Option<Number>,
    #[schemars(with = "Option<f64>")]
    pub(super) omega_b_rad_s: Option<Number>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ScheduleTable {
    #[schemars(with = "Option<f64>")]
    pub(super) rate_per_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    pub(super) midpoint_s: Option<Number>,
    /// Time between changes, s, for a person who alternates between the two states.
    #[schemars(with = "Option<f64>")]
    pub(super) interval_s: Option<Number>,
}

#[derive(Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct RemnantTable {
    #[schemars(with = "Option<i64>")]
    pub(super) order: Option<Spanned<i64>>,
    #[serde(rename = "T_n_s")]
    #[schemars(with = "Option<f64>")]
    pub(super) t_n_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    pub(super) noise_level: Option<Number>,
    pub(super) noise_definition: Option<DefinitionKey>,
    #[serde(rename = "K_n_initial_deg")]
    #[schemars(with = "Option<f64>")]
    pub(super) k_n_initial_deg: Option<Number>,
    #[serde(rename = "K_n_last_deg")]
    #[schemars(with = "Option<f64>")]
    pub(super) k_n_last_deg: Option<Number>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SinusoidTable {
    #[schemars(with = "f64")]
    pub(super) amplitude_deg: Number,
    #[schemars(with = "f64")]
    pub(super) phase_rad: Number,
    #[schemars(with = "Option<f64>")]
    pub(super) omega_rad_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    pub(super) cycles: Option<Number>,
}
