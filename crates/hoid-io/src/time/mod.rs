//! The time of a recording: its column, its unit, and whether it is evenly spaced.
//!
//! | module | contents |
//! |---|---|
//! | `time_choice` | [`TimeChoice`]: the column and its unit as a person types them |
//! | `time_column` | the time under another name, in another unit |
//! | `moment` | dates and times of a clock |
//! | `sampling` | the sample time of an evenly spaced t, and the reasons why t may be unevenly spaced |

mod moment;
pub(crate) mod sampling;
mod time_choice;
mod time_column;

pub(crate) use moment::{Moments, seconds};
pub use sampling::even_times;
pub use time_choice::TimeChoice;
pub(crate) use time_column::{is_time, may_be_time, with_time};
