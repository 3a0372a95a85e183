//! Conversion of arrays and records between Python and Rust.
//!
//! A Python record holds NumPy arrays. A call copies the required channels into a record of the library while it holds
//! the interpreter lock, so that later changes to the arrays by another thread have no effect. Vectors from the library
//! become arrays without a copy.

use hoid_model::{Channel, ModelError, Record, SampleTime};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::{prelude::*, types::PyDict};

use crate::errors::{Outcome, bad_option};

/// Converts a vector to a one-dimensional array without a copy.
pub fn array<'py>(py: Python<'py>, values: Vec<f64>) -> Bound<'py, PyArray1<f64>> {
    values.into_pyarray(py)
}

/// Converts a matrix stored by rows to a two-dimensional array without a copy.
pub fn matrix<'py>(py: Python<'py>, values: Vec<f64>, columns: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows = values.len().checked_div(columns).unwrap_or(0);
    values.into_pyarray(py).reshape([rows, columns])
}

/// Copies a contiguous float64 array, as created by the package, to a vector.
fn vector(values: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array: PyReadonlyArray1<'_, f64> = values.extract()?;
    Ok(array.as_slice()?.to_vec())
}

/// Channels of a record that a call needs in addition to the input and the output.
#[derive(Debug, Clone, Copy)]
pub enum ChannelSelection<'a> {
    All,
    Only(&'a [&'a str]),
}

/// Converts a `pyhoid.Record` to a record of the library.
pub fn record(found: &Bound<'_, PyAny>, wanted: ChannelSelection<'_>) -> Outcome<Record> {
    let text = |name: &str| -> PyResult<String> { found.getattr(name)?.extract() };
    let sample_time = SampleTime::new(found.getattr("sample_time")?.extract()?)?;
    let words_of =
        |attribute: &str| -> PyResult<Bound<'_, PyDict>> { found.getattr(attribute)?.cast_into().map_err(PyErr::from) };
    let (units, roles) = (words_of("units")?, words_of("roles")?);
    let words = |all: &Bound<'_, PyDict>, name: &str| -> PyResult<String> {
        match all.get_item(name)? {
            Some(words) => words.extract(),
            None => Ok(String::new()),
        }
    };
    let channel = |name: String, values: &Bound<'_, PyAny>| -> PyResult<Channel> {
        let values = vector(values)?;
        let (unit, role) = (words(&units, &name)?, words(&roles, &name)?);
        Ok(Channel::new(name, unit, values).with_role(role))
    };
    let output = channel(text("output_name")?, &found.getattr("u")?)?;
    let input = found.getattr("e")?;
    let mut record = if input.is_none() {
        Record::from_output(sample_time, output)?
    } else {
        Record::new(sample_time, channel(text("input_name")?, &input)?, output)?
    };
    record = record.labelled(text("label")?);
    record = record.starting_at(found.getattr("start_time")?.extract()?);
    let channels: Bound<'_, PyDict> = found.getattr("channels")?.cast_into().map_err(PyErr::from)?;
    for (name, values) in channels {
        let name: String = name.extract()?;
        let needed = match wanted {
            ChannelSelection::All => true,
            ChannelSelection::Only(names) => names.contains(&name.as_str()),
        };
        if needed {
            record = record.with_channel(channel(name, &values)?)?;
        }
    }
    Ok(record)
}

/// Checks the parts of a `pyhoid.Record` as [`record`] does, but without a copy of the arrays.
pub fn check(found: &Bound<'_, PyAny>) -> Outcome<()> {
    SampleTime::new(found.getattr("sample_time")?.extract()?)?;
    let mut named: Vec<(String, Bound<'_, PyAny>)> = Vec::new();
    let input = found.getattr("e")?;
    if !input.is_none() {
        named.push((found.getattr("input_name")?.extract()?, input));
    }
    named.push((found.getattr("output_name")?.extract()?, found.getattr("u")?));
    let channels: Bound<'_, PyDict> = found.getattr("channels")?.cast_into().map_err(PyErr::from)?;
    for (name, values) in channels {
        named.push((name.extract()?, values));
    }
    let mut length = None;
    for (k, (name, values)) in named.iter().enumerate() {
        let array: PyReadonlyArray1<'_, f64> = values.extract()?;
        let values = array.as_slice().map_err(PyErr::from)?;
        let expected = *length.get_or_insert(values.len());
        if expected == 0 {
            return Err(ModelError::EmptyRecord {
                label: "(unnamed)".to_owned(),
            }
            .into());
        }
        if named[..k].iter().any(|(other, _)| other == name) {
            return Err(ModelError::DuplicateChannel { name: name.clone() }.into());
        }
        if values.len() != expected {
            return Err(ModelError::LengthMismatch {
                channel: name.clone(),
                found: values.len(),
                expected,
                reference: named[0].0.clone(),
            }
            .into());
        }
        if let Some(index) = values.iter().position(|v| !v.is_finite()) {
            return Err(ModelError::NotFinite {
                channel: name.clone(),
                index,
                value: values[index],
            }
            .into());
        }
    }
    Ok(())
}

/// Converts one `pyhoid.Record` or several to records of the library.
pub fn records(found: &[Bound<'_, PyAny>], wanted: ChannelSelection<'_>) -> Outcome<Vec<Record>> {
    if found.is_empty() {
        return Err(bad_option("there is no record; give one or more"));
    }
    found.iter().map(|one| record(one, wanted)).collect()
}

/// Converts a record of the library to the parts of a `pyhoid.Record` without copying any vector.
pub fn record_to_dict<'py>(py: Python<'py>, record: Record) -> PyResult<Bound<'py, PyDict>> {
    let parts = PyDict::new(py);
    parts.set_item("sample_time", record.sample_time().s())?;
    parts.set_item("start_time", record.time_s(0))?;
    parts.set_item("label", record.label())?;
    let (input, output, others) = record.into_channels();
    let (channels, units, roles) = (PyDict::new(py), PyDict::new(py), PyDict::new(py));
    for channel in input.iter().chain([&output]).chain(&others) {
        units.set_item(&channel.name, &channel.unit)?;
        if !channel.role.is_empty() {
            roles.set_item(&channel.name, &channel.role)?;
        }
    }
    parts.set_item("input_name", input.as_ref().map_or("e", |c| c.name.as_str()))?;
    parts.set_item("output_name", &output.name)?;
    parts.set_item("e", input.map(|c| array(py, c.values)))?;
    parts.set_item("u", array(py, output.values))?;
    for channel in others {
        channels.set_item(channel.name, array(py, channel.values))?;
    }
    parts.set_item("channels", channels)?;
    parts.set_item("units", units)?;
    parts.set_item("roles", roles)?;
    Ok(parts)
}
