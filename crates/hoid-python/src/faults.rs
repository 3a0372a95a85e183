//! What was found in the records of a fit, and what was done to them.

use hoid_analysis::Recordings;
use hoid_io::Step;
use hoid_model::Fault;
use pyo3::{prelude::*, types::PyDict};

use crate::arrays::parts;

/// Which of the given records it belongs to, and its parts.
type Of<'py> = (usize, Bound<'py, PyDict>);

/// The faults of recordings: which of those given, and the fault.
pub fn faults_of<'py>(py: Python<'py>, data: &Recordings) -> PyResult<Vec<Of<'py>>> {
    let all = data.origins.iter().zip(&data.accounts);
    all.flat_map(|(origin, account)| account.faults.iter().map(|fault| (*origin, fault)))
        .map(|(origin, fault)| Ok((origin, fault_parts(py, fault)?)))
        .collect()
}

/// A fault by the names of its fields.
fn fault_parts<'py>(py: Python<'py>, fault: &Fault) -> PyResult<Bound<'py, PyDict>> {
    let one = PyDict::new(py);
    one.set_item("kind", fault.kind.name())?;
    one.set_item("channel", &fault.channel)?;
    one.set_item("from", fault.from_s)?;
    one.set_item("to", fault.to_s)?;
    one.set_item("samples", fault.samples)?;
    one.set_item("size", fault.size)?;
    one.set_item("deviations", fault.deviations)?;
    one.set_item("action", fault.action.name())?;
    one.set_item("words", fault.to_string())?;
    Ok(one)
}

/// Which of the given records a record is of, its parts, and what was done to it.
pub type UsedRecord<'py> = (usize, Bound<'py, PyDict>, Vec<String>);

/// The records as they were fitted.
pub fn used_records<'py>(py: Python<'py>, data: &Recordings) -> PyResult<Vec<UsedRecord<'py>>> {
    let all = data.origins.iter().zip(&data.records).zip(&data.accounts);
    all.map(|((origin, record), account)| {
        let steps: Vec<String> = account.steps.iter().map(ToString::to_string).collect();
        let leads = account.steps.iter().map(|step| match step {
            Step::Rate { input_lead_s, .. } => *input_lead_s,
            _ => 0.0,
        });
        let parts = parts(py, record.clone())?;
        parts.set_item("input_lead", leads.sum::<f64>())?;
        Ok((*origin, parts, steps))
    })
    .collect()
}
