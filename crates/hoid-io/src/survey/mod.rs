//! Contents of a file before any selection: columns, their sampling and ranges.
//!
//! | module | contents |
//! |---|---|
//! | `file` | [`survey()`]: contents of a file |
//! | `read` | the columns of a file, as read |
//! | `values` | [`ValueSurvey`]: statistics of a column |
//! | `sampling` | [`SamplingSurvey`]: the sampling of columns that share a time |

mod file;
mod read;
mod sampling;
mod values;

pub use file::{ColumnSurvey, FileSurvey, survey};
pub use sampling::SamplingSurvey;
pub use values::ValueSurvey;
