//! One line of the output.

use hoid::model::{Decimated, Finding, VerdictLevel, uncertainty::Estimate};
use hoid::track::{Change, Live, TrackFault, Tracker};
use serde::{Serialize, Serializer};
use serde_json::Value;

use crate::json;

/// Counts since the start.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Counts {
    /// Samples, those with a fault and missing ones included.
    #[serde(skip)]
    pub samples: u64,
    /// Samples with a fault in e or u, missing ones included.
    pub skipped: u64,
    /// Samples that the guard held back, or during which it let the estimate stay constant.
    pub held: u64,
    /// How often the guard started the estimate again.
    pub restarts: u64,
    /// For these, samples that were missing by the column t.
    #[serde(skip)]
    pub bridged: u64,
    /// Steps that stability or a bound made shorter.
    pub shortened: u64,
    /// Lines that could not be taken for a sample.
    pub dropped: u64,
}

#[derive(Serialize)]
struct Line<'a> {
    t: Option<f64>,
    parameters: Option<Parameters<'a>>,
    operator: Option<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    response: Option<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    open_loop: Option<Value>,
    level: &'static str,
    innovation: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    change: Option<ChangeLine>,
    #[serde(flatten)]
    counts: Counts,
    /// Last event of the guard since the last line.
    #[serde(skip_serializing_if = "Option::is_none")]
    event: Option<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fault: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    decimated: Option<Rate>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    findings: Vec<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    warm_up: Option<WarmUp<'a>>,
}

/// Known properties of a change: the odds at every line, the rest at the first line after one was
/// declared.
#[derive(Serialize)]
struct ChangeLine {
    log_odds: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    declared: Option<Value>,
}

/// The rate at which a fast stream is tracked, and by how much the estimate is after its line.
#[derive(Serialize)]
struct Rate {
    factor: usize,
    from_hz: f64,
    to_hz: f64,
    behind_s: f64,
}

impl From<Decimated> for Rate {
    fn from(done: Decimated) -> Self {
        Self {
            factor: done.factor,
            from_hz: done.from_hz,
            to_hz: done.to_hz,
            behind_s: done.lag_s,
        }
    }
}

#[derive(Serialize)]
struct WarmUp<'a> {
    collected: usize,
    needed: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<&'a str>,
}

struct Parameters<'a> {
    names: &'a [String],
    estimates: Vec<Estimate>,
}

impl Serialize for Parameters<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let pairs = self.names.iter().zip(&self.estimates);
        serializer.collect_map(pairs.map(|(name, e)| (name, Number::from(e))))
    }
}

#[derive(Serialize)]
struct Number {
    value: f64,
    standard_error: Option<f64>,
}

impl From<&Estimate> for Number {
    fn from(e: &Estimate) -> Self {
        Self {
            value: e.value,
            standard_error: e.standard_error,
        }
    }
}

/// Where the recursion is after a line of the input.
pub struct StreamStatus<'a> {
    /// Time of the last sample, s.
    pub t: Option<f64>,
    pub live: &'a Live,
    /// Names of the coefficients; empty during the warm-up.
    pub names: &'a [String],
    pub innovation: Option<f64>,
    /// The last change since the last line, with the time at which it was declared, s.
    pub change: Option<(Option<f64>, Change)>,
    pub counts: Counts,
    /// Last event of the guard since the last line.
    pub event: Option<TrackFault>,
    /// Faults since the last line.
    pub fault: Option<String>,
    /// How the rate was lowered.
    pub decimated: Option<Decimated>,
    /// Findings that make the whole stream doubtful.
    pub finding: Option<&'a Finding>,
}

impl StreamStatus<'_> {
    /// Writes the line into a buffer, its end included.
    ///
    /// # Errors
    /// The errors of the serialiser, which a buffer in memory does not have.
    pub fn write(&self, buffer: &mut Vec<u8>) -> serde_json::Result<()> {
        let tracker: Option<&Tracker> = match self.live {
            Live::Tracking(tracker) => Some(tracker),
            Live::Collecting(_) => None,
        };
        let operator = tracker.map(Tracker::operator);
        let level = tracker.zip(operator.as_ref()).map(|(t, o)| t.level(o));
        let line = Line {
            level: level
                .unwrap_or(VerdictLevel::NotDetermined)
                .max(
                    self.finding
                        .map_or(VerdictLevel::Trustworthy, |_| VerdictLevel::Doubtful),
                )
                .name(),
            t: self.t,
            parameters: tracker.map(|t| Parameters {
                names: self.names,
                estimates: t.parameters(),
            }),
            // Other orders have no meaning as an operator at all.
            operator: (operator.zip(tracker))
                .map(|(o, t)| json::tracked_operator(&o, |o| t.determined(o)))
                .filter(|o| !o.is_null()),
            response: tracker.filter(|t| !t.options().at_rad_s.is_empty()).map(|t| {
                let at = &t.options().at_rad_s;
                json::responses(at, |_, omega_rad_s| t.response(omega_rad_s))
            }),
            open_loop: tracker.and_then(Tracker::open_loop).as_ref().map(json::open_loop),
            innovation: self.innovation,
            change: tracker.and_then(Tracker::change_odds).map(|odds| ChangeLine {
                // Before the first birth there are no odds.
                log_odds: odds.is_finite().then_some(odds),
                declared: self.change.as_ref().map(|(t, change)| json::change(*t, change)),
            }),
            counts: self.counts,
            event: self.event.as_ref().map(json::track_fault),
            fault: self.fault.as_deref(),
            decimated: self.decimated.map(Rate::from),
            findings: self.finding.map(json::finding).into_iter().collect(),
            warm_up: match self.live {
                Live::Collecting(warm_up) => Some(WarmUp {
                    collected: warm_up.collected,
                    needed: warm_up.needed,
                    reason: warm_up.trouble.as_deref(),
                }),
                Live::Tracking(_) => None,
            },
        };
        buffer.clear();
        serde_json::to_writer(&mut *buffer, &line)?;
        buffer.push(b'\n');
        Ok(())
    }
}
