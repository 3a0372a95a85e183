//! Stages of a run on the server: sent, started, received in batches, ended.

use std::{collections::BTreeMap, sync::Arc, thread};

use hoid_track::Sample;

use super::{ActiveRun, LabState, Mode, OutgoingMessage, PreparedRun, SharedState};
use crate::{
    LabError, calibrate, experiment,
    live::{LiveRun, Samples, start},
    record::record,
    reports,
    session::{Batch, LoggedRun, RunEnd, RunLog, RunStart, Session},
    task::{TICKS_PER_SAMPLE, Task},
    utc,
    verify::Measures,
    wire::{FromPage, ToPage},
};

impl SharedState {
    pub(super) fn send_run(&self, state: &mut LabState, id: u64) -> Result<(), LabError> {
        if state.run.is_some() {
            return Err(LabError::Order("a run is already in progress".to_owned()));
        }
        let session = current_session(state)?;
        let next = session
            .next_run()
            .and_then(|place| Some((place, session.plan.planned_run(place)?)));
        let Some((planned, (plan, condition))) = next else {
            return Err(LabError::Order("all runs of the session are done".to_owned()));
        };
        let condition = condition.clone();
        let number = session.next_run_number()?;
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
        self.send_to_pages(&run, |page, _| page == id);
        let numbers = task.target.iter().chain(&task.disturbance).chain(noise);
        let bytes: Vec<u8> = numbers.flat_map(|v| v.to_le_bytes()).collect();
        if let Some(page) = self.pages().get(&id) {
            let _ = page.sender.send(OutgoingMessage::Binary(bytes));
        }
        state.prepared_run = Some(PreparedRun {
            plan_index: planned,
            number,
            task,
        });
        Ok(())
    }

    pub(super) fn start_run(self: &Arc<Self>, state: &mut LabState, message: FromPage) -> Result<(), LabError> {
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
            .prepared_run
            .take()
            .filter(|ready| ready.number == number && state.run.is_none());
        let Some(PreparedRun {
            plan_index: planned,
            task,
            ..
        }) = ready
        else {
            return Err(LabError::Order(format!("run {number} was not requested")));
        };
        // Until the log exists, batches of this run are ignored.
        state.last_ended_run = Some(number);
        let session = current_session(state)?;
        let Some((plan, condition)) = session.plan.planned_run(planned) else {
            return Err(LabError::Order(format!("the session has no run {planned}")));
        };
        let condition = condition.clone();
        let stem = session.stem(&condition.name, number);
        let run_start = RunStart {
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
            limits: session.plan.config.limits,
            phases: task.phases.clone(),
            condition,
        };
        run_start.write(&stem, &task).map_err(unverified_run_error)?;
        let log = RunLog::create(&stem, task.ticks).map_err(unverified_run_error)?;
        let live = LiveRun::new(&session.plan.config.method, run_start.condition.task_definition()?)?;
        let teller = Arc::downgrade(self);
        let live = start(live, &stem, move |line| {
            if let Some(shared) = teller.upgrade() {
                shared.send_live(number, line);
            }
        });
        state.run = Some(ActiveRun {
            log,
            run_start,
            stem,
            task,
            live: Some(live),
        });
        Ok(())
    }

    pub(super) fn append_batch(&self, state: &mut LabState, number: usize, batch: &Batch) -> Result<(), LabError> {
        if state.run.is_none() && state.last_ended_run == Some(number) {
            return Ok(());
        }
        state.active_run(number)?;
        let Some(run) = &mut state.run else { return Ok(()) };
        run.log.check_batch(batch)?;
        // The samples are passed to the estimate before the data are written, since the estimate is displayed live and
        // writing may take time.
        let samples = (batch.first..)
            .zip(batch.u.iter().zip(&batch.e))
            .filter(|(tick, _)| tick.is_multiple_of(TICKS_PER_SAMPLE))
            .map(|(tick, (u, e))| Sample {
                e: *e,
                u: *u,
                reference: run.task.target.get(tick).copied(),
            });
        let samples: Samples = samples.collect();
        if let (Some(live), false) = (&run.live, samples.is_empty()) {
            // If the thread of the estimate has ended, the error is ignored; the missing lines indicate it.
            let _ = live.send(samples);
        }
        let refused = match run.log.append(batch) {
            Err(error @ LabError::File { .. }) => unverified_run_error(error),
            other => return other,
        };
        // If the disk is full, the run is closed when the session is next opened.
        let _ = self.end_run(state, RunEnd::Interrupted, BTreeMap::new());
        Err(refused)
    }

    /// Ends a run of which all ticks have been received.
    pub(super) fn finish_run(
        self: &Arc<Self>,
        state: &mut LabState,
        number: usize,
        counted: BTreeMap<String, f64>,
    ) -> Result<(), LabError> {
        let run = state.active_run(number)?;
        if run.log.tick_count() != run.run_start.ticks {
            let (ticks, all) = (run.log.tick_count(), run.run_start.ticks);
            return Err(LabError::Order(format!(
                "the run has only {ticks} of {all} ticks and cannot be finished"
            )));
        }
        if counted.len() > 16 || counted.values().any(|v| !v.is_finite()) {
            return Err(LabError::Message(
                "the counts sent by the page are too many or not finite".to_owned(),
            ));
        }
        self.end_run(state, RunEnd::Finished, counted)?;
        if state
            .session
            .as_ref()
            .is_some_and(|session| session.next_run().is_none())
        {
            self.create_reports(state);
        }
        Ok(())
    }

    /// Ends the current run, if there is one.
    pub(super) fn end_run(
        &self,
        state: &mut LabState,
        how: RunEnd,
        counted: BTreeMap<String, f64>,
    ) -> Result<(), LabError> {
        let Some(run) = state.run.take() else { return Ok(()) };
        state.last_ended_run = Some(run.run_start.number);
        let measures = self.close_run(state, run, how, counted).map_err(unverified_run_error)?;
        let done = state.session.as_ref().and_then(|session| session.finished_runs.last());
        if let (Some(done), Some(measures)) = (done, &measures) {
            self.send_to_pages(&ToPage::Verdict { done, measures }, |_, page| page.role.is_some());
        }
        if self.mode == Mode::Sessions {
            experiment::write_manifest(&self.out)?;
        }
        Ok(())
    }

    /// Closes a run. Its record is written before its verdict, so that every run reported as verified has a record.
    fn close_run(
        &self,
        state: &mut LabState,
        mut run: ActiveRun,
        how: RunEnd,
        counted: BTreeMap<String, f64>,
    ) -> Result<Option<Measures>, LabError> {
        run.live = None;
        run.log.sync()?;
        drop(run.log);
        let Some(session) = &mut state.session else {
            return Ok(None);
        };
        let logged = LoggedRun::read(&run.stem)?;
        let record = (logged.signals.e.len() > 2 * TICKS_PER_SAMPLE)
            .then(|| record(&run.run_start, &run.task, &logged))
            .transpose()?;
        if let Some(record) = &record {
            hoid_io::write_record(&run.stem.file("beh.parquet"), record)?;
        }
        let checked = session.end_run(&run.stem, how, counted)?;
        if let (Mode::Calibrate, RunEnd::Finished, Some(record)) = (&self.mode, how, &record) {
            state.calibration = Some(calibrate::evaluate(&self.out, record, &logged)?);
        }
        Ok(Some(checked.measures))
    }

    /// Creates the pages about the session on a separate thread.
    pub(super) fn create_reports(self: &Arc<Self>, state: &mut LabState) {
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
            let pages = reports::make_pages(&program, &out, &folder, &|pages| {
                shared.state().pages = pages.clone();
                shared.send_state();
            });
            let mut state = shared.state();
            state.reporting = false;
            state.pages = pages;
            drop(state);
            shared.send_state();
        });
    }
}

/// Creates the error for a run that cannot be written and is therefore unverified: the run ends, and the session
/// continues.
fn unverified_run_error(error: LabError) -> LabError {
    let what = match &error {
        LabError::File { file, source } => format!("{file}: {source}"),
        LabError::Io(error) => error.to_string(),
        _ => return error,
    };
    LabError::Order(format!(
        "{what}. The run was ended and does not count; free space on the disk and start the run again"
    ))
}

fn current_session(state: &LabState) -> Result<&Session, LabError> {
    state
        .session
        .as_ref()
        .ok_or_else(|| LabError::Order("there is no session yet".to_owned()))
}
