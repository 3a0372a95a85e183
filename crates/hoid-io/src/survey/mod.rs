//! Contents of a file before any selection: columns, their sampling and ranges.
//!
//! | module | contents |
//! |---|---|
//! | `file` | [`survey()`]: all that is found in a file |
//! | `read` | its columns, as they were read |
//! | `values` | [`ValueSurvey`]: the numbers of a column |
//! | `sampling` | [`SamplingSurvey`]: the sampling of columns that belong together |

mod file;
mod read;
mod sampling;
mod values;

pub use file::{ColumnSurvey, FileSurvey, survey};
pub use sampling::SamplingSurvey;
pub use values::ValueSurvey;
