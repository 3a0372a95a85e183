//! `hoid describe`: the response of an operator at the lines of a periodic excitation. `run`
//! computes the description from records; `form` formats it as text and JSON.

mod form;
mod run;

pub use run::run;
