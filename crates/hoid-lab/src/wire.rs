//! The messages between the page and the server: JSON in text frames, the `type` first. The tables of
//! a run follow its message as one binary frame of 64-bit numbers, little end first.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{
    config::{Condition, LiveFor},
    live::LiveLine,
    plant::InputMap,
    session::{Batch, Done},
    task::Phase,
    verify::Measures,
};

/// Largest message of a page, bytes: a second of ticks is a tenth of it.
pub const LARGEST: usize = 1 << 20;

/// Audience of a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// The person who tracks.
    Person,
    /// Observers.
    Experimenter,
}

/// Content of a page. Variants without fields have braces, so that they take no unknown ones.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
#[allow(missing_docs)]
pub enum FromPage {
    /// It is there.
    Hello {
        role: Role,
        #[serde(default)]
        browser: BTreeMap<String, String>,
    },
    /// The person has read the text.
    Consent { subject: String, agreed: bool, cc0: bool },
    /// The person continues with a session.
    Resume { session: String },
    /// The next run is requested.
    Next {},
    /// Tick 0 of the run that was sent.
    Begin {
        number: usize,
        input: InputMap,
        device: String,
        clock: String,
        refresh_ms: f64,
        zero_ms: f64,
    },
    /// Events since the last batch.
    Batch { number: usize, batch: Batch },
    /// The run reached its end.
    Finish {
        number: usize,
        #[serde(default)]
        counted: BTreeMap<String, f64>,
    },
    /// The run was broken off.
    Abort { number: usize },
    /// The pages about the session are requested.
    Reports {},
}

/// Report of the server.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
#[allow(missing_docs)]
pub enum ToPage<'a> {
    /// State of the session.
    State(Box<State>),
    /// A run; its tables follow.
    Run {
        number: usize,
        condition: &'a Condition,
        training: bool,
        run_in: usize,
        ticks: usize,
        phases: &'a [Phase],
        /// Lengths of the tables that follow: target, disturbance, and the noise of a simulated
        /// operator.
        tables: Vec<usize>,
        operator: Option<&'a SimulatedOperator>,
    },
    /// Reliability of a run.
    Verdict { done: &'a Done, measures: &'a Measures },
    /// The estimate while a run continues.
    Live { number: usize, line: &'a LiveLine },
    /// The request is refused; `elsewhere` if the session is in another window.
    Refused { words: String, elsewhere: bool },
    /// The session continues in this window, whose other window is gone.
    Yours {},
}

/// State of a session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct State {
    /// `consent`, `runs`, `finished` or `replay`.
    pub phase: &'static str,
    /// Name of the experiment.
    pub name: String,
    /// Items to be confirmed.
    pub consent: String,
    /// When the person sees the live estimate.
    pub live: LiveFor,
    /// True if a simulated operator replaces the person.
    pub calibrate: bool,
    /// The session, such as `sub-P01/ses-01`.
    pub session: Option<String>,
    /// Sessions that can be resumed.
    pub open: Vec<String>,
    /// Runs that ended.
    pub done: Vec<Done>,
    /// Names of the conditions of all planned runs; `next` is the index of the next one.
    pub planned: Vec<String>,
    /// See `planned`.
    pub next: Option<usize>,
    /// The condition of the next run.
    pub condition: Option<Condition>,
    /// Whether it is a training run.
    pub training: bool,
    /// The run that continues, where one does.
    pub running: Option<usize>,
    /// True while pages are being made.
    pub reporting: bool,
    /// Pages that were written: titles and paths.
    pub reports: Vec<(String, String)>,
    /// Answers of the calibration.
    pub calibration: Vec<(String, String)>,
}

/// The operator of a calibration: `u = (H e)(t - delay) + n`, H held over a tick.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulatedOperator {
    /// H.
    pub plant: crate::plant::Plant,
    /// Delay, in ticks.
    pub delay: usize,
}
