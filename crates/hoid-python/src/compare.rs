//! `pyhoid.compare`: differences between conditions and people; the package reads the JSON of the result.

use std::path::{Path, PathBuf};

use hoid_design::compare::{
    Adjustment, CompareError, Comparison, ComparisonOptions, Covariate, GroupEstimates, Variation, Weights,
};
use hoid_report::comparison_figure;
use hoid_study::{
    Progress, RunOptions,
    group::{Manifest, run_group},
};
use pyo3::prelude::*;

use crate::{errors::Outcome, interrupt, names};

/// Compares results of a group, or recordings that are first analysed in `directory`, and returns the comparison as
/// JSON.
#[pyfunction]
#[pyo3(signature = (results, *, factors, variation, of, covariate, adjust, weights, directory, jobs, progress))]
#[allow(clippy::too_many_arguments)]
pub fn compare(
    py: Python<'_>,
    results: PathBuf,
    factors: Vec<String>,
    variation: Option<&str>,
    of: Vec<String>,
    covariate: Option<&str>,
    adjust: &str,
    weights: &str,
    directory: PathBuf,
    jobs: Option<usize>,
    progress: Option<Bound<'_, PyAny>>,
) -> Outcome<String> {
    let comparing = ComparisonOptions {
        factors: factors.iter().map(|text| text.parse()).collect::<Result<_, _>>()?,
        variation: variation
            .map(|name| names::choice::<Variation>("variation", name))
            .transpose()?,
        quantities: of.iter().map(|text| text.parse()).collect::<Result<_, _>>()?,
        covariate: covariate
            .map(|name| names::choice::<Covariate>("covariate", name))
            .transpose()?,
        adjustment: names::choice::<Adjustment>("adjust", adjust)?,
        weights: names::choice::<Weights>("weights", weights)?,
    };
    let Some(path) = GroupEstimates::recordings_path(&results) else {
        return Ok(py.detach(|| comparing.run(&GroupEstimates::read(&results)?))?.to_json());
    };
    let manifest = Manifest::read(&path)?;
    let runs = manifest.runs.iter().filter(|run| run.counts).count() as u64;
    let base = path.parent().map_or_else(|| PathBuf::from("."), Path::to_path_buf);
    // Runs that were already analysed in the directory for another comparison are reused.
    let options = RunOptions {
        jobs,
        resume: true,
        ..RunOptions::default()
    };
    interrupt::run(py, runs, progress.as_ref(), true, move |status| {
        let estimates = comparing.estimates_of(&manifest, &directory, |manifest, place| {
            let on_progress = |p: Progress| status.set(p.done, p.total);
            run_group(manifest, &base, place, &options, &on_progress, &|| {
                status.should_continue()
            })
            .map(|_| ())
            .map_err(CompareError::from)
        })?;
        Ok::<_, CompareError>(comparing.run(&estimates)?.to_json())
    })
}

/// Checks the JSON of a comparison and returns its figure as SVG.
#[pyfunction]
pub fn comparison_figure_of(text: &str) -> Outcome<String> {
    Ok(comparison_figure(&Comparison::from_json(text)?))
}
