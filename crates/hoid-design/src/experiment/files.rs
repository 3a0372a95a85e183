//! The files of a designed experiment: a scenario for its simulation, a table of the lines, and an experiment for
//! `hoid lab`.

use hoid_model::{
    FamilyOperator,
    family_scenario::{Display, Feedforward},
    forcing::Sinusoid,
    operator_family::{Coordinate, NamedParameter},
};

use super::{DesignedLine, EntryPoint, ExperimentDesign, task::SAMPLE_TIME_S};

/// Time before the measurement, s.
const RUN_IN_S: f64 = 10.0;

impl ExperimentDesign {
    /// Returns the text of a scenario file with the designed forcing function.
    pub fn scenario(&self) -> String {
        let operator = &self.task.state.operator;
        let forcing = |enters: EntryPoint| {
            let own = self.lines.iter().filter(|l| l.enters == enters);
            let lines: Vec<String> = own.map(|l| line_toml(&l.line)).collect();
            match lines.as_slice() {
                [] => String::new(),
                lines => format!("[{}]\nlines = [\n{},\n]\n\n", enters.name(), lines.join(",\n")),
            }
        };
        let shape = match self.task.remnant.time_constant_s {
            0.0 => "shape = \"white\"\n".to_owned(),
            t => format!("shape = \"lag\"\nT_n_s = {t}\n"),
        };
        let sample_s = self.sample_time_s();
        format!(
            "# Made by `hoid design`.\nname = \"design\"\nform = \"{}\"\nneuromuscular = {}\nsample_time_s = {}\nmeasurement_s = {}\nrun_in_s = {}\n\n\
             [initial]\n{}controlled_element = \"{}\"\n\n{}{}{}[[remnant]]\n{shape}share = {}\n",
            operator.form().name(),
            operator.has_neuromuscular(),
            sample_s,
            self.length_s,
            sample_s * (RUN_IN_S / sample_s).round(),
            operator_keys(operator),
            self.task.state.controlled_element,
            forcing(EntryPoint::Target),
            self.task
                .feedforward
                .as_ref()
                .map_or_else(String::new, |seen| feedforward_keys(seen, sample_s)),
            forcing(EntryPoint::Disturbance),
            self.task.remnant.share,
        )
    }

    /// Returns a sample time in s such that a run is a whole number of samples.
    fn sample_time_s(&self) -> f64 {
        let whole = self.length_s / SAMPLE_TIME_S;
        match (whole - whole.round()).abs() < 1e-6 {
            true => SAMPLE_TIME_S,
            false => self.length_s / whole.ceil(),
        }
    }

    /// Returns the table of the lines as CSV, which [`super::OtherForcing`] reads.
    pub fn forcing_csv(&self) -> String {
        let line = |DesignedLine { enters, line: l, .. }: &DesignedLine| {
            let enters = enters.name();
            format!("{},{},{},{enters}\n", l.omega_rad_s, l.amplitude_deg, l.phase_rad)
        };
        let lines: String = self.lines.iter().map(line).collect();
        format!("omega_rad_s,amplitude,phase_rad,enters\n{lines}")
    }
}

/// Half width of the display and full deflection of the stick, in multiples of the rms of e and u. A Gaussian signal
/// exceeds four times its rms in 1 of 16000 samples.
const RMS_MULTIPLE: f64 = 4.0;
/// Largest number of runs of a condition in `hoid lab`.
const MAX_RUNS: usize = 100;

impl ExperimentDesign {
    /// Returns an experiment for `hoid lab --config`. Its condition is the scenario file named by `scenario`, in the
    /// same directory. `None` if a run is not a whole number of hundredths of a second, as the lab requires.
    pub fn lab_config(&self, scenario: &str) -> Option<String> {
        if self.sample_time_s().to_bits() != SAMPLE_TIME_S.to_bits() {
            return None;
        }
        let room = |rms: f64| RMS_MULTIPLE * if rms > 0.0 { rms } else { 1.0 };
        Some(format!(
            "# Made by `hoid design`; show it with `hoid lab --config`.\nname = \"design\"\n\n[[condition]]\nname = \"design\"\n\
             text = \"Keep the error small.\"\nscenario = \"{scenario}\"\ndisplay = \"{}\"\n{}\
             # {RMS_MULTIPLE} times the expected rms of the error and of the control.\nhalf_width = {:.4}\nfull_deflection = {:.4}\n\
             training = 1\nruns = {}\n",
            self.display.name(),
            self.preview_key(),
            room(self.expected.rms_e),
            room(self.expected.rms_u),
            self.runs.clamp(1, MAX_RUNS),
        ))
    }
}

fn line_toml(line: &Sinusoid) -> String {
    format!(
        "  {{ amplitude = {}, omega_rad_s = {}, phase_rad = {} }}",
        line.amplitude_deg, line.omega_rad_s, line.phase_rad
    )
}

/// Returns the keys of the response to a displayed target. Its neuromuscular system is the same as in the response to
/// the error.
fn feedforward_keys(seen: &Feedforward, sample_s: f64) -> String {
    let named = seen.operator.named_parameters();
    let own = |p: &&NamedParameter| {
        let common = matches!(p.coordinate, Some(Coordinate::LogOmega | Coordinate::LogZeta));
        p.coordinate.is_some() && !common
    };
    let key = |p: &NamedParameter| match p.coordinate {
        Some(Coordinate::Delay) => format!("tau_f_s = {}\n", p.value - seen.preview_s),
        _ => scenario_key(p),
    };
    let keys: String = named.iter().filter(own).map(key).collect();
    let form = seen.operator.form().name();
    // The preview is rounded to whole samples.
    let preview_s = sample_s * (seen.preview_s / sample_s).round();
    format!("[feedforward]\nform = \"{form}\"\n{keys}preview_s = {preview_s}\n\n")
}

fn operator_keys(operator: &FamilyOperator) -> String {
    let named = operator.named_parameters();
    named
        .iter()
        .filter(|p| p.coordinate.is_some())
        .map(scenario_key)
        .collect()
}

impl ExperimentDesign {
    /// Returns the preview as a key of a lab experiment.
    fn preview_key(&self) -> String {
        let seen = self
            .task
            .feedforward
            .as_ref()
            .filter(|_| self.display == Display::Preview);
        seen.map_or_else(String::new, |seen| format!("preview_s = {}\n", seen.preview_s))
    }
}

/// Returns the name of a parameter as a key of a scenario.
fn scenario_key(p: &NamedParameter) -> String {
    let name = match p.name {
        "K_e" => "K",
        "K_d" => "K_d_s",
        "T_L" => "T_L_s",
        "T_I" => "T_I_s",
        "c_1" => "c_1_s",
        "c_2" => "c_2_s2",
        "alpha" => "alpha_rad_s",
        "omega_nm" => "omega_nm_rad_s",
        "tau_e" => "tau_e_s",
        other => other,
    };
    let value = if p.value.is_finite() {
        p.value.to_string()
    } else {
        "inf".to_owned()
    };
    format!("{name} = {value}\n")
}
