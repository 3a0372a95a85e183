//! The faults: kinds, sizes, places, and the order of the cases.

/// Channel of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channels {
    E,
    U,
    Both,
}

impl Channels {
    pub fn e(self) -> bool {
        self != Self::U
    }

    pub fn u(self) -> bool {
        self != Self::E
    }
}

/// Kind of change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// Nothing: a clean run.
    Nothing,
    /// One sample deviates; size in standard deviations of its channel.
    Spike,
    /// Samples deviate by 10 standard deviations with either sign; the size is their number.
    Burst,
    /// Empty cells; the size is their number.
    Missing,
    /// 360 deg is added for some seconds.
    Wrap,
    /// A lasting change in the level, in percent of the standard deviation.
    Step,
    /// A level of the whole record, in percent of the standard deviation.
    Offset,
    /// A straight line over the whole record, in standard deviations at its end.
    Drift,
    /// A constant value for some seconds.
    Frozen,
    /// Some seconds of zeros inserted before, inside or after the run.
    Idle,
    /// As `Idle`, with noise of 0.001 standard deviations.
    IdleNoisy,
    /// Zeros in place of the signal for some seconds.
    Dropout,
    /// Both channels are multiplied by a factor for 10 s.
    Scaled,
    /// As `Scaled`, for 50 s or for 40 % of a shorter record.
    ScaledLong,
    /// The time is in ms.
    Milliseconds,
    /// e and u are exchanged for some seconds, or throughout.
    Swapped,
    /// The sign is inverted for some seconds, or throughout.
    Flipped,
    /// Values are limited to some standard deviations from the mean.
    Saturated,
    /// Values are rounded to steps of some standard deviations.
    Quantised,
    /// Rows are missing for some seconds, but the time is counted without a gap.
    Lost,
    /// Some seconds of rows are repeated, and the time is renumbered without a gap.
    Duplicated,
    /// u is delayed by some samples from here on.
    Late,
    /// A record of a given number of samples.
    Short,
    /// Another person acts from two thirds of the record on.
    SecondOperator,
}

/// A kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind {
    pub what: Change,
    pub on: Channels,
}

/// Position in the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultPosition {
    /// At 6 % of the length of the record.
    Start,
    /// At half the length.
    Middle,
    /// At 90 % of the length.
    End,
    /// The whole record, or as defined by the kind.
    Whole,
}

/// One fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fault {
    pub kind: Kind,
    pub size: f64,
    pub place: FaultPosition,
}

const EACH_CHANNEL_AND_BOTH: &[Channels] = &[Channels::E, Channels::U, Channels::Both];
const E_OR_U: &[Channels] = &[Channels::E, Channels::U];
const BOTH_CHANNELS: &[Channels] = &[Channels::Both];
const U_CHANNEL: &[Channels] = &[Channels::U];
const POSITIONS: &[FaultPosition] = &[FaultPosition::Start, FaultPosition::Middle, FaultPosition::End];
const WHOLE_RECORD: &[FaultPosition] = &[FaultPosition::Whole];
/// The whole record.
pub const WHOLE_LENGTH_S: f64 = f64::INFINITY;

/// An entry for each kind: name, unit of its size, channels, sizes, places.
type KindEntry = (
    Change,
    &'static str,
    &'static str,
    &'static [Channels],
    &'static [f64],
    &'static [FaultPosition],
);

const KIND_ENTRIES: [KindEntry; 23] = [
    (
        Change::Spike,
        "spike",
        "sigma",
        EACH_CHANNEL_AND_BOTH,
        &[5.0, 10.0, 30.0, 100.0, 1000.0],
        POSITIONS,
    ),
    (
        Change::Burst,
        "burst",
        "samples",
        EACH_CHANNEL_AND_BOTH,
        &[2.0, 5.0, 10.0],
        POSITIONS,
    ),
    (
        Change::Missing,
        "missing",
        "samples",
        EACH_CHANNEL_AND_BOTH,
        &[1.0, 10.0, 100.0],
        POSITIONS,
    ),
    (
        Change::Wrap,
        "wrap",
        "s",
        E_OR_U,
        &[0.1, 2.0, WHOLE_LENGTH_S],
        POSITIONS,
    ),
    (Change::Step, "step", "%", E_OR_U, &[2.0, 10.0, 50.0, 200.0], POSITIONS),
    (Change::Offset, "offset", "%", E_OR_U, &[3.0, 10.0, 50.0], WHOLE_RECORD),
    (Change::Drift, "drift", "sigma", E_OR_U, &[0.2, 1.0, 5.0], WHOLE_RECORD),
    (
        Change::Frozen,
        "frozen",
        "s",
        EACH_CHANNEL_AND_BOTH,
        &[0.1, 1.0, 10.0],
        POSITIONS,
    ),
    (Change::Idle, "idle", "s", BOTH_CHANNELS, &[5.0, 15.0, 30.0], POSITIONS),
    (
        Change::IdleNoisy,
        "idle with noise",
        "s",
        BOTH_CHANNELS,
        &[5.0, 15.0, 30.0],
        POSITIONS,
    ),
    (
        Change::Dropout,
        "dropout",
        "s",
        EACH_CHANNEL_AND_BOTH,
        &[0.05, 0.5, 5.0],
        POSITIONS,
    ),
    (
        Change::Scaled,
        "scaled for 10 s",
        "times",
        BOTH_CHANNELS,
        &[10.0, 1e6],
        POSITIONS,
    ),
    (
        Change::ScaledLong,
        "scaled for 50 s",
        "times",
        BOTH_CHANNELS,
        &[10.0, 1e6],
        &[FaultPosition::Start, FaultPosition::Middle],
    ),
    (
        Change::Milliseconds,
        "t in ms",
        "",
        BOTH_CHANNELS,
        &[1000.0],
        WHOLE_RECORD,
    ),
    (
        Change::Swapped,
        "swapped",
        "s",
        BOTH_CHANNELS,
        &[10.0, 30.0, WHOLE_LENGTH_S],
        POSITIONS,
    ),
    (
        Change::Flipped,
        "flipped",
        "s",
        E_OR_U,
        &[1.0, 10.0, WHOLE_LENGTH_S],
        POSITIONS,
    ),
    (
        Change::Saturated,
        "saturated",
        "sigma",
        E_OR_U,
        &[2.0, 1.0, 0.5],
        WHOLE_RECORD,
    ),
    (
        Change::Quantised,
        "quantised",
        "sigma",
        E_OR_U,
        &[0.05, 0.3, 1.0],
        WHOLE_RECORD,
    ),
    (Change::Lost, "lost", "s", BOTH_CHANNELS, &[0.1, 1.0, 4.0], POSITIONS),
    (
        Change::Duplicated,
        "duplicated",
        "s",
        BOTH_CHANNELS,
        &[0.1, 1.0],
        POSITIONS,
    ),
    (Change::Late, "late", "samples", U_CHANNEL, &[1.0, 5.0, 20.0], POSITIONS),
    (
        Change::Short,
        "short",
        "samples",
        BOTH_CHANNELS,
        &[60.0, 200.0, 500.0],
        WHOLE_RECORD,
    ),
    (
        Change::SecondOperator,
        "second operator",
        "",
        BOTH_CHANNELS,
        &[1.0],
        WHOLE_RECORD,
    ),
];

impl Kind {
    pub const NO_CHANGE: Self = Self {
        what: Change::Nothing,
        on: Channels::Both,
    };

    /// Name in the tables: `spike, e`.
    pub fn name(self) -> String {
        let Some((_, name, _, channels, ..)) = KIND_ENTRIES.iter().find(|line| line.0 == self.what) else {
            return "none".to_owned();
        };
        match self.on {
            _ if channels.len() == 1 => (*name).to_owned(),
            Channels::E => format!("{name} e"),
            Channels::U => format!("{name} u"),
            Channels::Both => format!("{name} both"),
        }
    }
}

impl Fault {
    pub const NO_FAULT: Self = Self {
        kind: Kind::NO_CHANGE,
        size: 0.0,
        place: FaultPosition::Whole,
    };

    /// Size with its unit: `30 sigma`.
    pub fn size_text(&self) -> String {
        let unit = KIND_ENTRIES
            .iter()
            .find(|line| line.0 == self.kind.what)
            .map_or("", |line| line.2);
        match self.size {
            _ if unit.is_empty() => String::new(),
            WHOLE_LENGTH_S if self.kind.what == Change::Wrap => "to the end".to_owned(),
            WHOLE_LENGTH_S => "whole".to_owned(),
            size => format!("{size} {unit}"),
        }
    }
}

/// All faults, in the order of the tables.
pub fn faults() -> Vec<Fault> {
    let mut all = Vec::new();
    for (what, _, _, channels, sizes, places) in KIND_ENTRIES {
        for &on in channels {
            for &size in sizes {
                // A fault of the whole record has no position, but a wrap has a start.
                let places = if size == WHOLE_LENGTH_S && what != Change::Wrap {
                    WHOLE_RECORD
                } else {
                    places
                };
                all.extend(places.iter().map(|&place| Fault {
                    kind: Kind { what, on },
                    size,
                    place,
                }));
            }
        }
    }
    all
}
