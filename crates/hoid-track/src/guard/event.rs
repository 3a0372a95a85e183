//! Events found by the guard, and what it did.

use hoid_model::SampleTime;

/// The findings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GuardKind {
    /// One to a few samples that the signal does not predict and that it comes back from.
    Outlier,
    /// A jump that the signal does not come back from.
    Step,
    /// Samples that are not numbers, for longer than an outlier lasts.
    Missing,
    /// A signal 30 times as large as it was.
    Level,
    /// A signal that stays constant.
    Frozen,
    /// Two signals that are nearly silent.
    Idle,
    /// e is as u was, and u as e was.
    Swapped,
    /// A model that predicts u worse than the past of u does.
    Misfit,
    /// An estimate that predicts u worse than the start fit does.
    Diverged,
}

hoid_model::named_choice!(GuardKind, "kind of fault", 9, {
    Outlier => "spike",
    Step => "step",
    Missing => "missing",
    Level => "scale",
    Frozen => "frozen",
    Idle => "idle",
    Swapped => "exchanged",
    Misfit => "misfit",
    Diverged => "astray",
});

/// The actions taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GuardAction {
    /// Predictions replaced the samples; the estimate stayed.
    Held,
    /// Held back at first, then taken as they came, as if nothing had been.
    Accepted,
    /// The estimate stays constant from here on.
    Paused,
    /// The estimate, which had stayed constant, moves again.
    Resumed,
    /// The estimate moves again, from where it was before the span.
    Restarted,
    /// The estimate moves again, from the start of the recursion.
    Relearnt,
}

hoid_model::named_choice!(GuardAction, "action", 6, {
    Held => "held",
    Accepted => "accepted",
    Paused => "paused",
    Resumed => "resumed",
    Restarted => "restarted",
    Relearnt => "relearnt",
});

/// Which signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GuardChannel {
    /// e.
    Input,
    /// u.
    Output,
    /// Both.
    Both,
}

hoid_model::named_choice!(GuardChannel, "channel", 3, {
    Input => "e",
    Output => "u",
    Both => "e, u",
});

/// A span that was not as it should be, and the actions taken, as told at one of its samples or after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuardEvent {
    /// The findings.
    pub kind: GuardKind,
    /// In which signal.
    pub channel: GuardChannel,
    /// Samples since the first one of it.
    pub ago: u64,
    /// Samples of it so far.
    pub samples: u64,
    /// Largest distance from the prediction for outliers and steps, largest magnitude for levels, in
    /// the unit of the signal; zero if it has no size.
    pub size: f64,
    /// The actions taken.
    pub action: GuardAction,
}

/// A span of a run that was not as it should be, and the actions taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackFault {
    /// The findings.
    pub kind: GuardKind,
    /// In which signal.
    pub channel: GuardChannel,
    /// Time of its first sample, s.
    pub from_s: f64,
    /// Time of the sample after its last, s.
    pub to_s: f64,
    /// As [`GuardEvent::size`].
    pub size: f64,
    /// The actions taken.
    pub action: GuardAction,
}

impl GuardEvent {
    /// In times, for what was reported at a sample at `now_s`.
    pub fn at(&self, now_s: f64, sample_time: SampleTime) -> TrackFault {
        let ts = sample_time.s();
        let from_s = now_s - self.ago as f64 * ts;
        TrackFault {
            kind: self.kind,
            channel: self.channel,
            from_s,
            to_s: from_s + self.samples as f64 * ts,
            size: self.size,
            action: self.action,
        }
    }
}

impl TrackFault {
    /// True for a span in which the estimate stayed constant, of which the end is not known.
    pub fn is_open(&self) -> bool {
        self.action == GuardAction::Paused
    }

    /// Puts a fault after those before it; the end of a pause takes the place of its start.
    pub(crate) fn put(self, behind: &mut Vec<Self>) {
        if behind.last().is_some_and(Self::is_open) {
            behind.pop();
        }
        behind.push(self);
    }
}
