//! Conversion of the keys of a file to a scenario of the operator family.

use hoid_model::{
    ContinuousTransferFunction, FamilyOperator, FamilyScenario, FamilyState, Form, ModelError, SampleTime,
    family_scenario::{
        DependenceSignal, Excitation, Feedforward, Intermittence, MultiSine, PartStrength, Pulses, RemnantPart,
        RemnantShape, SignalDependence, Stick,
    },
    forcing::{ForcingFunction, Sinusoid},
    operator_family::Coordinate,
    scenario::Realisation,
    schedule::Schedule,
};
use toml::Spanned;

use super::condition::MAX_LINES;
use super::error::ScenarioFileError;
use super::family_keys::{ExcitationTable, FamilyFile, FamilyStateTable, FollowsKey, PartTable, ShapeKey};
use super::keys::{FeedforwardTable, RealisationKey};
use super::values::{Limits, Source};

impl Source<'_> {
    pub(super) fn family_scenario(&self, file: FamilyFile, name: &str) -> Result<FamilyScenario, ScenarioFileError> {
        let form = self.parse_form("form", &file.form)?;
        let rate = self.optional_number("sampling_rate_hz", file.sampling_rate_hz, Limits::RATE_HZ)?;
        let sample_time = match (
            self.optional_number("sample_time_s", file.sample_time_s, Limits::SAMPLE_TIME_S)?,
            rate,
        ) {
            (None, None) => SampleTime::AT_60_HZ,
            (Some(ts), None) => SampleTime::new(ts).map_err(|error| self.model_error(error))?,
            (None, Some(rate)) => SampleTime::new(1.0 / rate).map_err(|error| self.model_error(error))?,
            (Some(_), Some(_)) => {
                return Err(self.keys_error(
                    "sample_time_s and sampling_rate_hz specify the same quantity: give only one of the two",
                ));
            }
        };
        let initial = self.family_state(form, file.neuromuscular, "initial", &file.initial)?;
        let mut scenario = FamilyScenario::new(initial, sample_time);
        scenario.name = file.name.unwrap_or_else(|| name.to_owned());
        scenario.measurement_s = self.whole_samples(
            "measurement_s",
            file.measurement_s,
            scenario.measurement_s,
            sample_time,
            1.0,
        )?;
        scenario.run_in_s = self.whole_samples("run_in_s", file.run_in_s, scenario.run_in_s, sample_time, 0.0)?;
        if let Some(RealisationKey::Output) = file.realisation {
            scenario.realisation = Realisation::Output;
        }
        scenario.schedule = self.schedule(file.schedule, Schedule::Constant)?;
        match (&file.last, scenario.schedule) {
            (None, Schedule::Constant) => {}
            (Some(_), Schedule::Constant) => {
                return Err(self.keys_error(
                    "[last] is given, but nothing changes: add [schedule] with rate_per_s and midpoint_s",
                ));
            }
            (None, _) => {
                return Err(
                    self.keys_error("[schedule] is given, but no [last]: add [last] with the values that change")
                );
            }
            (Some(last), _) => {
                let last = last.with_defaults_from(&file.initial);
                scenario.last = self.family_state(form, file.neuromuscular, "last", &last)?;
            }
        }
        if let Some(table) = file.target {
            scenario.target = self.excitation("target", table)?;
        }
        if let Some(table) = file.feedforward {
            if scenario.target.function.sinusoids().is_empty() {
                return Err(self.keys_error("[feedforward] is given, but there is no displayed target: add [target]"));
            }
            let muscles = scenario.initial.operator.neuromuscular_parameters();
            scenario.feedforward = Some(self.feedforward(&table, muscles, sample_time)?);
        }
        if let Some(table) = file.motion {
            if table.preview_s.is_some() || table.last.is_some() {
                return Err(self.keys_error("[motion] has a preview or values after the change; expected neither"));
            }
            let muscles = scenario.initial.operator.neuromuscular_parameters();
            scenario.motion = Some(self.further_input("motion", &table, muscles, sample_time)?.operator);
        }
        if let Some(table) = file.disturbance {
            scenario.disturbance = self.excitation("disturbance", table)?;
        }
        for (k, table) in (1..).zip(file.remnant) {
            scenario.remnant.push(self.remnant_part(k, table)?);
        }
        scenario.stick = Stick {
            bias: file.stick.bias,
            walk_per_root_s: file.stick.walk_per_root_s,
            offset_e: file.stick.offset_e,
            offset_u: file.stick.offset_u,
        };
        Ok(scenario)
    }

    fn family_state(
        &self,
        form: Form,
        neuromuscular: bool,
        table: &str,
        given: &FamilyStateTable,
    ) -> Result<FamilyState, ScenarioFileError> {
        let operator = self.operator(form, neuromuscular, table, given)?;
        let Some(element) = &given.controlled_element else {
            return Err(self.keys_error(&format!(
                "[{table}] lacks controlled_element, such as controlled_element = \"1/s\" or \"90/(s(s+6))\""
            )));
        };
        Ok(FamilyState {
            operator,
            controlled_element: self.parse_element(&format!("{table}.controlled_element"), element)?,
        })
    }

    fn operator(
        &self,
        form: Form,
        neuromuscular: bool,
        table: &str,
        given: &FamilyStateTable,
    ) -> Result<FamilyOperator, ScenarioFileError> {
        for (key, value) in given.values() {
            // A lag with an infinite time constant is an integrator.
            if let Some(value) = value.filter(|value| !(key == "T_I_s" && value.is_infinite())) {
                self.check(&format!("{table}.{key}"), value, limits_of(key))?;
            }
        }
        let need = |key: &str, value: Option<f64>| {
            value.ok_or_else(|| self.keys_error(&format!("[{table}] lacks {key} for the form {form}")))
        };
        let positive = |key: &str, value: Option<f64>| {
            let value = need(key, value)?;
            if value > 0.0 {
                Ok(value)
            } else {
                Err(self.keys_error(&format!("{table}.{key} is {value}, expected a positive number")))
            }
        };
        let mut used = vec!["tau_e_s"];
        let mut coordinates = Vec::new();
        for kind in form.coordinates(neuromuscular) {
            let (keys, value): (&[&'static str], f64) = match kind {
                Coordinate::Gain if form.has_lag() => match given.k_over_t_i {
                    Some(ratio) => (&["K_over_T_I"], ratio),
                    None => {
                        let t_i = positive("T_I_s", given.t_i_s)?;
                        if t_i.is_infinite() {
                            return Err(self.keys_error(&format!(
                                "[{table}] has an infinite T_I_s: give K_over_T_I in place of K"
                            )));
                        }
                        (&["K"], need("K or K_over_T_I", given.k)? / t_i)
                    }
                },
                Coordinate::Gain => match form.gain_name_and_unit().0 {
                    "K_I" => (&["K_I"], need("K_I", given.k_i)?),
                    "K_d" => (&["K_d_s"], need("K_d_s", given.k_d_s)?),
                    "K_m" => (&["K_m_s2"], need("K_m_s2", given.k_m_s2)?),
                    "K_m_rate" => (&["K_m_rate_s"], need("K_m_rate_s", given.k_m_rate_s)?),
                    _ => (&["K"], need("K", given.k)?),
                },
                Coordinate::Lead => (&["T_L_s"], need("T_L_s", given.t_l_s)?),
                Coordinate::LagRate => (&["T_I_s"], 1.0 / positive("T_I_s", given.t_i_s)?),
                Coordinate::Linear => (&["c_1_s"], need("c_1_s", given.c_1_s)?),
                Coordinate::Quadratic => (&["c_2_s2"], need("c_2_s2", given.c_2_s2)?),
                Coordinate::Droop => (&["alpha_rad_s"], need("alpha_rad_s", given.alpha_rad_s)?),
                Coordinate::LogOmega => (
                    &["omega_nm_rad_s"],
                    positive("omega_nm_rad_s", given.omega_nm_rad_s)?.ln(),
                ),
                Coordinate::LogZeta => (&["zeta_nm"], positive("zeta_nm", given.zeta_nm)?.ln()),
                Coordinate::Delay => (&["tau_e_s"], need("tau_e_s", given.tau_e_s)?),
            };
            used.extend(keys);
            coordinates.push(value);
        }
        if let Some(key) = given
            .values()
            .iter()
            .find(|(key, value)| value.is_some() && !used.contains(key))
        {
            return Err(self.keys_error(&format!(
                "[{table}] has {}, which the form {form} does not use, or which repeats another key; the form takes {}",
                key.0,
                used.join(", ")
            )));
        }
        FamilyOperator::new(form, neuromuscular, &coordinates).map_err(|error| self.model_error(error))
    }

    fn parse_form(&self, key: &str, given: &Spanned<String>) -> Result<Form, ScenarioFileError> {
        let form = given.get_ref().parse();
        form.map_err(|error: hoid_model::UnknownName| {
            self.value_error(key, given.span().start, given.get_ref(), &error.to_string())
        })
    }

    /// Returns the person's response to a target. The response includes the neuromuscular system of the operator, with
    /// omega_nm in rad/s and zeta_nm.
    pub(super) fn feedforward(
        &self,
        given: &FeedforwardTable,
        neuromuscular: Option<(f64, f64)>,
        sample_time: SampleTime,
    ) -> Result<Feedforward, ScenarioFileError> {
        self.further_input("feedforward", given, neuromuscular, sample_time)
    }

    /// As [`Self::feedforward`], for a table with another name.
    fn further_input(
        &self,
        name: &str,
        given: &FeedforwardTable,
        neuromuscular: Option<(f64, f64)>,
        sample_time: SampleTime,
    ) -> Result<Feedforward, ScenarioFileError> {
        let form = self.parse_form(&format!("{name}.form"), &given.form)?;
        let preview_s = given.preview_s.clone();
        let preview_s = self.whole_samples(&format!("{name}.preview_s"), preview_s, 0.0, sample_time, 0.0)?;
        let early = if name == "motion" {
            "to motion before it happens"
        } else {
            "to a target before it is displayed"
        };
        let of = |table: &str, tau_f_s: f64, gains: FamilyStateTable| {
            self.check(&format!("{table}.tau_f_s"), tau_f_s, Limits::LEAD_S)?;
            let delay_s = Feedforward::delay_s(tau_f_s, preview_s).map_err(|_| {
                self.keys_error(&format!(
                    "{table}.tau_f_s is {tau_f_s}, expected at least {}: a person cannot respond {early}",
                    -preview_s
                ))
            })?;
            let table_of_form = FamilyStateTable {
                omega_nm_rad_s: neuromuscular.map(|(omega, _)| omega),
                zeta_nm: neuromuscular.map(|(_, zeta)| zeta),
                tau_e_s: Some(delay_s),
                ..gains
            };
            self.operator(form, neuromuscular.is_some(), table, &table_of_form)
        };
        let before = || FamilyStateTable {
            k: given.k,
            k_over_t_i: given.k_over_t_i,
            k_d_s: given.k_d_s,
            k_m_s2: given.k_m_s2,
            k_m_rate_s: given.k_m_rate_s,
            t_l_s: given.t_l_s,
            t_i_s: given.t_i_s,
            ..FamilyStateTable::default()
        };
        let last = given.last.as_ref().map(|last| {
            let own = FamilyStateTable {
                k: last.k,
                k_over_t_i: last.k_over_t_i,
                k_d_s: last.k_d_s,
                k_m_s2: last.k_m_s2,
                k_m_rate_s: last.k_m_rate_s,
                t_l_s: last.t_l_s,
                t_i_s: last.t_i_s,
                ..FamilyStateTable::default()
            };
            let tau_f_s = last.tau_f_s.unwrap_or(given.tau_f_s);
            of(&format!("{name}.last"), tau_f_s, own.with_defaults_from(&before()))
        });
        Ok(Feedforward {
            operator: of(name, given.tau_f_s, before())?,
            last: last.transpose()?,
            preview_s,
        })
    }

    /// Parses a transfer function such as `90/(s(s+6))`, or `90/1,6,0` with coefficients in descending powers of s.
    fn parse_element(
        &self,
        key: &str,
        given: &Spanned<String>,
    ) -> Result<ContinuousTransferFunction, ScenarioFileError> {
        let at = given.span().start;
        let element: ContinuousTransferFunction = given.get_ref().parse().map_err(|error| match error {
            ModelError::TransferFunction { expected, .. } => self.value_error(key, at, given.get_ref(), &expected),
            other => self.model_error(other),
        })?;
        let mut coefficients = element.num().iter().chain(element.den());
        if let Some(value) = coefficients.find(|value| !Limits::ANY.contains(**value)) {
            return Err(self.value_error(key, at, value, &format!("{} in each coefficient", Limits::ANY)));
        }
        Ok(element)
    }

    fn excitation(&self, name: &str, given: ExcitationTable) -> Result<Excitation, ScenarioFileError> {
        let Some(lines) = given.lines else {
            for (key, value, limits) in [
                ("period_s", given.period_s, Limits::INTERVAL_S),
                ("rms", given.rms, Limits::NOISE_GAIN),
            ] {
                if let Some(value) = value {
                    self.check(&format!("{name}.{key}"), value, limits)?;
                }
            }
            let default = MultiSine::default();
            let sum = MultiSine {
                period_s: given.period_s.unwrap_or(default.period_s),
                largest: given.largest_multiple.unwrap_or(default.largest),
                rms: given.rms.unwrap_or(default.rms),
                interleaved: match &given.interleaved {
                    None => default.interleaved,
                    Some(word) => word.get_ref().parse().map_err(|error: hoid_model::UnknownName| {
                        let key = format!("{name}.interleaved");
                        self.value_error(&key, word.span().start, word.get_ref(), &error.to_string())
                    })?,
                },
            };
            let mut excitation = sum.excitation().map_err(|error| self.model_error(error))?;
            excitation.random_phases = given.random_phases.unwrap_or(true);
            return Ok(excitation);
        };
        let of_primes = given.interleaved.is_some() || given.largest_multiple.is_some();
        if given.period_s.is_some() || of_primes || given.rms.is_some() {
            return Err(self.keys_error(&format!(
                "[{name}] has both lines and the keys of a multi-sine: give only one of the two"
            )));
        }
        if lines.len() > MAX_LINES {
            return Err(self.keys_error(&format!(
                "[{name}] has {} lines, expected at most {MAX_LINES}",
                lines.len()
            )));
        }
        for line in &lines {
            self.check(&format!("{name}.lines.amplitude"), line.amplitude, Limits::GAIN)?;
            self.check(
                &format!("{name}.lines.omega_rad_s"),
                line.omega_rad_s,
                Limits::FREQUENCY_RAD_S,
            )?;
            self.check(&format!("{name}.lines.phase_rad"), line.phase_rad, Limits::PHASE_RAD)?;
        }
        let line = |line: &super::family_keys::LineTable| Sinusoid {
            amplitude_deg: line.amplitude,
            omega_rad_s: line.omega_rad_s,
            phase_rad: line.phase_rad,
        };
        Ok(Excitation {
            function: ForcingFunction::new(lines.iter().map(line).collect())
                .map_err(|error| self.model_error(error))?,
            random_phases: given.random_phases.unwrap_or(false),
        })
    }

    fn remnant_part(&self, k: usize, given: PartTable) -> Result<RemnantPart, ScenarioFileError> {
        let refuse = |reason: String| Err(self.keys_error(&format!("[[remnant]] number {k}: {reason}")));
        let numbers = [
            given.share,
            given.gain,
            given.gain_last,
            given.t_n_s,
            given.omega_rad_s,
            given.zeta,
            given.follows_part,
            given.follows_memory_s,
            given.pulses_per_s,
            given.pulses_part,
            given.on_s,
            given.off_s,
        ];
        let coefficients = given.coefficients.iter().flatten().copied();
        if let Some(value) = numbers
            .into_iter()
            .flatten()
            .chain(coefficients)
            .find(|v| !Limits::GAIN.contains(*v))
        {
            return refuse(format!("one of its values is {value}, expected {}", Limits::GAIN));
        }
        let strength = match (given.share, given.gain) {
            (Some(share), None) if given.gain_last.is_none() => PartStrength::Share(share),
            (None, Some(initial)) => PartStrength::Gain {
                initial,
                last: given.gain_last.unwrap_or(initial),
            },
            _ => {
                return refuse("give share (of the variance of u) or gain; give gain_last only with gain".to_owned());
            }
        };
        let mut used = Vec::new();
        let shape = match given.shape {
            ShapeKey::White => Some(RemnantShape::White),
            ShapeKey::Lag => {
                used.extend(["T_n_s", "order"]);
                given.t_n_s.map(|time_constant_s| RemnantShape::Lag {
                    time_constant_s,
                    order: given.order.unwrap_or(1),
                })
            }
            ShapeKey::Resonance => {
                used.extend(["omega_rad_s", "zeta"]);
                let both = given.omega_rad_s.zip(given.zeta);
                both.map(|(omega_rad_s, zeta)| RemnantShape::Resonance { omega_rad_s, zeta })
            }
            ShapeKey::Ar => {
                used.push("coefficients");
                let coefficients = given.coefficients.clone();
                coefficients.map(|coefficients| RemnantShape::Ar { coefficients })
            }
        };
        let takes = if used.is_empty() {
            "no other key".to_owned()
        } else {
            used.join(" and ")
        };
        for (key, is_there) in [
            ("T_n_s", given.t_n_s.is_some()),
            ("order", given.order.is_some()),
            ("omega_rad_s", given.omega_rad_s.is_some()),
            ("zeta", given.zeta.is_some()),
            ("coefficients", given.coefficients.is_some()),
        ] {
            if is_there && !used.contains(&key) {
                return refuse(format!("its shape takes {takes}; remove {key}"));
            }
        }
        let Some(shape) = shape else {
            return refuse(format!("a key of its shape is missing; the shape takes {takes}"));
        };
        let requires = |owner: &str, is_there: bool, others: bool| {
            if others && !is_there {
                return Err(self.keys_error(&format!("[[remnant]] number {k} lacks {owner}")));
            }
            Ok(())
        };
        let follows = given.follows_part.is_some() || given.follows_memory_s.is_some();
        requires("follows", given.follows.is_some(), follows)?;
        requires(
            "pulses_per_s",
            given.pulses_per_s.is_some(),
            given.pulses_part.is_some(),
        )?;
        requires("on_s", given.on_s.is_some(), given.off_s.is_some())?;
        requires("off_s", given.off_s.is_some(), given.on_s.is_some())?;
        Ok(RemnantPart {
            shape,
            strength,
            signal_dependence: given.follows.map(|follows| SignalDependence {
                signal: match follows {
                    FollowsKey::Control => DependenceSignal::Control,
                    FollowsKey::Rate => DependenceSignal::Rate,
                },
                share: given.follows_part.unwrap_or(1.0),
                memory_s: given.follows_memory_s.unwrap_or(1.0),
            }),
            pulses: given.pulses_per_s.map(|rate_per_s| Pulses {
                share: given.pulses_part.unwrap_or(1.0),
                rate_per_s,
            }),
            intermittence: given
                .on_s
                .zip(given.off_s)
                .map(|(on_s, off_s)| Intermittence { on_s, off_s }),
        })
    }
}

/// Returns the admissible range of an operator parameter.
fn limits_of(key: &str) -> Limits {
    match key {
        "T_L_s" | "T_I_s" | "c_1_s" | "c_2_s2" | "tau_e_s" | "K_d_s" | "K_m_s2" | "K_m_rate_s" => Limits::LEAD_S,
        "omega_nm_rad_s" => Limits::FREQUENCY_RAD_S,
        "zeta_nm" => Limits::DAMPING,
        _ => Limits::GAIN,
    }
}

impl FamilyStateTable {
    fn values(&self) -> [(&'static str, Option<f64>); 14] {
        [
            ("K", self.k),
            ("K_over_T_I", self.k_over_t_i),
            ("K_I", self.k_i),
            ("K_d_s", self.k_d_s),
            ("K_m_s2", self.k_m_s2),
            ("K_m_rate_s", self.k_m_rate_s),
            ("T_L_s", self.t_l_s),
            ("T_I_s", self.t_i_s),
            ("c_1_s", self.c_1_s),
            ("c_2_s2", self.c_2_s2),
            ("alpha_rad_s", self.alpha_rad_s),
            ("omega_nm_rad_s", self.omega_nm_rad_s),
            ("zeta_nm", self.zeta_nm),
            ("tau_e_s", self.tau_e_s),
        ]
    }

    /// Takes missing settings from `base`. If both define the gain, the definition in `self` applies.
    fn with_defaults_from(&self, base: &Self) -> Self {
        let says_gain = self.k.is_some() || self.k_over_t_i.is_some();
        let gain = |own: Option<f64>, of_base: Option<f64>| if says_gain { own } else { of_base };
        Self {
            k: gain(self.k, base.k),
            k_over_t_i: gain(self.k_over_t_i, base.k_over_t_i),
            k_i: self.k_i.or(base.k_i),
            k_d_s: self.k_d_s.or(base.k_d_s),
            k_m_s2: self.k_m_s2.or(base.k_m_s2),
            k_m_rate_s: self.k_m_rate_s.or(base.k_m_rate_s),
            t_l_s: self.t_l_s.or(base.t_l_s),
            t_i_s: self.t_i_s.or(base.t_i_s),
            c_1_s: self.c_1_s.or(base.c_1_s),
            c_2_s2: self.c_2_s2.or(base.c_2_s2),
            alpha_rad_s: self.alpha_rad_s.or(base.alpha_rad_s),
            omega_nm_rad_s: self.omega_nm_rad_s.or(base.omega_nm_rad_s),
            zeta_nm: self.zeta_nm.or(base.zeta_nm),
            tau_e_s: self.tau_e_s.or(base.tau_e_s),
            controlled_element: self
                .controlled_element
                .clone()
                .or_else(|| base.controlled_element.clone()),
        }
    }
}
