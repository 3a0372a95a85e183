//! `pyhoid.read`, `pyhoid.read_segments`, `pyhoid.write` and tables of results.

use std::{collections::BTreeMap, path::PathBuf, str::FromStr};

use hoid_analysis::Reading;
use hoid_io::{ColumnExpression, ColumnValues, IoError, NewRate, Preparation, ReadOptions, Repair, Step, write_record};
use hoid_model::{Decimation, SampleTime};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{self, ChannelSelection, array, record_to_dict},
    errors::{Outcome, bad_option},
    names,
};

/// The parts of a record, the steps applied to the numbers of the file, and notes on reading it.
type ReadParts<'py> = (Bound<'py, PyDict>, Vec<String>, Vec<String>);

/// Reads the record of a file, or the records between its masked parts.
#[pyfunction]
#[pyo3(signature = (path, *, input, output, time, trial, all_trials, sampling_frequency, start, stop, resample, fill, sparse, columns, detrend, drop_repeated, unit, scale, offset, decimate,
    new_sampling_frequency, run_in, mask, shortest))]
#[allow(clippy::too_many_arguments)]
pub fn read<'py>(
    py: Python<'py>,
    path: PathBuf,
    input: Option<String>,
    output: &str,
    time: Option<&str>,
    trial: Option<&str>,
    all_trials: bool,
    sampling_frequency: Option<f64>,
    start: Option<f64>,
    stop: Option<f64>,
    resample: bool,
    fill: bool,
    sparse: BTreeMap<String, String>,
    columns: Option<Vec<String>>,
    detrend: &str,
    drop_repeated: bool,
    unit: BTreeMap<String, String>,
    scale: BTreeMap<String, String>,
    offset: BTreeMap<String, String>,
    decimate: Option<usize>,
    new_sampling_frequency: Option<f64>,
    run_in: f64,
    mask: Vec<String>,
    shortest: f64,
) -> Outcome<Vec<ReadParts<'py>>> {
    let options = ReadOptions {
        input: match input {
            Some(column) => Some(column.parse()?),
            None => None,
        },
        output: output.parse()?,
        trial: trial.map(str::parse).transpose()?,
        time: time.map(str::parse).transpose()?,
        sampling_hz: sampling_frequency,
        span_s: (start, stop),
        sparse: names::sparse_treatments(sparse)?,
        columns,
        repair: Repair { resample, fill },
    };
    let preparation = Preparation {
        units: unit,
        scale: parse_values(scale)?,
        offset: parse_values(offset)?,
        rate: match (decimate, new_sampling_frequency) {
            (Some(_), Some(_)) => return Err(bad_option("give decimate or new_sampling_frequency, not both")),
            (Some(factor), None) => NewRate::Decimated(factor),
            (None, Some(hz)) => NewRate::Hz(hz),
            (None, None) => NewRate::Kept,
        },
        run_in_s: run_in,
        detrend: names::detrend(detrend)?,
        drop_repeated,
    };
    let mask = mask
        .iter()
        .map(|name| names::quality_issue_kind(name))
        .collect::<Outcome<Vec<_>>>()?;
    let reading = Reading {
        options,
        preparation,
        mask,
        shortest_s: shortest,
    };
    let found = py.detach(|| {
        if all_trials {
            reading.read_segments(&path)
        } else {
            reading.single_record(&path).map(|read| vec![read])
        }
    })?;
    found
        .into_iter()
        .map(|read| {
            let steps = read.steps.iter().map(ToString::to_string).collect();
            let issues = read.quality_issues.iter().map(ToString::to_string);
            let notes = read.notes.iter().cloned().chain(issues).collect();
            let leads = read.steps.iter().map(|step| match step {
                Step::Rate { input_lead_s, .. } => *input_lead_s,
                _ => 0.0,
            });
            let (lead, parts) = (leads.sum::<f64>(), record_to_dict(py, read.record)?);
            parts.set_item("input_lead", lead)?;
            Ok((parts, steps, notes))
        })
        .collect()
}

/// Parses scalings or offsets by channel, written as on the command line.
fn parse_values<T: FromStr<Err = IoError>>(texts: BTreeMap<String, String>) -> Result<BTreeMap<String, T>, IoError> {
    texts
        .into_iter()
        .map(|(name, text)| Ok((name, text.parse()?)))
        .collect()
}

#[pyfunction]
#[pyo3(signature = (path, record))]
pub fn write(py: Python<'_>, path: PathBuf, record: &Bound<'_, PyAny>) -> Outcome<()> {
    let record = arrays::record(record, ChannelSelection::All)?;
    py.detach(|| write_record(&path, &record))?;
    Ok(())
}

/// Checks the parts of a `pyhoid.Record`.
#[pyfunction]
#[pyo3(signature = (record))]
pub fn check_record(record: &Bound<'_, PyAny>) -> Outcome<()> {
    arrays::check(record)
}

/// Returns the sample time in s if the times are evenly spaced; otherwise `None` and the row at which the spacing
/// changes.
#[pyfunction]
#[pyo3(signature = (times))]
pub fn even_times(times: PyReadonlyArray1<'_, f64>) -> (Option<f64>, usize) {
    match hoid_io::even_times(&times.as_array().to_vec()) {
        Ok(sample_time_s) => (Some(sample_time_s), 0),
        Err(row) => (None, row),
    }
}

/// Returns the sign and the index of each column of a table from which a signal such as `r-y` or `-e` is computed.
#[pyfunction]
#[pyo3(signature = (text, names))]
pub fn signal_of(text: &str, names: Vec<String>) -> Outcome<Vec<(f64, usize)>> {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    Ok(text.parse::<ColumnExpression>()?.signed_columns(&names, "the table")?)
}

/// Returns the record with the mean or the linear trend removed from the input and the output.
#[pyfunction]
#[pyo3(signature = (record, how))]
pub fn detrended<'py>(py: Python<'py>, record: &Bound<'py, PyAny>, how: &str) -> Outcome<Bound<'py, PyDict>> {
    let how = names::detrend(how)?;
    let record = arrays::record(record, ChannelSelection::All)?;
    Ok(record_to_dict(py, record.detrended(how))?)
}

/// Returns the record at a lower rate and a description of the step; `None` if the rate is kept.
#[pyfunction]
#[pyo3(signature = (record, decimate))]
pub fn decimated<'py>(
    py: Python<'py>,
    record: &Bound<'py, PyAny>,
    decimate: &str,
) -> Outcome<Option<(Bound<'py, PyDict>, String)>> {
    let decimation = decimation(decimate)?;
    let sample_time = SampleTime::new(record.getattr("sample_time")?.extract()?)?;
    if decimation.factor(sample_time) == 1 {
        return Ok(None);
    }
    let record = arrays::record(record, ChannelSelection::All)?;
    let (record, done) = py.detach(|| decimation.apply(record))?;
    let Some(done) = done else { return Ok(None) };
    let parts = record_to_dict(py, record)?;
    parts.set_item("input_lead", done.lead_s)?;
    Ok(Some((parts, Step::from(done).to_string())))
}

/// Parses a decimation: "auto", "off" or a factor.
pub fn decimation(text: &str) -> Outcome<Decimation> {
    text.parse().map_err(|_| {
        bad_option(format!(
            "decimate is {text:?}, expected \"auto\", \"off\" or an integer factor, such as 10"
        ))
    })
}

/// Reads a table written by hoid, as columns by name: real numbers, whole numbers, or text.
#[pyfunction]
#[pyo3(signature = (path))]
pub fn read_table<'py>(py: Python<'py>, path: PathBuf) -> Outcome<Bound<'py, PyDict>> {
    let table = py.detach(|| hoid_io::read_table(&path))?;
    let all = PyDict::new(py);
    for column in table.columns {
        match column.values {
            ColumnValues::Real(values) => all.set_item(column.name, array(py, values))?,
            ColumnValues::Whole(values) => all.set_item(column.name, PyArray1::from_vec(py, values))?,
            ColumnValues::Text(values) => all.set_item(column.name, values)?,
        }
    }
    Ok(all)
}
