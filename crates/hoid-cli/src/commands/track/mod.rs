//! `hoid track`: a recursive estimate over a record, its trace into a file.

mod errors;
mod json;
mod page;
mod report;
mod result;
mod run;

pub use errors::relative_errors;
pub use run::run;
