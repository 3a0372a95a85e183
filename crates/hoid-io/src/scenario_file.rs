//! Scenarios in TOML.
//!
//! A file starts from a condition C1-C6 and changes what it names, or describes everything itself. Units are part of the keys,
//! times count from the start of the measurement, an unknown key is an error.
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
//! | (top) | `condition`, `name`, `sample_time_s`, `measurement_s`, `run_in_s`, `tau_e_s`, `realisation` |
//! | `[initial]`, `[last]` | `K_e`, `T_L_s`, `omega_nm_rad_s`, `zeta_nm`, `tau_e_s`, `K_c`, `omega_b_rad_s` |
//! | `[schedule]` | `rate_per_s` (G), `midpoint_s` (t_M), `interval_s` (T, for changes there and back again) |
//! | `[remnant]` | `order`, `T_n_s`; `noise_level` and `noise_definition` ("response", "remnant"), or `K_n_initial_deg` and `K_n_last_deg` |
//! | `[[forcing]]` | `amplitude_deg`, `phase_rad`, and `omega_rad_s` or `cycles` (within `measurement_s`); `forcing = []` is a target at rest |
//!
//! What the file leaves out is that of the condition; without one, the parameters of `[last]` are those of `[initial]`, and
//! all else is as in C1.

use std::{f64::consts::TAU, path::Path};

use hoid_model::{
    ModelError, SampleTime,
    forcing::{ForcingFunction, Sinusoid},
    remnant_gain::NoiseDefinition,
    scenario::{Condition, OperatingState, Realisation, RemnantStrength, Scenario},
    schedule::Schedule,
};
use schemars::JsonSchema;
use serde::Deserialize;
use thiserror::Error;
use toml::Spanned;

/// Why a file gives no scenario.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ScenarioFileError {
    /// A file that cannot be read.
    #[error("scenario file {path}: {reason}; expected a readable text file")]
    Unreadable {
        /// The file.
        path: String,
        /// What the system says.
        reason: String,
    },
    /// No TOML, or keys and types that do not belong to a scenario.
    #[error("scenario file {path}, line {line}: {reason}")]
    Syntax {
        /// The file.
        path: String,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        reason: String,
    },
    /// A value without meaning.
    #[error("scenario file {path}, line {line}: {key} is {found}, expected {expected}")]
    Value {
        /// The file.
        path: String,
        /// Line, from 1.
        line: usize,
        /// The key.
        key: String,
        /// The value found.
        found: String,
        /// What has a meaning, and the remedy.
        expected: String,
    },
    /// Keys that are missing or contradict each other.
    #[error("scenario file {path}: {reason}")]
    Keys {
        /// The file.
        path: String,
        /// What is missing or too much, and the remedy.
        reason: String,
    },
    /// Values that have a meaning each, but not together.
    #[error("scenario file {path}: {source}")]
    Model {
        /// The file.
        path: String,
        /// What is wrong.
        source: ModelError,
    },
}

type Number = Spanned<f64>;

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct File {
    #[schemars(with = "Option<String>")]
    condition: Option<Spanned<String>>,
    name: Option<String>,
    #[schemars(with = "Option<f64>")]
    sample_time_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    measurement_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    run_in_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    tau_e_s: Option<Number>,
    realisation: Option<RealisationKey>,
    #[serde(default)]
    initial: StateTable,
    last: Option<StateTable>,
    schedule: Option<ScheduleTable>,
    #[serde(default)]
    remnant: RemnantTable,
    forcing: Option<Vec<SinusoidTable>>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum RealisationKey {
    Input,
    Output,
}

#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum DefinitionKey {
    Response,
    Remnant,
}

#[derive(Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields)]
struct StateTable {
    #[serde(rename = "K_e")]
    #[schemars(with = "Option<f64>")]
    k_e: Option<Number>,
    #[serde(rename = "T_L_s")]
    #[schemars(with = "Option<f64>")]
    t_l_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    omega_nm_rad_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    zeta_nm: Option<Number>,
    #[schemars(with = "Option<f64>")]
    tau_e_s: Option<Number>,
    #[serde(rename = "K_c")]
    #[schemars(with = "Option<f64>")]
    k_c: Option<Number>,
    #[schemars(with = "Option<f64>")]
    omega_b_rad_s: Option<Number>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ScheduleTable {
    #[schemars(with = "Option<f64>")]
    rate_per_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    midpoint_s: Option<Number>,
    /// Time from one change to the next, for a person who changes there and back again.
    #[schemars(with = "Option<f64>")]
    interval_s: Option<Number>,
}

#[derive(Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields)]
struct RemnantTable {
    #[schemars(with = "Option<i64>")]
    order: Option<Spanned<i64>>,
    #[serde(rename = "T_n_s")]
    #[schemars(with = "Option<f64>")]
    t_n_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    noise_level: Option<Number>,
    noise_definition: Option<DefinitionKey>,
    #[serde(rename = "K_n_initial_deg")]
    #[schemars(with = "Option<f64>")]
    k_n_initial_deg: Option<Number>,
    #[serde(rename = "K_n_last_deg")]
    #[schemars(with = "Option<f64>")]
    k_n_last_deg: Option<Number>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SinusoidTable {
    #[schemars(with = "f64")]
    amplitude_deg: Number,
    #[schemars(with = "f64")]
    phase_rad: Number,
    #[schemars(with = "Option<f64>")]
    omega_rad_s: Option<Number>,
    #[schemars(with = "Option<f64>")]
    cycles: Option<Number>,
}

/// Most samples of a run, so that a slip of the unit does not ask for all memory.
const MOST_SAMPLES: f64 = 1e7;

/// Reads and checks a scenario. Without a `name` it is called as its file.
///
/// # Errors
/// [`ScenarioFileError`], which names the file and where it can the line and the key.
pub fn read_scenario(path: &Path) -> Result<Scenario, ScenarioFileError> {
    let shown = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|error| ScenarioFileError::Unreadable {
        path: shown.clone(),
        reason: error.to_string(),
    })?;
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned());
    parse_scenario(&text, &shown, &stem.unwrap_or_else(|| shown.clone()))
}

/// A scenario from the text of a file; `path` is for messages, `name` for a text that has none.
///
/// # Errors
/// As [`read_scenario`].
pub fn parse_scenario(text: &str, path: &str, name: &str) -> Result<Scenario, ScenarioFileError> {
    let file: File = toml::from_str(text).map_err(|error| ScenarioFileError::Syntax {
        path: path.to_owned(),
        line: error.span().map_or(1, |span| line_of(text, span.start)),
        reason: error.message().trim_end().to_owned(),
    })?;
    let source = Source { text, path };
    let scenario = source.scenario(file, name)?;
    scenario.resolve().map_err(|error| source.model(error))?;
    Ok(scenario)
}

/// JSON schema of a scenario file, as text.
pub fn scenario_schema() -> String {
    let schema = schemars::schema_for!(File);
    format!("{:#}", schema.as_value())
}

/// Line of a byte of a text, from 1.
fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|b| *b == b'\n').count()
}

/// The text that values are traced back to.
struct Source<'a> {
    text: &'a str,
    path: &'a str,
}

impl Source<'_> {
    fn scenario(&self, file: File, name: &str) -> Result<Scenario, ScenarioFileError> {
        let condition = match &file.condition {
            None => None,
            Some(given) => Some(given.get_ref().parse::<Condition>().map_err(|_| {
                self.value(
                    "condition",
                    given.span().start,
                    given.get_ref(),
                    "C1, C2, C3, C4, C5 or C6",
                )
            })?),
        };
        if condition.is_none() {
            self.require_all(&file)?;
        }
        let mut scenario = Scenario::condition(condition.unwrap_or(Condition::C1));
        scenario.name = file.name.unwrap_or_else(|| name.to_owned());
        if let Some(ts) = self.positive("sample_time_s", file.sample_time_s)? {
            scenario.sample_time = SampleTime::new(ts).map_err(|error| self.model(error))?;
        }
        let ts = scenario.sample_time;
        let tau_e_s = self.whole("tau_e_s", file.tau_e_s, scenario.initial.operator.tau_e_s, ts, 0.0)?;
        for state in [&mut scenario.initial, &mut scenario.last] {
            state.operator.tau_e_s = tau_e_s;
        }
        scenario.measurement_s = self.whole("measurement_s", file.measurement_s, scenario.measurement_s, ts, 1.0)?;
        scenario.run_in_s = self.whole("run_in_s", file.run_in_s, scenario.run_in_s, ts, 0.0)?;
        match file.realisation {
            Some(RealisationKey::Input) => scenario.realisation = Realisation::Input,
            Some(RealisationKey::Output) => scenario.realisation = Realisation::Output,
            None => {}
        }

        self.change(&mut scenario.initial, "initial", file.initial, ts)?;
        if scenario.schedule == Schedule::Constant {
            scenario.last = scenario.initial;
        }
        let changes_last = file.last.is_some();
        if let Some(table) = file.last {
            self.change(&mut scenario.last, "last", table, ts)?;
        }
        scenario.schedule = self.schedule(file.schedule, scenario.schedule)?;
        if scenario.schedule == Schedule::Constant && changes_last {
            return Err(
                self.keys("[last] is given, but nothing changes: add [schedule] with rate_per_s and midpoint_s")
            );
        }
        if scenario.schedule != Schedule::Constant && scenario.initial == scenario.last {
            return Err(self.keys("[schedule] is given, but both states are the same: add [last] with what changes"));
        }
        self.remnant(&mut scenario, file.remnant)?;
        if let Some(tables) = file.forcing {
            scenario.forcing = self.forcing(tables, scenario.measurement_s)?;
        }
        Ok(scenario)
    }

    fn require_all(&self, file: &File) -> Result<(), ScenarioFileError> {
        let i = &file.initial;
        let missing: Vec<&str> = [
            ("tau_e_s", if i.tau_e_s.is_some() { &i.tau_e_s } else { &file.tau_e_s }),
            ("initial.K_e", &i.k_e),
            ("initial.T_L_s", &i.t_l_s),
            ("initial.omega_nm_rad_s", &i.omega_nm_rad_s),
            ("initial.zeta_nm", &i.zeta_nm),
            ("initial.K_c", &i.k_c),
            ("initial.omega_b_rad_s", &i.omega_b_rad_s),
        ]
        .into_iter()
        .filter_map(|(key, value)| value.is_none().then_some(key))
        .collect();
        if missing.is_empty() {
            return Ok(());
        }
        Err(self.keys(&format!(
            "missing {}: give them, or start from a condition such as condition = \"C1\"",
            missing.join(", ")
        )))
    }

    fn change(
        &self,
        state: &mut OperatingState,
        table: &str,
        given: StateTable,
        sample_time: SampleTime,
    ) -> Result<(), ScenarioFileError> {
        let key = |name: &str| format!("{table}.{name}");
        let OperatingState {
            operator,
            controlled_element,
        } = state;
        operator.tau_e_s = self.whole(&key("tau_e_s"), given.tau_e_s, operator.tau_e_s, sample_time, 0.0)?;
        let any = [
            ("K_e", given.k_e, &mut operator.k_e),
            ("T_L_s", given.t_l_s, &mut operator.t_l_s),
            ("K_c", given.k_c, &mut controlled_element.k_c),
            (
                "omega_b_rad_s",
                given.omega_b_rad_s,
                &mut controlled_element.omega_b_rad_s,
            ),
        ];
        for (name, value, target) in any {
            if let Some(value) = self.finite(&key(name), value)? {
                *target = value;
            }
        }
        let positive = [
            ("omega_nm_rad_s", given.omega_nm_rad_s, &mut operator.omega_nm_rad_s),
            ("zeta_nm", given.zeta_nm, &mut operator.zeta_nm),
        ];
        for (name, value, target) in positive {
            if let Some(value) = self.positive(&key(name), value)? {
                *target = value;
            }
        }
        Ok(())
    }

    fn schedule(&self, given: Option<ScheduleTable>, base: Schedule) -> Result<Schedule, ScenarioFileError> {
        let Some(given) = given else { return Ok(base) };
        let rate = self.positive("schedule.rate_per_s", given.rate_per_s)?;
        let midpoint = self.finite("schedule.midpoint_s", given.midpoint_s)?;
        let (of_base, at_base) = (base.rate_per_s(), base.change_s());
        let missing = |key: &str| self.keys(&format!("[schedule] lacks {key}: there is no change to take it from"));
        let rate_per_s = rate.or(of_base).ok_or_else(|| missing("rate_per_s"))?;
        let midpoint_s = midpoint.or(at_base).ok_or_else(|| missing("midpoint_s"))?;
        Ok(match self.positive("schedule.interval_s", given.interval_s)? {
            Some(interval_s) => Schedule::Alternating {
                rate_per_s,
                midpoint_s,
                interval_s,
            },
            None => Schedule::Sigmoid { rate_per_s, midpoint_s },
        })
    }

    fn remnant(&self, scenario: &mut Scenario, given: RemnantTable) -> Result<(), ScenarioFileError> {
        if let Some(order) = given.order {
            scenario.remnant.order = match usize::try_from(*order.get_ref()) {
                Ok(m @ 1..=4) => m,
                _ => return Err(self.value("remnant.order", order.span().start, order.get_ref(), "1, 2, 3 or 4")),
            };
        }
        if let Some(t_n_s) = self.positive("remnant.T_n_s", given.t_n_s)? {
            scenario.remnant.time_constant_s = t_n_s;
        }
        let level = self.not_negative("remnant.noise_level", given.noise_level)?;
        let definition = given.noise_definition.map(|key| match key {
            DefinitionKey::Response => NoiseDefinition::Response,
            DefinitionKey::Remnant => NoiseDefinition::Remnant,
        });
        let gains = [
            self.not_negative("remnant.K_n_initial_deg", given.k_n_initial_deg)?,
            self.not_negative("remnant.K_n_last_deg", given.k_n_last_deg)?,
        ];
        match (gains, &mut scenario.remnant.strength) {
            (
                [None, None],
                RemnantStrength::Level {
                    level: l,
                    definition: d,
                },
            ) => {
                *l = level.unwrap_or(*l);
                *d = definition.unwrap_or(*d);
            }
            ([None, None], RemnantStrength::Gain { .. }) => {}
            _ if level.is_some() || definition.is_some() => {
                return Err(self.keys("[remnant] has a noise level and a gain K_n: give one of them"));
            }
            ([Some(initial), last], strength) => {
                if last.is_none() && scenario.schedule != Schedule::Constant {
                    return Err(
                        self.keys("[remnant] has K_n_initial_deg but no K_n_last_deg for the state after the change")
                    );
                }
                *strength = RemnantStrength::Gain {
                    initial,
                    last: last.unwrap_or(initial),
                };
            }
            ([None, Some(_)], _) => {
                return Err(self.keys("[remnant] has K_n_last_deg but no K_n_initial_deg: give both"));
            }
        }
        Ok(())
    }

    fn forcing(&self, tables: Vec<SinusoidTable>, measurement_s: f64) -> Result<ForcingFunction, ScenarioFileError> {
        let mut sinusoids = Vec::with_capacity(tables.len());
        for (k, table) in (1..).zip(tables) {
            let omega = self.positive("forcing.omega_rad_s", table.omega_rad_s)?;
            let cycles = self.positive("forcing.cycles", table.cycles)?;
            let omega_rad_s = match (omega, cycles) {
                (Some(omega), None) => omega,
                (None, Some(cycles)) => cycles * TAU / measurement_s,
                _ => {
                    return Err(self.keys(&format!(
                        "[[forcing]] number {k}: give either omega_rad_s or cycles (periods within measurement_s)"
                    )));
                }
            };
            sinusoids.push(Sinusoid {
                amplitude_deg: self.number("forcing.amplitude_deg", &table.amplitude_deg)?,
                omega_rad_s,
                phase_rad: self.number("forcing.phase_rad", &table.phase_rad)?,
            });
        }
        ForcingFunction::new(sinusoids).map_err(|error| self.model(error))
    }

    /// A time that is `least` to ten million samples, a whole number of them. One that the file does not give can fail as well,
    /// when the file gives the sample time.
    fn whole(
        &self,
        key: &str,
        given: Option<Number>,
        default: f64,
        sample_time: SampleTime,
        least: f64,
    ) -> Result<f64, ScenarioFileError> {
        let time_s = given.as_ref().map_or(default, |n| *n.get_ref());
        let whole = sample_time.whole_samples(time_s).map(|n| n as f64);
        if whole.is_some_and(|n| (least..=MOST_SAMPLES).contains(&n)) {
            return Ok(time_s);
        }
        let expected = format!(
            "{least} to 1e7 samples of {} s, a whole number of them: round it or change sample_time_s",
            sample_time.s()
        );
        Err(match given {
            Some(given) => self.value(key, given.span().start, &time_s, &expected),
            None => self.keys(&format!(
                "{key} is {time_s} where the file does not give it, expected {expected}"
            )),
        })
    }

    fn positive(&self, key: &str, given: Option<Number>) -> Result<Option<f64>, ScenarioFileError> {
        self.within(key, given, |v| v > 0.0, "a positive finite number")
    }

    fn not_negative(&self, key: &str, given: Option<Number>) -> Result<Option<f64>, ScenarioFileError> {
        self.within(key, given, |v| v >= 0.0, "a finite number, zero or more")
    }

    fn finite(&self, key: &str, given: Option<Number>) -> Result<Option<f64>, ScenarioFileError> {
        self.within(key, given, |_| true, "a finite number")
    }

    fn number(&self, key: &str, given: &Number) -> Result<f64, ScenarioFileError> {
        let value = *given.get_ref();
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.value(key, given.span().start, &value, "a finite number"))
    }

    fn within(
        &self,
        key: &str,
        given: Option<Number>,
        has_meaning: impl Fn(f64) -> bool,
        expected: &str,
    ) -> Result<Option<f64>, ScenarioFileError> {
        match given {
            Some(n) if !(n.get_ref().is_finite() && has_meaning(*n.get_ref())) => {
                Err(self.value(key, n.span().start, n.get_ref(), expected))
            }
            given => Ok(given.map(Spanned::into_inner)),
        }
    }

    fn value(&self, key: &str, offset: usize, found: &dyn std::fmt::Display, expected: &str) -> ScenarioFileError {
        ScenarioFileError::Value {
            path: self.path.to_owned(),
            line: line_of(self.text, offset),
            key: key.to_owned(),
            found: found.to_string(),
            expected: expected.to_owned(),
        }
    }

    fn keys(&self, reason: &str) -> ScenarioFileError {
        ScenarioFileError::Keys {
            path: self.path.to_owned(),
            reason: reason.to_owned(),
        }
    }

    fn model(&self, source: ModelError) -> ScenarioFileError {
        ScenarioFileError::Model {
            path: self.path.to_owned(),
            source,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Scenario, ScenarioFileError> {
        parse_scenario(text, "x.toml", "x")
    }

    fn refusal(text: &str) -> String {
        parse(text).unwrap_err().to_string()
    }

    fn named(condition: Condition) -> Scenario {
        Scenario {
            name: "x".to_owned(),
            ..Scenario::condition(condition)
        }
    }

    #[test]
    fn the_example_of_the_documentation_is_read() {
        let example: String = include_str!("scenario_file.rs")
            .lines()
            .skip_while(|l| *l != "//! ```toml")
            .skip(1)
            .take_while(|l| *l != "//! ```")
            .map(|l| format!("{}\n", l.trim_start_matches("//!").trim_start()))
            .collect();
        let mut expected = named(Condition::C4);
        expected.realisation = Realisation::Output;
        for state in [&mut expected.initial, &mut expected.last] {
            state.operator.tau_e_s = 0.3;
        }
        expected.last.operator.k_e = 0.08;
        expected.last.operator.t_l_s = 1.0;
        expected.schedule = Schedule::Sigmoid {
            rate_per_s: 0.5,
            midpoint_s: 40.96,
        };
        expected.remnant.order = 2;
        expected.remnant.strength = RemnantStrength::Level {
            level: 0.2,
            definition: NoiseDefinition::Response,
        };
        assert_eq!(parse(&example), Ok(expected));
    }

    #[test]
    fn a_delay_of_its_own_for_each_state() {
        let delays = |text: &str| {
            let scenario = parse(text).unwrap();
            [scenario.initial, scenario.last].map(|state| state.operator.tau_e_s)
        };
        assert_eq!(delays("condition = \"C4\"\n[last]\ntau_e_s = 0.34"), [0.28, 0.34]);
        assert_eq!(
            delays("condition = \"C4\"\ntau_e_s = 0.3\n[last]\ntau_e_s = 0.34"),
            [0.3, 0.34]
        );
        assert_eq!(delays("condition = \"C1\"\n[initial]\ntau_e_s = 0.2"), [0.2, 0.2]);
    }

    #[test]
    fn an_interval_is_there_and_back_again() {
        let mut expected = named(Condition::C4);
        expected.schedule = Schedule::Alternating {
            rate_per_s: 100.0,
            midpoint_s: 40.96,
            interval_s: 10.0,
        };
        assert_eq!(parse("condition = \"C4\"\n[schedule]\ninterval_s = 10"), Ok(expected));
        assert!(parse("condition = \"C4\"\n[schedule]\ninterval_s = -1").is_err());
    }

    #[test]
    fn a_condition_alone_is_that_condition() {
        for condition in Condition::ALL {
            assert_eq!(parse(&format!("condition = \"{condition}\"")), Ok(named(condition)));
        }
    }

    #[test]
    fn a_file_with_every_key_is_c4() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/scenario/full.toml");
        let expected = Scenario {
            name: "s1 to s2, fast".to_owned(),
            realisation: Realisation::Output,
            ..Scenario::condition(Condition::C4)
        };
        // The last state takes omega_nm and zeta_nm from the initial one, cycles give Table 1 to the last bit.
        assert_eq!(read_scenario(&path), Ok(expected));
    }

    #[test]
    fn constant_conditions_stay_constant() {
        let own = parse("condition = \"C1\"\n[initial]\nK_e = 0.08").unwrap();
        assert_eq!(own.initial.operator.k_e, 0.08);
        assert_eq!(own.last, own.initial);
        let text = "condition = \"C1\"\n[remnant]\nK_n_initial_deg = 0.1";
        let RemnantStrength::Gain { initial, last } = parse(text).unwrap().remnant.strength else {
            panic!("no gain");
        };
        assert_eq!([initial, last], [0.1, 0.1]);
        let at_rest = parse("condition = \"C1\"\nforcing = []\n[remnant]\nnoise_level = 0").unwrap();
        assert_eq!(at_rest.forcing.value(1.0), 0.0);
    }

    #[test]
    fn bad_values_name_line_key_and_remedy() {
        for (text, parts) in [
            ("\n\ncondition = \"C7\"", ["line 3", "condition is C7", "C1, C2"]),
            (
                "condition = \"C1\"\n[initial]\nK_e = nan",
                ["line 3", "initial.K_e is NaN", "finite"],
            ),
            (
                "condition = \"C4\"\n[last]\nzeta_nm = -0.1",
                ["line 3", "last.zeta_nm is -0.1", "positive"],
            ),
            (
                "condition = \"C1\"\ntau_e_s = 0.285",
                ["line 2", "tau_e_s is 0.285", "change sample_time_s"],
            ),
            (
                "condition = \"C4\"\n[last]\ntau_e_s = 0.285",
                ["line 3", "last.tau_e_s is 0.285", "change sample_time_s"],
            ),
            (
                "condition = \"C1\"\nsample_time_s = 0.03",
                ["tau_e_s is 0.28", "does not give it", "0.03 s"],
            ),
            (
                "condition = \"C1\"\nmeasurement_s = 1e12",
                ["line 2", "measurement_s", "1e7 samples"],
            ),
            (
                "condition = \"C1\"\nsample_time_s = 0",
                ["line 2", "sample_time_s is 0", "positive"],
            ),
            (
                "condition = \"C1\"\n[remnant]\norder = 5",
                ["line 3", "remnant.order is 5", "1, 2, 3 or 4"],
            ),
            (
                "condition = \"C1\"\n[remnant]\nnoise_level = -1",
                ["line 3", "noise_level is -1", "zero or more"],
            ),
            (
                "condition = \"C1\"\n[[forcing]]\namplitude_deg = inf\nphase_rad = 0\ncycles = 2",
                ["line 3", "amplitude_deg is inf", "finite"],
            ),
        ] {
            let message = refusal(text);
            for part in ["x.toml", parts[0], parts[1], parts[2]] {
                assert!(message.contains(part), "{text}: {message} lacks {part}");
            }
        }
    }

    #[test]
    fn keys_that_do_not_fit_are_refused() {
        let c1 = "condition = \"C1\"\n";
        for (text, part) in [
            (String::new(), "initial.omega_b_rad_s"),
            (format!("{c1}K_e = 1"), "unknown field `K_e`"),
            (format!("{c1}[initial]\nk_e = 1"), "unknown field `k_e`"),
            (format!("{c1}run_in_s = \"long\""), "line 2"),
            (format!("{c1}realisation = \"both\""), "unknown variant `both`"),
            (format!("{c1}[initial"), "line 2"),
            (format!("{c1}[last]\nK_e = 1"), "add [schedule]"),
            (
                format!("{c1}[schedule]\nrate_per_s = 1\nmidpoint_s = 9"),
                "both states are the same",
            ),
            (
                format!("{c1}[last]\nK_e = 1\n[schedule]\nrate_per_s = 1"),
                "lacks midpoint_s",
            ),
            (
                format!("{c1}[remnant]\nnoise_level = 0.1\nK_n_initial_deg = 1"),
                "give one of them",
            ),
            (format!("{c1}[remnant]\nK_n_last_deg = 1"), "give both"),
            (
                "condition = \"C4\"\n[remnant]\nK_n_initial_deg = 1".to_owned(),
                "no K_n_last_deg",
            ),
            (
                format!("{c1}[[forcing]]\namplitude_deg = 1\nphase_rad = 0"),
                "either omega_rad_s or cycles",
            ),
        ] {
            let message = refusal(&text);
            assert!(message.contains(part), "{text}: {message} lacks {part}");
        }
    }

    #[test]
    fn what_the_model_refuses_names_the_file() {
        let unreachable = "condition = \"C1\"\n[remnant]\nnoise_level = 3\nnoise_definition = \"remnant\"";
        assert!(refusal(unreachable).contains("largest reachable"));
        assert!(refusal("condition = \"C1\"\n[initial]\nK_e = 5").contains("x.toml"));
        let nowhere = read_scenario(Path::new("/nowhere/a.toml")).unwrap_err();
        assert!(matches!(nowhere, ScenarioFileError::Unreadable { .. }));
    }
}
