//! A virtual experiment with people drawn from the family of operators.
//!
//! Each subject is a new person for each controlled element ([`hoid_sim::people`]), with parameters from published
//! ranges, a realistic remnant, and a stick with drift. The kinds of remnant alternate over the subjects. The files
//! have the columns t, e, u, d, y, as in recorded experiments. `truth.csv` contains the true parameters, crossover and
//! margin of each run. If T_I of a form with a lag is empty, it is infinite.

use std::path::Path;

use hoid_io::{ColumnKind, ColumnSchema, TableSchema};
use hoid_model::{Form, ModelError, SampleTime, operator_family::PARAMETERS};
use hoid_sim::{
    RunSeed, SimError,
    people::{Person, PersonRun, Plant, Population, RemnantKind, Task},
};

use super::{
    analysis_settings::AnalysisSettings, condition_settings::ConditionSettings, manifest::Manifest,
    sampling_defects::SamplingDefect, virtual_files::VirtualFiles, virtual_subjects::check_run_count,
};
use crate::{StudyError, columns::Rows};

/// A virtual experiment with people drawn from the family of operators.
#[derive(Debug, Clone, PartialEq)]
pub struct PeopleExperiment {
    /// Number of subjects.
    pub subjects: u64,
    /// Controlled elements; each is a condition.
    pub plants: Vec<Plant>,
    /// Form of the operators; `None` for the typical form for each controlled element.
    pub form: Option<Form>,
    /// Kinds of remnant, alternating over the subjects.
    pub remnants: Vec<RemnantKind>,
    /// Number of runs per subject and condition.
    pub runs: u64,
    /// Relative spread of the parameters between the runs of a subject.
    pub between_runs: f64,
    /// Population from which the people are drawn.
    pub population: Population,
    /// Sample time of the recordings.
    pub sample_time: SampleTime,
    /// Seed of all random streams.
    pub seed: u64,
    /// Sampling defects applied to the recordings.
    pub defects: Vec<SamplingDefect>,
}

impl Default for PeopleExperiment {
    /// Returns an experiment with three subjects, all controlled elements, all kinds of remnant and five runs each.
    fn default() -> Self {
        Self {
            subjects: 3,
            plants: Plant::ALL.to_vec(),
            form: None,
            remnants: RemnantKind::ALL.to_vec(),
            runs: 5,
            between_runs: 0.03,
            population: Population::default(),
            sample_time: SampleTime::AT_60_HZ,
            seed: 1,
            defects: Vec::new(),
        }
    }
}

/// Columns of a file, except t.
const FILE_COLUMNS: [&str; 4] = ["e", "u", "d", "y"];
/// Columns of `truth.csv` for true values other than the parameters, and for settings of the recording.
const OTHER_COLUMNS: [&str; 7] = [
    "crossover_rad_s",
    "phase_margin_deg",
    "remnant_share",
    "walk_per_root_s",
    "offset_e",
    "offset_u",
    "sample_time_s",
];
/// Cell number of the random streams for the defects; no person has this number.
const DEFECT_STREAM: u64 = u64::MAX / 2;

/// Simulates the experiment and writes its files to a directory: one file per run, `truth.csv`, and `group.toml`.
///
/// # Errors
/// [`StudyError::Virtual`] for an invalid experiment, [`StudyError::ExperimentThere`] if the directory already contains
/// one, [`StudyError::Io`] if a file cannot be written.
pub fn simulate_people(
    experiment: &PeopleExperiment,
    directory: &Path,
    each: &dyn Fn(),
) -> Result<Manifest, StudyError> {
    experiment.check()?;
    VirtualFiles::check_no_experiment(directory)?;
    // All people are drawn before any file is written.
    let mut people = Vec::new();
    for subject in 1..=experiment.subjects {
        for (place, plant) in (0..).zip(&experiment.plants) {
            people.push((subject, experiment.draw_person(subject, place, *plant)?));
        }
    }
    let mut files = VirtualFiles::new(directory, &FILE_COLUMNS, &experiment.defects)?;
    let mut truth = Rows::new(&truth_schema());
    for (subject, person) in &people {
        for run in 1..=experiment.runs {
            let found = person.run(run).map_err(|error| virtual_error(&error))?;
            let noise = RunSeed {
                cell: DEFECT_STREAM - person.run_seed(run).cell,
                ..person.run_seed(run)
            }
            .white_noise(found.record.len());
            files.write_run((*subject, person.plant.to_string(), run), &found.record, &noise)?;
            write_truth_row(&mut truth, *subject, run, person, &found)?;
            each();
        }
    }
    let settings = |plant: &Plant| {
        let settings = ConditionSettings {
            controlled_element: Some(plant.text().to_owned()),
            excitation: Some("d".to_owned()),
            period_s: Some(plant.disturbance().period_s),
            ..ConditionSettings::default()
        };
        (plant.to_string(), settings)
    };
    let analysis = AnalysisSettings {
        // Realistic remnants are not first-order lags, so several orders are tried.
        nd: (1, 6),
        ..AnalysisSettings::default()
    };
    files.finish(
        "virtual-people",
        truth,
        analysis,
        experiment.plants.iter().map(settings),
    )
}

impl PeopleExperiment {
    fn check(&self) -> Result<(), StudyError> {
        let bad = |reason: String| Err(StudyError::Virtual { reason });
        let least = [
            self.subjects,
            self.runs,
            self.plants.len() as u64,
            self.remnants.len() as u64,
        ];
        if least.contains(&0) {
            return bad("there are no subjects, runs, plants or remnants, expected at least one of each".to_owned());
        }
        check_run_count(&[self.subjects, self.runs, self.plants.len() as u64])?;
        for (i, plant) in self.plants.iter().enumerate() {
            if self.plants[..i].contains(plant) {
                return bad(format!("the plant {plant} is named twice; name each once"));
            }
        }
        if !(0.0..=1.0).contains(&self.between_runs) {
            return bad(format!(
                "the spread between runs is {}, expected 0 to 1",
                self.between_runs
            ));
        }
        Ok(())
    }

    fn draw_person(&self, subject: u64, place: u64, plant: Plant) -> Result<Person, StudyError> {
        let task = Task {
            sample_time: self.sample_time,
            spread_between_runs: self.between_runs,
            ..Task::default()
        };
        let kind = self.remnants[(subject - 1) as usize % self.remnants.len()];
        let number = subject * 1000 + place;
        Person::draw(&self.population, &task, plant, self.form, kind, self.seed, number)
            .map_err(|error| virtual_error(&error))
    }
}

fn virtual_error(error: &SimError) -> StudyError {
    StudyError::Virtual {
        reason: error.to_string(),
    }
}

fn truth_schema() -> TableSchema {
    let of = |kind: ColumnKind, names: &[&str]| -> Vec<ColumnSchema> {
        let column = |name: &&str| ColumnSchema {
            name: (*name).to_owned(),
            kind,
        };
        names.iter().map(column).collect()
    };
    let texts = ["subject", "condition", "run", "form", "remnant"];
    TableSchema {
        comments: Vec::new(),
        columns: [
            of(ColumnKind::Text, &texts),
            of(ColumnKind::Real, &PARAMETERS.map(|(name, _)| name)),
            of(ColumnKind::Real, &OTHER_COLUMNS),
        ]
        .concat(),
    }
}

fn write_truth_row(
    rows: &mut Rows,
    subject: u64,
    run: u64,
    person: &Person,
    found: &PersonRun,
) -> Result<(), StudyError> {
    let wrong = |error: ModelError| virtual_error(&SimError::Model(error));
    rows.start_row();
    rows.set_text("subject", &format!("S{subject}"));
    rows.set_text("condition", &person.plant.to_string());
    rows.set_text("run", &run.to_string());
    rows.set_text("form", &found.state.operator.form().to_string());
    rows.set_text("remnant", &person.kind.to_string());
    for parameter in found.state.operator.named_parameters() {
        if parameter.value.is_finite() {
            rows.set_real(parameter.name, parameter.value);
        }
    }
    let margins = found.state.margins().map_err(wrong)?;
    for (name, value) in [
        ("crossover_rad_s", margins.crossover_rad_s),
        ("phase_margin_deg", margins.phase_margin_deg),
        ("remnant_share", Some(person.remnant_share)),
        ("walk_per_root_s", Some(person.stick.walk_per_root_s)),
        ("offset_e", Some(person.stick.offset_e)),
        ("offset_u", Some(person.stick.offset_u)),
        ("sample_time_s", Some(found.record.sample_time().s())),
    ] {
        if let Some(value) = value {
            rows.set_real(name, value);
        }
    }
    Ok(())
}
