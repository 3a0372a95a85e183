//! From a recording to a trace and its verdict: the steps in their order.
//!
//! ```text
//! file -- Reading --> Recordings -- Tracking { options }.run --> Tracked { trace, verdict, data, settings }
//! ```
//!
//! A high rate is lowered; open orders are searched on the start span; the recursion processes the record, with a
//! second run that chooses its covariance if one is given; the verdict is that of the trace together with the findings
//! of the recording. Faults are handled by the guard, sample by sample: a recording is not repaired beforehand.

mod errors;
mod run;
mod settings;
mod tracked;

pub use errors::relative_errors;
pub use run::{Tracking, options_of_recursion};
pub use settings::settings_of_recursion;
pub use tracked::Tracked;
