//! `pyhoid.group` and `pyhoid.simulate_group`: recorded runs by subject and condition, and virtual
//! experiments.

use std::path::{Path, PathBuf};

use hoid_model::{Form, SampleTime, scenario::Condition};
use hoid_report::{ReportError, write_group_pages};
use hoid_sim::people::{Plant, Population, Range, RemnantKind};
use hoid_study::{
    RunOptions,
    group::{
        Manifest, Pattern, PeopleExperiment, SamplingDefect, VirtualExperiment, run_group,
        simulate_group as simulate_into, simulate_people as people_into,
    },
};
use pyo3::prelude::*;

use crate::{errors::Outcome, interrupt, names};

/// Analyses the runs of a manifest and writes the tables and pages.
///
/// Returns whether the analysis was finished, and the number of estimates made.
#[pyfunction]
#[pyo3(signature = (manifest, directory, *, jobs, resume, csv, progress))]
pub fn group(
    py: Python<'_>,
    manifest: PathBuf,
    directory: PathBuf,
    jobs: Option<usize>,
    resume: bool,
    csv: bool,
    progress: Option<Bound<'_, PyAny>>,
) -> Outcome<(bool, u64)> {
    let found = Manifest::read(&manifest)?;
    let base = manifest.parent().map_or_else(|| PathBuf::from("."), Path::to_path_buf);
    let options = RunOptions {
        jobs,
        resume,
        csv,
        ..RunOptions::default()
    };
    let runs = found.runs.iter().filter(|run| run.counts).count() as u64;
    let outcome = interrupt::run(py, runs, progress.as_ref(), true, move |standing| {
        let outcome = run_group(
            &found,
            &base,
            &directory,
            &options,
            &|p| standing.set(p.done, p.total),
            &|| standing.should_continue(),
        )?;
        if outcome.finished {
            write_group_pages(&found, &manifest, &directory)?;
        }
        Ok::<_, ReportError>(outcome)
    })?;
    Ok((outcome.finished, outcome.estimates))
}

/// Returns the text of a manifest of the files whose names match a pattern, and the names of the other files in the
/// directory.
#[pyfunction]
#[pyo3(signature = (directory, pattern))]
pub fn group_manifest(directory: PathBuf, pattern: &str) -> Outcome<(String, Vec<String>)> {
    let (manifest, others) = Manifest::from_directory(&directory, &Pattern::new(pattern)?)?;
    Ok((manifest.text(), others))
}

/// Simulates runs of people drawn from the family of operators and writes them to a directory; returns the number of
/// runs.
#[pyfunction]
#[pyo3(signature = (directory, *, subjects, plants, form, remnants, remnant_share, sample_time, runs, between_runs, seed, trouble))]
#[allow(clippy::too_many_arguments)]
pub fn simulate_people(
    py: Python<'_>,
    directory: PathBuf,
    subjects: u64,
    plants: Vec<String>,
    form: Option<String>,
    remnants: Vec<String>,
    remnant_share: (f64, f64),
    sample_time: f64,
    runs: u64,
    between_runs: f64,
    seed: u64,
    trouble: Vec<String>,
) -> Outcome<usize> {
    let experiment = PeopleExperiment {
        subjects,
        plants: plants
            .iter()
            .map(|name| names::choice::<Plant>("plants", name))
            .collect::<Outcome<_>>()?,
        form: form.map(|name| names::choice::<Form>("form", &name)).transpose()?,
        remnants: remnants
            .iter()
            .map(|name| names::choice::<RemnantKind>("remnants", name))
            .collect::<Outcome<_>>()?,
        runs,
        between_runs,
        population: Population {
            remnant_share: Range::new(remnant_share.0, remnant_share.1),
            ..Population::default()
        },
        sample_time: SampleTime::new(sample_time)?,
        seed,
        defects: defects(&trouble)?,
    };
    let manifest = py.detach(|| people_into(&experiment, &directory, &|| ()))?;
    Ok(manifest.runs.len())
}

fn defects(trouble: &[String]) -> Outcome<Vec<SamplingDefect>> {
    let known = SamplingDefect::ALL.map(|trouble| (trouble.name(), trouble));
    trouble
        .iter()
        .map(|name| names::value_of_name("trouble", name, &known))
        .collect()
}

/// Simulates the runs of a virtual experiment and writes them to a directory; returns the number of runs.
#[pyfunction]
#[pyo3(signature = (directory, *, subjects, conditions, runs, between_subjects, between_runs, remnant_order, noise_level, seed, trouble))]
#[allow(clippy::too_many_arguments)]
pub fn simulate_group(
    py: Python<'_>,
    directory: PathBuf,
    subjects: u64,
    conditions: Vec<String>,
    runs: u64,
    between_subjects: f64,
    between_runs: f64,
    remnant_order: usize,
    noise_level: f64,
    seed: u64,
    trouble: Vec<String>,
) -> Outcome<usize> {
    let experiment = VirtualExperiment {
        subjects,
        conditions: conditions
            .iter()
            .map(|name| Ok(name.parse::<Condition>()?))
            .collect::<Outcome<_>>()?,
        runs,
        between_subjects,
        between_runs,
        remnant_order,
        noise_level,
        seed,
        defects: defects(&trouble)?,
    };
    let manifest = py.detach(|| simulate_into(&experiment, &directory, &|| ()))?;
    Ok(manifest.runs.len())
}
