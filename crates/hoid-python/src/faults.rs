//! `repair`: the faults of records, and the records without them.

use hoid_analysis::Recordings;
use hoid_ident::level;
use hoid_model::{Fault, FaultHandling, Verdict};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{self, Wanted, parts},
    errors::Outcome,
    figures::{VerdictParts, verdict},
    names::{self, Kind},
};

/// Which of the given records it belongs to, and its parts.
type Of<'py> = (usize, Bound<'py, PyDict>);
/// The segments of records, what was found in them, and what that says of a result.
type Repaired<'py> = (Vec<Of<'py>>, Vec<Of<'py>>, VerdictParts);

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

/// The records without their faults, as every fit takes them: a record that is cut gives several.
#[pyfunction]
#[pyo3(signature = (records, handling))]
pub fn repair<'py>(py: Python<'py>, records: Vec<Bound<'py, PyAny>>, handling: &str) -> Outcome<Repaired<'py>> {
    let handling = names::choice::<FaultHandling>("faults", handling)?;
    let records = arrays::records(&records, Wanted::All)?;
    let found = py.detach(|| Recordings::of_records(records).repaired(handling))?;
    let faults = faults_of(py, &found)?;
    let says = verdict(&Verdict::of(found.findings()));
    let segments = found.origins.into_iter().zip(found.records);
    let segments: PyResult<Vec<_>> = segments.map(|(origin, s)| Ok((origin, parts(py, s)?))).collect();
    Ok((segments?, faults, says))
}

/// True for records that a level is estimated of.
#[pyfunction]
pub fn may_have_level(records: Vec<Bound<'_, PyAny>>) -> Outcome<bool> {
    Ok(level::may_have_level(&arrays::records(&records, Wanted::All)?))
}

/// The records without their means, where a fit of this structure estimates a level by that.
#[pyfunction]
pub fn without_level<'py>(
    py: Python<'py>,
    records: Vec<Bound<'py, PyAny>>,
    structure: &str,
) -> Outcome<Option<Vec<Bound<'py, PyDict>>>> {
    let takes_means = match names::kind(structure)? {
        Kind::Polynomial(structure) => structure.has_input(),
        Kind::GreyBox => true,
        Kind::TimeVarying => false,
    };
    if !takes_means {
        return Ok(None);
    }
    let records = arrays::records(&records, Wanted::All)?;
    let without: PyResult<Vec<_>> = level::without_level(&records)
        .into_iter()
        .map(|r| parts(py, r))
        .collect();
    Ok(Some(without?))
}
