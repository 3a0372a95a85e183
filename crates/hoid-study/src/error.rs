//! Errors of studies.

use hoid_io::IoError;
use thiserror::Error;

/// An error of a study as a whole. A failed fit is not an error: it is a row of the results with its reason.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StudyError {
    /// The plan is invalid.
    #[error("plan {path}{}: {reason}", .line.map_or_else(String::new, |line| format!(", line {line}")))]
    Plan {
        /// Path of the plan.
        path: String,
        /// Line of the plan, counted from 1, if known.
        line: Option<usize>,
        /// The problem, and what was expected instead.
        reason: String,
    },
    /// A file cannot be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The text does not name a shard.
    #[error("shard {found:?}: expected I/N with 1 <= I <= N, such as 2/7")]
    BadShard {
        /// The text given.
        found: String,
    },
    /// The file `study.json` is invalid.
    #[error(
        "{file}: {reason}; expected the file that hoid wrote: choose another directory, or remove this directory to \
         start again"
    )]
    Manifest {
        /// Path of the file `study.json`.
        file: String,
        /// The problem with the file.
        reason: String,
    },
    /// The run would overwrite existing results.
    #[error("{directory} already holds a study: continue with --resume, or choose another directory")]
    Occupied {
        /// Directory of the existing results.
        directory: String,
    },
    /// The copy written with the results would replace a plan or manifest of the user.
    #[error("{file} is already present and would be replaced by this run; choose another directory for the results")]
    SourceExists {
        /// Path of the plan or manifest of the user.
        file: String,
    },
    /// The parts have no checksums.
    #[error(
        "the blocks in {directory} have no checksums because an earlier version of hoid wrote them: run that shard again \
         with --resume to recompute them"
    )]
    Unsealed {
        /// Directory of the parts.
        directory: String,
    },
    /// The results belong to different studies.
    #[error("{directory} holds another study: {reason}; choose another directory")]
    OtherStudy {
        /// Directory of the other study.
        directory: String,
        /// The differences between the studies.
        reason: String,
    },
    /// A directory that should hold results holds none.
    #[error("{directory:?} holds no study: expected a directory that `hoid study run` has written")]
    NoStudy {
        /// The directory without results.
        directory: String,
    },
    /// The tables of the study have not been written yet.
    #[error("{directory} holds a study that is not finished: continue with --resume, or merge its shards")]
    Unfinished {
        /// Directory of the unfinished study.
        directory: String,
    },
    /// A table does not match the plan.
    #[error("{file}: {reason}; expected the table that hoid wrote: run the study again")]
    Table {
        /// Path of the table.
        file: String,
        /// The problem with the table.
        reason: String,
    },
    /// The study is already complete, so there is nothing to merge.
    #[error(
        "{directory} holds a complete study, so there is nothing to merge: expected directories written with \
             --shard"
    )]
    Whole {
        /// Directory of the complete study.
        directory: String,
    },
    /// Two directories contain the same block.
    #[error("block {block} is in both {first} and {second}: name each shard once")]
    DuplicateBlock {
        /// Number of the block.
        block: u64,
        /// Directory of the first copy.
        first: String,
        /// Directory of the second copy.
        second: String,
    },
    /// Some blocks are missing.
    #[error(
        "{missing} of {blocks} blocks of {plan} are missing, starting with {first}: run the missing shards, or finish the stopped shards with --resume"
    )]
    MissingBlocks {
        /// Number of missing blocks.
        missing: u64,
        /// Number of blocks of the study.
        blocks: u64,
        /// Number of the first missing block.
        first: u64,
        /// Name of the study.
        plan: String,
    },
    /// The operating system cannot provide the threads.
    #[error("the threads cannot be started: {reason}; use --jobs 1")]
    Threads {
        /// Error reported by the operating system.
        reason: String,
    },
    /// The pattern of file names is invalid.
    #[error("pattern {pattern:?}: {reason}; expected a pattern such as {{subject}}_{{condition}}_{{run}}.csv")]
    Pattern {
        /// Text of the pattern.
        pattern: String,
        /// The problem with the pattern.
        reason: String,
    },
    /// The manifest of a group is missing.
    #[error("there is no {path}, expected a manifest; in a directory of recordings, `hoid group init DIR` writes one")]
    NoManifest {
        /// Path where the manifest was expected.
        path: String,
    },
    /// A recorded run cannot be read.
    #[error("{reason}")]
    Recording {
        /// Path of the file, reason for the error, and remedy.
        reason: String,
    },
    /// No file of the directory matches the pattern.
    #[error(
        "no file in {directory} matches {pattern}; found {found}: describe the file names with --pattern, such as \
         {{subject}}_{{run}}.csv"
    )]
    NoRuns {
        /// Directory that was searched.
        directory: String,
        /// Pattern of the file names.
        pattern: String,
        /// Some of the files in the directory.
        found: String,
    },
    /// A virtual experiment would overwrite another one.
    #[error("{directory} already holds an experiment; choose another directory")]
    ExperimentThere {
        /// Directory of the existing experiment.
        directory: String,
    },
    /// A virtual experiment cannot be simulated.
    #[error("the virtual experiment cannot be simulated: {reason}")]
    Virtual {
        /// Reason for the error, and remedy.
        reason: String,
    },
}
