//! Examination of a file: the meaning of its columns, the excitation of the loop and its span of whole periods, and
//! the lag of the recorded control.
//!
//! Command line, groups and Python all use this module, and nothing is chosen silently: the findings are shown, with
//! the evidence, in the form of [`Advice`] on how to read the file. Requested values are not searched for.
//!
//! | file | contents |
//! |---|---|
//! | `options` | prior knowledge of the file |
//! | `columns` | error and control, recognised by their common names |
//! | `periods` | the excitation, its period and lines, and the longest span of whole periods |
//! | `lag` | by how many samples the control was recorded later than the error, from the controlled element |
//! | `file` | all of these findings for one file: [`Look`] |
//! | `other_columns` | error message for a file without the columns that were requested |
//! | `advice` | advice on how to read the file, and the command to type |

mod advice;
mod columns;
mod file;
mod lag;
mod options;
mod other_columns;
mod periods;

pub use advice::{Advice, typed};
pub use columns::{Role, Roles};
pub use file::{Look, RecordSummary};
pub use lag::Lag;
pub use options::LookOptions;
pub use other_columns::{OtherColumns, other_columns};
pub use periods::Periods;
