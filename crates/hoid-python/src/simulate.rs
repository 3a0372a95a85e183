//! `pyhoid.simulate`, `pyhoid.margins`, `pyhoid.convert`: scenarios, and conversions of the operator.

use std::path::PathBuf;

use hoid_io::{AnyScenario, ScenarioChanges, parse_any_scenario, read_any_scenario};
use hoid_model::{
    ContinuousTransferFunction, DiscreteOperator, FamilyScenario, ModelError, OperatorParameters, SampleTime,
    discretise::discretise,
    margins::{MANUAL_CONTROL_RANGE_RAD_S, margins as margins_of},
    remnant::HIGHEST_ORDER,
    scenario::{Condition, Scenario},
    second_order::ZohSecondOrder,
    uncertainty::OperatorEstimate,
};
use hoid_sim::{FamilySimulator, RunSeed, Simulator};
use numpy::PyArray1;
use pyo3::{
    prelude::*,
    types::{PyDict, PyList},
};

use crate::{
    arrays::{array, record_to_dict},
    errors::{Outcome, bad_option},
    figures, names,
};

/// Returns the scenario given by a condition, a file, or text.
fn scenario(condition: Option<&str>, file: Option<PathBuf>, text: Option<&str>) -> Outcome<AnyScenario> {
    match (condition, file, text) {
        (Some(condition), None, None) => {
            let scenario = Scenario::condition(condition.parse::<Condition>()?);
            Ok(AnyScenario::Reference(Box::new(scenario)))
        }
        (None, Some(file), None) => Ok(read_any_scenario(&file)?),
        (None, None, Some(text)) => Ok(parse_any_scenario(text, "(text)", "scenario")?),
        _ => Err(bad_option("give either condition, such as \"C4\", or scenario")),
    }
}

/// Simulates one closed-loop run.
#[pyfunction]
#[pyo3(signature = (*, condition, scenario_file, scenario_text, remnant_order, noise_level, noise_definition, remnant_time_constant,
    sample_time, realisation, feedforward, disturbance, seed, cell, replication, keep_run_in))]
#[allow(clippy::too_many_arguments)]
pub fn simulate<'py>(
    py: Python<'py>,
    condition: Option<String>,
    scenario_file: Option<PathBuf>,
    scenario_text: Option<String>,
    remnant_order: Option<usize>,
    noise_level: Option<f64>,
    noise_definition: Option<String>,
    remnant_time_constant: Option<f64>,
    sample_time: Option<f64>,
    realisation: Option<String>,
    feedforward: Option<String>,
    disturbance: Option<f64>,
    seed: u64,
    cell: u64,
    replication: u64,
    keep_run_in: bool,
) -> Outcome<Bound<'py, PyDict>> {
    let run_seed = RunSeed {
        seed,
        cell,
        replication,
    };
    let changes = ScenarioChanges {
        remnant_order,
        noise_level,
        noise_definition: noise_definition.as_deref().map(names::noise_definition).transpose()?,
        remnant_time_constant,
        sample_time,
        realisation: realisation.as_deref().map(names::realisation).transpose()?,
        feedforward,
        disturbance,
    };
    let base = scenario(condition.as_deref(), scenario_file, scenario_text.as_deref())?;
    let changed = changes.apply(base).map_err(|error| bad_option(error.to_string()))?;
    let record = py.detach(|| match changed {
        AnyScenario::Reference(scenario) => Simulator::new(&scenario)?.run(run_seed, keep_run_in),
        AnyScenario::Family(scenario) => FamilySimulator::new(&scenario)?.run_with_truth(run_seed, keep_run_in),
    })?;
    Ok(record_to_dict(py, record)?)
}

/// Returns the crossover frequency, the margins and the remnant gains of a scenario.
#[pyfunction]
#[pyo3(signature = (*, condition, scenario_file, scenario_text, state, noise_levels, noise_definition))]
pub fn margins<'py>(
    py: Python<'py>,
    condition: Option<String>,
    scenario_file: Option<PathBuf>,
    scenario_text: Option<String>,
    state: &str,
    noise_levels: Vec<f64>,
    noise_definition: &str,
) -> Outcome<Bound<'py, PyDict>> {
    let scenario = scenario(condition.as_deref(), scenario_file, scenario_text.as_deref())?;
    let last = names::value_of_name("state", state, &[("initial", false), ("last", true)])?;
    let scenario = match scenario {
        AnyScenario::Reference(scenario) => *scenario,
        AnyScenario::Family(scenario) => return family_margins(py, &scenario, last),
    };
    let state = if last { scenario.last } else { scenario.initial };
    let open_loop = state
        .operator
        .transfer_function()?
        .series(&state.controlled_element.transfer_function()?);
    let found = margins_of(|omega| open_loop.response(omega), MANUAL_CONTROL_RANGE_RAD_S);
    let definition = names::noise_definition(noise_definition)?;
    let all = figures::plain_margins(py, &found)?;
    let gains = PyList::empty(py);
    for order in 1..=HIGHEST_ORDER {
        for &level in &noise_levels {
            let row = PyDict::new(py);
            row.set_item("remnant_order", order)?;
            row.set_item("noise_level", level)?;
            row.set_item("definition", noise_definition)?;
            // A noise level that cannot be reached is a row of the table; any other error concerns all noise levels.
            match scenario.remnant_gain_for(&state, order, level, definition) {
                Ok(k_n) => row.set_item("K_n", k_n)?,
                Err(reason @ ModelError::UnreachableNoiseLevel { .. }) => {
                    row.set_item("K_n", py.None())?;
                    row.set_item("reason", reason.to_string())?;
                }
                Err(error) => return Err(error.into()),
            }
            gains.append(row)?;
        }
    }
    all.set_item("remnant_gain", gains)?;
    Ok(all)
}

/// Returns the crossover frequency and the margins for an operator of the family, with the gain of each part of its
/// remnant.
fn family_margins<'py>(py: Python<'py>, scenario: &FamilyScenario, last: bool) -> Outcome<Bound<'py, PyDict>> {
    let state = if last { &scenario.last } else { &scenario.initial };
    let all = figures::plain_margins(py, &state.margins()?)?;
    let simulator = FamilySimulator::new(scenario)?;
    let gains = PyList::empty(py);
    for (part, gain) in scenario
        .remnant
        .iter()
        .zip(simulator.remnant_gains()[usize::from(last)])
    {
        let row = PyDict::new(py);
        row.set_item("share", part.share())?;
        row.set_item("gain", *gain)?;
        gains.append(row)?;
    }
    all.set_item("remnant_gain", gains)?;
    Ok(all)
}

fn conversion<'py>(
    py: Python<'py>,
    discrete: DiscreteOperator,
    operator: Result<OperatorParameters, hoid_model::NotConvertible>,
) -> PyResult<Bound<'py, PyDict>> {
    let (all, coefficients) = (PyDict::new(py), PyDict::new(py));
    let held = discrete.zoh;
    coefficients.set_item("f", [held.f1, held.f2])?;
    coefficients.set_item("b", [held.b0, held.b1])?;
    coefficients.set_item("nk", discrete.nk)?;
    all.set_item("sample_time", discrete.sample_time.s())?;
    all.set_item("discrete", coefficients)?;
    all.set_item(
        "operator",
        figures::operator(py, &operator.map(OperatorEstimate::from))?,
    )?;
    Ok(all)
}

/// Computes operator parameters from discrete coefficients.
#[pyfunction]
#[pyo3(signature = (f, b, nk, sample_time))]
pub fn convert_discrete<'py>(
    py: Python<'py>,
    f: [f64; 2],
    b: [f64; 2],
    nk: usize,
    sample_time: f64,
) -> Outcome<Bound<'py, PyDict>> {
    let discrete = DiscreteOperator {
        zoh: ZohSecondOrder {
            b0: b[0],
            b1: b[1],
            f1: f[0],
            f2: f[1],
        },
        nk,
        sample_time: SampleTime::new(sample_time)?,
    };
    Ok(conversion(py, discrete, discrete.parameters())?)
}

/// Computes discrete coefficients from operator parameters.
#[pyfunction]
#[pyo3(signature = (operator, sample_time))]
pub fn convert_operator<'py>(
    py: Python<'py>,
    operator: Vec<(String, f64)>,
    sample_time: f64,
) -> Outcome<Bound<'py, PyDict>> {
    let operator = OperatorParameters::from_names(&operator)?;
    let discrete = operator.discretise(SampleTime::new(sample_time)?)?;
    Ok(conversion(py, discrete, Ok(operator))?)
}

/// Discretises a transfer function. The coefficients are given in descending powers of s and returned in ascending
/// powers of q^-1.
#[pyfunction]
#[pyo3(signature = (num, den, sample_time, method, prewarp))]
pub fn discretise_transfer_function<'py>(
    py: Python<'py>,
    num: Vec<f64>,
    den: Vec<f64>,
    sample_time: f64,
    method: &str,
    prewarp: Option<f64>,
) -> Outcome<[Bound<'py, PyArray1<f64>>; 2]> {
    let h = ContinuousTransferFunction::new(&num, &den)?;
    let method = names::discretisation(method, prewarp)?;
    let discrete = discretise(&h, SampleTime::new(sample_time)?, method)?;
    Ok([array(py, discrete.num().to_vec()), array(py, discrete.den().to_vec())])
}
