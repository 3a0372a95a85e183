//! The time of a recording: its column, its unit, and a check that it is evenly spaced.
//!
//! | module | contents |
//! |---|---|
//! | `time_choice` | [`TimeChoice`]: the column and its unit as typed by the user |
//! | `time_column` | recognition of the time under another name or in another unit |
//! | `moment` | dates and clock times |
//! | `sampling` | the sample time of an evenly spaced t, and the reasons why t is not evenly spaced |

mod moment;
pub(crate) mod sampling;
mod time_choice;
mod time_column;

pub(crate) use moment::{ClockTimes, is_clock_time, seconds_between};
pub use sampling::even_times;
pub use time_choice::TimeChoice;
pub(crate) use time_column::{is_time, is_time_unit, may_be_time, with_time};
