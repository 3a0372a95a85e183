//! The experiment as its pages see it: one session at a time, one page that tracks, any number that
//! look on.
//!
//! What pages say comes from the threads of their sockets, one message at a time under one lock; what
//! is said to them goes into the queue of each. The estimate has a thread of its own, the pages of
//! results too.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
        mpsc::Sender,
    },
    thread,
};

use hoid_io::DirectoryLock;
use hoid_track::Sample;

use crate::{
    LabError,
    calibrate::{self, Calibration},
    config::{Config, LiveFor},
    experiment, export,
    live::{LiveLine, LiveRun, Samples, start},
    record::record,
    replay,
    reports::{self, Pages},
    session::{Batch, Begun, Done, How, Logged, RunLog, Session, Stem},
    task::{TICKS_PER_SAMPLE, Task},
    utc,
    verify::check,
    wire::{FromPage, Role, State, ToPage},
};

/// What goes to a page.
#[derive(Debug, Clone, PartialEq)]
pub enum Outgoing {
    /// A message.
    Text(String),
    /// The tables of a run.
    Binary(Vec<u8>),
}

/// What is done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Mode {
    /// Sessions of people.
    Sessions,
    /// A session is shown again.
    Replay(PathBuf),
    /// A simulated operator takes the place of the person.
    Calibrate,
}

/// The experiment.
pub struct Lab {
    shared: Arc<Shared>,
    next_page: AtomicU64,
}

struct Shared {
    out: PathBuf,
    config: Config,
    mode: Mode,
    /// The program `hoid`, which makes the pages of results.
    program: Option<PathBuf>,
    state: Mutex<Current>,
    pages: Mutex<BTreeMap<u64, Page>>,
    /// No second server on one experiment.
    _lock: Option<DirectoryLock>,
}

struct Page {
    role: Option<Role>,
    sender: Sender<Outgoing>,
}

#[derive(Default)]
struct Current {
    session: Option<Session>,
    /// The page that tracks.
    person: Option<u64>,
    /// A run that was sent and has not begun.
    ready: Option<Ready>,
    run: Option<Running>,
    reporting: bool,
    pages: Pages,
    calibration: Option<Calibration>,
}

struct Ready {
    planned: usize,
    number: usize,
    task: Task,
}

struct Running {
    begun: Begun,
    stem: Stem,
    task: Task,
    log: RunLog,
    live: Option<Sender<Samples>>,
}

impl Lab {
    /// Opens an experiment, a session of which can be shown again or a calibration made.
    ///
    /// # Errors
    /// [`LabError`] for a folder that cannot be used, or holds no session to show.
    pub fn open(out: &Path, config: Config, mode: Mode, program: Option<PathBuf>) -> Result<Self, LabError> {
        let mut current = Current::default();
        let config = match &mode {
            Mode::Replay(folder) => {
                let session = Session::read(folder)?;
                current.pages = reports::found(&session.folder);
                let config = session.facts.config.clone();
                current.session = Some(session);
                config
            }
            Mode::Calibrate => calibrate::config(),
            Mode::Sessions => config,
        };
        // Runs that no person made stand apart.
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
            experiment::describe(&out, &config)?;
        }
        Ok(Self {
            shared: Arc::new(Shared {
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

    /// A page is there; its number.
    pub fn join(&self, sender: Sender<Outgoing>) -> u64 {
        let id = self.next_page.fetch_add(1, Ordering::Relaxed);
        self.shared.pages().insert(id, Page { role: None, sender });
        id
    }

    /// A page is gone; a run of it is broken off.
    pub fn leave(&self, id: u64) {
        self.shared.pages().remove(&id);
        let mut state = self.shared.state();
        if state.person == Some(id) {
            state.person = None;
            state.ready = None;
            // Its files cannot be closed: the session says so when it is opened next.
            let _ = self.shared.end_run(&mut state, How::Interrupted, BTreeMap::new());
            drop(state);
            self.shared.tell_state();
        }
    }

    /// Hears a page.
    ///
    /// # Errors
    /// [`LabError::Message`] for what no page of this program says, [`LabError::Order`] for what comes
    /// at the wrong time, those of files.
    pub fn hear(&self, id: u64, message: FromPage) -> Result<(), LabError> {
        let shared = &self.shared;
        if let FromPage::Hello { role, browser } = message {
            return shared.hello(id, role, browser);
        }
        if matches!(shared.mode, Mode::Replay(_)) {
            return Err(LabError::Order(
                "a session is shown again; nothing is measured".to_owned(),
            ));
        }
        let mut state = shared.state();
        if state.person != Some(id) {
            return Err(LabError::Order(
                "This window looks on; the session runs in another one.".to_owned(),
            ));
        }
        match message {
            FromPage::Hello { .. } => {}
            FromPage::Consent { subject, agreed, cc0 } => shared.consent(&mut state, &subject, agreed, cc0)?,
            FromPage::Resume { session } => shared.resume(&mut state, &session)?,
            FromPage::Next => return shared.send_run(&mut state, id),
            FromPage::Batch { number, batch } => return shared.take(&mut state, number, &batch),
            FromPage::Abort { number } => {
                running(&state, number)?;
                shared.end_run(&mut state, How::Interrupted, BTreeMap::new())?;
            }
            FromPage::Finish { number, counted } => {
                let run = running(&state, number)?;
                if run.log.ticks() != run.begun.ticks {
                    let (ticks, all) = (run.log.ticks(), run.begun.ticks);
                    return Err(LabError::Order(format!(
                        "the run has {ticks} of {all} ticks and cannot be finished"
                    )));
                }
                if counted.len() > 16 || counted.values().any(|v| !v.is_finite()) {
                    return Err(LabError::Message(
                        "what the page counted is not a few numbers".to_owned(),
                    ));
                }
                shared.end_run(&mut state, How::Finished, counted)?;
                if state.session.as_ref().is_some_and(|session| session.next().is_none()) {
                    shared.report(&mut state);
                }
            }
            FromPage::Reports => shared.report(&mut state),
            begin @ FromPage::Begin { .. } => shared.begin(&mut state, begin)?,
        }
        drop(state);
        shared.tell_state();
        Ok(())
    }

    /// The session as one archive; nothing where there is none.
    ///
    /// # Errors
    /// Those of files.
    pub fn export(&self) -> Result<Option<(Vec<u8>, &'static str)>, LabError> {
        let folder = self
            .shared
            .state()
            .session
            .as_ref()
            .map(|session| session.folder.clone());
        let Some(folder) = folder else { return Ok(None) };
        Ok(Some((export::archive(&self.shared.out, &folder)?, "application/zip")))
    }

    /// The signals of a run, `3.json`; nothing where there is no such run.
    ///
    /// # Errors
    /// Those of files.
    pub fn data(&self, name: &str) -> Result<Option<(Vec<u8>, &'static str)>, LabError> {
        let number: Option<usize> = name.strip_suffix(".json").and_then(|number| number.parse().ok());
        let folder = self
            .shared
            .state()
            .session
            .as_ref()
            .map(|session| session.folder.clone());
        let (Some(number), Some(folder)) = (number, folder) else {
            return Ok(None);
        };
        let found = Stem::all(&folder)?.into_iter().find(|(known, _)| *known == number);
        let Some((_, stem)) = found else { return Ok(None) };
        Ok(Some((replay::data(&stem)?, "application/json")))
    }

    /// A file of the pages of results, by the names that [`State::reports`] has.
    ///
    /// # Errors
    /// Those of files.
    pub fn report(&self, names: &[&str]) -> Result<Option<(Vec<u8>, &'static str)>, LabError> {
        let folder = self
            .shared
            .state()
            .session
            .as_ref()
            .map(|session| session.folder.clone());
        let Some(folder) = folder else { return Ok(None) };
        reports::file(&folder, &self.shared.out, names)
    }
}

fn running(state: &Current, number: usize) -> Result<&Running, LabError> {
    let run = state.run.as_ref().filter(|run| run.begun.number == number);
    run.ok_or_else(|| LabError::Order(format!("run {number} is not going on")))
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, Current> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn pages(&self) -> MutexGuard<'_, BTreeMap<u64, Page>> {
        self.pages.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends to the pages that `wants` picks.
    fn tell(&self, message: &ToPage<'_>, wants: impl Fn(u64, &Page) -> bool) {
        // Everything that is said can be written as JSON.
        let Ok(text) = serde_json::to_string(message) else {
            return;
        };
        for (id, page) in &*self.pages() {
            if wants(*id, page) {
                // A page that is gone leaves by itself.
                let _ = page.sender.send(Outgoing::Text(text.clone()));
            }
        }
    }

    fn hello(&self, id: u64, role: Role, browser: BTreeMap<String, String>) -> Result<(), LabError> {
        let long = |(name, value): (&String, &String)| name.len() > 64 || value.len() > 512;
        if browser.len() > 32 || browser.iter().any(long) {
            return Err(LabError::Message("the page says too much of its browser".to_owned()));
        }
        if let Some(page) = self.pages().get_mut(&id) {
            page.role = Some(role);
        }
        let mut state = self.state();
        if role == Role::Person && state.run.is_none() {
            // The newest window has the session; an older one is told that it has not.
            let before = state.person.replace(id).filter(|before| *before != id);
            state.ready = None;
            if let Some(session) = state.session.as_mut().filter(|_| self.mode == Mode::Sessions) {
                session.facts.browser.clone_from(&browser);
                session.save()?;
            }
            if let Some(before) = before {
                let words = "The session goes on in another window; this one looks on.".to_owned();
                self.tell(&ToPage::Refused { words, elsewhere: true }, |page, _| page == before);
            }
        } else if role == Role::Person {
            let words = "A run goes on in another window; this one looks on.".to_owned();
            self.tell(&ToPage::Refused { words, elsewhere: true }, |page, _| page == id);
        }
        drop(state);
        self.tell_state();
        Ok(())
    }

    fn consent(&self, state: &mut Current, subject: &str, agreed: bool, cc0: bool) -> Result<(), LabError> {
        if !agreed {
            return Err(LabError::Order("without consent nothing is measured".to_owned()));
        }
        if state.run.is_some() || matches!(self.mode, Mode::Replay(_)) {
            return Err(LabError::Order("another session goes on".to_owned()));
        }
        state.session = Some(Session::begin(&self.out, &self.config, subject, cc0)?);
        state.pages = Pages::default();
        experiment::list(&self.out)
    }

    fn resume(&self, state: &mut Current, name: &str) -> Result<(), LabError> {
        let open = self.open_sessions();
        if state.run.is_some() || !open.iter().any(|known| known == name) {
            return Err(LabError::Order(format!("there is no session {name:?} to go on with")));
        }
        state.session = Some(Session::open(&self.out.join(name))?);
        state.pages = Pages::default();
        Ok(())
    }

    /// Sessions that can go on, as `sub-P01/ses-01`.
    fn open_sessions(&self) -> Vec<String> {
        if self.mode != Mode::Sessions {
            return Vec::new();
        }
        let unfinished = |folder: &PathBuf| Session::read(folder).is_ok_and(|session| !session.facts.finished);
        let folders = Session::folders(&self.out).unwrap_or_default();
        folders
            .iter()
            .filter(|folder| unfinished(folder))
            .map(|folder| name_of(folder))
            .collect()
    }

    fn send_run(&self, state: &mut Current, id: u64) -> Result<(), LabError> {
        if state.run.is_some() {
            return Err(LabError::Order("a run goes on".to_owned()));
        }
        let session = session_of(state)?;
        let Some(planned) = session.next() else {
            return Err(LabError::Order("all runs of the session are done".to_owned()));
        };
        let plan = &session.facts.plan[planned];
        let condition = session.facts.config.condition[plan.condition].clone();
        let number = session.new_number()?;
        let training = plan.training;
        let task = Task::new(&condition, plan.condition as u64, number as u64)?;
        let simulated = (self.mode == Mode::Calibrate)
            .then(|| calibrate::operator(&task, number as u64))
            .transpose()?;
        let noise = simulated.as_ref().map_or(&[][..], |(_, noise)| noise);
        let run = ToPage::Run {
            number,
            condition: &condition,
            training,
            run_in: task.run_in,
            ticks: task.ticks,
            phases: &task.phases,
            tables: vec![task.target.len(), task.disturbance.len(), noise.len()],
            operator: simulated.as_ref().map(|(operator, _)| operator),
        };
        self.tell(&run, |page, _| page == id);
        let numbers = task.target.iter().chain(&task.disturbance).chain(noise);
        let bytes: Vec<u8> = numbers.flat_map(|v| v.to_le_bytes()).collect();
        if let Some(page) = self.pages().get(&id) {
            let _ = page.sender.send(Outgoing::Binary(bytes));
        }
        state.ready = Some(Ready { planned, number, task });
        Ok(())
    }

    fn begin(self: &Arc<Self>, state: &mut Current, message: FromPage) -> Result<(), LabError> {
        let FromPage::Begin {
            number,
            input,
            device,
            clock,
            refresh_ms,
            zero_ms,
        } = message
        else {
            return Ok(());
        };
        if let Some(fault) = input.fault() {
            return Err(LabError::Message(fault));
        }
        let known = ["mouse", "pen", "touch", "gamepad"].contains(&device.as_str());
        let timed = ["browser", "injected"].contains(&clock.as_str()) && refresh_ms >= 0.0 && zero_ms.is_finite();
        if !known || !timed {
            return Err(LabError::Message(format!(
                "device {device:?}, clock {clock:?}, refresh {refresh_ms} ms"
            )));
        }
        let ready = state
            .ready
            .take()
            .filter(|ready| ready.number == number && state.run.is_none());
        let Some(Ready { planned, task, .. }) = ready else {
            return Err(LabError::Order(format!("run {number} was not asked for")));
        };
        let session = session_of(state)?;
        let plan = &session.facts.plan[planned];
        let condition = session.facts.config.condition[plan.condition].clone();
        let stem = session.stem(&condition.name, number);
        let begun = Begun {
            hoid: env!("CARGO_PKG_VERSION").to_owned(),
            number,
            planned,
            training: plan.training,
            utc: utc::now(),
            cell: plan.condition as u64,
            replication: number as u64,
            run_in: task.run_in,
            ticks: task.ticks,
            input,
            device,
            clock,
            refresh_ms,
            zero_ms,
            limits: session.facts.config.limits,
            phases: task.phases.clone(),
            condition,
        };
        begun.write(&stem, &task)?;
        let live = LiveRun::new(&session.facts.config.method, begun.condition.course()?)?;
        let teller = Arc::downgrade(self);
        let live = start(live, &stem, move |line| {
            if let Some(shared) = teller.upgrade() {
                shared.tell_live(number, line);
            }
        });
        state.run = Some(Running {
            log: RunLog::create(&stem, task.ticks)?,
            begun,
            stem,
            task,
            live: Some(live),
        });
        Ok(())
    }

    fn tell_live(&self, number: usize, line: &LiveLine) {
        let person = self.config.live == LiveFor::During;
        self.tell(&ToPage::Live { number, line }, |_, page| match page.role {
            Some(Role::Experimenter) => true,
            Some(Role::Person) => person,
            None => false,
        });
    }

    fn take(&self, state: &mut Current, number: usize, batch: &Batch) -> Result<(), LabError> {
        running(state, number)?;
        let Some(run) = &mut state.run else { return Ok(()) };
        // First the estimate, which is waited for; the disk may take its time.
        let first = batch.first.next_multiple_of(TICKS_PER_SAMPLE) - batch.first;
        let samples = (first..batch.u.len().min(batch.e.len()))
            .step_by(TICKS_PER_SAMPLE)
            .map(|k| Sample {
                e: batch.e[k],
                u: batch.u[k],
                reference: run.task.target.get(batch.first + k).copied(),
            });
        let samples: Samples = samples.collect();
        if let (Some(live), false) = (&run.live, samples.is_empty()) {
            // An estimate that ended early is seen by the lines that lack.
            let _ = live.send(samples);
        }
        run.log.append(batch)
    }

    /// Ends the run that goes on, if one does.
    fn end_run(&self, state: &mut Current, how: How, counted: BTreeMap<String, f64>) -> Result<(), LabError> {
        let Some(mut run) = state.run.take() else { return Ok(()) };
        run.live = None;
        run.log.sync()?;
        drop(run.log);
        let Some(session) = &mut state.session else {
            return Ok(());
        };
        let checked = session.end(&run.stem, how, counted)?;
        let logged = Logged::read(&run.stem)?;
        if logged.signals.e.len() > 2 * TICKS_PER_SAMPLE {
            let record = record(&run.begun, &run.task, &logged)?;
            hoid_io::write_record(&run.stem.file("beh.parquet"), &record)?;
            if self.mode == Mode::Calibrate && how == How::Finished {
                state.calibration = Some(calibrate::judge(&self.out, &record, &logged)?);
            }
        }
        if self.mode == Mode::Sessions {
            experiment::manifest(&self.out)?;
        }
        if let Some(done) = session.done.last() {
            let measures = &checked.measures;
            self.tell(&ToPage::Verdict { done, measures }, |_, page| page.role.is_some());
        }
        Ok(())
    }

    /// Makes the pages about the session, on a thread of its own.
    fn report(self: &Arc<Self>, state: &mut Current) {
        let (Some(program), Some(session)) = (&self.program, &state.session) else {
            return;
        };
        if state.reporting || self.mode != Mode::Sessions {
            return;
        }
        state.reporting = true;
        let (program, out, folder) = (program.clone(), self.out.clone(), session.folder.clone());
        let shared = Arc::clone(self);
        thread::spawn(move || {
            let pages = reports::make(&program, &out, &folder, &|pages| {
                shared.state().pages = pages.clone();
                shared.tell_state();
            });
            let mut state = shared.state();
            state.reporting = false;
            state.pages = pages;
            drop(state);
            shared.tell_state();
        });
    }

    fn tell_state(&self) {
        let state = self.state();
        let session = state.session.as_ref();
        let facts = session.map(|session| &session.facts);
        let next = session.and_then(Session::next);
        let plan = |k: usize| facts.and_then(|facts| facts.plan.get(k));
        let condition_of = |k: usize| facts.map(|facts| &facts.config.condition[facts.plan[k].condition]);
        let done = match (&self.mode, session) {
            (Mode::Replay(_), Some(session)) => judged_again(session),
            (_, Some(session)) => session.done.clone(),
            _ => Vec::new(),
        };
        let message = State {
            phase: match (&self.mode, session) {
                (Mode::Replay(_), _) => "replay",
                (_, None) => "consent",
                (_, Some(session)) if session.next().is_some() => "runs",
                _ => "finished",
            },
            name: self.config.name.clone(),
            consent: self.config.consent.clone(),
            live: self.config.live,
            calibrate: self.mode == Mode::Calibrate,
            session: session.map(|session| name_of(&session.folder)),
            open: if session.is_none() {
                self.open_sessions()
            } else {
                Vec::new()
            },
            done,
            planned: (0..facts.map_or(0, |facts| facts.plan.len()))
                .filter_map(|k| condition_of(k).map(|condition| condition.name.clone()))
                .collect(),
            next,
            condition: next.and_then(condition_of).cloned(),
            training: next.and_then(plan).is_some_and(|plan| plan.training),
            running: state.run.as_ref().map(|run| run.begun.number),
            reporting: state.reporting,
            reports: state.pages.links(),
            calibration: state.calibration.as_ref().map(Calibration::rows).unwrap_or_default(),
        };
        drop(state);
        self.tell(&ToPage::State(Box::new(message)), |_, page| page.role.is_some());
    }
}

/// The runs with the verdicts that their files deserve now.
fn judged_again(session: &Session) -> Vec<Done> {
    let again = |done: &Done| {
        let checked = check(&session.stem(&done.condition, done.number));
        let (verdict, reasons) = match &checked {
            Ok(checked) => (checked.word(), checked.reasons()),
            Err(error) => ("unverified", error.to_string()),
        };
        Done {
            verdict: verdict.to_owned(),
            reasons,
            ..done.clone()
        }
    };
    session.done.iter().map(again).collect()
}

fn session_of(state: &Current) -> Result<&Session, LabError> {
    state
        .session
        .as_ref()
        .ok_or_else(|| LabError::Order("there is no session yet".to_owned()))
}

/// `sub-P01/ses-01`.
fn name_of(folder: &Path) -> String {
    let last = |path: &Path| {
        path.file_name()
            .map(|name| name.to_string_lossy().into_owned())
            .unwrap_or_default()
    };
    let person = folder.parent().map(last).unwrap_or_default();
    format!("{person}/{}", last(folder))
}
