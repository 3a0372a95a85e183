//! A virtual experiment: subjects, conditions and runs of simulated people, with the truth beside the files.
//!
//! The gain K_e, the lead T_L, omega_nm, zeta_nm and the noise level of subject s are those of the condition times `exp(a z)`, z a normal deviate of the subject, a the
//! spread between subjects (0.15 is 15 %); in each run each of them is multiplied by `exp(b z)` again, b the spread between runs. The delay differs by whole
//! samples. A loop that would be unstable is drawn again, from the next deviates. Deviates come from the random stream (seed, subject, run),
//! remnants from the streams that `hoid simulate` uses.

use std::path::Path;

use hoid_io::{ColumnKind, ColumnSchema, ColumnValues, OutputColumn, OutputTable, TableSchema};
use hoid_model::{
    Record,
    remnant_gain::NoiseDefinition,
    scenario::{Condition, RemnantStrength, Scenario},
    uncertainty::OperatorEstimate,
};
use hoid_sim::{RunSeed, Simulator};

use super::{
    MANIFEST,
    manifest::{Analysis, ConditionFacts, Manifest, Reading, RunEntry},
    preparing::Preparing,
};
use crate::{
    StudyError,
    columns::{OPERATOR, Rows},
};

/// What is to be simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct VirtualExperiment {
    /// Number of subjects.
    pub subjects: u64,
    /// Conditions.
    pub conditions: Vec<Condition>,
    /// Runs of each subject and condition.
    pub runs: u64,
    /// Spread of the parameters between subjects.
    pub between_subjects: f64,
    /// Spread of the parameters between the runs of a subject.
    pub between_runs: f64,
    /// Order of the remnant.
    pub remnant_order: usize,
    /// Noise level before it is spread.
    pub noise_level: f64,
    /// Seed of all random streams.
    pub seed: u64,
    /// What is wrong with the sampling.
    pub trouble: Vec<Trouble>,
}

/// Sampling trouble, as recorded data have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trouble {
    /// Times that scatter by a fifth of a sample.
    Jitter,
    /// One row of two hundred is missing.
    Missing,
    /// One row of two hundred is there twice.
    Repeated,
    /// A clock that runs slow by 0.2 %.
    SlowClock,
    /// A stick that goes no further than one and a half standard deviations of u.
    Saturated,
    /// A stick with 8 bits over its range.
    Quantised,
    /// A recorder that writes the same values for half a second, once.
    Stalled,
}

impl Trouble {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Jitter,
        Self::Missing,
        Self::Repeated,
        Self::SlowClock,
        Self::Saturated,
        Self::Quantised,
        Self::Stalled,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Jitter => "jitter",
            Self::Missing => "missing",
            Self::Repeated => "repeated",
            Self::SlowClock => "slow-clock",
            Self::Saturated => "saturated",
            Self::Quantised => "quantised",
            Self::Stalled => "stalled",
        }
    }
}

/// Streams of the people: no cell of a study has this number.
const PEOPLE: u64 = u64::MAX;
/// Draws after which a spread is too large for stable loops.
const MOST_DRAWS: usize = 100;

/// Simulates the experiment into a directory: a file a run, `truth.csv`, `group.toml`.
///
/// # Errors
/// [`StudyError::Virtual`] for an experiment without meaning, [`StudyError::ExperimentThere`], [`StudyError::Io`].
pub fn simulate_group(
    experiment: &VirtualExperiment,
    directory: &Path,
    each: &dyn Fn(),
) -> Result<Manifest, StudyError> {
    experiment.check()?;
    if directory.join(MANIFEST).exists() {
        return Err(StudyError::ExperimentThere {
            directory: directory.display().to_string(),
        });
    }
    hoid_io::make_directory(directory)?;
    let mut runs = Vec::new();
    let mut truth = Rows::new(&truth_schema());
    for subject in 1..=experiment.subjects {
        for (cell, condition) in experiment.conditions.iter().enumerate() {
            for run in 1..=experiment.runs {
                let (scenario, record) = experiment.run(subject, cell as u64, *condition, run)?;
                let file = format!("S{subject}_{condition}_{run}.csv");
                let table = experiment.troubled(&record, subject, cell as u64, run);
                hoid_io::write_table(&directory.join(&file), &table)?;
                truth_row(&mut truth, subject, *condition, run, &scenario);
                runs.push(RunEntry {
                    then: None,
                    file: file.into(),
                    subject: format!("S{subject}"),
                    condition: condition.to_string(),
                    run: run.to_string(),
                    counts: true,
                });
                each();
            }
        }
    }
    hoid_io::write_table(&directory.join("truth.csv"), &truth.into_table(Vec::new()))?;
    let facts = |condition: &Condition| {
        let scenario = Scenario::condition(*condition);
        let change_s = scenario.schedule.change_s();
        let element = scenario.initial.controlled_element;
        let facts = ConditionFacts {
            // What is controlled in the whole run.
            controlled_element: change_s
                .is_none()
                .then(|| format!("{}/1,{},0", element.k_c, element.omega_b_rad_s)),
            excitation: Some("f_t".to_owned()),
            change_s,
            ..ConditionFacts::default()
        };
        (condition.to_string(), facts)
    };
    let uneven = [Trouble::Jitter, Trouble::Missing, Trouble::Repeated]
        .iter()
        .any(|t| experiment.trouble.contains(t));
    let manifest = Manifest {
        name: "virtual-experiment".to_owned(),
        read: Reading {
            resample: uneven,
            ..Reading::default()
        },
        prepare: Preparing::default(),
        analysis: Analysis {
            windows_s: Some([(0.0, 30.72), (51.2, 81.91)]),
            ..Analysis::default()
        },
        conditions: experiment.conditions.iter().map(facts).collect(),
        runs,
    };
    let text = manifest.text();
    hoid_io::write_atomically(&directory.join(MANIFEST), |file| file.write_all(text.as_bytes()))?;
    Ok(manifest)
}

impl VirtualExperiment {
    fn check(&self) -> Result<(), StudyError> {
        let bad = |reason: String| Err(StudyError::Virtual { reason });
        if self.subjects == 0 || self.runs == 0 || self.conditions.is_empty() {
            return bad("there are no subjects, runs or conditions, expected at least one of each".to_owned());
        }
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

    /// The person of a run, and the run.
    fn run(&self, subject: u64, cell: u64, condition: Condition, run: u64) -> Result<(Scenario, Record), StudyError> {
        let deviates = |replication: u64| {
            let run_seed = RunSeed {
                seed: self.seed,
                cell: PEOPLE - subject,
                replication,
            };
            run_seed.white_noise(6 * MOST_DRAWS)
        };
        let of_subject = deviates(0);
        let of_run = deviates(1 + cell * 1_000_000 + run);
        let mut reason = String::new();
        for draw in 0..MOST_DRAWS {
            // The subject is drawn again when no run of his can be stable, the run before that.
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
                "subject {subject} has no stable loop in {condition} after {MOST_DRAWS} draws ({reason}): take smaller spreads"
            ),
        })
    }

    /// The columns of a run as a recorder with troubles would have written them.
    fn troubled(&self, record: &Record, subject: u64, cell: u64, run: u64) -> OutputTable {
        let has = |trouble: Trouble| self.trouble.contains(&trouble);
        let n = record.len();
        let noise = RunSeed {
            seed: self.seed,
            cell: PEOPLE / 2 - subject * 1000 - cell,
            replication: run,
        }
        .white_noise(n);
        let ts = record.sample_time().s();
        let mut t = record.times_s();
        if has(Trouble::SlowClock) {
            t.iter_mut().for_each(|t| *t *= 0.998);
        }
        if has(Trouble::Jitter) {
            // Less than half a sample, so that the order stays.
            t.iter_mut()
                .zip(&noise)
                .for_each(|(t, z)| *t += (0.2 * z).clamp(-0.45, 0.45) * ts);
        }
        let mut u = record.output().to_vec();
        let sd = (u.iter().map(|u| u * u).sum::<f64>() / n as f64).sqrt();
        if has(Trouble::Saturated) {
            u.iter_mut().for_each(|u| *u = u.clamp(-1.5 * sd, 1.5 * sd));
        }
        if has(Trouble::Quantised) {
            let step = 8.0 * sd / 256.0;
            u.iter_mut().for_each(|u| *u = (*u / step).round() * step);
        }
        // Where the values of each row come from; the times go on.
        let held = |k: usize| {
            let stall = n / 3..n / 3 + (0.5 / ts) as usize;
            if has(Trouble::Stalled) && stall.contains(&k) {
                stall.start
            } else {
                k
            }
        };
        let mut rows: Vec<usize> = (0..n).collect();
        // One in two hundred by a deviate that is anyhow drawn.
        let rare = |k: usize| (noise[k] * 1e6).abs() as u64 % 200;
        if has(Trouble::Missing) {
            rows.retain(|k| *k == 0 || rare(*k) != 0);
        }
        if has(Trouble::Repeated) {
            rows = rows
                .into_iter()
                .flat_map(|k| std::iter::repeat_n(k, if rare(k) == 1 { 2 } else { 1 }))
                .collect();
        }
        let column = |name: &str, values: &[f64]| OutputColumn {
            name: name.to_owned(),
            values: ColumnValues::Real(
                rows.iter()
                    .map(|k| values[if name == "t" { *k } else { held(*k) }])
                    .collect(),
            ),
        };
        OutputTable {
            comments: self
                .trouble
                .iter()
                .map(|trouble| format!("trouble: {}", trouble.name()))
                .collect(),
            columns: vec![
                column("t", &t),
                column("f_t", record.channel("f_t").unwrap_or_default()),
                column("e", record.input()),
                column("u", &u),
                column("x", record.channel("x").unwrap_or_default()),
            ],
        }
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
        columns.extend(OPERATOR.iter().map(|name| real(format!("{name}_{when}"))));
    }
    columns.extend(["tau_e", "noise_level"].map(|name| real(name.to_owned())));
    TableSchema {
        comments: Vec::new(),
        columns,
    }
}

fn truth_row(rows: &mut Rows, subject: u64, condition: Condition, run: u64, scenario: &Scenario) {
    rows.begin();
    rows.text("subject", &format!("S{subject}"));
    rows.text("condition", &condition.to_string());
    rows.text("run", &run.to_string());
    for (state, when) in [(&scenario.initial, "initial"), (&scenario.last, "last")] {
        for (name, _, estimate) in &OperatorEstimate::from(state.operator).rows()[..5] {
            rows.real(&format!("{name}_{when}"), estimate.value);
        }
    }
    rows.real("tau_e", scenario.initial.operator.tau_e_s);
    if let RemnantStrength::Level { level, .. } = scenario.remnant.strength {
        rows.real("noise_level", level);
    }
}
