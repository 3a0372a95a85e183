//! The same evaluation with recorded people.
//!
//! Trials of one person, each with 40 s after a ramp and sampled at 60 Hz, are joined. A trial on `1/s` joined to one
//! on `1/(s(s+1))`, or vice versa, gives a change in the plant and hence in the operator at 40 s; two trials on the
//! same plant give a seam without a change. The second trial has its own ramp as history ([`Seam`]), so no filter
//! jumps. Single trials contain no change. The true response is the average describing function of the person over
//! their other trials on that plant, at the seven lowest lines of the disturbance: `sum U conj(D) / sum E conj(D)` over
//! trials of two whole periods. The delay is not given. The control output of a row was read one sample before it was
//! written, so e(k) is aligned with u(k+1).
//!
//! The recordings are not part of the project.

use std::{collections::BTreeMap, f64::consts::TAU, path::Path};

use hoid_io::{ReadOptions, read_record};
use hoid_model::{Complex64, SampleTime};
use rayon::prelude::*;

use super::{
    draw::Portion,
    entrant::{Entrant, Seam, Task},
    measure::{ChangeOutcome, Line, evaluate_result, requested_times},
    run::{chosen_entrants, read_or_compute_lines, refusal},
};
use crate::ChallengeError;

/// Length of the ramp (s); `TRIAL_S` is the length of a trial after the ramp and `PERIOD_S` the period of the
/// disturbance.
const RAMP_S: f64 = 5.0;
const TRIAL_S: f64 = 40.0;
const PERIOD_S: f64 = 20.0;
/// Frequencies of the lines as multiples of 1/period.
const LINE_MULTIPLES: [f64; 7] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0];
const RATE_HZ: f64 = 60.0;
/// Start span of joined trials (s); `SINGLE_START_S` is the start span of single trials.
const START_S: (f64, f64) = (5.0, 30.0);
const SINGLE_START_S: (f64, f64) = (5.0, 20.0);

/// Evidence assigned to a change in the plant, which is known and therefore not computed.
const KNOWN_CHANGE_EVIDENCE: f64 = 1e9;

/// Options of the runs.
#[derive(Debug, Clone)]
pub struct PeopleOptions {
    /// Directory of the recordings.
    pub recordings: std::path::PathBuf,
    /// Directory of the results.
    pub directory: std::path::PathBuf,
    /// Maximum number of records of each kind for each person.
    pub runs: usize,
    /// Kinds `fo-so`, `so-fo`, `fo-fo`, `so-so`, `fo`, `so`; empty for all kinds.
    pub kinds: Vec<String>,
    /// Names of entrants; empty for all entrants.
    pub methods: Vec<String>,
    /// Part of the runs that is computed.
    pub portion: Portion,
}

/// A trial: e and u including the ramp, and products of their Fourier coefficients at the lines after the ramp.
struct Trial {
    e: Vec<f64>,
    u: Vec<f64>,
    /// Products `U conj(D)` and `E conj(D)` at each line.
    products: Vec<[Complex64; 2]>,
}

/// Trials by person and plant.
type TrialsByCell = BTreeMap<(String, String), Vec<Trial>>;

/// Computes the missing results and returns the lines of all selected runs.
///
/// # Errors
/// [`ChallengeError`] if recordings or results cannot be read or written, or a name is unknown.
pub fn challenge_people(options: &PeopleOptions, each: &(dyn Fn(&str) + Sync)) -> Result<Vec<Line>, ChallengeError> {
    let cells = read_all(&options.recordings)?;
    let (entrants, _) = chosen_entrants(&options.methods)?;
    let mut all = Vec::new();
    for (person, plant) in cells.keys() {
        let count = cells[&(person.clone(), plant.clone())].len();
        let other = if plant == "fo" { "so" } else { "fo" };
        let others = cells.get(&(person.clone(), other.to_owned())).map_or(0, Vec::len);
        for i in 0..count {
            if i < others {
                all.push(JoinedTrials::new(person, plant, i, Some((other, i))));
            }
            if i % 2 == 0 && i + 1 < count {
                all.push(JoinedTrials::new(person, plant, i, Some((plant, i + 1))));
            }
            all.push(JoinedTrials::new(person, plant, i, None));
        }
    }
    all.retain(|j| (options.kinds.is_empty() || options.kinds.contains(&j.kind())) && j.index_in_kind() < options.runs);
    let own: Vec<JoinedTrials> = (all.into_iter().enumerate())
        .filter(|(i, _)| options.portion.contains(*i))
        .map(|(_, joined)| joined)
        .collect();
    let lines: Vec<Vec<Line>> = own
        .into_par_iter()
        .map(|joined| {
            let folder = options
                .directory
                .join("people")
                .join(&joined.person)
                .join(joined.kind());
            let lines = read_or_compute_lines(&folder, joined.first.1 as u64, &entrants, false, &mut || {
                let posed = joined.evaluation_run(&cells)?;
                Ok(Box::new(move |entrant: Option<&dyn Entrant>| posed.line(entrant)))
            });
            each(&format!("{} {} {}", joined.person, joined.kind(), joined.first.1));
            lines
        })
        .collect::<Result<_, _>>()?;
    Ok(lines.concat())
}

fn read_all(directory: &Path) -> Result<TrialsByCell, ChallengeError> {
    let mut names = hoid_io::file_names(directory)?;
    names.sort();
    let mut cells = TrialsByCell::new();
    let options = ReadOptions {
        input: Some("r-y".parse().map_err(|e| refusal(format!("{e}")))?),
        ..ReadOptions::default()
    };
    for name in names.iter().filter(|name| name.ends_with("_d_only.csv")) {
        let mut parts = name.split('_');
        let (Some(person), Some(plant)) = (parts.next(), parts.next()) else {
            continue;
        };
        let record = read_record(&directory.join(name), &options)?.record;
        let own = Trial::new(record.input(), record.output(), record.channel("d")).ok_or_else(|| {
            refusal(format!(
                "{name} is not a trial of {} s with the column d",
                RAMP_S + TRIAL_S
            ))
        })?;
        cells
            .entry((person.to_owned(), plant.to_owned()))
            .or_default()
            .push(own);
    }
    if cells.is_empty() {
        return Err(refusal(format!(
            "{} holds no trials; expected PERSON_PLANT_NUMBER_d_only.csv",
            directory.display()
        )));
    }
    Ok(cells)
}

impl Trial {
    fn new(e: &[f64], u: &[f64], d: Option<&[f64]>) -> Option<Self> {
        let (ramp, end) = ((RAMP_S * RATE_HZ) as usize, ((RAMP_S + TRIAL_S) * RATE_HZ) as usize);
        if e.len() <= end {
            return None;
        }
        let (e, u, d) = (e[..end].to_vec(), u[1..=end].to_vec(), &d?[..end]);
        let products = LINE_MULTIPLES
            .iter()
            .map(|multiple| {
                let turn = |x: &[f64]| -> Complex64 {
                    let phase = -TAU * multiple / PERIOD_S / RATE_HZ;
                    let each = x[ramp..].iter().enumerate();
                    each.map(|(k, x)| Complex64::from_polar(*x, phase * k as f64)).sum()
                };
                let of_d = turn(d).conj();
                [turn(&u) * of_d, turn(&e) * of_d]
            })
            .collect();
        Some(Self { e, u, products })
    }
}

/// The trials of a joined record: plant and index of the first trial and, if there is one, of the second.
struct JoinedTrials {
    person: String,
    first: (String, usize),
    second: Option<(String, usize)>,
}

impl JoinedTrials {
    fn new(person: &str, plant: &str, i: usize, second: Option<(&str, usize)>) -> Self {
        Self {
            person: person.to_owned(),
            first: (plant.to_owned(), i),
            second: second.map(|(plant, i)| (plant.to_owned(), i)),
        }
    }

    fn kind(&self) -> String {
        match &self.second {
            Some((second, _)) => format!("{}-{second}", self.first.0),
            None => self.first.0.clone(),
        }
    }

    /// Returns the index of the record among the records of its kind.
    fn index_in_kind(&self) -> usize {
        match &self.second {
            Some((second, _)) if *second == self.first.0 => self.first.1 / 2,
            _ => self.first.1,
        }
    }

    fn evaluation_run(&self, cells: &TrialsByCell) -> Result<EvaluationRun, ChallengeError> {
        let sample_time = SampleTime::new(1.0 / RATE_HZ).map_err(|e| refusal(e.to_string()))?;
        let ramp = (RAMP_S * RATE_HZ) as usize;
        let cell = |plant: &str| &cells[&(self.person.clone(), plant.to_owned())];
        let of = |(plant, i): &(String, usize)| &cell(plant)[*i];
        let first = of(&self.first);
        let (mut e, mut u) = (first.e[ramp..].to_vec(), first.u[ramp..].to_vec());
        let seam = self.second.as_ref().map(|second| {
            let next = of(second);
            let at = e.len();
            e.extend_from_slice(&next.e[ramp..]);
            u.extend_from_slice(&next.u[ramp..]);
            Seam {
                at,
                e: next.e[..ramp].to_vec(),
                u: next.u[..ramp].to_vec(),
            }
        });
        // The average response of the person on a plant, without the trials in this record.
        let average = |plant: &str| -> Vec<Complex64> {
            let used: Vec<usize> = [Some(&self.first), self.second.as_ref()]
                .into_iter()
                .flatten()
                .filter(|(own, _)| own == plant)
                .map(|(_, i)| *i)
                .collect();
            let others = cell(plant).iter().enumerate().filter(|(i, _)| !used.contains(i));
            let mut sums = [[Complex64::from(0.0); 2]; LINE_MULTIPLES.len()];
            for (_, trial) in others {
                for (sum, own) in sums.iter_mut().zip(&trial.products) {
                    *sum = [sum[0] + own[0], sum[1] + own[1]];
                }
            }
            sums.iter().map(|[u, e]| u / e).collect()
        };
        let second = self.second.as_ref().unwrap_or(&self.first);
        let changes = self.second.as_ref().is_some_and(|second| second.0 != self.first.0);
        let start_s = if self.second.is_some() { START_S } else { SINGLE_START_S };
        let length_s = e.len() as f64 / RATE_HZ;
        // At a seam the response is requested at the same times as at a change.
        let at_s: &[f64] = if self.second.is_some() { &[TRIAL_S] } else { &[] };
        let (labels, asked_s): (Vec<String>, Vec<f64>) =
            requested_times(at_s, start_s.1, length_s, false).into_iter().unzip();
        let found = ChangeOutcome {
            at_s: TRIAL_S,
            evidence: [KNOWN_CHANGE_EVIDENCE; 2],
            after_s: None,
        };
        Ok(EvaluationRun {
            case: self.kind(),
            number: self.first.1 as u64,
            truths: [average(&self.first.0), average(&second.0)],
            changes: if changes { vec![found] } else { Vec::new() },
            labels,
            task: Task {
                sample_time,
                e,
                u,
                label: format!("{} {} {}", self.person, self.kind(), self.first.1),
                start_s,
                nk: None,
                lines_rad_s: LINE_MULTIPLES.map(|m| m * TAU / PERIOD_S).into(),
                asked_s,
                seam,
            },
        })
    }
}

/// A joined record with the task that it poses.
struct EvaluationRun {
    case: String,
    number: u64,
    task: Task,
    labels: Vec<String>,
    changes: Vec<ChangeOutcome>,
    /// True responses at the lines before and after the seam.
    truths: [Vec<Complex64>; 2],
}

impl EvaluationRun {
    fn line(&self, entrant: Option<&dyn Entrant>) -> Line {
        let truth = |omega: f64, t_s: f64| {
            let at = self
                .task
                .lines_rad_s
                .iter()
                .position(|line| *line == omega)
                .unwrap_or(0);
            self.truths[usize::from(t_s >= TRIAL_S && self.task.seam.is_some())][at]
        };
        let (name, answer) = match entrant {
            Some(entrant) => (entrant.name(), entrant.follow(&self.task)),
            None => (String::new(), Err("nobody".to_owned())),
        };
        let mut line = evaluate_result(&self.task, &self.labels, &truth, name, answer, &self.changes);
        (line.case, line.run) = (self.case.clone(), self.number);
        line.moments.iter_mut().for_each(|moment| moment.parameters.clear());
        line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The control of the trial is the error, delayed by one sample and multiplied by a gain: the describing function
    /// is this gain, and the sample is the shift of the recorder.
    #[test]
    fn describing_function_of_a_gain_is_the_gain() {
        let n = 2702;
        let sines = |k: usize, shift: f64| -> f64 {
            let t = (k as f64 - shift) / RATE_HZ;
            LINE_MULTIPLES.iter().map(|m| (m * TAU / PERIOD_S * t + m).sin()).sum()
        };
        let d: Vec<f64> = (0..n).map(|k| sines(k, 0.0)).collect();
        let e: Vec<f64> = (0..n).map(|k| 0.5 * sines(k, 7.0)).collect();
        let u: Vec<f64> = (0..n).map(|k| 1.5 * sines(k, 8.0)).collect();
        let trial = Trial::new(&e, &u, Some(&d)).unwrap();
        for [u, e] in trial.products {
            assert!((u / e - 3.0).norm() < 1e-9, "{}", u / e);
        }
        assert!(Trial::new(&e[..2000], &u[..2000], Some(&d)).is_none() && Trial::new(&e, &u, None).is_none());
    }
}
