//! Findings on the quality of the channels, which concern every result.
//!
//! | finding | condition | consequence |
//! |---|---|---|
//! | `stick-at-its-end` | u at a limit of its range in more than 5 % of the samples | the intended output beyond the limit is unknown: gain and margins are biased |
//! | `resting-stick` | u returns to exactly the same value in at least 10 % of the samples ([`StickRest`]) | a dead zone or pulsed control; only a note, since the operator is the linear part of the response |
//! | `coarse` | quantisation step of e above .05, or of u above .15, of its standard deviation | rounding errors do not behave like a remnant, so intervals and bands are too narrow |
//! | `bridged` | a gap longer than .25 s filled by a straight line | the line is treated as behaviour of the person |
//! | `held` | a value of a sparse column held longer than .25 s | the signal between the logged values is unknown |
//!
//! Standard errors do not account for these problems.

use hoid_ident::faults::StickRest;
use hoid_io::{QualityIssueKind, Step};
use hoid_model::{Finding, Record};
use hoid_numerics::statistics::standard_deviation;

use crate::recordings::{Account, RESTING_STICK};

/// Limits above which a result is doubtful, because clipping or rounding lost information: the fraction of samples at
/// the limits of the stick, and the quantisation steps of e and u relative to their standard deviations.
const MAX_SATURATED_SHARE: f64 = 0.05;
const MAX_QUANTUM_RATIOS: [f64; 2] = [0.05, 0.15];
/// Longest gap that may be filled by a straight line, s.
const MAX_BRIDGED_S: f64 = 0.25;

/// Kind of system whose records are assessed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SystemKind {
    /// A person who responds to a displayed error.
    Person,
    /// Any system, whose input may for example have only two levels.
    System,
}

/// Returns the findings on the quality of the channels.
pub(crate) fn findings_of_quality(account: &Account, record: &Record, of: SystemKind) -> Vec<Finding> {
    let mut all = Vec::new();
    let issues = |kind: QualityIssueKind| account.quality_issues.iter().filter(move |issue| issue.kind == kind);
    let output = record.output_channel().name.as_str();
    let at_ends = || issues(QualityIssueKind::Saturated).filter(|issue| issue.channel == output);
    let share: f64 = at_ends().map(|issue| issue.share).sum();
    if share > MAX_SATURATED_SHARE {
        let finding = Finding::warning(
            "stick-at-its-end",
            format!(
                "{output} is saturated in {:.0} % of the samples: the gain and margins are biased",
                100.0 * share
            ),
        );
        let spans = at_ends().flat_map(|issue| &issue.row_spans);
        all.push(finding.over_spans(spans.filter_map(|span| span.from_s.zip(span.to_s))));
    }
    if let Some(rest) = StickRest::of(record.output()).filter(|_| of == SystemKind::Person) {
        all.push(Finding::note(
            RESTING_STICK,
            format!(
                "{output} rests at {} for {:.0} % of the samples, on {} occasions, as if the stick had a dead zone or \
                 were moved in pulses; the operator describes only the linear part of the response",
                rest.value,
                100.0 * rest.share,
                rest.visits
            ),
        ));
    }
    let input = record.input_channel().map_or("", |channel| channel.name.as_str());
    for (channel, values, least) in [
        (input, record.input(), MAX_QUANTUM_RATIOS[0]),
        (output, record.output(), MAX_QUANTUM_RATIOS[1]),
    ] {
        if of == SystemKind::System && channel == input {
            continue;
        }
        let deviation = standard_deviation(values);
        let coarse = issues(QualityIssueKind::Quantised).find(|issue| issue.channel == channel);
        if let Some(issue) = coarse.filter(|issue| issue.size > least * deviation) {
            all.push(Finding::warning(
                "coarse",
                format!(
                    "{channel} is quantised in steps of {:.2} standard deviations: intervals and bands are too narrow",
                    issue.size / deviation
                ),
            ));
        }
    }
    let seconds = |step: &Step| match step {
        Step::Fill { longest, .. } => *longest as f64 * record.sample_time().s(),
        Step::Interpolate { longest_step_s, .. } => *longest_step_s,
        Step::Sparse {
            how: "linear",
            longest_s,
            ..
        } => *longest_s,
        _ => 0.0,
    };
    let longest = account.steps.iter().map(seconds).fold(0.0, f64::max);
    if longest > MAX_BRIDGED_S {
        all.push(Finding::warning(
            "bridged",
            format!(
                "gaps of up to {longest:.2} s are bridged by straight lines, which are analysed as if recorded; \
                 exclude them with --mask gap in a fit, or track with hoid stream"
            ),
        ));
    }
    for step in &account.steps {
        let Step::Sparse {
            channel,
            how: "hold",
            longest_s,
            ..
        } = step
        else {
            continue;
        };
        if *longest_s > MAX_BRIDGED_S {
            all.push(Finding::warning(
                "held",
                format!(
                    "{channel} is held for up to {longest_s:.2} s: changes during this time were not recorded; \
                     shorten the span with --from and --to"
                ),
            ));
        }
    }
    all
}
