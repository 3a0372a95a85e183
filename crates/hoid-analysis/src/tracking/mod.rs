//! From a recording to a trace and its reliability: what is done, in its order.
//!
//! ```text
//! file -- Reading --> Recordings -- Tracking { options }.run --> Tracked { trace, verdict, data, settings }
//! ```
//!
//! A high rate is lowered; orders that are open are searched on the start span; the recursion goes over the record,
//! with a second run that chooses its covariance where one is given; the verdict is that of the trace after what the
//! recording shows. Faults are the guard's, sample by sample: a recording is not repaired before.

mod errors;
mod run;
mod settings;
mod tracked;

pub use errors::relative_errors;
pub use run::{Tracking, plan_of};
pub use settings::settings_of_recursion;
pub use tracked::Tracked;
