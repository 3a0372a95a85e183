//! Detection of runs that are given twice.
//!
//! Standard errors are computed from the scatter between runs. A copy adds no information, but would reduce the
//! reported errors by a factor of up to the square root of two.

use hoid_model::Record;

use crate::{AnalysisError, recordings::Recordings};

/// Rejects recordings if two of them contain the same samples of e and u.
pub(crate) fn reject_duplicate_runs(all: &Recordings) -> Result<(), AnalysisError> {
    for (i, record) in all.records.iter().enumerate() {
        let same = |other: &&Record| {
            let times = record.sample_time() == other.sample_time();
            times && record.input() == other.input() && record.output() == other.output()
        };
        if let Some(j) = all.records[..i].iter().position(|other| same(&other)) {
            return Err(AnalysisError::SameSamples {
                first: all.names[j].clone(),
                second: all.names[i].clone(),
            });
        }
    }
    Ok(())
}
