//! A run of a session as its page starts it.

use hoid_lab::{
    config::Limits,
    plant::InputMap,
    session::{RunStart, Session},
    task::Task,
};

/// Starts the next run with the given number.
pub fn start_run(session: &Session, number: usize, input: InputMap) -> Option<(RunStart, Task)> {
    let planned = session.next_run()?;
    let condition = session.plan.config.condition[0].clone();
    let task = Task::new(&condition, 0, number as u64).ok()?;
    let run_start = RunStart {
        hoid: "test".to_owned(),
        number,
        planned,
        training: false,
        utc: String::new(),
        condition,
        cell: 0,
        replication: number as u64,
        run_in: task.run_in,
        ticks: task.ticks,
        input,
        device: "mouse".to_owned(),
        clock: "browser".to_owned(),
        refresh_ms: 16.7,
        zero_ms: 1000.0,
        limits: Limits::default(),
        phases: task.phases.clone(),
    };
    Some((run_start, task))
}
