//! Results of a finished group for each run, read from its tables: the operator in the form chosen for the person, RMS
//! values, and responses.

use std::{collections::BTreeMap, path::Path};

use hoid_io::{OutputTable, read_table};
use hoid_model::uncertainty::Estimate;

use super::{
    analysis::RECORD_LABEL,
    family_fits::{JOINT_LABEL, SINGLE_RUN_LABEL},
    person::ALL_RUNS,
    responses::MedianResponse,
    tables::{numbers, texts},
};
use crate::{StudyError, directory::table_path};

/// Subject, condition, run.
type Key = [String; 3];

/// The estimates of the runs of a group.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunEstimates {
    /// The runs of a person in a condition, in the order of the manifest.
    runs: BTreeMap<[String; 2], Vec<String>>,
    parameters: BTreeMap<Key, BTreeMap<String, Estimate>>,
    responses: BTreeMap<Key, MedianResponse>,
}

impl RunEstimates {
    /// Reads the tables in the directory of a finished group.
    ///
    /// # Errors
    /// [`StudyError::Io`] if a table cannot be read.
    pub fn read(directory: &Path) -> Result<Self, StudyError> {
        let table = |name: &str| read_table(&table_path(directory, name, false));
        Ok(Self::of(&table("estimates")?, &table("responses")?))
    }

    fn of(estimates: &OutputTable, responses: &OutputTable) -> Self {
        let mut all = Self::default();
        let key = |table: &OutputTable, row: usize| {
            ["subject", "condition", "run"].map(|name| texts(table, name).get(row).cloned().unwrap_or_default())
        };
        let [estimator, parameter, status] = ["estimator", "parameter", "status"].map(|name| texts(estimates, name));
        let [value, error] = ["value", "standard_error"].map(|name| numbers(estimates, name));
        for row in 0..status.len() {
            if status[row] != "ok" || !(estimator[row] == SINGLE_RUN_LABEL || estimator[row] == RECORD_LABEL) {
                continue;
            }
            let key = key(estimates, row);
            let [subject, condition, run] = key.clone();
            let runs = all.runs.entry([subject, condition]).or_default();
            if !runs.contains(&run) {
                runs.push(run);
            }
            let estimate = Estimate {
                value: value[row],
                standard_error: Some(error[row]).filter(|e| e.is_finite()),
            };
            let of_run = all.parameters.entry(key).or_default();
            of_run.insert(parameter[row].clone(), estimate);
        }
        let estimator = texts(responses, "estimator");
        let columns = ["omega_rad_s", "magnitude_db", "phase_deg"].map(|name| numbers(responses, name));
        for row in 0..estimator.len() {
            if estimator[row] == SINGLE_RUN_LABEL || estimator[row] == JOINT_LABEL {
                let of_run = all.responses.entry(key(responses, row)).or_default();
                of_run.omega_rad_s.push(columns[0][row]);
                of_run.magnitude_db.push(columns[1][row]);
                of_run.phase_deg.push(columns[2][row]);
            }
        }
        all
    }

    /// Returns the runs of a person in a condition, in the order of the manifest.
    pub fn runs(&self, subject: &str, condition: &str) -> &[String] {
        let key = [subject, condition].map(str::to_owned);
        self.runs.get(&key).map_or(&[], Vec::as_slice)
    }

    /// Returns a quantity of a run: a parameter of the operator, `crossover_rad_s`, `phase_margin_deg`, `rms_e` or
    /// `rms_u`.
    pub fn parameter(&self, [subject, condition, run]: [&str; 3], name: &str) -> Option<Estimate> {
        let key = [subject, condition, run].map(str::to_owned);
        self.parameters.get(&key)?.get(name).copied()
    }

    /// Returns the gain in dB and the phase in deg of the operator of a run, or of the joint fit (`run = None`); `None`
    /// outside 0.1 to 40 rad/s.
    pub fn response(&self, [subject, condition]: [&str; 2], run: Option<&str>, omega_rad_s: f64) -> Option<[f64; 2]> {
        let key = [subject, condition, run.unwrap_or(ALL_RUNS)].map(str::to_owned);
        self.responses.get(&key)?.decibel_and_degrees(omega_rad_s)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::{
        super::{responses::responses_schema, run_rows::estimates_schema},
        *,
    };
    use crate::columns::Rows;

    #[test]
    fn run_estimates_are_read_back() {
        let mut estimates = Rows::new(&estimates_schema());
        for (run, estimator, parameter, value, status) in [
            ("2", "family", "tau_e", 0.2, "ok"),
            ("1", "family", "tau_e", 0.3, "ok"),
            ("1", "ARX", "tau_e", 9.0, "ok"),
            ("1", "record", "rms_e", 1.5, "ok"),
            ("3", "family", "", f64::NAN, "failed"),
        ] {
            estimates.start_row();
            for (name, text) in [
                ("subject", "P"),
                ("condition", "c"),
                ("run", run),
                ("estimator", estimator),
            ] {
                estimates.set_text(name, text);
            }
            estimates.set_text("parameter", parameter);
            estimates.set_text("status", status);
            estimates.set_real("value", value);
        }
        let mut responses = Rows::new(&responses_schema());
        for (omega, gain, phase) in [(1.0, 0.0, 0.0), (4.0, -20.0, -90.0)] {
            responses.start_row();
            for (name, text) in [
                ("subject", "P"),
                ("condition", "c"),
                ("run", "all"),
                ("estimator", "family, all runs"),
            ] {
                responses.set_text(name, text);
            }
            responses.set_real("omega_rad_s", omega);
            responses.set_real("magnitude_db", gain);
            responses.set_real("phase_deg", phase);
        }
        let all = RunEstimates::of(&estimates.into_table(Vec::new()), &responses.into_table(Vec::new()));
        assert_eq!(all.runs("P", "c"), ["2", "1"]);
        assert_eq!(all.parameter(["P", "c", "1"], "tau_e"), Some(Estimate::fixed(0.3)));
        assert_eq!(all.parameter(["P", "c", "1"], "rms_e"), Some(Estimate::fixed(1.5)));
        assert_eq!(
            (all.parameter(["P", "c", "3"], "tau_e"), all.runs("Q", "c").len()),
            (None, 0)
        );
        let [gain, phase] = all.response(["P", "c"], None, 2.0).unwrap();
        assert!((gain + 10.0).abs() < 1e-12 && (phase + 45.0).abs() < 1e-12);
        assert_eq!(all.response(["P", "c"], None, 5.0), None);
        assert_eq!(all.response(["P", "c"], Some("1"), 2.0), None);
    }
}
