//! Faults of recorded data, looked for and mended before a fit: what was done stands in the account
//! of each record, on its page, in its JSON and in its report.

use hoid::ident::faults::mend;
use hoid::model::{FaultHandling, Finding, Record, Verdict};

use super::reading::{Account, ReadAll};
use crate::error::CliError;

/// The records without their faults; one that is cut gives several.
pub fn mended(read: ReadAll, handling: FaultHandling) -> Result<ReadAll, CliError> {
    let mut all = ReadAll::default();
    let one = read.files.into_iter().zip(read.records).zip(read.accounts);
    for ((file, record), account) in one {
        let found = mend(&record, handling)?;
        let whole = found.segments.len() == 1 && found.segments[0].len() == record.len();
        let mut account = Account {
            faults: found.faults,
            findings: found.findings,
            ..account
        };
        for segment in found.segments {
            let span = format!(" ({:.3} to {:.3} s)", segment.time_s(0), segment.time_s(segment.len()));
            all.files
                .push(if whole { file.clone() } else { format!("{file}{span}") });
            let label = format!("{}{span}", segment.label());
            all.records.push(if whole { segment } else { segment.labelled(label) });
            // What was found is told once.
            all.accounts.push(std::mem::take(&mut account));
        }
    }
    Ok(all)
}

/// The same records read another way, mended alike.
pub fn mended_again(records: Vec<Record>, handling: FaultHandling) -> Result<Vec<Record>, CliError> {
    let mut all = Vec::with_capacity(records.len());
    for record in records {
        all.extend(mend(&record, handling)?.segments);
    }
    Ok(all)
}

/// What was found in all records, for the verdict of a result of them.
pub fn findings(files: &[String], accounts: &[Account]) -> Vec<Finding> {
    let several = files.len() > 1;
    let all = files.iter().zip(accounts);
    all.flat_map(|(file, account)| {
        account.findings.iter().map(move |finding| Finding {
            words: if several {
                format!("{file}: {}", finding.words)
            } else {
                finding.words.clone()
            },
            ..finding.clone()
        })
    })
    .collect()
}

/// A verdict with what the faults of the records say: first, since a wrong recording is why a result is
/// wrong.
pub fn judged(verdict: Verdict, files: &[String], accounts: &[Account]) -> Verdict {
    let more = findings(files, accounts);
    if more.is_empty() { verdict } else { verdict.behind(more) }
}
