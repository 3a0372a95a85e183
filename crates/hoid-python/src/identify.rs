//! `pyhoid.identify`: identification of a model from records.

use std::{collections::BTreeMap, sync::Arc};

use hoid_analysis::{
    AnalysisError, Axis, AxisPair, BatchEstimator, Coupling, Identification, IdentifiedModel, Recordings, Request,
    ResolvedRequest,
    json::{BatchResult, state},
    registry::estimators,
};
use hoid_ident::settings::{Kind, MethodSpec, Setting};
use hoid_model::{FaultHandling, Record};
use pyo3::prelude::*;

use crate::{
    arrays::{self, ChannelSelection},
    errors::{DataError, Failure, Outcome, bad_option},
    family::PyOperatorFit,
    files,
    fit::{PartRead, PyFit},
    interrupt::{self, RunStatus},
    names,
    time_varying::PyTimeVaryingFit,
};

/// Number of samples times number of models above which a fit runs in a separate thread, so that it can be interrupted.
const MIN_SAMPLES_FOR_THREAD: usize = 50_000;

/// Fits a model to records; returns the fit and notes on the request. The package has already converted all options to
/// text.
#[pyfunction]
#[pyo3(signature = (records, *, structure, method, options, faults, decimate, progress))]
#[allow(clippy::too_many_arguments)]
pub fn identify<'py>(
    py: Python<'py>,
    records: Vec<Bound<'py, PyAny>>,
    structure: Option<String>,
    method: String,
    options: BTreeMap<String, String>,
    faults: &str,
    decimate: &str,
    progress: Option<Bound<'py, PyAny>>,
) -> Outcome<(Bound<'py, PyAny>, Vec<String>)> {
    let records = arrays::records(&records, ChannelSelection::All)?;
    let request = Request {
        structure,
        method: Some(method),
        options,
        faults: names::choice::<FaultHandling>("faults", faults)?,
        rate: files::decimation(decimate)?,
    };
    let (asked, notes) = request.resolve()?;
    let progress = progress.as_ref();
    let fit = match asked {
        ResolvedRequest::Operator(how) => BatchResult::Operator(run(py, how, records, 1, progress)?),
        ResolvedRequest::Remnant(how) => BatchResult::Remnant(run(py, how, records, 10, progress)?),
        ResolvedRequest::Change(how) => BatchResult::Change(run(py, how, records, 10, progress)?),
        ResolvedRequest::Polynomials(how) => {
            let models = how.estimator.ranges(records[0].sample_time())?.combinations()?.len();
            BatchResult::Polynomials(run(py, how, records, models, progress)?)
        }
    };
    Ok((to_python_class(py, fit)?, notes))
}

/// Input of a coupling, p-value of the test for a response to it, whether there is a response, and the reason if it was
/// not tested.
type CouplingParts = (String, Option<f64>, bool, String);

/// Identifies the operators of several axes, each with its couplings. `axes` contains the records of each axis, and
/// `pairs` contains its input and output.
#[pyfunction]
#[pyo3(signature = (axes, pairs, *, options, faults, decimate))]
pub fn identify_axes(
    py: Python<'_>,
    axes: Vec<Vec<Bound<'_, PyAny>>>,
    pairs: Vec<String>,
    options: BTreeMap<String, String>,
    faults: &str,
    decimate: &str,
) -> Outcome<Vec<(PyOperatorFit, Vec<CouplingParts>)>> {
    let request = Request {
        structure: None,
        method: None,
        options,
        faults: names::choice::<FaultHandling>("faults", faults)?,
        rate: files::decimation(decimate)?,
    };
    let (ResolvedRequest::Operator(how), _) = request.resolve()? else {
        return Err(bad_option(
            "axes are identified as operators: options of other structures do not apply",
        ));
    };
    let pairs: Vec<AxisPair> = (pairs.iter())
        .map(|pair| pair.parse().map_err(|why| bad_option(format!("pairs: {why}"))))
        .collect::<Outcome<_>>()?;
    hoid_analysis::check_axes(&how, &pairs)?;
    let mut all = Vec::with_capacity(pairs.len());
    for (pair, records) in pairs.into_iter().zip(&axes) {
        let records = arrays::records(records, ChannelSelection::All)?;
        all.push((pair, Recordings::from_records(records)));
    }
    let found = py.detach(|| hoid_analysis::axes(&how, all))?;
    let parts = |coupling: Coupling| {
        let (p_value, reason) = match coupling.p_value {
            Ok(p) => (Some(p), String::new()),
            Err(reason) => (None, reason),
        };
        (coupling.input, p_value, coupling.responds, reason)
    };
    let one = |axis: Axis| {
        let couplings = axis.couplings.into_iter().map(parts).collect();
        (PyOperatorFit(axis.identified), couplings)
    };
    Ok(found.into_iter().map(one).collect())
}

/// Restores a result from the text that `to_json` returned.
#[pyfunction]
pub fn from_json<'py>(py: Python<'py>, text: &str) -> Outcome<Bound<'py, PyAny>> {
    Ok(to_python_class(py, BatchResult::from_json(text)?)?)
}

/// Restores a model that is a part of another result from the text that its `state` returned.
#[pyfunction]
pub fn from_state(text: &str) -> PyResult<PyFit> {
    let part: PartRead = state::read(text).map_err(DataError::new_err)?;
    Ok(part.into())
}

/// Wraps a result in its Python class.
fn to_python_class(py: Python<'_>, answer: BatchResult) -> PyResult<Bound<'_, PyAny>> {
    Ok(match answer {
        BatchResult::Operator(found) => Bound::new(py, PyOperatorFit(found))?.into_any(),
        BatchResult::Remnant(found) => Bound::new(py, PyFit::from_grey_box(found))?.into_any(),
        BatchResult::Change(found) => Bound::new(py, PyTimeVaryingFit(found))?.into_any(),
        BatchResult::Polynomials(found) => Bound::new(py, PyFit::from_polynomials(found))?.into_any(),
    })
}

/// Runs the identification without the interpreter lock, in a separate thread if it takes long.
fn run<E>(
    py: Python<'_>,
    how: Identification<E>,
    records: Vec<Record>,
    models: usize,
    progress: Option<&Bound<'_, PyAny>>,
) -> Outcome<IdentifiedModel<E::Fit>>
where
    E: BatchEstimator + Send + Sync + 'static,
    E::Fit: Send + 'static,
{
    let samples: usize = records.iter().map(Record::len).sum();
    let work = move |status: &Arc<RunStatus>| -> Result<_, AnalysisError> {
        interrupt::with_progress(status, || how.run(Recordings::from_records(records)))
    };
    if samples * models < MIN_SAMPLES_FOR_THREAD && progress.is_none() {
        py.detach(|| work(&Arc::default())).map_err(Failure::from)
    } else {
        interrupt::run(py, models as u64, progress, false, work)
    }
}

/// Returns the name of the type of a setting, from which the package derives its conversion.
fn kind(setting: &Setting) -> &'static str {
    match setting.kind {
        Kind::Flag => "flag",
        Kind::Choice(_) => "choice",
        Kind::Counts | Kind::Delay => "counts",
        Kind::Names => "names",
        Kind::Element => "element",
        Kind::Prior => "prior",
        Kind::Named(Kind::Guess) => "guesses",
        _ => "text",
    }
}

/// Returns the name of each batch estimator, the structures that it supports, and its keywords with their types.
#[pyfunction]
pub fn batch_estimators() -> Vec<(&'static str, Vec<&'static str>, BTreeMap<&'static str, &'static str>)> {
    let structures = |spec: &MethodSpec| spec.structures.iter().map(|structure| structure.name()).collect();
    let keywords = |spec: &MethodSpec| {
        spec.settings
            .iter()
            .map(|setting| (setting.name, kind(setting)))
            .collect()
    };
    let of = |spec: &MethodSpec| (spec.name, structures(spec), keywords(spec));
    estimators().iter().map(of).collect()
}
