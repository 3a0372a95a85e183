//! Rules for all files and directories that are written.
//!
//! | module | contents |
//! |---|---|
//! | `atomic` | [`write_atomically`]: files that are whole or not there |
//! | `part_file` | files on their way, and what dead processes left of them |
//! | `place` | [`check_output`]: no result in the place of an input |
//! | `directory_lock` | [`DirectoryLock`]: one process a directory |

mod atomic;
mod directory_lock;
mod part_file;
mod place;

pub(crate) use atomic::WholeFile;
pub use atomic::{make_directory, write_atomically};
pub use directory_lock::DirectoryLock;
pub use part_file::remove_unfinished_files;
pub use place::{check_output, check_output_directory, is_same_file};
