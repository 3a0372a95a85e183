//! Tracking: the processing steps from a recording to a trace and its verdict.
//!
//! ```text
//! file -- Reading --> Recordings -- Tracking { options }.run --> TrackingResult { trace, verdict, data, settings }
//! ```
//!
//! A high sampling rate is reduced. Orders that are not given are searched on the span of the start fit. The recursion
//! then processes the record; if a second run is given, it determines the covariance of the recursion. The verdict
//! combines the verdict on the trace and the findings on the recording. The guard handles faults sample by sample, so a
//! recording is not repaired beforehand.

mod errors;
mod inputs;
mod run;
mod settings;
mod tracked;

pub use errors::relative_errors;
pub use inputs::two_inputs;
pub use run::{Tracking, recursion_options_error};
pub use settings::settings_of_recursion;
pub use tracked::TrackingResult;
