//! `pyhoid.identify`: from records and options to a fit.

use std::{collections::BTreeMap, sync::Arc};

use hoid_analysis::{
    AnalysisError, BatchEstimator, Identification, Identified, PolynomialFit, Polynomials, Recordings,
};
use hoid_ident::{
    Estimator, GreyBox, GreyBoxFit, InitialState, Instruments, Loss, SearchOptions, SigmoidChange, SigmoidFit,
    estimators, settings::MethodSpec,
};
use hoid_model::{Decimation, FaultHandling, Record};
use pyo3::prelude::*;

use crate::{
    arrays::{self, Wanted},
    errors::{Failure, Outcome, bad_option},
    family::PriorOfUser,
    files,
    fit::PyFit,
    interrupt::{self, Standing},
    names::{self, Kind},
    time_varying::PyTimeVaryingFit,
};

/// Samples times models from which a fit is long enough to get a thread of its own, for interrupts.
const LONG: usize = 50_000;

/// What a fit gave.
enum Found {
    Polynomials(Box<Identified<PolynomialFit>>),
    GreyBox(Box<Identified<GreyBoxFit>>),
    Change(Box<Identified<SigmoidFit>>),
}

type Work = Box<dyn FnOnce(&Arc<Standing>) -> Result<Found, AnalysisError> + Send>;

/// Fits a model to records. The package has brought all options into plain form.
#[pyfunction]
#[pyo3(signature = (records, structure, *, orders, method, instruments, form, neuromuscular, prior, remnant_order, delay, individual, criterion, initial_state, start, fix,
    bound, coefficient_prior, robust, focus, stable, search_method, max_iterations, tolerance, faults, decimate, progress))]
#[allow(clippy::too_many_arguments)]
pub fn identify<'py>(
    py: Python<'py>,
    records: Vec<Bound<'py, PyAny>>,
    structure: &str,
    orders: BTreeMap<String, (usize, usize)>,
    method: &str,
    instruments: Option<String>,
    form: Option<String>,
    neuromuscular: bool,
    prior: Option<PriorOfUser>,
    remnant_order: Option<(usize, usize)>,
    delay: Option<(f64, f64)>,
    individual: Vec<String>,
    criterion: &str,
    initial_state: &str,
    start: Option<BTreeMap<String, f64>>,
    fix: BTreeMap<String, f64>,
    bound: BTreeMap<String, (f64, f64)>,
    coefficient_prior: BTreeMap<String, (f64, f64)>,
    robust: Option<f64>,
    focus: &str,
    stable: bool,
    search_method: &str,
    max_iterations: Option<usize>,
    tolerance: Option<f64>,
    faults: &str,
    decimate: &str,
    progress: Option<Bound<'py, PyAny>>,
) -> Outcome<Bound<'py, PyAny>> {
    let kind = names::kind(structure)?;
    let records = arrays::records(&records, Wanted::All)?;
    let step = names::search_method(search_method)?;
    let search = |usual: SearchOptions| SearchOptions {
        method: step,
        max_iterations: max_iterations.unwrap_or(usual.max_iterations),
        tolerance: tolerance.unwrap_or(usual.tolerance),
    };
    let initial_state = names::initial_state(initial_state)?;
    let constraints = names::constraints(fix, bound)?;
    let handling = (
        names::choice::<FaultHandling>("faults", faults)?,
        files::decimation(decimate)?,
    );
    let samples: usize = records.iter().map(Record::len).sum();

    /// How it is done, for a thread of its own.
    fn work<E: BatchEstimator + Send + 'static>(
        estimator: E,
        (faults, rate): (FaultHandling, Decimation),
        records: Vec<Record>,
        found: impl FnOnce(Box<Identified<E::Fit>>) -> Found + Send + 'static,
    ) -> Work {
        let how = Identification {
            faults,
            rate,
            ..Identification::of(estimator)
        };
        Box::new(move |standing| {
            let run = || how.run(Recordings::of_records(records));
            Ok(found(Box::new(interrupt::told(standing, run)?)))
        })
    }

    let (work, models): (Work, usize) = match kind {
        Kind::Polynomial(structure) => {
            let usual = Polynomials::new(structure);
            let estimator = Polynomials {
                template: Estimator {
                    initial_state,
                    search: search(usual.template.search),
                    constraints,
                    priors: names::priors(coefficient_prior)?,
                    loss: robust.map_or(Loss::Quadratic, |threshold| Loss::Huber { threshold }),
                    focus: names::focus(focus)?,
                    stable,
                    ..usual.template
                },
                orders: names::named_orders(&orders)?,
                delay_s: delay,
                criterion: names::criterion(criterion)?,
                start,
                method: names::fit_method(method)?,
                instruments: instruments.as_deref().map(Instruments::of_text),
                ..usual
            };
            let models = estimator.ranges(records[0].sample_time())?.combinations()?.len();
            (work(estimator, handling, records, Found::Polynomials), models)
        }
        Kind::GreyBox => {
            let usual = GreyBox::new(names::range("remnant_order", remnant_order.unwrap_or((1, 4)))?);
            let estimator = GreyBox {
                delay_range_s: delay.unwrap_or(usual.delay_range_s),
                constraints,
                individual,
                initial_state: initial_state.unwrap_or_default(),
                search: search(usual.search),
                ..usual
            };
            (work(estimator, handling, records, Found::GreyBox), 10)
        }
        Kind::TimeVarying => {
            if initial_state.is_some_and(|rule| rule != InitialState::Estimate) {
                return Err(bad_option(
                    "initial_state: the time-varying fit estimates the initial states; \
                     give \"auto\" or \"estimate\"",
                ));
            }
            let usual = SigmoidChange::default().with_noise_orders(&names::named_orders(&orders)?)?;
            let estimator = SigmoidChange {
                form: match form.as_deref() {
                    None | Some("auto") => usual.form,
                    Some(name) => names::choice("form", name)?,
                },
                neuromuscular,
                prior: prior.map_or(Ok(usual.prior.clone()), PriorOfUser::prior)?,
                delay_range_s: delay.unwrap_or(usual.delay_range_s),
                constraints,
                search: search(usual.search),
                ..usual
            };
            (work(estimator, handling, records, Found::Change), 10)
        }
    };
    let found = if samples * models < LONG && progress.is_none() {
        py.detach(|| work(&Arc::default())).map_err(Failure::from)?
    } else {
        interrupt::run(py, models as u64, progress.as_ref(), false, work)?
    };
    Ok(match found {
        Found::Polynomials(found) => Bound::new(py, PyFit::of_polynomials(*found))?.into_any(),
        Found::GreyBox(found) => Bound::new(py, PyFit::of_grey_box(*found))?.into_any(),
        Found::Change(found) => Bound::new(py, PyTimeVaryingFit::new(*found))?.into_any(),
    })
}

/// Name of each batch estimator, the structures that it serves, and the keywords that it takes.
#[pyfunction]
pub fn batch_estimators() -> Vec<(&'static str, Vec<&'static str>, Vec<&'static str>)> {
    let structures = |spec: &MethodSpec| spec.structures.iter().map(|structure| structure.name()).collect();
    let keywords = |spec: &MethodSpec| spec.settings.iter().map(|setting| setting.name).collect();
    let of = |spec: &MethodSpec| (spec.name, structures(spec), keywords(spec));
    estimators().iter().map(of).collect()
}
