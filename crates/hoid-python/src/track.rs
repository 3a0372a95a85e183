//! `pyhoid.track`: a recursive estimate over a record.

use std::path::PathBuf;

use hoid_analysis::findings_of_channels;
use hoid_ident::{Choice, IdentError};
use hoid_io::{ColumnValues, OutputColumn, OutputTable};
use hoid_report::{BatchLine, TraceSection, TrackReport, default_batch_fits, write_report};
use hoid_track::{
    CovarianceChoice, CovarianceUpdates, NoCrossover, StartAt, Trace, TrackOptions, choose_covariance,
    track as track_record, track_validated, usual_start_span,
};
use numpy::PyArray1;
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{self, Wanted, array},
    errors::Outcome,
    figures,
    fit::PyFit,
    interrupt, recursion,
};

/// Tracks a record; `options` are those of the recursion, the others concern the record.
#[pyfunction]
#[pyo3(signature = (record, options, *, start_span, update_from, moving_average, every, validate, update_covariance, progress))]
#[allow(clippy::too_many_arguments)]
pub fn track<'py>(
    py: Python<'py>,
    record: &Bound<'py, PyAny>,
    options: &Bound<'py, PyDict>,
    start_span: Option<(f64, f64)>,
    update_from: Option<f64>,
    moving_average: Option<usize>,
    every: usize,
    validate: Option<Bound<'py, PyAny>>,
    update_covariance: bool,
    progress: Option<Bound<'py, PyAny>>,
) -> Outcome<PyTrace> {
    let record = arrays::record(record, Wanted::Only(&["f_t"]))?;
    let validation = match &validate {
        Some(other) => Some(arrays::record(other, Wanted::Only(&[]))?),
        None => None,
    };
    let plan = recursion::plan(options, record.sample_time())?;
    let span_s = start_span.unwrap_or_else(|| usual_start_span(&record));
    let candidates = plan.ranges().combinations()?.len() as u64;
    let (trace, choice, covariance) = interrupt::run(py, candidates, progress.as_ref(), false, move |standing| {
        let (options, choice) = if plan.is_settled() {
            (plan.options().clone(), None)
        } else {
            plan.choose(&record.span(span_s.0, span_s.1)?, &|| standing.inc())?
        };
        let options = TrackOptions {
            start: match options.start {
                StartAt::Span(_) => StartAt::Span(Some(span_s)),
                other => other,
            },
            update_from_s: update_from,
            ..options
        };
        let (trace, covariance) = match &validation {
            Some(other) if update_covariance => {
                let updates = CovarianceUpdates::default();
                (track_validated(&record, other, &options, &updates, every)?, None)
            }
            Some(other) => {
                let (options, found) = choose_covariance(&record, other, &options)?;
                (track_record(&record, &options, every)?, Some(found))
            }
            None => (track_record(&record, &options, every)?, None),
        };
        Ok::<_, IdentError>((trace.moving_average(moving_average.unwrap_or(1)), choice, covariance))
    })?;
    Ok(PyTrace {
        trace,
        choice,
        covariance,
    })
}

/// The estimate at every sample that was kept; the package wraps it in `pyhoid.Trace`.
#[pyclass(name = "Trace", module = "pyhoid._pyhoid", frozen)]
pub struct PyTrace {
    trace: Trace,
    choice: Option<Choice>,
    covariance: Option<CovarianceChoice>,
}

#[pymethods]
impl PyTrace {
    fn __len__(&self) -> usize {
        self.trace.len()
    }

    #[getter]
    fn method(&self) -> &'static str {
        self.trace.options().method.name()
    }

    #[getter]
    fn structure(&self) -> &'static str {
        self.trace.options().structure.name()
    }

    #[getter]
    fn orders<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        figures::orders(py, &self.trace.options().orders)
    }

    #[getter]
    fn parameter_names(&self) -> Vec<String> {
        self.trace.parameter_names()
    }

    #[getter]
    fn operator_names(&self) -> Vec<&'static str> {
        self.trace.operator_columns()
    }

    #[getter]
    fn updated_from(&self) -> f64 {
        self.trace.updated_from_s()
    }

    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (counts, all) = (self.trace.counts(), PyDict::new(py));
        all.set_item("samples", counts.samples)?;
        all.set_item("skipped", counts.skipped)?;
        all.set_item("held", counts.held)?;
        all.set_item("restarts", counts.restarts)?;
        all.set_item("steps_shortened", counts.shortened)?;
        Ok(all)
    }

    /// What the guard found, and what it did.
    #[getter]
    fn faults<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.trace
            .faults()
            .iter()
            .map(|f| figures::track_fault(py, f))
            .collect()
    }

    /// The changes that were declared, for the methods adaptive and multiple-model.
    #[getter]
    fn changes<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let one = |(t, c): &(f64, hoid_track::Change)| {
            let all = PyDict::new(py);
            all.set_item("t", t)?;
            all.set_item("seconds_ago", c.seconds_ago)?;
            all.set_item("log_odds", c.odds)?;
            all.set_item("changed", c.changed())?;
            all.set_item("K_e", c.k_e.map(figures::pair))?;
            all.set_item("K_e_dot", c.k_e_dot.map(figures::pair))?;
            all.set_item("omega_nm", c.omega_nm_rad_s.map(figures::pair))?;
            all.set_item("zeta_nm", c.zeta_nm.map(figures::pair))?;
            all.set_item("tau_e", c.tau_e_s.map(figures::pair))?;
            all.set_item("T_L", c.t_l_s)?;
            all.set_item("innovation_variance", c.innovation_variance)?;
            all.set_item("z", c.z)?;
            Ok(all)
        };
        self.trace.changes().iter().map(one).collect()
    }

    /// The start covariances that were tried on a second run, and the one that was taken.
    #[getter]
    fn covariance_choice<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(choice) = &self.covariance else {
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

    /// Number of fits that failed, and why the last did, for the method window.
    #[getter]
    fn failures(&self) -> Option<(usize, String)> {
        self.trace.failures().cloned()
    }

    /// The batch fit that the recursion started from.
    #[getter]
    fn start(&self) -> Option<PyFit> {
        let fit = self.trace.start()?.clone();
        Some(PyFit::new(fit, self.choice.clone(), 1))
    }

    /// What the trace is worth, on the record that it was made of.
    fn verdict(&self, py: Python<'_>, record: &Bound<'_, PyAny>) -> Outcome<figures::VerdictParts> {
        let record = arrays::record(record, Wanted::Only(&[]))?;
        let found = py.detach(|| self.trace.verdict(&record, self.choice.as_ref()))?;
        Ok(figures::verdict(&found.behind(findings_of_channels(&record))))
    }

    /// Why most of the rows without a crossover have none, and how many there are; None without a
    /// controlled element.
    #[getter]
    fn no_crossover(&self) -> Option<(usize, Option<&'static str>)> {
        self.trace.options().controlled_element.as_ref()?;
        let all: Vec<NoCrossover> = (0..self.trace.len())
            .filter_map(|row| self.trace.open_loop(row)?.err())
            .collect();
        let count = |reason: &NoCrossover| all.iter().filter(|one| *one == reason).count();
        Some((
            all.len(),
            all.iter().max_by_key(|one| count(one)).map(|one| one.words()),
        ))
    }

    /// All columns by name, as in a trace file; whole numbers stay whole.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let trace = &self.trace;
        let (columns, determined, convertible) = py.detach(|| {
            let operators = trace.operators();
            let convertible: Vec<u64> = operators.iter().map(|o| u64::from(o.is_ok())).collect();
            let determined = trace.determined_columns(&operators);
            (trace.estimate_columns(&operators), determined, convertible)
        });
        let all = PyDict::new(py);
        for (name, values) in columns {
            all.set_item(name, array(py, values))?;
        }
        for (name, values) in determined {
            all.set_item(name, PyArray1::from_vec(py, values))?;
        }
        all.set_item("convertible", PyArray1::from_vec(py, convertible))?;
        all.set_item("innovation", PyArray1::from_slice(py, trace.innovation()))?;
        if !trace.change_odds().is_empty() {
            all.set_item("change_log_odds", PyArray1::from_slice(py, trace.change_odds()))?;
        }
        if trace.is_guarded() {
            all.set_item("held", PyArray1::from_slice(py, trace.held()))?;
        }
        all.set_item("steps_shortened", PyArray1::from_slice(py, trace.steps_shortened()))?;
        Ok(all)
    }

    #[getter]
    fn innovation_variance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.trace.innovation_variance())
    }

    /// The operator of a row.
    fn operator<'py>(&self, py: Python<'py>, row: usize) -> PyResult<Option<Bound<'py, PyDict>>> {
        if row >= self.trace.len() {
            return Err(pyo3::exceptions::PyIndexError::new_err(format!(
                "row {row}: the trace has {} rows",
                self.trace.len()
            )));
        }
        figures::operator(py, &self.trace.operator(row))
    }

    /// Writes the page about the trace into a directory, with the batch fits of the start and of
    /// the last third.
    #[pyo3(signature = (record, directory, *, title, settings))]
    fn report(
        &self,
        py: Python<'_>,
        record: &Bound<'_, PyAny>,
        directory: PathBuf,
        title: String,
        settings: Vec<(String, String)>,
    ) -> Outcome<PathBuf> {
        let record = arrays::record(record, Wanted::All)?;
        let trace = &self.trace;
        let page = py.detach(|| {
            let (fits, missing) = default_batch_fits(trace, &record);
            let line = |((from_s, to_s), fit)| BatchLine { from_s, to_s, fit };
            let options = trace.options();
            let report = TrackReport {
                title,
                settings,
                record: &record,
                traces: vec![TraceSection {
                    name: format!("{}, {}", options.method.name(), options.structure.label()),
                    trace,
                    batch: fits.iter().map(|(span, fit)| line((*span, fit))).collect(),
                }],
                verdict: None,
                notes: missing
                    .map(|error| format!("There is no batch fit of the last third: {error}."))
                    .into_iter()
                    .collect(),
            };
            write_report(&directory, &report.to_html()?)
        })?;
        Ok(page)
    }

    /// Writes the columns into a file, with comments where the format has them.
    fn write(&self, py: Python<'_>, path: PathBuf, comments: Vec<String>) -> Outcome<()> {
        let trace = &self.trace;
        py.detach(|| {
            let operators = trace.operators();
            let column = |name: &str, values: ColumnValues| OutputColumn {
                name: name.to_owned(),
                values,
            };
            let mut columns: Vec<OutputColumn> = trace
                .estimate_columns(&operators)
                .into_iter()
                .map(|(name, values)| column(&name, ColumnValues::Real(values)))
                .collect();
            for (name, values) in trace.determined_columns(&operators) {
                columns.push(column(&name, ColumnValues::Whole(values)));
            }
            let convertible = operators.iter().map(|o| u64::from(o.is_ok())).collect();
            columns.push(column("convertible", ColumnValues::Whole(convertible)));
            columns.push(column("innovation", ColumnValues::Real(trace.innovation().to_vec())));
            if !trace.change_odds().is_empty() {
                let odds = trace.change_odds().to_vec();
                columns.push(column("change_log_odds", ColumnValues::Real(odds)));
            }
            if trace.is_guarded() {
                columns.push(column("held", ColumnValues::Whole(trace.held().to_vec())));
            }
            let shortened = trace.steps_shortened().to_vec();
            columns.push(column("steps_shortened", ColumnValues::Whole(shortened)));
            hoid_io::write_table(&path, &OutputTable { comments, columns })
        })?;
        Ok(())
    }
}
