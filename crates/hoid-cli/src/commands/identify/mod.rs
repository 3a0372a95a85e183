//! `hoid identify`: identification of a model and of the parameters of the operator from records.

mod axes;
mod family;
mod family_form;
mod request;
mod run;
mod several_inputs;
mod sigmoid;

pub use run::run;
