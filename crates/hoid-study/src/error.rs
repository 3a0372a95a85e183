//! Errors of studies.

use hoid_io::IoError;
use thiserror::Error;

/// Errors of a study as a whole. A failed fit is a row of the results with its reason, not an
/// error.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StudyError {
    /// An invalid plan.
    #[error("plan {path}{}: {reason}", .line.map_or_else(String::new, |line| format!(", line {line}")))]
    Plan {
        /// The file.
        path: String,
        /// Line, from 1, if known.
        line: Option<usize>,
        /// The problem and the expected value.
        reason: String,
    },
    /// A file that cannot be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// An invalid shard.
    #[error("shard {found:?}: expected I/N with 1 <= I <= N, such as 2/7")]
    BadShard {
        /// The value given.
        found: String,
    },
    /// An invalid `study.json`.
    #[error(
        "{file}: {reason}; expected the file that hoid wrote: choose another directory, or remove this one to start \
         again"
    )]
    Manifest {
        /// The file.
        file: String,
        /// The problem.
        reason: String,
    },
    /// Results that would be overwritten.
    #[error("{directory} already holds a study: continue with --resume, or choose another directory")]
    Occupied {
        /// The directory.
        directory: String,
    },
    /// A plan or manifest of the user that the copy with the results would replace.
    #[error("{file} is already present and would be replaced by this run; choose another directory for the results")]
    SourceThere {
        /// The file.
        file: String,
    },
    /// Parts without checksums.
    #[error(
        "the blocks of {directory} have no checksums, because an earlier hoid wrote them: run that shard again with \
         --resume, which computes them again"
    )]
    Unsealed {
        /// The directory.
        directory: String,
    },
    /// Results that do not belong together.
    #[error("{directory} holds another study: {reason}; choose another directory")]
    OtherStudy {
        /// The directory.
        directory: String,
        /// The differences.
        reason: String,
    },
    /// No results where some were expected.
    #[error("{directory:?} holds no study: expected a directory that `hoid study run` has written")]
    NoStudy {
        /// The directory.
        directory: String,
    },
    /// A study without tables.
    #[error("{directory} holds a study that is not finished: continue with --resume, or merge its shards")]
    Unfinished {
        /// The directory.
        directory: String,
    },
    /// A table that does not fit the plan.
    #[error("{file}: {reason}; expected the table that hoid wrote: run the study again")]
    Table {
        /// The file.
        file: String,
        /// The problem.
        reason: String,
    },
    /// A study that is already complete.
    #[error(
        "{directory} holds a complete study, so that there is nothing to merge: expected directories written with \
             --shard"
    )]
    Whole {
        /// The directory.
        directory: String,
    },
    /// A duplicated part.
    #[error("block {block} is both in {first} and in {second}: name each shard once")]
    Overlap {
        /// The block.
        block: u64,
        /// Location of its first copy.
        first: String,
        /// Location of its second copy.
        second: String,
    },
    /// Missing parts.
    #[error(
        "{missing} of {blocks} blocks of {plan} are missing, the first is {first}: run the missing shards, or finish those that were stopped with --resume"
    )]
    Gap {
        /// Number of missing blocks.
        missing: u64,
        /// Number of all blocks.
        blocks: u64,
        /// The first missing block.
        first: u64,
        /// Name of the study.
        plan: String,
    },
    /// Threads that the system cannot provide.
    #[error("no threads: {reason}; try --jobs 1")]
    Threads {
        /// Error reported by the operating system.
        reason: String,
    },
    /// An invalid pattern of file names.
    #[error("pattern {pattern:?}: {reason}; expected something like {{subject}}_{{condition}}_{{run}}.csv")]
    Pattern {
        /// The pattern.
        pattern: String,
        /// The problem.
        reason: String,
    },
    /// A missing manifest of a group.
    #[error("there is no {path}; `hoid group init DIR` writes one")]
    NoManifest {
        /// The manifest.
        path: String,
    },
    /// A recorded run that cannot be read.
    #[error("{reason}")]
    Recording {
        /// File, reason and remedy.
        reason: String,
    },
    /// A directory without runs.
    #[error(
        "no file in {directory} matches {pattern}; it has {found}: state with --pattern what their names mean, such as \
         {{subject}}_{{run}}.csv"
    )]
    NoRuns {
        /// The directory.
        directory: String,
        /// The pattern.
        pattern: String,
        /// Some of the existing files.
        found: String,
    },
    /// A virtual experiment that would overwrite another.
    #[error("{directory} already holds an experiment; choose another directory")]
    ExperimentThere {
        /// The directory.
        directory: String,
    },
    /// A virtual experiment that cannot be simulated.
    #[error("the virtual experiment cannot be simulated: {reason}")]
    Virtual {
        /// Reason and remedy.
        reason: String,
    },
}
