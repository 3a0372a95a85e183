//! Storage of a session in a folder.
//!
//! ```text
//! OUT/                                     one experiment, any number of people
//!   README, dataset_description.json, participants.tsv, group.toml
//!   sub-P01/ses-01/                        one session
//!     lab.toml, lab.copy.toml              plan, person, browser and screen; stored twice
//!     runs.csv                             a line for each run that ended, with its verdict
//!     sub-P01_ses-01_task-rate_run-01_...  the files of a run, one stem each:
//!       run.json                           the task and its settings, written before the run
//!       forcing.parquet                    target and disturbance at each tick
//!       ticks.csv, events.csv, frames.csv  ticks, events and frames, appended during the run
//!       live.csv                           the live estimate
//!       end.json                           end of the run, and hashes of the three files
//!       beh.parquet                        the record at 100 Hz, for all commands of hoid
//! ```
//!
//! Appended files are passed to the operating system with each batch from the page and flushed to the disk every
//! second. Other files are written atomically. A folder therefore always shows the progress of the session: a run
//! without `end.json` was interrupted.
//!
//! | file | contents |
//! |---|---|
//! | `folder` | the names of files and folders |
//! | `run_start` | [`RunStart`]: data known before a run; [`EndRecord`]: data known after it |
//! | `log` | [`RunLog`]: the appended data |
//! | `log_reader` | [`LoggedRun`]: the appended data, read back |
//! | `state` | [`Session`]: the session as a whole |

mod folder;
mod log;
mod log_reader;
mod run_start;
mod state;

pub use folder::{Stem, session_folder};
pub use log::{Batch, Event, Frame, RunLog};
pub use log_reader::LoggedRun;
pub use run_start::{EndRecord, RunEnd, RunStart, digest};
pub use state::{FinishedRun, Session, SessionPlan};
