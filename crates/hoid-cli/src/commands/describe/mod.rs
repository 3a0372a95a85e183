//! `hoid describe`: how a person responds at the lines of a periodic excitation. `run` takes
//! records to a description; `form` shows it, to people and to programs.

mod form;
mod run;

pub use run::run;
