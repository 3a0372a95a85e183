//! Messages between the page and the server: JSON in text frames, with `type` as the first key. The tables of a run
//! follow its message as one binary frame of little-endian 64-bit numbers.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{
    config::{Condition, LiveFor},
    live::LiveLine,
    plant::InputMap,
    session::{Batch, FinishedRun},
    task::Phase,
    verify::Measures,
};

/// Maximum size of a message from a page in bytes; one second of ticks takes about a tenth of this.
pub const MAX_MESSAGE_BYTES: usize = 1 << 20;

/// Role of the user of a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// The person who tracks.
    Person,
    /// An observer, such as the experimenter.
    Experimenter,
}

/// Message from a page. Variants without fields have braces, so that unknown fields are rejected.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
#[allow(missing_docs)]
pub enum FromPage {
    /// The page is connected.
    Hello {
        role: Role,
        #[serde(default)]
        browser: BTreeMap<String, String>,
    },
    /// The person has read the consent text.
    Consent { subject: String, agreed: bool, cc0: bool },
    /// The person resumes a session.
    Resume { session: String },
    /// The page requests the next run.
    Next {},
    /// The run that was sent is at tick 0.
    Begin {
        number: usize,
        input: InputMap,
        device: String,
        clock: String,
        refresh_ms: f64,
        zero_ms: f64,
    },
    /// Ticks, events and frames since the last batch.
    Batch { number: usize, batch: Batch },
    /// The run reached its end.
    Finish {
        number: usize,
        #[serde(default)]
        counted: BTreeMap<String, f64>,
    },
    /// The run was aborted.
    Abort { number: usize },
    /// The page requests the pages about the session.
    Reports {},
}

/// Message from the server to a page.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
#[allow(missing_docs)]
pub enum ToPage<'a> {
    /// State of the session.
    State(Box<State>),
    /// A run, followed by its tables.
    Run {
        number: usize,
        condition: &'a Condition,
        training: bool,
        run_in: usize,
        ticks: usize,
        phases: &'a [Phase],
        /// Lengths of the tables that follow: target, disturbance, and noise of a simulated operator.
        tables: Vec<usize>,
        operator: Option<&'a SimulatedOperator>,
    },
    /// Verdict on a run.
    Verdict {
        done: &'a FinishedRun,
        measures: &'a Measures,
    },
    /// Live estimate during a run.
    Live { number: usize, line: &'a LiveLine },
    /// A request is rejected; `elsewhere` is true if the session continues in another window.
    Refused { words: String, elsewhere: bool },
    /// The session continues in this window, because its other window was closed.
    Yours {},
}

/// State of a session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct State {
    /// Phase of the session: `consent`, `runs`, `finished` or `replay`.
    pub phase: &'static str,
    /// Name of the experiment.
    pub name: String,
    /// Consent text that the person must confirm.
    pub consent: String,
    /// Time at which the live estimate is shown to the person.
    pub live: LiveFor,
    /// True if a simulated operator replaces the person.
    pub calibrate: bool,
    /// Name of the session, such as `sub-P01/ses-01`.
    pub session: Option<String>,
    /// Names of the sessions that can be resumed.
    pub open: Vec<String>,
    /// Runs that have ended.
    pub done: Vec<FinishedRun>,
    /// Names of the conditions of all planned runs; `next` is the index of the next run.
    pub planned: Vec<String>,
    /// Index of the next run in `planned`.
    pub next: Option<usize>,
    /// The condition of the next run.
    pub condition: Option<Condition>,
    /// True if the next run is a training run.
    pub training: bool,
    /// Number of the run in progress, if there is one.
    pub running: Option<usize>,
    /// True while pages are being created.
    pub reporting: bool,
    /// Titles and paths of the existing pages.
    pub reports: Vec<(String, String)>,
    /// Results of the calibration: names and values.
    pub calibration: Vec<(String, String)>,
}

/// Simulated operator of a calibration: `u = (H e)(t - delay) + n`, with the input of H held over a tick.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulatedOperator {
    /// The transfer function H as matrices.
    pub plant: crate::plant::Plant,
    /// Delay in ticks.
    pub delay: usize,
}
