//! `pyhoid.track`: a recursive estimate over a record.

use std::path::PathBuf;

use hoid_analysis::{Recordings, Tracking, TrackingResult};
use hoid_io::{ColumnValues, OutputTable, write_table};
use hoid_report::{TrackReport, default_batch_fits, write_report};
use numpy::PyArray1;
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{self, ChannelSelection, array},
    errors::Outcome,
    faults::{UsedRecord, used_records},
    figures, files,
    fit::PyFit,
    interrupt, recursion,
};

/// Tracks a record. `options` are the options of the recursion; the other arguments concern the record.
#[pyfunction]
#[pyo3(signature = (record, options, *, start_span, update_from, moving_average, every, decimate, validate, update_covariance, progress))]
#[allow(clippy::too_many_arguments)]
pub fn track<'py>(
    py: Python<'py>,
    record: &Bound<'py, PyAny>,
    options: &Bound<'py, PyDict>,
    start_span: Option<(f64, f64)>,
    update_from: Option<f64>,
    moving_average: Option<f64>,
    every: usize,
    decimate: &str,
    validate: Option<Bound<'py, PyAny>>,
    update_covariance: bool,
    progress: Option<Bound<'py, PyAny>>,
) -> Outcome<PyTrace> {
    let recording = |one: &Bound<'py, PyAny>| -> Outcome<Recordings> {
        Ok(Recordings::from_records([arrays::record(one, ChannelSelection::All)?]))
    };
    let (recordings, validation) = (recording(record)?, validate.as_ref().map(recording).transpose()?);
    let tracking = Tracking {
        start_span_s: start_span,
        update_from_s: update_from,
        moving_average_s: moving_average,
        every,
        rate: files::decimation(decimate)?,
        update_covariance,
        ..Tracking::of(recursion::request(options)?)
    };
    let candidates = tracking.plan(&recordings)?.ranges().combinations()?.len() as u64;
    let tracked = interrupt::run(py, candidates, progress.as_ref(), false, move |standing| {
        tracking.run(recordings, validation, &|| standing.increment())
    })?;
    Ok(PyTrace(tracked))
}

/// A trace, with the estimate at each stored sample; the package wraps it in `pyhoid.Trace`.
#[pyclass(name = "Trace", module = "pyhoid._pyhoid", frozen)]
pub struct PyTrace(TrackingResult);

#[pymethods]
impl PyTrace {
    fn __len__(&self) -> usize {
        self.0.trace.len()
    }

    /// Returns the result as JSON, the same object as `hoid track --json` prints.
    fn to_json(&self) -> Outcome<String> {
        Ok(self.0.to_json()?)
    }

    /// Returns the record that was tracked: the index of the given record, the record, and the steps applied to it.
    fn records<'py>(&self, py: Python<'py>) -> PyResult<Vec<UsedRecord<'py>>> {
        used_records(py, &self.0.data)
    }

    #[getter]
    fn method(&self) -> &'static str {
        self.0.trace.options().method.name()
    }

    #[getter]
    fn structure(&self) -> &'static str {
        self.0.trace.options().structure.name()
    }

    #[getter]
    fn orders<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        figures::orders(py, &self.0.trace.options().orders)
    }

    #[getter]
    fn parameter_names(&self) -> Vec<String> {
        self.0.trace.parameter_names()
    }

    #[getter]
    fn operator_names(&self) -> Vec<&'static str> {
        self.0.trace.operator_columns()
    }

    #[getter]
    fn updated_from(&self) -> f64 {
        self.0.trace.updated_from_s()
    }

    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (counts, all) = (self.0.trace.counts(), PyDict::new(py));
        all.set_item("samples", counts.samples)?;
        all.set_item("skipped", counts.skipped)?;
        all.set_item("held", counts.held)?;
        all.set_item("restarts", counts.restarts)?;
        all.set_item("steps_shortened", counts.shortened)?;
        Ok(all)
    }

    /// Returns the faults that the guard found, and its actions.
    #[getter]
    fn faults<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.0
            .trace
            .faults()
            .iter()
            .map(|f| figures::track_fault(py, f))
            .collect()
    }

    /// Returns the declared changes, for the methods adaptive and multiple-model.
    #[getter]
    fn changes<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let one = |(t, c): &(f64, hoid_track::Change)| {
            let all = PyDict::new(py);
            all.set_item("t", t)?;
            all.set_item("seconds_ago", c.seconds_ago)?;
            all.set_item("log_odds", c.odds)?;
            all.set_item("changed", c.changed_quantities())?;
            all.set_item("K_e", c.k_e.map(figures::value_and_error))?;
            all.set_item("K_e_dot", c.k_e_dot.map(figures::value_and_error))?;
            all.set_item("omega_nm", c.omega_nm_rad_s.map(figures::value_and_error))?;
            all.set_item("zeta_nm", c.zeta_nm.map(figures::value_and_error))?;
            all.set_item("tau_e", c.tau_e_s.map(figures::value_and_error))?;
            all.set_item("T_L", c.t_l_s)?;
            all.set_item("innovation_variance", c.innovation_variance)?;
            all.set_item("z", c.z)?;
            Ok(all)
        };
        self.0.trace.changes().iter().map(one).collect()
    }

    /// Returns the start covariances that were tried on a second run, and the one selected; `None` if there was no
    /// second run.
    #[getter]
    fn covariance_choice<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some((_, choice)) = self.0.chosen_covariance() else {
            return Ok(None);
        };
        let one = |(p, vaf): &(f64, f64)| {
            let all = PyDict::new(py);
            all.set_item("covariance", p)?;
            all.set_item("vaf", vaf)?;
            Ok(all)
        };
        let all = PyDict::new(py);
        all.set_item("from", choice.span_s.0)?;
        all.set_item("to", choice.span_s.1)?;
        all.set_item("covariance", choice.covariance)?;
        let candidates: PyResult<Vec<_>> = choice.candidates.iter().map(one).collect();
        all.set_item("candidates", candidates?)?;
        Ok(Some(all))
    }

    /// Returns the number of fits that failed and the reason for the last failure, for the method window.
    #[getter]
    fn failures(&self) -> Option<(usize, String)> {
        self.0.trace.failures().cloned()
    }

    /// Returns the batch fit from which the recursion started.
    #[getter]
    fn start(&self) -> Option<PyFit> {
        let fit = self.0.trace.start()?.clone();
        Some(PyFit::new(fit, self.0.choice.clone(), 1))
    }

    /// Returns the verdict on the trace.
    #[getter]
    fn verdict(&self) -> String {
        figures::verdict(&self.0.verdict)
    }

    /// Returns the number of rows without a crossover and the most frequent reason; `None` without a controlled
    /// element.
    #[getter]
    fn no_crossover(&self) -> Option<(usize, Option<&'static str>)> {
        let (rows, reason) = self.0.rows_without_crossover()?;
        Some((rows, reason.map(|reason| reason.as_text())))
    }

    /// Returns all columns by name, as in a trace file; whole numbers remain integers.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let table = py.detach(|| self.0.table());
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

    #[getter]
    fn innovation_variance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.trace.innovation_variance())
    }

    /// Returns the operator of a row.
    fn operator<'py>(&self, py: Python<'py>, row: usize) -> PyResult<Option<Bound<'py, PyDict>>> {
        if row >= self.0.trace.len() {
            return Err(pyo3::exceptions::PyIndexError::new_err(format!(
                "row {row}: the trace has {} rows",
                self.0.trace.len()
            )));
        }
        figures::operator(py, &self.0.trace.operator(row))
    }

    /// Writes the report page of the trace to a directory, including the batch fits of the start and of the last third.
    #[pyo3(signature = (directory, *, title))]
    fn report(&self, py: Python<'_>, directory: PathBuf, title: Option<String>) -> Outcome<PathBuf> {
        let page = py.detach(|| {
            let (fits, missing) = default_batch_fits(&self.0.trace, self.0.record());
            let mut report = TrackReport::from_tracked(&self.0, &fits);
            report.title = title.unwrap_or(report.title);
            report.notes = missing
                .map(|error| format!("There is no batch fit of the last third: {error}."))
                .into_iter()
                .collect();
            write_report(&directory, &report.to_html()?)
        })?;
        Ok(page)
    }

    /// Writes the columns to a file, with comments if the format supports them.
    fn write(&self, py: Python<'_>, path: PathBuf, comments: Vec<String>) -> Outcome<()> {
        py.detach(|| {
            let table = OutputTable {
                comments,
                ..self.0.table()
            };
            write_table(&path, &table)
        })?;
        Ok(())
    }
}
