//! The native module of the Python package `pyhoid`; it only converts between Python and the libraries.
//!
//! The libraries compute the results. The user interface is in `python/src/pyhoid`, which converts arguments to plain
//! types (floats, contiguous arrays, dictionaries) and wraps the results. Long computations run without the interpreter
//! lock.
//!
//! | module | contents |
//! |---|---|
//! | `arrays` | conversion of arrays and records |
//! | `errors` | exceptions for the errors of the libraries, by kind |
//! | `names`, `recursion` | conversion of names and options from Python |
//! | `figures` | estimates, operators and tests as dictionaries |
//! | `family` | the operator of a person |
//! | `identify`, `fit`, `time_varying` | batch fits |
//! | `track`, `tracker` | recursive estimates, over a record and online |
//! | `simulate` | scenarios, margins, conversions |
//! | `describing` | describing functions |
//! | `compare` | comparison of conditions and people |
//! | `design` | design of an experiment: forcing function and expected errors |
//! | `study`, `group` | studies, reproduction of the thesis, groups |
//! | `files`, `survey` | files of records and tables, and a survey of their contents |
//! | `interrupt` | long computations that can be interrupted |
#![allow(
    missing_docs,
    reason = "every public item is a Python object; the package and its stubs document them"
)]

mod arrays;
mod compare;
mod controlled_element;
mod describing;
mod design;
mod errors;
mod family;
mod faults;
mod figures;
mod files;
mod fit;
mod group;
mod identify;
mod interrupt;
mod keyword_messages;
mod names;
mod recursion;
mod simulate;
mod study;
mod survey;
mod time_varying;
mod track;
mod tracker;

use pyo3::prelude::*;

#[pymodule(gil_used = true)]
fn _pyhoid(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<describing::PyDescribingFunction>()?;
    module.add_class::<describing::PyDescription>()?;
    module.add_class::<family::PyOperatorFit>()?;
    module.add_class::<fit::PyFit>()?;
    module.add_class::<study::PyPlan>()?;
    module.add_class::<time_varying::PyTimeVaryingFit>()?;
    module.add_class::<track::PyTrace>()?;
    module.add_class::<tracker::PyTracker>()?;
    for function in [
        wrap_pyfunction!(compare::compare, module)?,
        wrap_pyfunction!(compare::comparison_figure_of, module)?,
        wrap_pyfunction!(design::design, module)?,
        wrap_pyfunction!(design::design_figures_of, module)?,
        wrap_pyfunction!(design::design_files_of, module)?,
        wrap_pyfunction!(describing::describe, module)?,
        wrap_pyfunction!(describing::describing_function, module)?,
        wrap_pyfunction!(files::check_record, module)?,
        wrap_pyfunction!(files::decimated, module)?,
        wrap_pyfunction!(files::signal_of, module)?,
        wrap_pyfunction!(keyword_messages::in_python, module)?,
        wrap_pyfunction!(files::detrended, module)?,
        wrap_pyfunction!(files::even_times, module)?,
        wrap_pyfunction!(files::read, module)?,
        wrap_pyfunction!(files::read_table, module)?,
        wrap_pyfunction!(files::write, module)?,
        wrap_pyfunction!(group::group, module)?,
        wrap_pyfunction!(group::group_manifest, module)?,
        wrap_pyfunction!(group::simulate_group, module)?,
        wrap_pyfunction!(group::simulate_people, module)?,
        wrap_pyfunction!(identify::batch_estimators, module)?,
        wrap_pyfunction!(identify::from_json, module)?,
        wrap_pyfunction!(identify::from_state, module)?,
        wrap_pyfunction!(identify::identify, module)?,
        wrap_pyfunction!(identify::identify_axes, module)?,
        wrap_pyfunction!(recursion::recursive_methods, module)?,
        wrap_pyfunction!(recursion::renamed_method, module)?,
        wrap_pyfunction!(simulate::convert_discrete, module)?,
        wrap_pyfunction!(simulate::convert_operator, module)?,
        wrap_pyfunction!(simulate::discretise_transfer_function, module)?,
        wrap_pyfunction!(simulate::margins, module)?,
        wrap_pyfunction!(simulate::simulate, module)?,
        wrap_pyfunction!(study::merge_shards, module)?,
        wrap_pyfunction!(study::plan_names, module)?,
        wrap_pyfunction!(study::reproduce, module)?,
        wrap_pyfunction!(survey::info, module)?,
        wrap_pyfunction!(track::track, module)?,
    ] {
        module.add_function(function)?;
    }
    Ok(())
}
