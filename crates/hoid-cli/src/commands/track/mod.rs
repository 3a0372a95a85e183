//! `hoid track`: a recursive estimate over a record, its trace into a file.

mod page;
mod report;
mod run;

pub use run::run;
