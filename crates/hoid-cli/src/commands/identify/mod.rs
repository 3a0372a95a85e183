//! `hoid identify`: records to a model and the operator's parameters.

mod family;
mod family_form;
mod request;
mod run;
mod several;
mod sigmoid;

pub use run::run;
