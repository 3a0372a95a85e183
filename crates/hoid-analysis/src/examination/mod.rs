//! Examination of a file: the meaning of its columns, the excitation of the loop and its span of whole periods, and
//! the lag of the recorded control.
//!
//! The command line, the analysis of groups and Python use this module. No choice is made silently: the findings and
//! their evidence are shown as [`Advice`] on how to read the file. Values given by the user are not searched for.
//!
//! | file | contents |
//! |---|---|
//! | `options` | information about the file given by the user |
//! | `columns` | error and control, recognised by their common names |
//! | `periods` | the excitation, its period and lines, and the longest span of whole periods |
//! | `lag` | number of samples by which the control was recorded later than the error, for a known controlled element |
//! | `file` | [`FileExamination`]: all these findings for one file |
//! | `other_columns` | error message for a file without the columns that were requested |
//! | `advice` | advice on how to read the file, and the command to type |

mod advice;
mod columns;
mod file;
mod lag;
mod options;
mod other_columns;
mod periods;

pub use advice::{Advice, shell_command};
pub use columns::{Role, Roles};
pub use file::{FileExamination, RecordSummary};
pub use lag::Lag;
pub use options::ExaminationOptions;
pub use other_columns::{OtherColumns, other_columns};
pub use periods::Periods;
