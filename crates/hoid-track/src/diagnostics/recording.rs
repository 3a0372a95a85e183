//! Findings about a trace that follow from the recording: the actions of the guard, an idle head, and agreement of the
//! last row with the last few seconds. Samples that the guard held back are bridged.

use std::borrow::Cow;

use hoid_ident::diagnostics::{has_negative_lead, is_undetermined, operator_step};
use hoid_model::{Finding, ModelError, Record, numbers::count_with_noun};

use crate::{
    guard::{GuardAction, GuardChannel, GuardChoice, GuardKind, TrackFault},
    stationary::MIN_STATIONARY_BOTH_S,
    trace::Trace,
};

/// Share of held-back samples beyond which the finding about them is a warning.
const HELD_BACK_SHARE: f64 = 0.01;
/// Largest number of faulty spans that are listed individually.
const MAX_NAMED_FAULTS: usize = 3;
/// Lengths of the spans at the end of the record with which the last row is compared, s.
const LAST_SPANS_S: [f64; 2] = [16.0, 30.0];
/// Smallest number of declared changes that counts as many, and the length of record per change (in s) above which the
/// number does not count as many.
const MANY_CHANGE_COUNT: usize = 3;
const RECORD_PER_CHANGE_S: f64 = 30.0;
/// p-value below which one of ten comparisons counts as a difference between the end of the record and the last row.
const P_VALUE_LIMIT: f64 = 1e-4;

impl Trace {
    /// Findings about the actions of the guard.
    pub(super) fn guard_findings(&self) -> Vec<Finding> {
        let mut all = Vec::new();
        let of = |is: &dyn Fn(&TrackFault) -> bool| -> Vec<TrackFault> {
            self.faults().iter().filter(|fault| is(fault)).copied().collect()
        };
        let samples = |faults: &[TrackFault]| -> f64 {
            faults
                .iter()
                .map(|f| ((f.to_s - f.from_s) / self.sample_time().s()).round())
                .sum()
        };
        let held = of(&|f| f.kind == GuardKind::Outlier);
        if !held.is_empty() {
            let count = samples(&held);
            let sample = if count == 1.0 { "sample" } else { "samples" };
            let words = format!("{count} {sample} held back as outliers ({})", list_faults(&held));
            let finding = match count > HELD_BACK_SHARE * self.counts().samples as f64 {
                true => Finding::warning("held-back", words),
                false => Finding::note("held-back", words),
            };
            all.push(over_faults(finding, &held));
        }
        let steps = of(&|f| f.kind == GuardKind::Step);
        if !steps.is_empty() {
            let words = format!(
                "{}, used as recorded ({})",
                count_with_noun(steps.len(), "lasting jump"),
                list_faults(&steps)
            );
            all.push(over_faults(Finding::note("steps-in-signals", words), &steps));
        }
        let spans = of(&|f| !matches!(f.kind, GuardKind::Outlier | GuardKind::Step));
        if !spans.is_empty() {
            let words = format!(
                "the estimate stays constant in {} in which e and u show no tracking ({})",
                count_with_noun(spans.len(), "span"),
                list_faults(&spans)
            );
            all.push(over_faults(Finding::warning("hostile-span", words), &spans));
        }
        let again = of(&|f| matches!(f.action, GuardAction::Restarted | GuardAction::Relearnt));
        if !again.is_empty() {
            let words = format!(
                "the estimate was restarted after {}",
                count_with_noun(again.len(), "fault")
            );
            all.push(over_faults(Finding::warning("restarted", words), &again));
        }
        all
    }

    /// Finding about spans in which e and u stay constant while the estimate is updated, because the guard was turned
    /// off: the spans carry no information, and the error bars go to zero with the innovations ([`crate::stationary`]).
    pub(super) fn update_at_rest_finding(&self, record: &Record) -> Option<Finding> {
        if self.options().method.guard() != Some(GuardChoice::No) {
            return None;
        }
        let (e, u) = (record.input(), record.output());
        let begins = |k: usize| k == 0 || e.get(k - 1) != e.get(k) || u[k - 1] != u[k];
        let begun: Vec<usize> = (0..u.len()).filter(|k| begins(*k)).chain([u.len()]).collect();
        let longest = begun.windows(2).max_by_key(|of| of[1] - of[0])?;
        let [from, to] = [longest[0], longest[1]].map(|k| record.time_s(k));
        (to - from >= MIN_STATIONARY_BOTH_S).then(|| {
            Finding::warning(
                "learnt-at-rest",
                format!(
                    "neither e nor u moves from {from:.2} to {to:.2} s, but the estimate is updated there, and its \
                     error bars shrink without information; use the default guard, which keeps the estimate constant"
                ),
            )
            .over(from, to)
        })
    }

    /// Returns the record with straight lines in the spans that did not reach the recursion: outliers, missing samples
    /// and excessive levels. A single outlier of e would otherwise determine all that is estimated from the record.
    ///
    /// # Errors
    /// Errors of the signals of a record.
    pub(super) fn with_bridged_samples<'r>(&self, record: &'r Record) -> Result<Cow<'r, Record>, ModelError> {
        let is_bridged = |fault: &&TrackFault| {
            matches!(fault.kind, GuardKind::Outlier | GuardKind::Missing | GuardKind::Level)
                && !matches!(fault.action, GuardAction::Accepted | GuardAction::Relearnt)
        };
        let faults: Vec<&TrackFault> = self.faults().iter().filter(is_bridged).collect();
        if faults.is_empty() {
            return Ok(Cow::Borrowed(record));
        }
        let sample = |t: f64| ((t - record.time_s(0)) / self.sample_time().s()).round().max(0.0) as usize;
        let mut channels = [GuardChannel::Input, GuardChannel::Output]
            .into_iter()
            .skip(usize::from(record.input_channel().is_none()));
        let bridged = record.clone().map_signals(|values| {
            let channel = channels.next();
            for fault in &faults {
                if fault.channel == GuardChannel::Both || Some(fault.channel) == channel {
                    bridge(values, sample(fault.from_s), sample(fault.to_s));
                }
            }
        })?;
        Ok(Cow::Owned(bridged))
    }

    /// Compares the last few seconds of the record with the last row: the delay may have changed, or the estimate may
    /// not have recovered. A step of a parameter ([`operator_step`]) gives a finding if its p-value, given the errors
    /// of the step and of the row, is below [`P_VALUE_LIMIT`]. For a delay in whole samples, the step must also exceed
    /// one and a half samples.
    pub(super) fn outdated_last_row_finding(&self, record: &Record) -> Option<Finding> {
        let row = self.len().checked_sub(1)?;
        let operator = self.operator(row).ok()?;
        // If gain and lead approximate another form, their response differs from the response of the estimate, so they
        // are not compared. The batch fits of the last seconds have one input.
        if self.options().further.is_some() {
            return None;
        }
        if self.response_is_known && (is_undetermined(&operator.k_e) || has_negative_lead(&operator)) {
            return None;
        }
        let end = self.times_s()[row] + self.sample_time().s();
        let of_row = |name: &str| {
            let rows = operator.rows();
            rows.iter()
                .find(|(known, ..)| *known == name)
                .and_then(|(_, _, e)| e.standard_error)
        };
        let mut worst: Option<(f64, Finding)> = None;
        for length in LAST_SPANS_S {
            let from = end - length;
            if from < record.time_s(0) {
                continue;
            }
            let steps = record
                .span(from, end)
                .ok()
                .and_then(|span| operator_step(&operator.parameters(), &span));
            for step in steps.into_iter().flatten() {
                let (name, own) = (step.name, of_row(step.name));
                let whole_samples = name == "tau_e" && own.is_none();
                let grid = if whole_samples {
                    1.5 * self.sample_time().s()
                } else {
                    0.0
                };
                let p_value = step.p_value(own.unwrap_or(0.0), grid);
                if p_value < P_VALUE_LIMIT && worst.as_ref().is_none_or(|(known, _)| p_value < *known) {
                    let words = format!(
                        "in the last {length:.0} s the data require a {name} that differs from the last row by {}: the \
                         estimate does not follow a change in the person, or has not recovered; restart it there",
                        step.step
                    );
                    worst = Some((p_value, Finding::warning("not-followed", words).over(from, end)));
                }
            }
        }
        worst.map(|(_, finding)| finding)
    }

    /// Finding that neither gain is determined in the last row, regardless of earlier rows.
    pub(super) fn last_row_finding(&self) -> Option<Finding> {
        let last = self.len().checked_sub(1)?;
        let operator = self.operator(last).ok()?;
        let nothing = is_undetermined(&operator.k_e) && is_undetermined(&operator.k_e_dot) && !self.response_is_known;
        nothing.then(|| {
            Finding::warning(
                "last-row",
                "at the end of the record no gain differs from zero by at least two standard errors: report an \
                 earlier row",
            )
            .over(self.times_s()[last], self.times_s()[last])
        })
    }

    /// Finding that changes are declared more often than people change.
    pub(super) fn many_changes_finding(&self) -> Option<Finding> {
        let changes = self.changes().len();
        let length = self.times_s().last()? - self.times_s().first()?;
        (changes >= MANY_CHANGE_COUNT && changes as f64 * RECORD_PER_CHANGE_S >= length).then(|| {
            Finding::warning(
                "many-changes",
                format!(
                    "{changes} changes are declared in {length:.0} s: people rarely change so often; more common \
                     causes are a remnant that grows with the error, filled gaps and sensor steps; check e and u there"
                ),
            )
        })
    }

    /// Finding about an idle head of the record.
    pub(super) fn idle_finding(&self, record: &Record) -> Option<Finding> {
        let idle_s = self.idle_s();
        let (from, _) = self.options().start_span(record)?;
        if idle_s <= 0.0 {
            return None;
        }
        let left_out = from - record.time_s(0) >= idle_s - 0.5 * self.sample_time().s();
        let words = format!("neither e nor u moves in the first {idle_s:.1} s");
        let finding = if left_out {
            Finding::note("idle-head", format!("{words}: left out of the start fit"))
        } else {
            Finding::warning(
                "idle-head",
                format!("{words}, which are in the start fit; start the fit after them"),
            )
        };
        let start = record.time_s(0);
        Some(finding.over(start, start + idle_s))
    }
}

/// Replaces the samples from `from` to `to` by a straight line; at an end of the record, by the next value.
fn bridge(values: &mut [f64], from: usize, to: usize) {
    let before = from.checked_sub(1).and_then(|k| values.get(k)).copied();
    let after = values.get(to).copied();
    let Some((first, last)) = before.or(after).zip(after.or(before)) else {
        return;
    };
    let to = to.min(values.len());
    let length = (to + 1).saturating_sub(from) as f64;
    for (k, value) in values.iter_mut().enumerate().take(to).skip(from) {
        *value = first + (last - first) * (k + 1 - from) as f64 / length;
    }
}

/// Returns the finding with the span of the faults.
fn over_faults(finding: Finding, faults: &[TrackFault]) -> Finding {
    finding.over_spans(faults.iter().map(|fault| (fault.from_s, fault.to_s)))
}

/// Lists the first faulty spans as text.
fn list_faults(faults: &[TrackFault]) -> String {
    let one = |f: &TrackFault| format!("{} in {} at {:.2} to {:.2} s", f.kind, f.channel, f.from_s, f.to_s);
    let mut text = faults
        .iter()
        .take(MAX_NAMED_FAULTS)
        .map(one)
        .collect::<Vec<_>>()
        .join("; ");
    if faults.len() > MAX_NAMED_FAULTS {
        text.push_str("; ...");
    }
    text
}
