//! Writing of files and directories without loss of data.
//!
//! | module | contents |
//! |---|---|
//! | `atomic` | [`write_atomically`]: files that are either complete or absent |
//! | `part_file` | temporary files, and removal of those left by ended processes |
//! | `output_check` | [`check_output`]: protection of inputs from being overwritten |
//! | `directory_lock` | [`DirectoryLock`]: use of a directory by one process at a time |

mod atomic;
mod directory_lock;
mod output_check;
mod part_file;

pub(crate) use atomic::WholeFile;
pub use atomic::{make_directory, write_atomically};
pub use directory_lock::DirectoryLock;
pub use output_check::{check_output, check_output_directory, is_same_file};
pub use part_file::remove_unfinished_files;
