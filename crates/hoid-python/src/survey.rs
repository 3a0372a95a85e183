//! `pyhoid.info`: contents of a file, as reported by `hoid info --json`.

use std::path::PathBuf;

use hoid_analysis::{Advice, ExaminationOptions, FileExamination, Role};
use hoid_io::{ColumnSurvey, QualityIssue, SamplingSurvey, ValueSurvey};
use pyo3::{prelude::*, types::PyDict};

use crate::errors::Outcome;

#[pyfunction]
#[pyo3(signature = (path, *, input, output, excitation, controlled_element, time, trial, sampling_frequency))]
#[allow(clippy::too_many_arguments)]
pub fn info<'py>(
    py: Python<'py>,
    path: PathBuf,
    input: Option<String>,
    output: Option<String>,
    excitation: Option<String>,
    controlled_element: Option<String>,
    time: Option<&str>,
    trial: Option<&str>,
    sampling_frequency: Option<f64>,
) -> Outcome<Bound<'py, PyDict>> {
    let controlled_element = match controlled_element {
        Some(text) => {
            let element = text.parse()?;
            Some((text, element))
        }
        None => None,
    };
    let known = ExaminationOptions {
        input,
        output,
        excitation,
        controlled_element,
        time: time.map(str::parse).transpose()?,
        trial: trial.map(str::parse).transpose()?,
        sampling_hz: sampling_frequency,
        ..ExaminationOptions::default()
    };
    let look = py.detach(|| FileExamination::at(&path, &known))?;
    let found = &look.survey;
    let all = PyDict::new(py);
    all.set_item("format", found.format)?;
    all.set_item("samplings", to_dicts(&found.samplings, |s| sampling(py, s))?)?;
    all.set_item("columns", to_dicts(&found.columns, |c| column(py, c))?)?;
    all.set_item(
        "trouble",
        to_dicts(&found.quality_issues, |issue| quality_issue(py, issue))?,
    )?;
    all.set_item("notes", &found.notes)?;
    all.set_item("look", layout_to_dict(py, &look)?)?;
    Ok(all)
}

/// Returns the layout of the file, and the keywords with which to read it.
fn layout_to_dict<'py>(py: Python<'py>, look: &FileExamination) -> PyResult<Bound<'py, PyDict>> {
    let role = |role: &Role| -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        all.set_item("column", &role.column)?;
        all.set_item("why", &role.reason)?;
        all.set_item("certain", role.is_certain)?;
        Ok(all)
    };
    let all = PyDict::new(py);
    all.set_item("input", role(&look.roles.input)?)?;
    all.set_item("output", role(&look.roles.output)?)?;
    let units = PyDict::new(py);
    for (column, unit) in look.units() {
        units.set_item(column, unit)?;
    }
    all.set_item("units", units)?;
    let seen = look.summary.as_ref().ok();
    let excitation = seen.map(|seen| -> PyResult<_> {
        let all = PyDict::new(py);
        match &seen.periods {
            Ok(found) => {
                all.set_item("column", &found.channel)?;
                all.set_item("why", &found.description)?;
                all.set_item("period_s", found.period_s)?;
                all.set_item("from_s", found.span_s.0)?;
                all.set_item("to_s", found.span_s.1)?;
                all.set_item("lines_rad_s", found.excitation.omega_rad_s())?;
            }
            Err(reason) => {
                all.set_item("column", None::<String>)?;
                all.set_item("why", reason)?;
            }
        }
        Ok(all)
    });
    all.set_item("excitation", excitation.transpose()?)?;
    let lateness = seen.and_then(|seen| seen.lag.as_ref()).map(|lag| -> PyResult<_> {
        let all = PyDict::new(py);
        let lag = lag.as_ref();
        all.set_item("samples", lag.ok().map(|lag| lag.samples))?;
        all.set_item("seconds", lag.ok().map(|lag| lag.seconds))?;
        all.set_item("why", lag.map_or_else(String::as_str, |lag| lag.evidence.as_str()))?;
        Ok(all)
    });
    all.set_item("lateness", lateness.transpose()?)?;
    all.set_item("no_record", look.summary.as_ref().err().map(ToString::to_string))?;
    let advice = look.advice().map(|advice| keywords(py, &advice));
    all.set_item("read", advice.transpose()?)?;
    Ok(all)
}

/// Converts advice to keywords of `pyhoid.read`.
fn keywords<'py>(py: Python<'py>, advice: &Advice) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    for (name, column) in [("input", &advice.input), ("output", &advice.output)] {
        if let Some(column) = column {
            all.set_item(name, column)?;
        }
    }
    let texts = [
        ("time", advice.time.as_ref().map(ToString::to_string)),
        ("trial", advice.trial.as_ref().map(ToString::to_string)),
    ];
    for (name, text) in texts {
        if let Some(text) = text {
            all.set_item(name, text)?;
        }
    }
    let numbers = [
        ("sampling_frequency", advice.sampling_hz),
        ("start", advice.from_s),
        ("stop", advice.to_s),
    ];
    for (name, number) in numbers {
        if let Some(number) = number {
            all.set_item(name, number)?;
        }
    }
    if let Some(samples) = advice.late_samples {
        let offset = PyDict::new(py);
        offset.set_item("u", samples)?;
        all.set_item("offset", offset)?;
    }
    Ok(all)
}

fn to_dicts<'py, T>(
    items: &[T],
    one: impl Fn(&T) -> PyResult<Bound<'py, PyDict>>,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
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
    let places = t.row_spans.iter().map(|p| (p.row, p.rows, p.from_s, p.to_s));
    all.set_item("places", places.collect::<Vec<_>>())?;
    Ok(all)
}
