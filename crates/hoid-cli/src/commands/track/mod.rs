//! `hoid track`: a recursive estimate over a record, with the trace in a file.

mod methods;
mod page;
mod report;
mod run;

pub use run::run;
