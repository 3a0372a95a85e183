//! Events found by the guard, and its actions.

use hoid_model::SampleTime;

/// Kind of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GuardKind {
    /// One or a few samples that deviate from the prediction, after which the signal returns to the prediction.
    Outlier,
    /// A jump after which the signal does not return to the prediction.
    Step,
    /// Samples that are not finite numbers, for longer than an outlier lasts.
    Missing,
    /// A signal at more than 30 times its typical magnitude.
    Level,
    /// A signal that stays constant.
    Frozen,
    /// Neither signal moves noticeably.
    Idle,
    /// e now resembles the earlier u, and u the earlier e.
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
    /// The samples were replaced by predictions while the estimate was kept constant.
    Held,
    /// The samples were first held back and then used as recorded; the result is the same as without a guard.
    Accepted,
    /// The estimate stays constant from here on.
    Paused,
    /// The estimate, which had been kept constant, is updated again.
    Resumed,
    /// The estimate is updated again, from its state before the faulty span.
    Restarted,
    /// The estimate is updated again, after a restart of the recursion from its start.
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

/// Signal in which an event was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GuardChannel {
    /// e.
    Input,
    /// u.
    Output,
    /// Both e and u.
    Both,
}

hoid_model::named_choice!(GuardChannel, "channel", 3, {
    Input => "e",
    Output => "u",
    Both => "e, u",
});

/// A faulty span and the action taken, reported at one of its samples or after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuardEvent {
    /// Kind of the event.
    pub kind: GuardKind,
    /// Signal in which the event was found.
    pub channel: GuardChannel,
    /// Number of samples since the first sample of the span.
    pub ago: u64,
    /// Number of samples that the span contains so far.
    pub samples: u64,
    /// Size of the event: largest distance from the prediction for outliers and steps, largest magnitude for levels, in
    /// the unit of the signal; zero for other kinds.
    pub size: f64,
    /// Action of the guard.
    pub action: GuardAction,
    /// Number of samples since the state that was restored, if one was: what was learnt and declared since then is
    /// withdrawn.
    pub withdrawn: Option<u64>,
}

/// A faulty span of a run, and the action taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackFault {
    /// Kind of the event.
    pub kind: GuardKind,
    /// Signal in which the event was found.
    pub channel: GuardChannel,
    /// Time of the first sample of the span, s.
    pub from_s: f64,
    /// Time of the first sample after the span, s.
    pub to_s: f64,
    /// Size of the event, as [`GuardEvent::size`].
    pub size: f64,
    /// Action of the guard.
    pub action: GuardAction,
}

impl GuardEvent {
    /// Returns the time after which declared changes are withdrawn, for an event that was reported at the time `now_s`;
    /// `None` if none are.
    pub fn withdrawn_from_s(&self, now_s: f64, sample_time: SampleTime) -> Option<f64> {
        Some(now_s - (self.withdrawn? as f64 - 0.5) * sample_time.s())
    }

    /// Converts an event that was reported at the time `now_s` to a fault with its start and end.
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
    /// True for a span in which the estimate is kept constant and whose end is not known yet.
    pub fn is_open(&self) -> bool {
        self.action == GuardAction::Paused
    }

    /// Appends the fault to the earlier faults; the fault at the end of a pause replaces the one at its start.
    pub(crate) fn append_to(self, faults: &mut Vec<Self>) {
        if faults.last().is_some_and(Self::is_open) {
            faults.pop();
        }
        faults.push(self);
    }
}
