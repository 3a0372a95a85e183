//! `hoid identify`: from records to a model and the parameters of the operator.

mod axes;
mod family;
mod family_form;
mod request;
mod run;
mod several;
mod sigmoid;

pub use run::run;
