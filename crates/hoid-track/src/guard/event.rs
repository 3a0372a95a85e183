//! Events found by the guard, and its actions.

use hoid_model::SampleTime;

/// Kind of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GuardKind {
    /// One to a few samples that the signal does not predict and after which it returns.
    Outlier,
    /// A jump after which the signal does not return.
    Step,
    /// Samples that are not numbers, for longer than an outlier lasts.
    Missing,
    /// A signal 30 times as large as before.
    Level,
    /// A signal that stays constant.
    Frozen,
    /// Both signals are nearly silent.
    Idle,
    /// e is as u was before, and u as e was.
    Swapped,
    /// The model predicts u worse than the past of u does.
    Misfit,
    /// The estimate predicts u worse than the start fit does.
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

/// Action of the guard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GuardAction {
    /// Predictions replaced the samples; the estimate stayed constant.
    Held,
    /// Held back at first, then taken as recorded; the result is that without a guard.
    Accepted,
    /// The estimate stays constant from here on.
    Paused,
    /// The estimate, which had stayed constant, is updated again.
    Resumed,
    /// The estimate is updated again, from its state before the span.
    Restarted,
    /// The estimate is updated again, from the start of the recursion.
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

/// Signal of an event.
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

/// A faulty span and the action taken, as reported at one of its samples or after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuardEvent {
    /// Kind of the event.
    pub kind: GuardKind,
    /// Signal of the event.
    pub channel: GuardChannel,
    /// Number of samples since the first one of the span.
    pub ago: u64,
    /// Number of samples of the span so far.
    pub samples: u64,
    /// Largest distance from the prediction for outliers and steps, largest magnitude for levels, in the unit of the
    /// signal; zero for other kinds.
    pub size: f64,
    /// Action of the guard.
    pub action: GuardAction,
}

/// A faulty span of a run, and the action taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackFault {
    /// Kind of the event.
    pub kind: GuardKind,
    /// Signal of the event.
    pub channel: GuardChannel,
    /// Time of its first sample, s.
    pub from_s: f64,
    /// Time of the sample after its last, s.
    pub to_s: f64,
    /// Size, as [`GuardEvent::size`].
    pub size: f64,
    /// Action of the guard.
    pub action: GuardAction,
}

impl GuardEvent {
    /// Converts to times, for an event that was reported at `now_s`.
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
    /// True for a span in which the estimate stayed constant and whose end is not known.
    pub fn is_open(&self) -> bool {
        self.action == GuardAction::Paused
    }

    /// Appends a fault to those before it; the end of a pause replaces its start.
    pub(crate) fn put(self, behind: &mut Vec<Self>) {
        if behind.last().is_some_and(Self::is_open) {
            behind.pop();
        }
        behind.push(self);
    }
}
