//! `hoid describe`: the response of an operator at the lines of a periodic excitation. `run` computes the describing
//! function from records; `form` formats it as text.

mod form;
mod run;

pub use run::run;
