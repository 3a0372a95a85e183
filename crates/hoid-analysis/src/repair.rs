//! Detection and repair of faults of recordings, before all other processing.

use hoid_ident::faults::{MAX_SAMPLE_TIME_S, repair};
use hoid_model::{FaultHandling, Finding, ModelError, Record};

use crate::{
    AnalysisError,
    duplicate_runs::reject_duplicate_runs,
    quality::{SystemKind, findings_of_quality},
    recordings::{Account, Recordings},
};

/// Length in s below which a segment between two faults is not used if there is a longer one, since a few seconds do
/// not determine an operator.
const MIN_SEGMENT_S: f64 = 4.0;
/// Maximum number of levels of a step input.
const MAX_LEVELS: usize = 16;

impl Recordings {
    /// Repairs the faults of the recordings; a recording that is cut becomes several. The account of the first segment
    /// of a recording contains the findings and their consequences for all results.
    ///
    /// # Errors
    /// [`AnalysisError::SameSamples`] if a run is given twice.
    pub fn repaired(self, handling: FaultHandling, of: SystemKind) -> Result<Self, AnalysisError> {
        reject_duplicate_runs(&self)?;
        let mut all = Self {
            source: self.source,
            ..Self::default()
        };
        let one = self.names.into_iter().zip(self.records).zip(self.accounts);
        for (((name, record), account), origin) in one.zip(self.origins) {
            let steps = of == SystemKind::System && is_multilevel_input(&record);
            let handling = match handling {
                // Settling after a step is not a sensor fault, so it is reported and the recording is not cut.
                FaultHandling::Bridge | FaultHandling::Cut if steps => FaultHandling::Report,
                as_asked => as_asked,
            };
            let mut found = repair(&record, handling)?;
            if steps || (of == SystemKind::System && record.sample_time().s() > MAX_SAMPLE_TIME_S) {
                // Faults found in data with step inputs, or in data of slow systems such as a furnace, are typical and
                // become notes.
                let note = |finding: Finding| Finding::note(finding.kind, finding.message);
                found.findings = found.findings.into_iter().map(note).collect();
            }
            let whole = found.segments.len() == 1 && found.segments[0].len() == record.len();
            let mut findings = found.findings;
            findings.extend(findings_of_quality(&account, &record, of));
            let ts_s = record.sample_time().s();
            let longest = found.segments.iter().map(Record::len).max().unwrap_or(0);
            let is_short = |piece: &Record| piece.len() < longest && (piece.len() as f64) * ts_s < MIN_SEGMENT_S;
            if of == SystemKind::Person && found.segments.iter().any(is_short) {
                let left: f64 = found
                    .segments
                    .iter()
                    .filter(|piece| is_short(piece))
                    .map(|p| p.len() as f64 * ts_s)
                    .sum();
                found.segments.retain(|piece| !is_short(piece));
                findings.push(Finding::note(
                    "short-piece",
                    format!("pieces between faults shorter than {MIN_SEGMENT_S} s were left out: {left:.1} s in total"),
                ));
            }
            let mut account = Account {
                faults: found.faults,
                findings,
                ..account
            };
            for segment in found.segments {
                let span = format!(" ({:.3} to {:.3} s)", segment.time_s(0), segment.time_s(segment.len()));
                let label = format!("{}{span}", segment.label());
                let (name, segment) = if whole {
                    (name.clone(), segment)
                } else {
                    (format!("{name}{span}"), segment.labelled(label))
                };
                // Only the first segment has the findings, so each finding is reported once.
                all.push_part(origin, name, segment, std::mem::take(&mut account));
            }
        }
        Ok(all)
    }
}

/// True if the input takes only a few levels, as in a step test or a binary sequence.
pub(crate) fn is_multilevel_input(record: &Record) -> bool {
    let mut levels: Vec<f64> = Vec::new();
    for value in record.input() {
        if !levels.contains(value) {
            levels.push(*value);
        }
        if levels.len() > MAX_LEVELS {
            return false;
        }
    }
    levels.len() > 1
}

/// Repairs the same recordings, read with other options, in the same manner.
pub(crate) fn repair_records(records: Vec<Record>, handling: FaultHandling) -> Result<Vec<Record>, ModelError> {
    let mut all = Vec::with_capacity(records.len());
    for record in records {
        all.extend(repair(&record, handling)?.segments);
    }
    Ok(all)
}
