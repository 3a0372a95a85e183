//! Errors of the challenge.

use hoid_io::IoError;
use thiserror::Error;

/// Errors that stop a challenge. If an entrant fails, its line contains the reason and the challenge continues.
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
