//! One line of the output of `hoid stream`.

use hoid::model::{Decimated, Finding, VerdictLevel, uncertainty::Estimate};
use hoid::track::{Change, Live, Stage, TrackFault, Tracker};
use serde::{Serialize, Serializer};
use serde_json::Value;

use crate::json;

/// Counts since the start of the stream.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Counts {
    /// Number of samples, including invalid and missing ones.
    #[serde(skip)]
    pub samples: u64,
    /// Number of samples with an invalid e or u, including missing ones.
    pub skipped: u64,
    /// Number of samples that the guard held back, or during which it kept the estimate constant.
    pub held: u64,
    /// Number of restarts by the guard.
    pub restarts: u64,
    /// Number of samples that were missing according to the column t.
    #[serde(skip)]
    pub bridged: u64,
    /// Number of steps of the recursion that were shortened to stay stable or within bounds.
    pub shortened: u64,
    /// Number of lines that were dropped because they are not samples.
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
    /// Last event of the guard since the previous line of the output.
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

/// State of a change: the odds are in every line, the declared change only in the first line after its declaration.
#[derive(Serialize)]
struct ChangeLine {
    log_odds: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    declared: Option<Value>,
}

/// The rate at which a fast stream is tracked, and the lag of the estimate relative to its line.
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
    #[serde(rename = "collected")]
    collected_samples: usize,
    #[serde(rename = "needed")]
    required_samples: usize,
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

/// State of the recursion after a line of the input.
pub struct StreamStatus<'a> {
    /// Time of the last sample, s.
    pub t: Option<f64>,
    pub live: &'a Live,
    /// Names of the coefficients; empty during the warm-up.
    pub names: &'a [String],
    pub innovation: Option<f64>,
    /// Last change declared since the previous line of the output, with the time of its declaration, s.
    pub change: Option<(Option<f64>, Change)>,
    pub counts: Counts,
    /// Last event of the guard since the previous line of the output.
    pub event: Option<TrackFault>,
    /// Faults since the previous line of the output.
    pub fault: Option<String>,
    /// Finding that makes the whole stream doubtful.
    pub finding: Option<&'a Finding>,
}

impl StreamStatus<'_> {
    /// Writes the line, including its line feed, to a buffer.
    ///
    /// # Errors
    /// Errors of the serialiser, which do not occur for a buffer in memory.
    pub fn write(&self, buffer: &mut Vec<u8>) -> serde_json::Result<()> {
        let tracker = self.live.tracker();
        let operator = tracker.map(Tracker::operator);
        let level = tracker.zip(operator.as_ref()).map(|(t, o)| t.verdict_level(o));
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
            // The operator is null if the orders of the model are not those of an operator.
            operator: (operator.zip(tracker))
                .map(|(o, t)| json::tracked_operator(&o, |o| t.determinations(o)))
                .filter(|o| !o.is_null()),
            response: tracker.filter(|t| !t.options().at_rad_s.is_empty()).map(|t| {
                let at = &t.options().at_rad_s;
                json::responses(at, |_, omega_rad_s| t.response(omega_rad_s))
            }),
            open_loop: tracker.and_then(Tracker::open_loop).as_ref().map(json::open_loop),
            innovation: self.innovation,
            change: tracker.and_then(Tracker::change_odds).map(|odds| ChangeLine {
                // The odds are infinite until a change is first hypothesised.
                log_odds: odds.is_finite().then_some(odds),
                declared: self.change.as_ref().map(|(t, change)| json::change(*t, change)),
            }),
            counts: self.counts,
            event: self.event.as_ref().map(json::track_fault),
            fault: self.fault.as_deref(),
            decimated: self.live.decimation().map(Rate::from),
            findings: self.finding.map(json::finding).into_iter().collect(),
            warm_up: match self.live.stage() {
                Stage::Collecting(warm_up) => Some(WarmUp {
                    collected_samples: warm_up.collected,
                    required_samples: warm_up.needed,
                    reason: warm_up.trouble.as_deref(),
                }),
                Stage::Tracking(_) => None,
            },
        };
        buffer.clear();
        serde_json::to_writer(&mut *buffer, &line)?;
        buffer.push(b'\n');
        Ok(())
    }
}
