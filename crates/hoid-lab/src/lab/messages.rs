//! Messages to the pages: the state of the session, and the live estimate.

use std::path::{Path, PathBuf};

use super::{Mode, OutgoingMessage, Page, SharedState};
use crate::{
    calibrate::Calibration,
    config::LiveFor,
    live::LiveLine,
    session::{FinishedRun, Session},
    verify::check,
    wire::{Role, State, ToPage},
};

impl SharedState {
    /// Sends a message to the pages selected by `wants`.
    pub(super) fn send_to_pages(&self, message: &ToPage<'_>, wants: impl Fn(u64, &Page) -> bool) {
        // Every message can be serialised as JSON.
        let Ok(text) = serde_json::to_string(message) else {
            return;
        };
        for (id, page) in &*self.pages() {
            if wants(*id, page) {
                // A page that has been closed is removed by its socket thread.
                let _ = page.sender.send(OutgoingMessage::Text(text.clone()));
            }
        }
    }

    pub(super) fn send_live(&self, number: usize, line: &LiveLine) {
        let person = self.config.live == LiveFor::During;
        self.send_to_pages(&ToPage::Live { number, line }, |_, page| match page.role {
            Some(Role::Experimenter) => true,
            Some(Role::Person) => person,
            None => false,
        });
    }

    /// Returns the names of the sessions that can be resumed, such as `sub-P01/ses-01`.
    pub(super) fn open_sessions(&self) -> Vec<String> {
        if self.mode != Mode::Sessions {
            return Vec::new();
        }
        let unfinished = |folder: &PathBuf| Session::read(folder).is_ok_and(|session| !session.plan.finished);
        let folders = Session::folders(&self.out).unwrap_or_default();
        folders
            .iter()
            .filter(|folder| unfinished(folder))
            .map(|folder| session_name(folder))
            .collect()
    }

    pub(super) fn send_state(&self) {
        let state = self.state();
        let session = state.session.as_ref();
        let facts = session.map(|session| &session.plan);
        let next = session.and_then(Session::next_run);
        let run = |index: usize| facts.and_then(|facts| facts.planned_run(index));
        let done = match (&self.mode, session) {
            (Mode::Replay(_), Some(session)) => reverified_runs(session),
            (_, Some(session)) => session.finished_runs.clone(),
            _ => Vec::new(),
        };
        let message = State {
            phase: match (&self.mode, session) {
                (Mode::Replay(_), _) => "replay",
                (_, None) => "consent",
                (_, Some(session)) if session.next_run().is_some() => "runs",
                _ => "finished",
            },
            name: self.config.name.clone(),
            consent: self.config.consent.clone(),
            live: self.config.live,
            calibrate: self.mode == Mode::Calibrate,
            session: session.map(|session| session_name(&session.folder)),
            open: if session.is_none() {
                self.open_sessions()
            } else {
                Vec::new()
            },
            done,
            planned: (0..facts.map_or(0, |facts| facts.plan.len()))
                .filter_map(|index| run(index).map(|(_, condition)| condition.name.clone()))
                .collect(),
            next,
            condition: next.and_then(run).map(|(_, condition)| condition.clone()),
            training: next.and_then(run).is_some_and(|(plan, _)| plan.training),
            running: state.run.as_ref().map(|run| run.run_start.number),
            reporting: state.reporting,
            reports: state.pages.links(),
            calibration: state.calibration.as_ref().map(Calibration::rows).unwrap_or_default(),
        };
        drop(state);
        self.send_to_pages(&ToPage::State(Box::new(message)), |_, page| page.role.is_some());
    }
}

/// Returns the runs that have ended, each with a new verdict on the current state of its files.
fn reverified_runs(session: &Session) -> Vec<FinishedRun> {
    let again = |done: &FinishedRun| {
        let checked = check(&session.stem(&done.condition, done.number));
        let (verdict, reasons) = match &checked {
            Ok(checked) => (checked.label(), checked.reasons()),
            Err(error) => ("unverified", error.to_string()),
        };
        FinishedRun {
            verdict: verdict.to_owned(),
            reasons,
            ..done.clone()
        }
    };
    session.finished_runs.iter().map(again).collect()
}

/// Returns the name of a session, such as `sub-P01/ses-01`.
fn session_name(folder: &Path) -> String {
    let last = |path: &Path| {
        path.file_name()
            .map(|name| name.to_string_lossy().into_owned())
            .unwrap_or_default()
    };
    let person = folder.parent().map(last).unwrap_or_default();
    format!("{person}/{}", last(folder))
}
