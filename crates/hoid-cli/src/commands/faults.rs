//! Faults of recorded data, looked for and mended before a fit: what was done stands in the account
//! of each record, on its page, in its JSON and in its report.

use hoid::ident::faults::mend;
use hoid::io::{QualityIssueKind, Step};
use hoid::model::{FaultHandling, Finding, Record, Verdict};

use super::reading::{Account, ReadAll};
use crate::error::CliError;

/// The records without their faults; one that is cut gives several.
pub fn mended(read: ReadAll, handling: FaultHandling) -> Result<ReadAll, CliError> {
    refuse_copies(&read)?;
    let mut all = ReadAll::default();
    let one = read.files.into_iter().zip(read.records).zip(read.accounts);
    for ((file, record), account) in one {
        let found = mend(&record, handling)?;
        let whole = found.segments.len() == 1 && found.segments[0].len() == record.len();
        let mut findings = found.findings;
        findings.extend(of_quality(&account, &record));
        let mut account = Account {
            faults: found.faults,
            findings,
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

/// Errors come from the scatter between runs: one that is given twice has none.
fn refuse_copies(read: &ReadAll) -> Result<(), CliError> {
    for (i, record) in read.records.iter().enumerate() {
        let same = |other: &&Record| {
            let times = record.sample_time() == other.sample_time();
            times && record.input() == other.input() && record.output() == other.output()
        };
        if let Some(j) = read.records[..i].iter().position(|other| same(&other)) {
            return Err(CliError::Usage(format!(
                "{} and {} hold the same samples of e and u; runs of one person must be different recordings: give each once",
                read.files[j], read.files[i]
            )));
        }
    }
    Ok(())
}

/// Shares of the rows at the ends of the stick, and steps of e and u over their deviations, beyond which a
/// result is doubtful: what is cut off or rounded is lost, and no error bar knows of it.
const AT_ENDS: f64 = 0.05;
const COARSE: [f64; 2] = [0.05, 0.15];
/// Longest gap that may be bridged by a straight line, s.
const BRIDGED_S: f64 = 0.25;

/// What the quality of the channels says of any result.
pub fn of_quality(account: &Account, record: &Record) -> Vec<Finding> {
    let mut all = Vec::new();
    let issues = |kind: QualityIssueKind| account.quality_issues.iter().filter(move |issue| issue.kind == kind);
    let output = record.output_channel().name.as_str();
    let at_ends: f64 = issues(QualityIssueKind::Saturated)
        .filter(|issue| issue.channel == output)
        .map(|issue| issue.share)
        .sum();
    if at_ends > AT_ENDS {
        all.push(Finding::doubt(
            "stick-at-its-end",
            format!(
                "{output} stands at an end of its range in {:.0} % of the rows: what the person would have done beyond it is lost, \
                 and gain and margins are those of the stick",
                100.0 * at_ends
            ),
        ));
    }
    let input = record.input_channel().map_or("", |channel| channel.name.as_str());
    for (channel, values, least) in [(input, record.input(), COARSE[0]), (output, record.output(), COARSE[1])] {
        let deviation = deviation(values);
        let coarse = issues(QualityIssueKind::Quantised).find(|issue| issue.channel == channel);
        if let Some(issue) = coarse.filter(|issue| issue.size > least * deviation) {
            all.push(Finding::doubt(
                "coarse",
                format!(
                    "{channel} is rounded to steps of {:.2} of its standard deviation: intervals and bands are too narrow",
                    issue.size / deviation
                ),
            ));
        }
    }
    let seconds = |step: &Step| match step {
        Step::Fill { longest, .. } => *longest as f64 * record.sample_time().s(),
        Step::Interpolate { longest_step_s, .. } => *longest_step_s,
        _ => 0.0,
    };
    let longest = account.steps.iter().map(seconds).fold(0.0, f64::max);
    if longest > BRIDGED_S {
        all.push(Finding::doubt(
            "bridged",
            format!(
                "gaps of up to {longest:.2} s are bridged by straight lines, which count as tracking here; leave them out by \
                 --mask gap in a fit, by hoid stream in a tracker"
            ),
        ));
    }
    all
}

fn deviation(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
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
