//! A fault in recorded data: kind, location, size, and action.
//!
//! A [`Fault`] is a stretch of one channel of a record (or of all channels) where the recorded values cannot be those
//! of the signal. Detection is documented in the modules that implement it; this module describes a fault, so that it
//! is reported in the same way for files, fits and streams. [`fault_findings`] converts faults to the findings of a
//! [`Verdict`](crate::Verdict): a repaired fault becomes a note, and a fault that is still in the data becomes a
//! warning.

use std::fmt;

use crate::Finding;

/// Kind of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum FaultKind {
    /// One or a few samples that are inconsistent with their neighbours.
    Spike,
    /// A constant value to which the channel jumps and from which it returns.
    Dropout,
    /// A channel that holds its value while the other channels vary.
    Frozen,
    /// A stretch in which all channels, or a single named channel, are at rest.
    Idle,
    /// A value that left the range of its channel at one end and re-entered it at the other.
    Wrap,
    /// A permanent change in level from one sample to the next.
    Step,
    /// A stretch in another unit, with values larger by orders of magnitude.
    Scale,
    /// A time column that is not in seconds.
    TimeUnit,
    /// Input and output that have probably been exchanged.
    Exchanged,
    /// An output that responds with the wrong sign.
    Sign,
}

crate::named_choice!(FaultKind, "kind of fault", 10, {
    Spike => "spike",
    Dropout => "dropout",
    Frozen => "frozen",
    Idle => "idle",
    Wrap => "wrap",
    Step => "step",
    Scale => "scale",
    TimeUnit => "time-unit",
    Exchanged => "exchanged",
    Sign => "sign",
});

/// Handling of faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum FaultHandling {
    /// Faults are reported, and the data remain unchanged.
    Report,
    /// Short faults are bridged, and the record is cut at long faults.
    #[default]
    Bridge,
    /// The record is cut at every fault.
    Cut,
    /// The data are not searched for faults.
    Keep,
}

crate::named_choice!(FaultHandling, "handling of faults", 4, {
    Report => "report",
    Bridge => "bridge",
    Cut => "cut",
    Keep => "keep",
});

/// Action taken on a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum FaultAction {
    /// The fault is reported; the data are unchanged.
    Reported,
    /// The faulty samples were interpolated from their neighbours; a wrap was unwrapped.
    Bridged,
    /// The record ends before the fault, and another record starts after it.
    Cut,
}

crate::named_choice!(FaultAction, "action on a fault", 3, {
    Reported => "reported",
    Bridged => "bridged",
    Cut => "cut",
});

/// One fault.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Fault {
    /// Kind of the fault.
    pub kind: FaultKind,
    /// Name of the channel; empty if the fault concerns all channels or the time.
    pub channel: String,
    /// Time of the first faulty sample, s.
    pub from_s: f64,
    /// Time of the first sample after the fault, s.
    pub to_s: f64,
    /// Number of faulty samples.
    pub samples: usize,
    /// Size of the fault: deviation of a spike or a step and modulus of a wrap in the unit of the channel, duration of
    /// a frozen or idle stretch in s, factor of a change in scale, or the sample time in s for a wrong unit of time.
    pub size: f64,
    /// Size of the fault relative to the robust standard deviation of its test statistic for good data; `None` if the
    /// kind has no such statistic.
    pub deviations: Option<f64>,
    /// Action taken because of the fault.
    pub action: FaultAction,
}

impl Fault {
    /// Returns advice on how to remove the fault by hand.
    pub fn remedy(&self) -> &'static str {
        match self.kind {
            FaultKind::TimeUnit => "if t is in ms, add --time COLUMN:ms; or give the sampling frequency with --fs",
            FaultKind::Exchanged => "exchange them with --input and --output",
            FaultKind::Sign => "reverse the sign of one of them: --output=-u, or --input=-e",
            FaultKind::Step => "cut the record there with --from and --to, or use --faults cut",
            _ => "inspect the recording there; cut the fault out with --from and --to or --faults cut",
        }
    }
}

impl fmt::Display for Fault {
    /// Formats the fault as a phrase without a full stop: "spike in e at 41.2 s, off by 30 (210 robust standard
    /// deviations): bridged".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time = |s: f64| short_number(s, 6);
        let size = short_number(self.size, 3);
        let span = format!("{} to {} s", time(self.from_s), time(self.to_s));
        let channel = &self.channel;
        match self.kind {
            FaultKind::Spike if self.samples == 1 => {
                write!(f, "spike in {channel} at {} s, off by {size}", time(self.from_s))?;
            }
            FaultKind::Spike => write!(
                f,
                "spike of {} samples in {channel}, {span}, off by {size}",
                self.samples
            )?,
            FaultKind::Dropout => write!(f, "{channel} drops out, {span}")?,
            FaultKind::Frozen => write!(f, "{channel} is frozen, {span} ({size} s)")?,
            FaultKind::Idle if channel.is_empty() => write!(f, "all channels are idle, {span} ({size} s)")?,
            FaultKind::Idle => write!(f, "{channel} is idle, {span} ({size} s)")?,
            FaultKind::Wrap => write!(f, "{channel} wraps around by {size}, {span}")?,
            FaultKind::Step => write!(f, "the level of {channel} steps by {size} at {} s", time(self.from_s))?,
            FaultKind::Scale => write!(f, "{channel} is {size} times larger than elsewhere, {span}")?,
            FaultKind::TimeUnit => write!(f, "the sample time of {size} s is too long for a recording of a person")?,
            FaultKind::Exchanged => {
                f.write_str(
                    "input and output seem to be exchanged: the output responds immediately, and the input responds \
                     late",
                )?;
            }
            FaultKind::Sign => f.write_str("the output responds to the input with the wrong sign")?,
        }
        if let Some(deviations) = self.deviations {
            write!(f, " ({} robust standard deviations)", short_number(deviations, 3))?;
        }
        match self.action {
            FaultAction::Reported => write!(f, "; {}", self.remedy()),
            FaultAction::Bridged if self.kind == FaultKind::Wrap => f.write_str(": unwrapped"),
            action => write!(f, ": {action}"),
        }
    }
}

/// Formats a number with a given number of significant digits, without trailing zeros.
fn short_number(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let size = value.abs().log10().floor() as i32;
    if !(-4..9).contains(&size) {
        return format!("{value:.*e}", digits - 1);
    }
    let decimals = (digits as i32 - 1 - size).max(0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Maximum number of faults of one kind that are described individually; further faults are only counted.
const MAX_LISTED_FAULTS: usize = 3;
/// Largest share of faulty samples (interpolated or cut out) for which no warning is given.
pub const MAX_REPAIRED_SHARE: f64 = 0.2;

/// Returns the findings about faults: a note for repaired faults of a kind, a warning for faults that remain in the
/// data ([`Finding::undetermined`] for a wrong unit of time), and a warning if more than [`MAX_REPAIRED_SHARE`] of the
/// samples were interpolated or cut out.
pub fn fault_findings(faults: &[Fault], samples: usize) -> Vec<Finding> {
    let mut all = Vec::new();
    for kind in FaultKind::ALL {
        for left in [true, false] {
            let of: Vec<&Fault> = faults
                .iter()
                .filter(|fault| fault.kind == kind && (fault.action == FaultAction::Reported) == left)
                .collect();
            if of.is_empty() {
                continue;
            }
            let mut words: Vec<String> = of
                .iter()
                .take(MAX_LISTED_FAULTS)
                .map(|fault| fault.to_string())
                .collect();
            if of.len() > MAX_LISTED_FAULTS {
                words.push(format!("and {} more of this kind", of.len() - MAX_LISTED_FAULTS));
            }
            let words = words.join("; ");
            let finding = match (left, kind) {
                (false, _) => Finding::note("faults", words),
                // If the unit of time is wrong, no parameter is valid.
                (true, FaultKind::TimeUnit) => Finding::undetermined("faults", words),
                (true, _) => Finding::warning("faults", words),
            };
            all.push(finding.over_spans(of.iter().map(|fault| (fault.from_s, fault.to_s))));
        }
    }
    let repaired: usize = faults
        .iter()
        .filter(|fault| fault.action != FaultAction::Reported && fault.kind != FaultKind::Wrap)
        .map(|fault| fault.samples)
        .sum();
    // Idle stretches that were cut out do not count as part of the run.
    let idle: usize = (faults.iter())
        .filter(|fault| fault.action == FaultAction::Cut && fault.kind == FaultKind::Idle)
        .map(|fault| fault.samples)
        .sum();
    let share = (repaired - idle) as f64 / samples.saturating_sub(idle).max(1) as f64;
    if share > MAX_REPAIRED_SHARE {
        all.push(Finding::warning(
            "faults",
            format!(
                "{:.0} % of the samples are faulty; inspect the recording",
                100.0 * share
            ),
        ));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Severity;

    fn spike(action: FaultAction) -> Fault {
        Fault {
            kind: FaultKind::Spike,
            channel: "e".to_owned(),
            from_s: 41.2,
            to_s: 41.21,
            samples: 1,
            size: 30.0,
            deviations: Some(212.4),
            action,
        }
    }

    #[test]
    fn fault_is_printed_as_a_sentence() {
        assert_eq!(
            spike(FaultAction::Bridged).to_string(),
            "spike in e at 41.2 s, off by 30 (212 robust standard deviations): bridged"
        );
        assert!(spike(FaultAction::Reported).to_string().contains("--faults cut"));
        assert_eq!(
            (short_number(0.0123456, 3), short_number(1234.4, 3)),
            ("0.0123".to_owned(), "1234".to_owned())
        );
        assert_eq!(
            (short_number(1e12, 3), short_number(0.0, 3)),
            ("1.00e12".to_owned(), "0".to_owned())
        );
    }

    #[test]
    fn handled_faults_are_notes_and_reported_faults_are_warnings() {
        let of = |action| fault_findings(&[spike(action)], 1000)[0].severity;
        assert_eq!(of(FaultAction::Bridged), Severity::Note);
        assert_eq!(of(FaultAction::Cut), Severity::Note);
        assert_eq!(of(FaultAction::Reported), Severity::Doubt);
        assert!(fault_findings(&[], 0).is_empty());
        let many = vec![spike(FaultAction::Bridged); 300];
        let found = fault_findings(&many, 1000);
        assert!(
            found[0].message.ends_with("and 297 more of this kind"),
            "{}",
            found[0].message
        );
        assert_eq!(found[1].severity, Severity::Doubt);
        let idle = Fault {
            kind: FaultKind::Idle,
            samples: 900,
            ..spike(FaultAction::Cut)
        };
        assert_eq!(fault_findings(&[idle], 1000).len(), 1);
    }
}
