//! A virtual experiment: simulated subjects, conditions and runs, with the true parameters.
//!
//! The gain K_e, the lead T_L, omega_nm, zeta_nm and the noise level of a subject are the values of the condition
//! multiplied by `exp(a z)`, where z is a normal deviate of the subject and a is the spread between subjects (0.15 is
//! 15 %). In each run each parameter is multiplied by a further factor `exp(b z)`, where b is the spread between runs.
//! The delay varies between subjects with half their spread, rounded to whole samples, and not between runs. If the
//! loop is unstable, new deviates are drawn. Deviates come from the random stream (seed, subject, run), remnants from
//! the streams that `hoid simulate` uses.

use std::path::Path;

use hoid_io::{ColumnKind, ColumnSchema, TableSchema};
use hoid_model::{
    Record,
    controlled_element::ControlledElement,
    remnant_gain::NoiseDefinition,
    scenario::{Condition, RemnantStrength, Scenario},
    uncertainty::OperatorEstimate,
};
use hoid_sim::{RunSeed, Simulator};

use super::{
    analysis_settings::AnalysisSettings, condition_settings::ConditionSettings, manifest::Manifest,
    sampling_defects::SamplingDefect, virtual_files::VirtualFiles,
};
use crate::{
    StudyError,
    columns::{OPERATOR_PARAMETERS, Rows},
};

/// A virtual experiment with simulated subjects.
#[derive(Debug, Clone, PartialEq)]
pub struct VirtualExperiment {
    /// Number of subjects.
    pub subjects: u64,
    /// Conditions in which each subject is simulated.
    pub conditions: Vec<Condition>,
    /// Number of runs per subject and condition.
    pub runs: u64,
    /// Relative spread of the parameters between subjects.
    pub between_subjects: f64,
    /// Relative spread of the parameters between the runs of a subject.
    pub between_runs: f64,
    /// Order of the remnant.
    pub remnant_order: usize,
    /// Noise level before the spreads are applied.
    pub noise_level: f64,
    /// Seed of all random streams.
    pub seed: u64,
    /// Sampling defects applied to the recordings.
    pub defects: Vec<SamplingDefect>,
}

/// Cell number of the random stream of subject 0; no cell of a study has a number near it.
const SUBJECT_STREAM_CELL: u64 = u64::MAX;
/// Maximum number of draws for a stable loop; if all fail, the spreads are too large.
const MAX_DRAWS: usize = 100;

/// Simulates the experiment and writes its files to a directory: one file per run, `truth.csv`, and `group.toml`.
///
/// # Errors
/// [`StudyError::Virtual`] for an invalid experiment, [`StudyError::ExperimentThere`] if the directory already contains
/// one, [`StudyError::Io`] if a file cannot be written.
pub fn simulate_group(
    experiment: &VirtualExperiment,
    directory: &Path,
    each: &dyn Fn(),
) -> Result<Manifest, StudyError> {
    experiment.check()?;
    VirtualFiles::check_no_experiment(directory)?;
    let mut files = VirtualFiles::new(directory, &["f_t", "e", "u", "x"], &experiment.defects)?;
    let mut truth = Rows::new(&truth_schema());
    for subject in 1..=experiment.subjects {
        for (cell, condition) in experiment.conditions.iter().enumerate() {
            for run in 1..=experiment.runs {
                let (scenario, record) = experiment.run(subject, cell as u64, *condition, run)?;
                let noise = experiment.sampling_noise(subject, cell as u64, run, record.len());
                files.write_run((subject, condition.to_string(), run), &record, &noise)?;
                write_truth_row(&mut truth, subject, *condition, run, &scenario);
                each();
            }
        }
    }
    let settings = |condition: &Condition| {
        let scenario = Scenario::condition(*condition);
        let change_s = scenario.schedule.change_s();
        let text = |element: ControlledElement| format!("{}/1,{},0", element.k_c, element.omega_b_rad_s);
        let settings = ConditionSettings {
            controlled_element: Some(text(scenario.initial.controlled_element)),
            excitation: Some("f_t".to_owned()),
            change_s,
            changes_to: change_s.map(|_| text(scenario.last.controlled_element)),
            change_per_s: scenario.schedule.rate_per_s(),
            ..ConditionSettings::default()
        };
        (condition.to_string(), settings)
    };
    let analysis = AnalysisSettings {
        windows_s: Some([(0.0, 30.72), (51.2, 81.91)]),
        ..AnalysisSettings::default()
    };
    files.finish(
        "virtual-experiment",
        truth,
        analysis,
        experiment.conditions.iter().map(settings),
    )
}

/// Maximum number of runs of a virtual experiment; each run is a file.
const MAX_RUNS: u64 = 100_000;

/// Checks that an experiment does not have too many runs.
pub(super) fn check_run_count(factors: &[u64]) -> Result<(), StudyError> {
    let runs = factors.iter().try_fold(1_u64, |all, n| all.checked_mul(*n));
    if runs.is_some_and(|runs| runs <= MAX_RUNS) {
        return Ok(());
    }
    let found: Vec<String> = factors.iter().map(u64::to_string).collect();
    Err(StudyError::Virtual {
        reason: format!(
            "subjects times runs times conditions is {}, expected at most {MAX_RUNS} runs in total: request fewer runs, \
             or make several experiments with different seeds",
            found.join(" x ")
        ),
    })
}

impl VirtualExperiment {
    fn check(&self) -> Result<(), StudyError> {
        let bad = |reason: String| Err(StudyError::Virtual { reason });
        if self.subjects == 0 || self.runs == 0 || self.conditions.is_empty() {
            return bad("there are no subjects, runs or conditions, expected at least one of each".to_owned());
        }
        check_run_count(&[self.subjects, self.runs, self.conditions.len() as u64])?;
        for (name, spread) in [("subjects", self.between_subjects), ("runs", self.between_runs)] {
            if !(0.0..=1.0).contains(&spread) {
                return bad(format!("the spread between {name} is {spread}, expected 0 to 1"));
            }
        }
        if !(0.0..0.9).contains(&self.noise_level) {
            return bad(format!(
                "the noise level is {}, expected 0 to below 0.9",
                self.noise_level
            ));
        }
        if !(1..=4).contains(&self.remnant_order) {
            return bad(format!("the remnant order is {}, expected 1 to 4", self.remnant_order));
        }
        Ok(())
    }

    /// Returns the scenario of a run, with the parameters of its subject, and the simulated record. Subject and run are
    /// counted from 1; `cell` is an index of `conditions`.
    ///
    /// # Errors
    /// [`StudyError::Virtual`] if no draw gives a stable loop.
    pub fn run(
        &self,
        subject: u64,
        cell: u64,
        condition: Condition,
        run: u64,
    ) -> Result<(Scenario, Record), StudyError> {
        let deviates = |replication: u64| {
            let run_seed = RunSeed {
                seed: self.seed,
                cell: SUBJECT_STREAM_CELL - subject,
                replication,
            };
            run_seed.white_noise(6 * MAX_DRAWS)
        };
        let of_subject = deviates(0);
        let of_run = deviates(1 + cell * 1_000_000 + run);
        let mut reason = String::new();
        for draw in 0..MAX_DRAWS {
            // The deviates of the run are replaced in each draw, the deviates of the subject in every tenth draw.
            let (s, r) = (&of_subject[6 * (draw / 10)..], &of_run[6 * draw..]);
            let factor = |i: usize| (self.between_subjects * s[i] + self.between_runs * r[i]).exp();
            let mut scenario = Scenario::condition(condition);
            for state in [&mut scenario.initial, &mut scenario.last] {
                state.operator.k_e *= factor(0);
                state.operator.t_l_s *= factor(1);
                state.operator.omega_nm_rad_s *= factor(2);
                state.operator.zeta_nm *= factor(3);
                let ts = scenario.sample_time.s();
                let delay = state.operator.tau_e_s * (0.5 * self.between_subjects * s[4]).exp();
                state.operator.tau_e_s = (delay / ts).round().max(1.0) * ts;
            }
            scenario.remnant.order = self.remnant_order;
            scenario.remnant.strength = RemnantStrength::Level {
                level: (self.noise_level * factor(5)).min(0.9),
                definition: NoiseDefinition::Response,
            };
            scenario.name = format!("S{subject} {condition} {run}");
            let run_seed = RunSeed {
                seed: self.seed,
                cell: subject * 1000 + cell,
                replication: run,
            };
            match Simulator::new(&scenario).and_then(|simulator| simulator.run(run_seed, false)) {
                Ok(record) => return Ok((scenario, record)),
                Err(error) => reason = error.to_string(),
            }
        }
        Err(StudyError::Virtual {
            reason: format!(
                "subject {subject} has no stable loop in {condition} after {MAX_DRAWS} draws ({reason}): use smaller \
                 spreads"
            ),
        })
    }

    /// Returns normal deviates for the defects of a run, one per sample.
    fn sampling_noise(&self, subject: u64, cell: u64, run: u64, samples: usize) -> Vec<f64> {
        RunSeed {
            seed: self.seed,
            cell: SUBJECT_STREAM_CELL / 2 - subject * 1000 - cell,
            replication: run,
        }
        .white_noise(samples)
    }
}

fn truth_schema() -> TableSchema {
    let real = |name: String| ColumnSchema {
        name,
        kind: ColumnKind::Real,
    };
    let text = |name: &str| ColumnSchema {
        name: name.to_owned(),
        kind: ColumnKind::Text,
    };
    let mut columns = vec![text("subject"), text("condition"), text("run")];
    for when in ["initial", "last"] {
        columns.extend(OPERATOR_PARAMETERS.iter().map(|name| real(format!("{name}_{when}"))));
    }
    columns.extend(["tau_e", "noise_level"].map(|name| real(name.to_owned())));
    TableSchema {
        comments: Vec::new(),
        columns,
    }
}

fn write_truth_row(rows: &mut Rows, subject: u64, condition: Condition, run: u64, scenario: &Scenario) {
    rows.start_row();
    rows.set_text("subject", &format!("S{subject}"));
    rows.set_text("condition", &condition.to_string());
    rows.set_text("run", &run.to_string());
    for (state, when) in [(&scenario.initial, "initial"), (&scenario.last, "last")] {
        for (name, _, estimate) in &OperatorEstimate::from(state.operator).rows()[..5] {
            rows.set_real(&format!("{name}_{when}"), estimate.value);
        }
    }
    rows.set_real("tau_e", scenario.initial.operator.tau_e_s);
    if let RemnantStrength::Level { level, .. } = scenario.remnant.strength {
        rows.set_real("noise_level", level);
    }
}
