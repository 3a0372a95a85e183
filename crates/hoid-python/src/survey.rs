//! `pyhoid.info`: what is in a file, as `hoid info --json` tells it.

use std::path::PathBuf;

use hoid_io::{ColumnSurvey, FileSurvey, QualityIssue, SamplingSurvey, ValueSurvey, survey};
use pyo3::{prelude::*, types::PyDict};

use crate::errors::Outcome;

#[pyfunction]
#[pyo3(signature = (path))]
pub fn info<'py>(py: Python<'py>, path: PathBuf) -> Outcome<Bound<'py, PyDict>> {
    let found: FileSurvey = py.detach(|| survey(&path))?;
    let all = PyDict::new(py);
    all.set_item("format", found.format)?;
    all.set_item("samplings", each(&found.samplings, |s| sampling(py, s))?)?;
    all.set_item("columns", each(&found.columns, |c| column(py, c))?)?;
    all.set_item(
        "trouble",
        each(&found.quality_issues, |issue| quality_issue(py, issue))?,
    )?;
    all.set_item("notes", found.notes)?;
    Ok(all)
}

fn each<'py, T>(items: &[T], one: impl Fn(&T) -> PyResult<Bound<'py, PyDict>>) -> PyResult<Vec<Bound<'py, PyDict>>> {
    items.iter().map(one).collect()
}

fn sampling<'py>(py: Python<'py>, s: &SamplingSurvey) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    all.set_item("path", &s.path)?;
    all.set_item("rows", s.rows)?;
    all.set_item("first_s", s.span_s.0)?;
    all.set_item("last_s", s.span_s.1)?;
    all.set_item("sample_time", s.sample_time_s)?;
    all.set_item("jitter_s", s.jitter_s)?;
    all.set_item("gaps", s.gaps)?;
    all.set_item("missing", s.missing)?;
    all.set_item("first_gap_s", s.first_gap_s)?;
    all.set_item("not_increasing", s.not_increasing)?;
    all.set_item("repeated", s.repeated)?;
    Ok(all)
}

fn column<'py>(py: Python<'py>, c: &ColumnSurvey) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    all.set_item("path", &c.path)?;
    all.set_item("unit", &c.unit)?;
    all.set_item("type", &c.kind)?;
    all.set_item("rows", c.rows)?;
    all.set_item("values", c.values.as_ref().map(|v| values(py, v)).transpose()?)?;
    Ok(all)
}

fn values<'py>(py: Python<'py>, v: &ValueSurvey) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    all.set_item("missing", v.missing)?;
    all.set_item("min", v.min)?;
    all.set_item("max", v.max)?;
    all.set_item("mean", v.mean)?;
    all.set_item("deviation", v.deviation)?;
    all.set_item("constant", v.constant)?;
    all.set_item("quantum", v.quantum)?;
    all.set_item("saturated_low", v.saturated_low)?;
    all.set_item("saturated_high", v.saturated_high)?;
    all.set_item("sketch", &v.sketch)?;
    Ok(all)
}

fn quality_issue<'py>(py: Python<'py>, t: &QualityIssue) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    all.set_item("kind", t.kind.name())?;
    all.set_item("channel", &t.channel)?;
    all.set_item("rows", t.rows)?;
    all.set_item("share", t.share)?;
    all.set_item("size", t.size)?;
    all.set_item("unit", &t.unit)?;
    all.set_item("text", &t.text)?;
    all.set_item("remedy", t.kind.remedy())?;
    let places = t.places.iter().map(|p| (p.row, p.rows, p.from_s, p.to_s));
    all.set_item("places", places.collect::<Vec<_>>())?;
    Ok(all)
}
