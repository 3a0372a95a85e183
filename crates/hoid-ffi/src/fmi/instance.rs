//! Instance of a functional mock-up unit.
//!
//! Samples are taken at `t_0 + k Ts`, where t_0 is the start of the experiment. A communication step may be as long as
//! the sample time or shorter. If it is shorter, the sample uses the inputs of the first step within the sample time. A
//! step longer than the sample time is rejected, since a sample would be lost.

use std::{ffi::CString, fs, path::Path};

use hoid_io::fmu::{FMU_SETTINGS_FILE, FmuKind, FmuSettings, FmuStart, FmuVariable, Role};

use super::{
    model::Model,
    values::{FmiResult, VariableValues},
};

/// Tolerance in the comparison of times, as a fraction of the sample time.
const TIME_TOLERANCE: f64 = 1e-6;

/// Phase of an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Phase {
    /// The experiment has not started; parameters may be set.
    Setup,
    /// The experiment is running; samples are taken.
    Running,
    Ended,
}

/// Instance with its variables and its model.
pub(super) struct Instance {
    pub(super) token: String,
    pub(super) settings: FmuSettings,
    pub(super) variables: Vec<FmuVariable>,
    pub(super) values: Vec<FmuStart>,
    /// String values as C strings, indexed by value reference; empty for variables of other types.
    texts: Vec<CString>,
    first_output: usize,
    pub(super) phase: Phase,
    pub(super) start_s: f64,
    /// Index of the next sample.
    pub(super) k: u64,
    pub(super) end_s: f64,
    pub(super) model: Option<Model>,
}

impl Instance {
    /// Builds the instance of the unit with the given token; `resources` is the folder that contains its settings.
    pub fn new(token: &str, resources: Option<&Path>) -> FmiResult<Self> {
        let kind = (FmuKind::ALL.into_iter().find(|kind| kind.token() == token)).ok_or_else(|| {
            format!(
                "the model description is for {token:?}, but the library is for {}; build the unit again with hoid fmu",
                FmuKind::ALL.map(FmuKind::token).join(" and ")
            )
        })?;
        let settings = match resources {
            None => FmuSettings::new(kind),
            Some(folder) => {
                let path = folder.join(FMU_SETTINGS_FILE);
                let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
                FmuSettings::parse(&text)?
            }
        };
        if settings.kind()? != kind {
            return Err(format!(
                "{FMU_SETTINGS_FILE} is for a unit other than {token}; build it again with hoid fmu"
            ));
        }
        let variables = settings.variables()?;
        let first_output = variables.iter().take_while(|v| v.role != Role::Output).count();
        let mut instance = Self {
            token: token.to_owned(),
            settings,
            values: Vec::new(),
            texts: vec![CString::default(); variables.len()],
            variables,
            first_output,
            phase: Phase::Setup,
            start_s: 0.0,
            k: 0,
            end_s: 0.0,
            model: None,
        };
        instance.reset();
        Ok(instance)
    }

    /// Resets the instance to its initial state.
    pub fn reset(&mut self) {
        self.values = self.variables.iter().map(|variable| variable.start.clone()).collect();
        for reference in 0..self.values.len() {
            self.update_text(reference);
        }
        self.phase = Phase::Setup;
        (self.start_s, self.k, self.end_s) = (0.0, 0, 0.0);
        self.model = None;
    }

    pub(super) fn update_text(&mut self, reference: usize) {
        if let FmuStart::Text(text) = &self.values[reference] {
            self.texts[reference] = CString::new(text.replace('\0', " ")).unwrap_or_default();
        }
    }

    fn variable(&self, reference: u32) -> FmiResult<&FmuVariable> {
        let variable = self.variables.get(reference as usize);
        variable.ok_or_else(|| format!("there is no variable with the value reference {reference}"))
    }

    /// Returns the value of a variable.
    pub fn value(&self, reference: u32) -> FmiResult<&FmuStart> {
        self.variable(reference)?;
        Ok(&self.values[reference as usize])
    }

    /// Returns the value of a string variable; it is valid until the variable is set again.
    pub fn text(&self, reference: u32) -> FmiResult<&CString> {
        match self.value(reference)? {
            FmuStart::Text(_) => Ok(&self.texts[reference as usize]),
            _ => Err(self.wrong_type_message(reference)),
        }
    }

    /// Returns the error message for a variable whose type differs from that of the called function.
    pub fn wrong_type_message(&self, reference: u32) -> String {
        let name = self.variable(reference).map_or("?", |variable| variable.name);
        format!("{name} does not have the type of the called function")
    }

    /// Sets a parameter (only before the start) or an input.
    pub fn set(&mut self, reference: u32, value: FmuStart) -> FmiResult {
        let phase = self.phase;
        let variable = self.variable(reference)?;
        let (name, role) = (variable.name, variable.role);
        if std::mem::discriminant(&variable.start) != std::mem::discriminant(&value) {
            return Err(self.wrong_type_message(reference));
        }
        match role {
            Role::Output => return Err(format!("{name} is an output; it cannot be set")),
            Role::Parameter if phase != Phase::Setup => {
                return Err(format!(
                    "{name} is fixed once the experiment runs; set it before the experiment starts"
                ));
            }
            Role::Parameter | Role::Input => {}
        }
        self.values[reference as usize] = value;
        self.update_text(reference as usize);
        Ok(())
    }

    /// Sets the start time of the experiment in s.
    pub fn set_start_time(&mut self, start_s: f64) -> FmiResult {
        if !start_s.is_finite() {
            return Err(format!("the experiment starts at {start_s} s, expected a finite time"));
        }
        if self.phase != Phase::Setup {
            return Err("the experiment is already running".to_owned());
        }
        (self.start_s, self.end_s) = (start_s, start_s);
        Ok(())
    }

    /// Returns the values of the parameters and inputs, by name.
    fn variable_values(&self) -> VariableValues<'_> {
        VariableValues {
            variables: &self.variables,
            values: &self.values,
        }
    }

    /// Builds the model from the parameters and starts the experiment.
    pub fn start(&mut self) -> FmiResult {
        let model = Model::new(&self.settings, &self.variable_values(), self.start_s)?;
        self.values.splice(self.first_output.., model.outputs());
        self.model = Some(model);
        self.phase = Phase::Running;
        Ok(())
    }

    /// Performs a communication step of length `step_s` from the time `t_s`, both in s.
    pub fn step(&mut self, t_s: f64, step_s: f64) -> FmiResult {
        let given = VariableValues {
            variables: &self.variables,
            values: &self.values,
        };
        let model = match (&mut self.model, self.phase) {
            (Some(model), Phase::Running) => model,
            _ => return Err("the experiment is not running: initialise the unit first".to_owned()),
        };
        let ts = model.sample_time_s();
        if !(step_s > 0.0 && step_s <= ts * (1.0 + TIME_TOLERANCE)) {
            return Err(format!(
                "the step is {step_s} s, but the sample time is {ts} s, so samples would be lost; use the sample time \
                 or a fraction of it as the step"
            ));
        }
        if !(t_s >= self.end_s - TIME_TOLERANCE * ts && t_s.is_finite()) {
            return Err(format!("the step starts at {t_s} s, expected {} s", self.end_s));
        }
        self.end_s = t_s + step_s;
        let time_of = |k: u64| self.start_s + k as f64 * ts;
        if time_of(self.k) < self.end_s - TIME_TOLERANCE * ts {
            model.take(&given, time_of(self.k));
            self.k += 1;
        }
        // Outputs that belong to the next sample are not reported before the time of that sample.
        if model.outputs_of_taken_sample() || time_of(self.k) <= self.end_s + TIME_TOLERANCE * ts {
            self.values.splice(self.first_output.., model.outputs());
        }
        Ok(())
    }

    /// Ends the experiment.
    pub fn end(&mut self) {
        self.phase = Phase::Ended;
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::{Condition, Scenario};
    use hoid_sim::{RunSeed, Simulator};

    use super::*;

    fn tracker() -> Instance {
        Instance::new(&FmuKind::Tracker.token(), None).unwrap()
    }

    fn reference(instance: &Instance, name: &str) -> u32 {
        let found = instance.variables.iter().position(|v| v.name == name);
        u32::try_from(found.unwrap()).unwrap()
    }

    fn real(instance: &Instance, name: &str) -> f64 {
        match instance.value(reference(instance, name)).unwrap() {
            FmuStart::Real(value) => *value,
            other => panic!("{name}: {other:?}"),
        }
    }

    fn set(instance: &mut Instance, name: &str, value: FmuStart) {
        let reference = reference(instance, name);
        instance.set(reference, value).unwrap();
    }

    /// Every output has a value, in the order and with the type of the description.
    #[test]
    #[cfg_attr(miri, ignore = "safe code, and a simulated run takes minutes there")]
    fn outputs_match_the_description() {
        for kind in FmuKind::ALL {
            let folder = tempfile::tempdir().unwrap();
            let settings = FmuSettings::new(kind).with_scenario("condition = \"C4\"".to_owned());
            fs::write(folder.path().join(FMU_SETTINGS_FILE), settings.text()).unwrap();
            let mut instance = Instance::new(&kind.token(), Some(folder.path())).unwrap();
            instance.start().unwrap();
            let outputs: Vec<&FmuVariable> = instance.variables.iter().filter(|v| v.role == Role::Output).collect();
            let model = instance.model.as_ref().unwrap();
            assert_eq!(model.output_names(), outputs.iter().map(|v| v.name).collect::<Vec<_>>());
            for (variable, value) in outputs.iter().zip(model.outputs()) {
                assert_eq!(
                    std::mem::discriminant(&variable.start),
                    std::mem::discriminant(&value),
                    "{}",
                    variable.name
                );
            }
            assert_eq!(instance.values.len(), instance.variables.len());
        }
    }

    /// Steps of a tenth of the sample time give the same estimate as steps of the sample time.
    #[test]
    #[cfg_attr(miri, ignore = "safe code, and a simulated run takes minutes there")]
    fn shorter_steps_give_the_same_estimate() {
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        let record = simulator.run(RunSeed::default(), false).unwrap();
        let ended = |parts: u32| {
            let mut instance = tracker();
            instance.set_start_time(2.0).unwrap();
            instance.start().unwrap();
            for k in 0..1000 {
                for part in 0..parts {
                    // The inputs change within a sample.
                    let moved = f64::from(part);
                    set(&mut instance, "e", FmuStart::Real(record.input()[k] + moved));
                    set(&mut instance, "u", FmuStart::Real(record.output()[k] + moved));
                    let h = 0.01 / f64::from(parts);
                    instance.step(2.0 + 0.01 * k as f64 + h * moved, h).unwrap();
                }
            }
            ["K_e", "K_e_se", "tau_e", "innovation"].map(|name| real(&instance, name).to_bits())
        };
        let expected = ended(1);
        assert_eq!(ended(10), expected);
        assert_eq!(ended(3), expected);
        assert!(f64::from_bits(expected[0]).is_finite());
    }

    /// The unit contains a fit, whose values are reported before the data determine them.
    #[test]
    #[cfg_attr(
        miri,
        ignore = "safe code, and the filters of the method adaptive take minutes there"
    )]
    fn fmu_starts_from_its_fit() {
        let fit = r#"{"form": "gain", "neuromuscular": true, "verdict": {"level": "trustworthy"}, "parameters": [],
            "records": [{"sample_time": 0.01, "units": {"input": "", "output": ""}}],
            "noise": {"c": [], "d": [-0.9]}, "innovation_variance": 0.1,
            "covariance": {"coordinates": ["gain", "ln omega_nm", "ln zeta_nm", "tau_e"], "values": [2, 2.4, -1.2, 0.2],
                           "matrix": [[0.01, 0, 0, 0], [0, 0.01, 0, 0], [0, 0, 0.01, 0], [0, 0, 0, 0.0001]]}}"#;
        let folder = tempfile::tempdir().unwrap();
        let settings = FmuSettings::new(FmuKind::Tracker)
            .with("prior", FmuStart::Text("fit".to_owned()))
            .with("controlled_element", FmuStart::Text("1/s".to_owned()));
        let started = |settings: &FmuSettings| {
            fs::write(folder.path().join(FMU_SETTINGS_FILE), settings.text()).unwrap();
            let mut instance = Instance::new(&FmuKind::Tracker.token(), Some(folder.path())).unwrap();
            instance.start().map(|()| instance)
        };
        let refused = started(&settings).err().unwrap();
        assert!(refused.contains("hoid fmu --prior"), "{refused}");
        let mut instance = started(&settings.clone().with_fit(fit.to_owned())).unwrap();
        instance.step(0.0, 0.01).unwrap();
        assert!((real(&instance, "K_e") - 2.0).abs() < 0.1);
        assert!(
            (real(&instance, "crossover_rad_s") - 2.0).abs() < 0.3,
            "a gain over an integrator crosses at the gain"
        );
        let wrong = settings.with("options", FmuStart::Text("[".to_owned()));
        assert!(
            started(&wrong.with_fit(fit.to_owned()))
                .err()
                .unwrap()
                .contains("options")
        );
    }

    #[test]
    fn invalid_calls_give_the_reason() {
        let why = |done: FmiResult| done.unwrap_err();
        assert!(
            Instance::new("hoid-0.0.0-tracker", None)
                .err()
                .unwrap()
                .contains("hoid fmu")
        );
        assert!(
            Instance::new(&FmuKind::Operator.token(), None)
                .unwrap()
                .start()
                .is_err()
        );
        let mut instance = tracker();
        assert!(why(instance.step(0.0, 0.01)).contains("initialise"));
        assert!(why(instance.set(1000, FmuStart::Real(0.0))).contains("1000"));
        assert!(why(instance.set(0, FmuStart::Integer(1))).contains("type"));
        let output = reference(&instance, "K_e");
        assert!(why(instance.set(output, FmuStart::Real(0.0))).contains("output"));
        assert!(instance.text(0).is_err() && instance.set_start_time(f64::NAN).is_err());
        set(&mut instance, "method", FmuStart::Text("kalman".to_owned()));
        assert!(why(instance.start()).contains("adaptive"));
        instance.reset();
        // The method does not matter here, so the fastest method is used.
        set(&mut instance, "method", FmuStart::Text("rpem".to_owned()));
        set(&mut instance, "options", FmuStart::Text("{\"nk\": 9}".to_owned()));
        instance.start().unwrap();
        assert!(why(instance.set(0, FmuStart::Real(0.02))).contains("fixed"));
        for (t_s, step_s) in [(0.0, 0.02), (0.0, 0.0), (0.0, f64::NAN), (-1.0, 0.01), (f64::NAN, 0.01)] {
            assert!(instance.step(t_s, step_s).is_err(), "{t_s} {step_s}");
        }
        instance.step(0.0, 0.01).unwrap();
        instance.end();
        assert!(instance.step(0.01, 0.01).is_err());
        instance.reset();
        set(&mut instance, "sample_time", FmuStart::Real(f64::NAN));
        assert!(instance.start().is_err());
    }
}
