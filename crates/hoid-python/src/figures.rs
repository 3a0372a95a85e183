//! Conversion of small results to Python: estimates to pairs, operators to dictionaries.

use hoid_ident::{
    MarginEstimates, ResponsePoint, Termination,
    validation::{GoodnessOfFit, LjungBox},
};
use hoid_model::{
    NotConvertible, Orders, Verdict,
    margins::Margins,
    uncertainty::{Estimate, OperatorEstimate, RemnantEstimate},
};
use numpy::PyArray1;
use pyo3::{prelude::*, types::PyDict};

use crate::arrays::array;

/// Converts a fault detected by the guard of a recursion to a dictionary.
pub fn track_fault<'py>(py: Python<'py>, fault: &hoid_track::TrackFault) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    all.set_item("kind", fault.kind.name())?;
    all.set_item("channel", fault.channel.name())?;
    all.set_item("from", fault.from_s)?;
    all.set_item("to", fault.to_s)?;
    all.set_item("size", fault.size)?;
    all.set_item("action", fault.action.name())?;
    Ok(all)
}

/// Value and standard error.
pub type ValueWithError = (f64, Option<f64>);

pub fn value_and_error(e: Estimate) -> ValueWithError {
    (e.value, e.standard_error)
}

/// Returns the standard error as an array element; NaN if there is none.
pub fn error_or_nan(e: Estimate) -> f64 {
    e.standard_error.unwrap_or(f64::NAN)
}

/// Returns the verdict as in the JSON of results, from which the package builds `pyhoid.Verdict`.
pub fn verdict(v: &Verdict) -> String {
    hoid_analysis::json::verdict(v).to_string()
}

/// Converts the termination of a search to a dictionary.
pub fn termination<'py>(py: Python<'py>, found: Termination) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    all.set_item("reason", found.reason.to_string())?;
    all.set_item("converged", found.converged())?;
    all.set_item("iterations", found.iterations)?;
    Ok(all)
}

pub fn orders<'py>(py: Python<'py>, o: &Orders) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    for (name, value) in o.named_orders() {
        all.set_item(name, value)?;
    }
    Ok(all)
}

/// Returns the operator, or the reason why the model cannot be converted; `None` if its orders cannot represent an
/// operator.
pub fn operator<'py>(
    py: Python<'py>,
    found: &Result<OperatorEstimate, NotConvertible>,
) -> PyResult<Option<Bound<'py, PyDict>>> {
    let all = PyDict::new(py);
    match found {
        Ok(o) => {
            all.set_item("convertible", true)?;
            all.set_item("stable", o.parameters().is_stable())?;
            for (name, _, e) in o.rows() {
                all.set_item(name, value_and_error(e))?;
            }
        }
        Err(NotConvertible::OtherOrders { .. } | NotConvertible::PolesInBoth { .. }) => return Ok(None),
        Err(reason) => {
            all.set_item("convertible", false)?;
            all.set_item("reason", reason.to_string())?;
        }
    }
    Ok(Some(all))
}

pub fn remnant<'py>(py: Python<'py>, found: &Result<RemnantEstimate, NotConvertible>) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    match found {
        Ok(r) => {
            all.set_item("convertible", true)?;
            all.set_item("order", r.order)?;
            all.set_item("discretisation", r.discretisation.name())?;
            all.set_item("T_n", value_and_error(r.t_n_s))?;
            all.set_item("K_n", value_and_error(r.k_n))?;
        }
        Err(reason) => {
            all.set_item("convertible", false)?;
            all.set_item("reason", reason.to_string())?;
        }
    }
    Ok(all)
}

pub fn margins<'py>(py: Python<'py>, m: &MarginEstimates) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    for (name, estimate) in [
        ("crossover_rad_s", m.crossover_rad_s),
        ("phase_margin_deg", m.phase_margin_deg),
        ("gain_margin_db", m.gain_margin_db),
        ("phase_crossover_rad_s", m.phase_crossover_rad_s),
    ] {
        all.set_item(name, estimate.map(value_and_error))?;
    }
    Ok(all)
}

pub fn plain_margins<'py>(py: Python<'py>, m: &Margins) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    all.set_item("crossover_rad_s", m.crossover_rad_s)?;
    all.set_item("phase_margin_deg", m.phase_margin_deg)?;
    all.set_item("gain_margin_db", m.gain_margin_db)?;
    all.set_item("phase_crossover_rad_s", m.phase_crossover_rad_s)?;
    Ok(all)
}

/// Returns the settings: displayed name, value, and whether the user gave it.
pub fn settings(all: &[hoid_analysis::Setting]) -> Vec<(String, String, bool)> {
    let parts = |one: &hoid_analysis::Setting| (one.name.clone(), one.value.clone(), one.is_given);
    all.iter().map(parts).collect()
}

pub fn quality<'py>(py: Python<'py>, q: &GoodnessOfFit) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    all.set_item("vaf_simulation", q.vaf_simulation)?;
    all.set_item("vaf_prediction", q.vaf_prediction)?;
    all.set_item("nrmse_simulation", q.nrmse_simulation)?;
    all.set_item("nrmse_prediction", q.nrmse_prediction)?;
    Ok(all)
}

pub fn ljung_box<'py>(py: Python<'py>, test: Option<&LjungBox>) -> PyResult<Option<Bound<'py, PyDict>>> {
    let Some(test) = test else { return Ok(None) };
    let all = PyDict::new(py);
    all.set_item("statistic", test.statistic)?;
    all.set_item("degrees_of_freedom", test.degrees_of_freedom)?;
    all.set_item("p_value", test.p_value)?;
    Ok(Some(all))
}

/// Returns the magnitude in dB and the phase in deg at several points, each with its standard error (NaN if there is
/// none).
pub fn response_columns<'py>(py: Python<'py>, points: &[ResponsePoint]) -> [Bound<'py, PyArray1<f64>>; 4] {
    let column = |of: &dyn Fn(&ResponsePoint) -> f64| array(py, points.iter().map(of).collect());
    [
        column(&|p| p.magnitude_db.value),
        column(&|p| error_or_nan(p.magnitude_db)),
        column(&|p| p.phase_deg.value),
        column(&|p| error_or_nan(p.phase_deg)),
    ]
}
