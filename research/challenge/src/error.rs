//! Errors of the challenge.

use hoid_io::IoError;
use thiserror::Error;

/// Errors of a challenge as a whole. An entrant that fails is a line with its reason, not an error.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ChallengeError {
    /// An invalid case, entrant, recording or line.
    #[error("challenge: {reason}")]
    Refused {
        /// The problem and the expected value.
        reason: String,
    },
    /// A file that cannot be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
}
