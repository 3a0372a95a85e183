//! `mend`: the faults of a record, and the record without them.

use hoid_ident::{faults::mend as mend_record, level};
use hoid_model::{FaultHandling, Verdict};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{self, Wanted, parts},
    errors::Outcome,
    figures::{VerdictParts, verdict},
    names::{self, Kind},
};

/// The segments of a record, what was found in it, and what that says of a result.
type Mended<'py> = (Vec<Bound<'py, PyDict>>, Vec<Bound<'py, PyDict>>, VerdictParts);

#[pyfunction]
#[pyo3(signature = (record, handling))]
pub fn mend<'py>(py: Python<'py>, record: &Bound<'py, PyAny>, handling: &str) -> Outcome<Mended<'py>> {
    let handling = names::choice::<FaultHandling>("faults", handling)?;
    let record = arrays::record(record, Wanted::All)?;
    let found = py.detach(|| mend_record(&record, handling))?;
    let mut faults = Vec::with_capacity(found.faults.len());
    for fault in &found.faults {
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
        faults.push(one);
    }
    let segments: PyResult<Vec<_>> = found.segments.into_iter().map(|s| parts(py, s)).collect();
    Ok((segments?, faults, verdict(&Verdict::of(found.findings))))
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
