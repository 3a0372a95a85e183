//! Why a challenge cannot be run.

use hoid_io::IoError;
use thiserror::Error;

/// Errors of a challenge as a whole. An entrant that fails is a line with its reason, not an error.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ChallengeError {
    /// A case, an entrant, a recording or a line that cannot be used.
    #[error("challenge: {reason}")]
    Refused {
        /// The problem and the expected value.
        reason: String,
    },
    /// A file that cannot be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
}
