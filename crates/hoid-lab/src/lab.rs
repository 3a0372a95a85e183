//! The experiment as its pages interact with it: one session at a time, one page for tracking, and any number of pages
//! for observers.
//!
//! Messages from pages arrive on the threads of their sockets and are processed one at a time under a common lock;
//! messages to a page are queued for that page. The live estimate and the creation of result pages have separate
//! threads.
//!
//! | file | contents |
//! |---|---|
//! | `runs` | the stages of a run: sent, started, received in batches, ended |
//! | `messages` | messages to the pages |

mod messages;
mod runs;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
        mpsc::Sender,
    },
};

use hoid_io::DirectoryLock;

use crate::{
    LabError,
    calibrate::{self, Calibration},
    config::Config,
    experiment, export,
    live::Samples,
    replay,
    reports::{self, Pages},
    session::{RunEnd, RunLog, RunStart, Session, Stem},
    task::Task,
    wire::{FromPage, Role, ToPage},
};

/// A message to a page.
#[derive(Debug, Clone, PartialEq)]
pub enum OutgoingMessage {
    /// A text message.
    Text(String),
    /// The tables of a run.
    Binary(Vec<u8>),
}

/// Mode of operation of the lab.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Mode {
    /// Sessions with people.
    Sessions,
    /// Replay of the session in this folder.
    Replay(PathBuf),
    /// Calibration, in which a simulated operator replaces the person.
    Calibrate,
}

/// A running experiment.
pub struct Lab {
    shared: Arc<SharedState>,
    next_page: AtomicU64,
}

struct SharedState {
    out: PathBuf,
    config: Config,
    mode: Mode,
    /// Path of the program `hoid`, which creates the pages of results.
    program: Option<PathBuf>,
    state: Mutex<LabState>,
    pages: Mutex<BTreeMap<u64, Page>>,
    /// Prevents a second server for the same experiment.
    _lock: Option<DirectoryLock>,
}

struct Page {
    role: Option<Role>,
    browser: BTreeMap<String, String>,
    sender: Sender<OutgoingMessage>,
}

#[derive(Default)]
struct LabState {
    session: Option<Session>,
    /// Number of the page used for tracking.
    person: Option<u64>,
    /// A run that was sent to the page but not started.
    prepared_run: Option<PreparedRun>,
    run: Option<ActiveRun>,
    /// Number of the last run that ended; its page may still send batches.
    last_ended_run: Option<usize>,
    reporting: bool,
    pages: Pages,
    calibration: Option<Calibration>,
}

struct PreparedRun {
    plan_index: usize,
    number: usize,
    task: Task,
}

struct ActiveRun {
    run_start: RunStart,
    stem: Stem,
    task: Task,
    log: RunLog,
    live: Option<Sender<Samples>>,
}

impl LabState {
    /// Returns the current run if it has this number.
    fn active_run(&self, number: usize) -> Result<&ActiveRun, LabError> {
        let run = self.run.as_ref().filter(|run| run.run_start.number == number);
        run.ok_or_else(|| LabError::Order(format!("run {number} is not in progress")))
    }

    /// Makes a session the current one; a run that was sent for another session cannot be started in it.
    fn set_session(&mut self, session: Session) {
        self.session = Some(session);
        self.prepared_run = None;
        self.pages = Pages::default();
    }
}

impl Lab {
    /// Opens an experiment for sessions, a replay or a calibration.
    ///
    /// # Errors
    /// [`LabError`] for a folder that cannot be used, or that contains no session to replay.
    pub fn open(out: &Path, config: Config, mode: Mode, program: Option<PathBuf>) -> Result<Self, LabError> {
        let mut current = LabState::default();
        let config = match &mode {
            Mode::Replay(folder) => {
                let session = Session::read(folder)?;
                current.pages = reports::existing_pages(&session.folder);
                let config = session.plan.config.clone();
                current.session = Some(session);
                config
            }
            Mode::Calibrate => calibrate::config(),
            Mode::Sessions => config,
        };
        // Runs without a person are stored in a separate folder.
        let out = if mode == Mode::Calibrate {
            out.join("calibration")
        } else {
            out.to_owned()
        };
        let mut lock = None;
        if !matches!(mode, Mode::Replay(_)) {
            hoid_io::make_directory(&out)?;
            lock = Some(DirectoryLock::take(&out)?);
        }
        if mode == Mode::Sessions {
            experiment::write_description(&out, &config)?;
        }
        Ok(Self {
            shared: Arc::new(SharedState {
                out,
                config,
                mode,
                program,
                state: Mutex::new(current),
                pages: Mutex::new(BTreeMap::new()),
                _lock: lock,
            }),
            next_page: AtomicU64::new(1),
        })
    }

    /// Registers a page and returns its number.
    pub fn join(&self, sender: Sender<OutgoingMessage>) -> u64 {
        let id = self.next_page.fetch_add(1, Ordering::Relaxed);
        self.shared.pages().insert(
            id,
            Page {
                role: None,
                browser: BTreeMap::new(),
                sender,
            },
        );
        id
    }

    /// Removes a page. If it was the tracking page, its current run is aborted, and the session continues in the newest
    /// remaining window of the person: a reloaded page may connect before the old connection is known to be closed.
    pub fn leave(&self, id: u64) {
        self.shared.pages().remove(&id);
        let mut state = self.shared.state();
        if state.person == Some(id) {
            state.person = None;
            state.prepared_run = None;
            // If the files of the run cannot be completed now, the run is closed when the session is next opened.
            let _ = self.shared.end_run(&mut state, RunEnd::Interrupted, BTreeMap::new());
            let left = self.shared.newest_person();
            if let Some(newest) = left {
                let _ = self.shared.transfer_session_to(&mut state, newest);
            }
            drop(state);
            if let Some(newest) = left {
                self.shared.send_to_pages(&ToPage::Yours {}, |page, _| page == newest);
            }
            self.shared.send_state();
        }
    }

    /// Processes a message from a page.
    ///
    /// # Errors
    /// [`LabError::Message`] for invalid messages, [`LabError::Order`] for messages at the wrong time; errors of
    /// reading or writing files.
    pub fn receive(&self, id: u64, message: FromPage) -> Result<(), LabError> {
        let shared = &self.shared;
        if let FromPage::Hello { role, browser } = message {
            return shared.handle_hello(id, role, browser);
        }
        if matches!(shared.mode, Mode::Replay(_)) {
            return Err(LabError::Order(
                "a session is being replayed; nothing is measured".to_owned(),
            ));
        }
        let mut state = shared.state();
        if state.person != Some(id) {
            return Err(LabError::Order(
                "This window is view-only; the session runs in another window.".to_owned(),
            ));
        }
        // Neither of these messages changes the state of the session.
        let quiet = matches!(message, FromPage::Next {} | FromPage::Batch { .. });
        let obeyed = shared.execute(&mut state, id, message);
        drop(state);
        if !quiet || obeyed.is_err() {
            shared.send_state();
        }
        obeyed
    }

    /// Returns the session as an archive; `None` if there is no session.
    ///
    /// # Errors
    /// Errors of reading files.
    pub fn export(&self) -> Result<Option<(Vec<u8>, &'static str)>, LabError> {
        let Some(folder) = self.shared.session_folder() else {
            return Ok(None);
        };
        Ok(Some((export::archive(&self.shared.out, &folder)?, "application/zip")))
    }

    /// Returns the data for replaying a run, requested by a name such as `3.json`; `None` if there is no such run.
    ///
    /// # Errors
    /// Errors of reading files.
    pub fn data(&self, name: &str) -> Result<Option<(Vec<u8>, &'static str)>, LabError> {
        let number: Option<usize> = name.strip_suffix(".json").and_then(|number| number.parse().ok());
        let (Some(number), Some(folder)) = (number, self.shared.session_folder()) else {
            return Ok(None);
        };
        let found = Stem::find_all(&folder)?.into_iter().find(|(known, _)| *known == number);
        let Some((_, stem)) = found else { return Ok(None) };
        Ok(Some((replay::data(&stem)?, "application/json")))
    }

    /// Returns a file of the pages of results, by its path components as in
    /// [`State::reports`](crate::wire::State::reports).
    ///
    /// # Errors
    /// Errors of reading files.
    pub fn report(&self, names: &[&str]) -> Result<Option<(Vec<u8>, &'static str)>, LabError> {
        let Some(folder) = self.shared.session_folder() else {
            return Ok(None);
        };
        reports::read_page(&folder, &self.shared.out, names)
    }
}

impl SharedState {
    fn state(&self) -> MutexGuard<'_, LabState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the folder of the current or replayed session.
    fn session_folder(&self) -> Option<PathBuf> {
        self.state().session.as_ref().map(|session| session.folder.clone())
    }

    fn pages(&self) -> MutexGuard<'_, BTreeMap<u64, Page>> {
        self.pages.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn handle_hello(&self, id: u64, role: Role, browser: BTreeMap<String, String>) -> Result<(), LabError> {
        let long = |(name, value): (&String, &String)| name.len() > 64 || value.len() > 512;
        if browser.len() > 32 || browser.iter().any(long) {
            return Err(LabError::Message(
                "the browser information sent by the page is too long".to_owned(),
            ));
        }
        if let Some(page) = self.pages().get_mut(&id) {
            page.role = Some(role);
            page.browser = browser;
        }
        let mut state = self.state();
        if role == Role::Person && state.run.is_none() {
            // The newest window takes over the session; the previous window is notified.
            let before = state.person.filter(|before| *before != id);
            self.transfer_session_to(&mut state, id)?;
            if let Some(before) = before {
                let words = "The session continues in another window; this window is view-only.".to_owned();
                self.send_to_pages(&ToPage::Refused { words, elsewhere: true }, |page, _| page == before);
            }
        } else if role == Role::Person {
            let words = "A run is in progress in another window; this window is view-only.".to_owned();
            self.send_to_pages(&ToPage::Refused { words, elsewhere: true }, |page, _| page == id);
        }
        drop(state);
        self.send_state();
        Ok(())
    }

    /// Returns the newest window of the person.
    fn newest_person(&self) -> Option<u64> {
        let pages = self.pages();
        pages
            .iter()
            .rev()
            .find(|(_, page)| page.role == Some(Role::Person))
            .map(|(id, _)| *id)
    }

    /// Continues the session in the window `id`.
    fn transfer_session_to(&self, state: &mut LabState, id: u64) -> Result<(), LabError> {
        state.person = Some(id);
        state.prepared_run = None;
        let browser = self
            .pages()
            .get(&id)
            .map(|page| page.browser.clone())
            .unwrap_or_default();
        match state.session.as_mut().filter(|_| self.mode == Mode::Sessions) {
            Some(session) => {
                session.plan.browser = browser;
                session.save()
            }
            None => Ok(()),
        }
    }

    /// Executes a message from the tracking page.
    fn execute(self: &Arc<Self>, state: &mut LabState, id: u64, message: FromPage) -> Result<(), LabError> {
        match message {
            FromPage::Hello { .. } => Ok(()),
            FromPage::Consent { subject, agreed, cc0 } => self.handle_consent(state, &subject, agreed, cc0),
            FromPage::Resume { session } => self.resume(state, &session),
            FromPage::Next {} => self.send_run(state, id),
            begin @ FromPage::Begin { .. } => self.start_run(state, begin),
            FromPage::Batch { number, batch } => self.append_batch(state, number, &batch),
            FromPage::Abort { number } => {
                state.active_run(number)?;
                self.end_run(state, RunEnd::Interrupted, BTreeMap::new())
            }
            FromPage::Finish { number, counted } => self.finish_run(state, number, counted),
            FromPage::Reports {} => {
                self.create_reports(state);
                Ok(())
            }
        }
    }

    fn handle_consent(&self, state: &mut LabState, subject: &str, agreed: bool, cc0: bool) -> Result<(), LabError> {
        if !agreed {
            return Err(LabError::Order("nothing is measured without consent".to_owned()));
        }
        if state.run.is_some() || matches!(self.mode, Mode::Replay(_)) {
            return Err(LabError::Order("another session is in progress".to_owned()));
        }
        state.set_session(Session::create(&self.out, &self.config, subject, cc0)?);
        experiment::write_participants(&self.out)
    }

    fn resume(&self, state: &mut LabState, name: &str) -> Result<(), LabError> {
        let open = self.open_sessions();
        if state.run.is_some() || !open.iter().any(|known| known == name) {
            return Err(LabError::Order(format!("there is no session {name:?} to continue")));
        }
        state.set_session(Session::open(&self.out.join(name))?);
        Ok(())
    }
}
