//! Model in a unit: a tracker or an operator.

use hoid_io::fmu::{DETERMINED_VARIABLES, FmuKind, FmuSettings, FmuStart};
use hoid_track::Sample;
use serde_json::{Map, Value};

use super::{
    operator::OperatorModel,
    values::{FmiResult, VariableValues},
};
use crate::{
    binary_format::{as_bytes, as_numbers},
    results::level_number,
    session::Session,
};

/// Model in a unit.
pub(super) enum Model {
    Tracker(Box<TrackerModel>),
    Operator(Box<OperatorModel>),
}

/// Tracker, with the changes that it has reported.
pub(super) struct TrackerModel {
    session: Session,
    with_excitation: bool,
    innovation: f64,
    changes: i32,
    change_t_s: f64,
}

impl Model {
    /// Builds the model from the parameters, for an experiment that starts at `start_s`.
    pub fn new(settings: &FmuSettings, given: &VariableValues<'_>, start_s: f64) -> FmiResult<Self> {
        Ok(match settings.kind()? {
            FmuKind::Tracker => Self::Tracker(Box::new(TrackerModel::new(settings, given)?)),
            FmuKind::Operator => Self::Operator(Box::new(OperatorModel::new(settings, given, start_s)?)),
        })
    }

    /// Returns the saved state, without changing the model: the numbers that are not part of the recursion, and the
    /// recursion as bytes.
    pub fn save_state(&mut self) -> (Vec<f64>, Vec<u8>) {
        match self {
            Self::Tracker(tracker) => {
                let outputs = vec![tracker.innovation, f64::from(tracker.changes), tracker.change_t_s];
                (outputs, tracker.session.save())
            }
            Self::Operator(operator) => (Vec::new(), as_bytes(&operator.save_state())),
        }
    }

    /// Restores a model with the same parameters from the result of [`Model::save_state`].
    pub fn from_saved_state(
        settings: &FmuSettings,
        given: &VariableValues<'_>,
        start_s: f64,
        extra_numbers: &[f64],
        bytes: &[u8],
    ) -> FmiResult<Self> {
        let wrong = || "the state is from another model".to_owned();
        Ok(match settings.kind()? {
            FmuKind::Tracker => {
                let &[innovation, changes, change_t_s] = extra_numbers else {
                    return Err(wrong());
                };
                Self::Tracker(Box::new(TrackerModel {
                    session: Session::from_bytes(bytes).map_err(|failure| failure.text)?,
                    with_excitation: given.is("with_excitation"),
                    innovation,
                    changes: changes as i32,
                    change_t_s,
                }))
            }
            FmuKind::Operator => {
                let mut operator = OperatorModel::new(settings, given, start_s)?;
                let numbers = as_numbers(bytes).ok_or_else(wrong)?;
                if !operator.restore(&numbers) {
                    return Err(wrong());
                }
                Self::Operator(Box::new(operator))
            }
        })
    }

    pub fn sample_time_s(&self) -> f64 {
        match self {
            Self::Tracker(tracker) => tracker.session.sample_time_s(),
            Self::Operator(operator) => operator.sample_time_s(),
        }
    }

    /// True if the outputs belong to the sample that was taken last, false if they belong to the next sample.
    pub fn outputs_of_taken_sample(&self) -> bool {
        matches!(self, Self::Tracker(_))
    }

    /// Takes the sample at the time `t_s`.
    pub fn take(&mut self, given: &VariableValues<'_>, t_s: f64) {
        match self {
            Self::Tracker(tracker) => tracker.take(given, t_s),
            Self::Operator(operator) => operator.take(given.real("e")),
        }
    }

    /// Returns the outputs with their names, in the order of the model description.
    fn named_outputs(&self) -> Vec<(&'static str, FmuStart)> {
        match self {
            Self::Tracker(tracker) => tracker.named_outputs(),
            Self::Operator(operator) => vec![
                ("u", FmuStart::Real(operator.control())),
                ("n", FmuStart::Real(operator.remnant())),
            ],
        }
    }

    /// Returns the outputs in the order of the model description.
    pub fn outputs(&self) -> Vec<FmuStart> {
        self.named_outputs().into_iter().map(|(_, value)| value).collect()
    }

    #[cfg(test)]
    pub fn output_names(&self) -> Vec<&'static str> {
        self.named_outputs().into_iter().map(|(name, _)| name).collect()
    }
}

impl TrackerModel {
    fn new(settings: &FmuSettings, given: &VariableValues<'_>) -> FmiResult<Self> {
        let text = given.text("options");
        let mut options: Map<String, Value> = serde_json::from_str(if text.is_empty() { "{}" } else { text })
            .map_err(|error| format!("options: not a JSON object ({error})"))?;
        let element = given.text("controlled_element");
        if !element.is_empty() {
            options.insert("controlled_element".to_owned(), element.into());
        }
        let prior = given.text("prior");
        let of_unit = prior == "fit";
        // Some methods have no option `prior`; the default must not set it.
        if !of_unit && !["", "population"].contains(&prior) {
            options.insert("prior".to_owned(), prior.into());
        }
        let fit = settings.fit.as_deref().filter(|_| of_unit);
        if of_unit && fit.is_none() {
            return Err(
                "prior is \"fit\", but the unit contains no fit; build it with hoid fmu --prior FILE.json".to_owned(),
            );
        }
        let options = Value::Object(options).to_string();
        let method = Some(given.text("method")).filter(|name| !name.is_empty());
        let session = Session::new(method, given.real("sample_time"), Some(&options), fit);
        Ok(Self {
            session: session.map_err(|failure| failure.text)?,
            with_excitation: given.is("with_excitation"),
            innovation: f64::NAN,
            changes: 0,
            change_t_s: f64::NAN,
        })
    }

    fn take(&mut self, given: &VariableValues<'_>, t_s: f64) {
        let reference = given.real("f_t");
        let sample = Sample {
            e: given.real("e"),
            u: given.real("u"),
            reference: Some(reference).filter(|f| self.with_excitation && f.is_finite()),
        };
        self.innovation = self.session.take(sample, true).innovation;
        if let Ok(change) = self.session.change() {
            self.changes = self.changes.saturating_add(1);
            self.change_t_s = t_s - change.seconds_ago;
        }
    }

    fn named_outputs(&self) -> Vec<(&'static str, FmuStart)> {
        let session = &self.session;
        let operator = session.operator().unwrap_or_default();
        let open_loop = session.open_loop().unwrap_or_default();
        let mut all = Vec::with_capacity(32);
        let pairs = [
            (["K_e", "K_e_se"], operator.first()),
            (["T_L", "T_L_se"], operator.get(1)),
            (["K_e_dot", "K_e_dot_se"], operator.get(2)),
            (["omega_nm", "omega_nm_se"], operator.get(3)),
            (["zeta_nm", "zeta_nm_se"], operator.get(4)),
            (["tau_e", "tau_e_se"], operator.get(5)),
            (["crossover_rad_s", "crossover_rad_s_se"], open_loop.first()),
            (["phase_margin_deg", "phase_margin_deg_se"], open_loop.get(1)),
        ];
        for ([name, error_name], estimate) in pairs {
            let value = estimate.map_or(f64::NAN, |e| e.value);
            let error = estimate.map_or(f64::NAN, |e| e.standard_error);
            all.extend([(name, FmuStart::Real(value)), (error_name, FmuStart::Real(error))]);
        }
        for (i, name) in DETERMINED_VARIABLES.into_iter().enumerate() {
            let is = operator.get(i).is_some_and(|e| e.determined == 1);
            all.push((name, FmuStart::Boolean(is)));
        }
        let counts = session.counts();
        let count = |n: u64| FmuStart::Integer(i32::try_from(n).unwrap_or(i32::MAX));
        all.extend([
            ("innovation", FmuStart::Real(self.innovation)),
            (
                "change_log_odds",
                FmuStart::Real(session.change_log_odds().unwrap_or(f64::NAN)),
            ),
            ("change_t", FmuStart::Real(self.change_t_s)),
            ("changes", FmuStart::Integer(self.changes)),
            ("level", FmuStart::Integer(level_number(session.level()))),
            ("ready", FmuStart::Boolean(session.tracker().is_ok())),
            ("samples", count(counts.samples)),
            ("skipped", count(counts.skipped)),
            ("held", count(counts.held)),
            ("restarts", count(counts.restarts)),
        ]);
        all
    }
}
