//! Faults in the records of a fit, and the records with the steps applied to them.

use hoid_analysis::{FoundFault, Recordings};
use hoid_io::Step;
use pyo3::{prelude::*, types::PyDict};

use crate::arrays::record_to_dict;

/// Index of the given record, and the properties of the fault as a dictionary.
type IndexedFault<'py> = (usize, Bound<'py, PyDict>);

/// Returns the faults in recordings, each with the index of the given record.
pub fn faults_of<'py>(py: Python<'py>, data: &Recordings) -> PyResult<Vec<IndexedFault<'py>>> {
    let all = data.origins.iter().zip(&data.accounts);
    all.flat_map(|(origin, account)| account.found_faults().into_iter().map(|found| (*origin, found)))
        .map(|(origin, found)| Ok((origin, fault_to_dict(py, found)?)))
        .collect()
}

fn fault_to_dict(py: Python<'_>, found: FoundFault) -> PyResult<Bound<'_, PyDict>> {
    let one = PyDict::new(py);
    one.set_item("kind", found.kind)?;
    one.set_item("channel", found.channel)?;
    one.set_item("from", found.from_s)?;
    one.set_item("to", found.to_s)?;
    one.set_item("samples", found.samples)?;
    one.set_item("size", found.size)?;
    one.set_item("deviations", found.deviations)?;
    one.set_item("action", found.action)?;
    one.set_item("words", found.words)?;
    Ok(one)
}

/// Index of the given record from which a record comes, the parts of the record, and the steps applied to it.
pub type UsedRecord<'py> = (usize, Bound<'py, PyDict>, Vec<String>);

/// Returns the records that were fitted.
pub fn used_records<'py>(py: Python<'py>, data: &Recordings) -> PyResult<Vec<UsedRecord<'py>>> {
    let all = data.origins.iter().zip(&data.records).zip(&data.accounts);
    all.map(|((origin, record), account)| {
        let steps: Vec<String> = account.steps.iter().map(ToString::to_string).collect();
        let leads = account.steps.iter().map(|step| match step {
            Step::Rate { input_lead_s, .. } => *input_lead_s,
            _ => 0.0,
        });
        let parts = record_to_dict(py, record.clone())?;
        parts.set_item("input_lead", leads.sum::<f64>())?;
        Ok((*origin, parts, steps))
    })
    .collect()
}
