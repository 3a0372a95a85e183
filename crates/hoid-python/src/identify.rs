//! `pyhoid.identify`: from records and options to a fit.

use std::collections::BTreeMap;

use hoid_ident::{
    Choice, Estimator, Fit, GreyBox, GreyBoxFit, IdentError, InitialState, InstrumentalVariable, Instruments, Loss,
    SearchOptions, SigmoidChange, SigmoidFit, estimators,
    judgement::second_opinion::{of_grey_box, of_polynomials, of_sigmoid},
    order_selection::{default_operator_ranges, fit_or_choose},
    settings::MethodSpec,
};
use hoid_model::{Finding, Record};
use pyo3::prelude::*;

use crate::{
    arrays::{self, Wanted},
    errors::{Failure, Outcome, bad_option},
    family::PriorOfUser,
    fit::PyFit,
    interrupt::{self, Standing},
    names::{self, Kind},
    time_varying::PyTimeVaryingFit,
};

/// Samples times models from which a fit is long enough to get a thread of its own, for interrupts.
const LONG: usize = 50_000;

/// What a fit gave.
enum Found {
    Model(Box<(Fit, Option<Choice>, Option<GreyBoxFit>)>, Vec<Finding>),
    Change(Box<SigmoidFit>, Option<Finding>),
}

/// Fits a model to records. The package has brought all options into plain form.
#[pyfunction]
#[pyo3(signature = (records, structure, *, orders, method, instruments, form, neuromuscular, prior, remnant_order, delay, individual, criterion, initial_state, start, fix,
    bound, coefficient_prior, robust, focus, stable, search_method, max_iterations, tolerance, second_opinion, level, progress))]
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
    max_iterations: usize,
    tolerance: f64,
    second_opinion: bool,
    level: bool,
    progress: Option<Bound<'py, PyAny>>,
) -> Outcome<Bound<'py, PyAny>> {
    let kind = names::kind(structure)?;
    let by_instruments = names::fit_method(method)?;
    let mut channels: Vec<&str> = Vec::new();
    if by_instruments.is_some() {
        channels.push(instruments.as_deref().unwrap_or("f_t"));
    }
    let records = arrays::records(&records, Wanted::Only(&channels))?;
    let search = SearchOptions {
        method: names::search_method(search_method)?,
        max_iterations,
        tolerance,
    };
    let initial_state = names::initial_state(initial_state)?;
    let constraints = names::constraints(fix, bound)?;
    let count = records.len();
    let samples: usize = records.iter().map(Record::len).sum();

    type Work = Box<dyn FnOnce(&Standing) -> Result<Found, IdentError> + Send>;
    let (work, models): (Work, usize) = match kind {
        Kind::Polynomial(structure) => {
            let usual = default_operator_ranges(structure, records[0].sample_time());
            let orders = names::with_delay(&orders, delay, records[0].sample_time())?;
            let ranges = usual.with(&orders)?;
            let criterion = names::criterion(criterion)?;
            let combinations = ranges.combinations()?;
            let mut estimator = Estimator {
                initial_state,
                search,
                constraints,
                priors: names::priors(coefficient_prior)?,
                loss: robust.map_or(Loss::Quadratic, |threshold| Loss::Huber { threshold }),
                focus: names::focus(focus)?,
                stable,
                ..Estimator::new(structure, combinations[0])
            };
            estimator.start = match &start {
                Some(_) if combinations.len() > 1 => {
                    return Err(bad_option(
                        "start belongs to one model, but a range of orders or delays is searched; \
                         give nk and the orders as single numbers",
                    ));
                }
                Some(start) => Some(names::theta(&combinations[0].parameter_names(), start)?),
                None => None,
            };
            let work: Work = Box::new(move |standing| {
                let (mut fit, choice) = fit_or_choose(&estimator, &ranges, criterion, &records, &|| standing.inc())?;
                if let Some(method) = by_instruments {
                    let instruments = match instruments.as_deref() {
                        Some("simulated") => Instruments::Simulated,
                        Some(channel) => Instruments::External(channel.to_owned()),
                        None => Instruments::usual(&records),
                    };
                    fit = InstrumentalVariable {
                        instruments,
                        max_iterations,
                        ..InstrumentalVariable::new(method, fit.orders())
                    }
                    .fit(&records)?;
                }
                let by_squares = by_instruments.is_none() && estimator.loss == Loss::Quadratic;
                let opinions = (second_opinion && by_squares).then(|| of_polynomials(&estimator, &fit, &records, None));
                Ok(Found::Model(
                    Box::new((fit, choice, None)),
                    opinions.unwrap_or_default(),
                ))
            });
            (work, combinations.len())
        }
        Kind::GreyBox => {
            let (low, high) = remnant_order.unwrap_or((1, 4));
            let mut estimator = GreyBox {
                constraints,
                individual,
                initial_state: initial_state.unwrap_or_default(),
                search,
                ..GreyBox::new(names::range("remnant_order", (low, high))?)
            };
            if let Some(delay) = delay {
                estimator.delay_range_s = delay;
            }
            let work: Work = Box::new(move |_| {
                let found = estimator.fit(&records)?;
                let opinions = second_opinion.then(|| of_grey_box(&estimator, &found, &records, None));
                let model = Box::new((found.polynomial_fit(0).clone(), None, Some(found)));
                Ok(Found::Model(model, opinions.unwrap_or_default()))
            });
            (work, 10)
        }
        Kind::TimeVarying => {
            if initial_state.is_some_and(|rule| rule != InitialState::Estimate) {
                return Err(bad_option(
                    "initial_state: the time-varying fit estimates the initial states; \
                     give \"auto\" or \"estimate\"",
                ));
            }
            let usual = SigmoidChange::default();
            let nd = match orders.iter().next() {
                None => usual.nd,
                Some((name, (low, high))) if orders.len() == 1 && name == "nd" && low == high => *low,
                Some(_) => return Err(bad_option("the time-varying fit takes only nd, a single number")),
            };
            let mut estimator = SigmoidChange {
                form: match form.as_deref() {
                    None | Some("auto") => usual.form,
                    Some(name) => names::choice("form", name)?,
                },
                neuromuscular,
                level,
                prior: prior.map_or(Ok(usual.prior.clone()), PriorOfUser::prior)?,
                nd,
                constraints,
                search,
                ..usual
            };
            if let Some(delay) = delay {
                estimator.delay_range_s = delay;
            }
            let work: Work = Box::new(move |_| {
                let found = estimator.fit(&records)?;
                let opinion = second_opinion.then(|| of_sigmoid(&estimator, &found, &records));
                Ok(Found::Change(Box::new(found), opinion.flatten()))
            });
            (work, 10)
        }
    };
    let found = if samples * models < LONG && progress.is_none() {
        py.detach(|| work(&Standing::default())).map_err(Failure::from)?
    } else {
        interrupt::run(py, models as u64, progress.as_ref(), false, work)?
    };
    Ok(match found {
        Found::Model(found, opinions) => {
            let (fit, choice, grey_box) = *found;
            Bound::new(py, PyFit::new(fit, choice, grey_box, count).with_opinions(opinions))?.into_any()
        }
        Found::Change(fit, opinion) => Bound::new(py, PyTimeVaryingFit::new(*fit, opinion))?.into_any(),
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
