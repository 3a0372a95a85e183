//! `pyhoid.study` and `pyhoid.reproduce`: plans, shards, merged tables.

use std::{ffi::CString, path::PathBuf};

use hoid_study::{NamedPlan, Outcome as StudyOutcome, Plan, RunOptions, StudyError, merge, run};
use hoid_thesis::plans::{find as find_plan, named_plans};
use hoid_thesis::reproduction::{Reproduction, ReproductionEvent, reproduce as reproduce_into};
use pyo3::{exceptions::PyUserWarning, prelude::*, types::PyDict};

use crate::{
    errors::{Outcome, bad_option},
    interrupt,
};

/// Whether the study is finished, the number of estimates made, and the paths of the tables.
type OutcomeParts = (bool, u64, Vec<PathBuf>);

fn outcome_parts(py: Python<'_>, outcome: StudyOutcome) -> Outcome<OutcomeParts> {
    warn(py, &outcome.notes)?;
    Ok((outcome.finished, outcome.estimates, outcome.tables))
}

/// Issues notes as Python warnings.
pub fn warn(py: Python<'_>, notes: &[String]) -> PyResult<()> {
    for note in notes {
        let text = CString::new(note.replace('\0', " "))?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
    }
    Ok(())
}

/// A plan of Monte Carlo runs.
///
/// Examples
/// --------
/// >>> pyhoid.Plan(name="bias", replications=10).estimates
#[pyclass(name = "Plan", module = "pyhoid._pyhoid", frozen)]
pub struct PyPlan {
    plan: Plan,
}

#[pymethods]
impl PyPlan {
    /// Creates a plan from a file, from text, or from the name of a plan included with hoid.
    #[new]
    #[pyo3(signature = (*, path=None, text=None, name=None, replications=None))]
    fn new(path: Option<PathBuf>, text: Option<&str>, name: Option<&str>, replications: Option<u64>) -> Outcome<Self> {
        let mut plan = match (path, text, name) {
            (Some(path), None, None) => Plan::read(&path)?,
            (None, Some(text), None) => Plan::parse(text, "(text)")?,
            (None, None, Some(name)) => match find_plan(name) {
                Some(named) => named.plan()?,
                None => {
                    let known: Vec<&str> = named_plans().map(|p| p.name).collect();
                    return Err(bad_option(format!(
                        "no file or plan is named {name}; the plans are {}",
                        known.join(", ")
                    )));
                }
            },
            _ => return Err(bad_option("give one of path, text and name")),
        };
        if let Some(replications) = replications {
            plan = plan.with_replications(replications)?;
        }
        Ok(Self { plan })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.plan.name
    }

    #[getter]
    fn title(&self) -> &str {
        &self.plan.title
    }

    #[getter]
    fn description(&self) -> &str {
        &self.plan.description
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.plan.seed
    }

    #[getter]
    fn replications(&self) -> u64 {
        self.plan.replications
    }

    #[getter]
    fn estimates(&self) -> u64 {
        self.plan.estimate_count()
    }

    #[getter]
    fn text(&self) -> &str {
        self.plan.text()
    }

    #[getter]
    fn sha256(&self) -> String {
        self.plan.hash()
    }

    #[getter]
    fn estimators(&self) -> Vec<String> {
        self.plan.estimators.iter().map(|e| e.label.clone()).collect()
    }

    #[getter]
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let one = |cell: &hoid_study::plan::Cell| {
            let all = PyDict::new(py);
            all.set_item("cell", cell.index)?;
            all.set_item("scenario", &cell.scenario)?;
            all.set_item("condition", &cell.condition)?;
            all.set_item("replications", cell.replications)?;
            for axis in &cell.axes {
                all.set_item(&axis.key, axis.value.to_string())?;
            }
            Ok(all)
        };
        self.plan.cells.iter().map(one).collect()
    }

    fn __repr__(&self) -> String {
        let p = &self.plan;
        format!(
            "<pyhoid.Plan {}: {} cells, {} estimators, {} replications, {} estimates>",
            p.name,
            p.cells.len(),
            p.estimators.len(),
            p.replications,
            p.estimate_count()
        )
    }

    /// Runs the plan, or one shard of it, and writes the tables to a directory.
    #[pyo3(signature = (directory, *, shard, jobs, resume, csv, progress))]
    #[allow(clippy::too_many_arguments)]
    fn run(
        &self,
        py: Python<'_>,
        directory: PathBuf,
        shard: Option<String>,
        jobs: Option<usize>,
        resume: bool,
        csv: bool,
        progress: Option<Bound<'_, PyAny>>,
    ) -> Outcome<OutcomeParts> {
        let options = RunOptions {
            shard: shard.map(|s| s.parse()).transpose()?,
            jobs,
            resume,
            csv,
        };
        let plan = self.plan.clone();
        let total = plan.estimate_count();
        let outcome = interrupt::run(py, total, progress.as_ref(), true, move |standing| {
            run(&plan, &directory, &options, &|p| standing.set(p.done, p.total), &|| {
                standing.should_continue()
            })
        })?;
        outcome_parts(py, outcome)
    }
}

/// Returns the names and the titles of the plans included with hoid.
#[pyfunction]
pub fn plan_names() -> Outcome<Vec<(String, String)>> {
    let one = |named: &NamedPlan| -> Result<(String, String), StudyError> {
        Ok((named.name.to_owned(), named.plan()?.title))
    };
    Ok(named_plans().map(one).collect::<Result<_, _>>()?)
}

/// Merges the shards of a study.
#[pyfunction]
#[pyo3(signature = (shards, directory, csv))]
pub fn merge_shards(py: Python<'_>, shards: Vec<PathBuf>, directory: PathBuf, csv: bool) -> Outcome<OutcomeParts> {
    let outcome = py.detach(|| merge(&shards, &directory, csv))?;
    outcome_parts(py, outcome)
}

/// Path of the index page, number of tables and figures, and counts of the claims by outcome.
type ReproductionParts = (PathBuf, usize, Option<[usize; 5]>);

/// Reproduces the tables, figures and claims of the thesis; `None` after an interrupt.
#[pyfunction]
#[pyo3(signature = (directory, *, only, replications, jobs, recordings, progress))]
pub fn reproduce(
    py: Python<'_>,
    directory: PathBuf,
    only: Vec<String>,
    replications: u64,
    jobs: Option<usize>,
    recordings: Option<PathBuf>,
    progress: Option<Bound<'_, PyAny>>,
) -> Outcome<Option<ReproductionParts>> {
    let wanted = Reproduction {
        only,
        replications,
        jobs,
        recordings,
    };
    let found = interrupt::run(py, 0, progress.as_ref(), true, move |standing| {
        let on_event = |event: ReproductionEvent<'_>| {
            if let ReproductionEvent::Progress(p) = event {
                standing.set(p.done, p.total);
            }
        };
        reproduce_into(&wanted, &directory, &on_event, &|| standing.should_continue())
    })?;
    Ok(found.map(|made| (made.index, made.items, made.verdict_counts)))
}
