//! One self-contained HTML page about recursive estimates over a record: parameters over time with 95 % bands, batch
//! fits and, if the record contains them, the true values, as well as innovations, standard errors and shortened steps.

mod batch_fits;
mod coefficients;
mod evaluated_trace;
mod panels;
mod report;
mod section;
mod tables;
mod truth;

pub use batch_fits::{BatchFit, batch_fit, default_batch_fits};
pub use report::TrackReport;
pub use section::{BatchLine, TraceSection};
