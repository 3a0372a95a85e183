//! Conversion of the keys of a file to a scenario; missing keys have the values of the condition that the file names.

use std::f64::consts::TAU;

use hoid_model::{
    SampleTime,
    forcing::{ForcingFunction, Sinusoid},
    remnant_gain::NoiseDefinition,
    scenario::{Condition, OperatingState, Realisation, RemnantStrength, Scenario},
    schedule::Schedule,
};

use super::changes::rescaled_disturbance;
use super::error::ScenarioFileError;
use super::keys::{DefinitionKey, File, RealisationKey, RemnantTable, ScheduleTable, SinusoidTable, StateTable};
use super::values::{Limits, Source};

/// Maximum number of lines (sinusoids) of a forcing function.
pub(super) const MAX_LINES: usize = 10_000;

impl Source<'_> {
    pub(super) fn scenario(&self, file: File, name: &str) -> Result<Scenario, ScenarioFileError> {
        let condition = match &file.condition {
            None => None,
            Some(given) => Some(given.get_ref().parse::<Condition>().map_err(|_| {
                self.value_error(
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
        if let Some(ts) = self.optional_number("sample_time_s", file.sample_time_s, Limits::SAMPLE_TIME_S)? {
            scenario.sample_time = SampleTime::new(ts).map_err(|error| self.model_error(error))?;
        }
        let ts = scenario.sample_time;
        let tau_e_s = self.whole_samples("tau_e_s", file.tau_e_s, scenario.initial.operator.tau_e_s, ts, 0.0)?;
        for state in [&mut scenario.initial, &mut scenario.last] {
            state.operator.tau_e_s = tau_e_s;
        }
        scenario.measurement_s =
            self.whole_samples("measurement_s", file.measurement_s, scenario.measurement_s, ts, 1.0)?;
        scenario.run_in_s = self.whole_samples("run_in_s", file.run_in_s, scenario.run_in_s, ts, 0.0)?;
        match file.realisation {
            Some(RealisationKey::Input) => scenario.realisation = Realisation::Input,
            Some(RealisationKey::Output) => scenario.realisation = Realisation::Output,
            None => {}
        }

        self.set_state(&mut scenario.initial, "initial", file.initial, ts)?;
        if scenario.schedule == Schedule::Constant {
            scenario.last = scenario.initial;
        }
        let changes_last = file.last.is_some();
        if let Some(table) = file.last {
            self.set_state(&mut scenario.last, "last", table, ts)?;
        }
        scenario.schedule = self.schedule(file.schedule, scenario.schedule)?;
        if scenario.schedule == Schedule::Constant && changes_last {
            return Err(
                self.keys_error("[last] is given, but nothing changes: add [schedule] with rate_per_s and midpoint_s")
            );
        }
        if let Some(table) = &file.feedforward {
            let of = scenario.initial.operator;
            scenario.feedforward = Some(self.feedforward(table, Some((of.omega_nm_rad_s, of.zeta_nm)), ts)?);
        }
        let response_changes = scenario.feedforward.as_ref().is_some_and(|seen| seen.last.is_some());
        if response_changes && scenario.schedule == Schedule::Constant {
            return Err(self.keys_error(
                "[feedforward.last] is given, but nothing changes: add [schedule] with rate_per_s and midpoint_s",
            ));
        }
        if scenario.schedule != Schedule::Constant && scenario.initial == scenario.last && !response_changes {
            return Err(self.keys_error(
                "[schedule] is given, but both states are the same: add [last] with the values that change",
            ));
        }
        self.set_remnant(&mut scenario, file.remnant)?;
        if let Some(tables) = file.forcing {
            scenario.forcing = self.forcing("forcing", tables, scenario.measurement_s)?;
        }
        if let Some(tables) = file.disturbance {
            scenario.disturbance = self.forcing("disturbance", tables, scenario.measurement_s)?;
        }
        if let Some(rms) = self.optional_number("disturbance_rms_deg", file.disturbance_rms_deg, Limits::NOISE_GAIN)? {
            scenario.disturbance =
                rescaled_disturbance(&scenario.disturbance, rms).map_err(|error| self.model_error(error))?;
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
        Err(self.keys_error(&format!(
            "missing {}: give them, or start from a condition, such as condition = \"C1\"",
            missing.join(", ")
        )))
    }

    fn set_state(
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
        operator.tau_e_s = self.whole_samples(&key("tau_e_s"), given.tau_e_s, operator.tau_e_s, sample_time, 0.0)?;
        let any = [
            ("K_e", given.k_e, &mut operator.k_e, Limits::GAIN),
            ("T_L_s", given.t_l_s, &mut operator.t_l_s, Limits::LEAD_S),
            ("K_c", given.k_c, &mut controlled_element.k_c, Limits::GAIN),
            (
                "omega_b_rad_s",
                given.omega_b_rad_s,
                &mut controlled_element.omega_b_rad_s,
                Limits::BREAK_RAD_S,
            ),
            (
                "omega_nm_rad_s",
                given.omega_nm_rad_s,
                &mut operator.omega_nm_rad_s,
                Limits::FREQUENCY_RAD_S,
            ),
            ("zeta_nm", given.zeta_nm, &mut operator.zeta_nm, Limits::DAMPING),
        ];
        for (name, value, target, limits) in any {
            if let Some(value) = self.optional_number(&key(name), value, limits)? {
                *target = value;
            }
        }
        Ok(())
    }

    pub(super) fn schedule(&self, given: Option<ScheduleTable>, base: Schedule) -> Result<Schedule, ScenarioFileError> {
        let Some(given) = given else { return Ok(base) };
        let rate = self.optional_number("schedule.rate_per_s", given.rate_per_s, Limits::CHANGE_PER_S)?;
        let midpoint = self.optional_number("schedule.midpoint_s", given.midpoint_s, Limits::INSTANT_S)?;
        let (of_base, at_base) = (base.rate_per_s(), base.change_s());
        let missing = |key: &str| self.keys_error(&format!("[schedule] lacks {key}, which has no default: add it"));
        let rate_per_s = rate.or(of_base).ok_or_else(|| missing("rate_per_s"))?;
        let midpoint_s = midpoint.or(at_base).ok_or_else(|| missing("midpoint_s"))?;
        Ok(
            match self.optional_number("schedule.interval_s", given.interval_s, Limits::INTERVAL_S)? {
                Some(interval_s) => Schedule::Alternating {
                    rate_per_s,
                    midpoint_s,
                    interval_s,
                },
                None => Schedule::Sigmoid { rate_per_s, midpoint_s },
            },
        )
    }

    fn set_remnant(&self, scenario: &mut Scenario, given: RemnantTable) -> Result<(), ScenarioFileError> {
        if let Some(order) = given.order {
            scenario.remnant.order = match usize::try_from(*order.get_ref()) {
                Ok(m @ 1..=4) => m,
                _ => {
                    return Err(self.value_error("remnant.order", order.span().start, order.get_ref(), "1, 2, 3 or 4"));
                }
            };
        }
        if let Some(t_n_s) = self.optional_number("remnant.T_n_s", given.t_n_s, Limits::TIME_CONSTANT_S)? {
            scenario.remnant.time_constant_s = t_n_s;
        }
        let level = self.optional_number("remnant.noise_level", given.noise_level, Limits::NOISE_LEVEL)?;
        let definition = given.noise_definition.map(|key| match key {
            DefinitionKey::Response => NoiseDefinition::Response,
            DefinitionKey::Remnant => NoiseDefinition::Remnant,
        });
        let gains = [
            self.optional_number("remnant.K_n_initial_deg", given.k_n_initial_deg, Limits::NOISE_GAIN)?,
            self.optional_number("remnant.K_n_last_deg", given.k_n_last_deg, Limits::NOISE_GAIN)?,
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
                return Err(self.keys_error("[remnant] has a noise level and a gain K_n: give only one of the two"));
            }
            ([Some(initial), last], strength) => {
                if last.is_none() && scenario.schedule != Schedule::Constant {
                    return Err(self.keys_error(
                        "[remnant] has K_n_initial_deg but no K_n_last_deg for the state after the change: add it",
                    ));
                }
                *strength = RemnantStrength::Gain {
                    initial,
                    last: last.unwrap_or(initial),
                };
            }
            ([None, Some(_)], _) => {
                return Err(self.keys_error("[remnant] has K_n_last_deg but no K_n_initial_deg: give both"));
            }
        }
        Ok(())
    }

    /// Returns the sum of sines of a list of tables, `forcing` or `disturbance`.
    fn forcing(
        &self,
        name: &str,
        tables: Vec<SinusoidTable>,
        measurement_s: f64,
    ) -> Result<ForcingFunction, ScenarioFileError> {
        if tables.len() > MAX_LINES {
            return Err(self.keys_error(&format!(
                "there are {} [[{name}]] tables, expected at most {MAX_LINES}",
                tables.len()
            )));
        }
        let mut sinusoids = Vec::with_capacity(tables.len());
        for (k, table) in (1..).zip(tables) {
            let omega = self.optional_number(
                &format!("{name}.omega_rad_s"),
                table.omega_rad_s,
                Limits::FREQUENCY_RAD_S,
            )?;
            let cycles = self.optional_number(&format!("{name}.cycles"), table.cycles, Limits::CYCLES)?;
            let omega_rad_s = match (omega, cycles) {
                (Some(omega), None) => omega,
                (None, Some(cycles)) => cycles * TAU / measurement_s,
                _ => {
                    return Err(self.keys_error(&format!(
                        "[[{name}]] number {k}: give either omega_rad_s or cycles (periods within measurement_s)"
                    )));
                }
            };
            sinusoids.push(Sinusoid {
                amplitude_deg: self.number(&format!("{name}.amplitude_deg"), &table.amplitude_deg, Limits::GAIN)?,
                omega_rad_s,
                phase_rad: self.number(&format!("{name}.phase_rad"), &table.phase_rad, Limits::PHASE_RAD)?,
            });
        }
        ForcingFunction::new(sinusoids).map_err(|error| self.model_error(error))
    }
}
