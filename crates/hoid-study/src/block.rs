//! One block of a study: several replications of a cell, with all estimators of the cell.

use hoid_analysis::{AnalysisError, Recordings, ResolvedRequest};
use hoid_ident::{Fit, IdentError};
use hoid_model::Record;
use hoid_sim::{RunSeed, Simulator};
use hoid_track::track_from;

use crate::{
    batch_fits::BatchFits,
    columns::Schemas,
    estimate_rows::{BlockTables, EstimateRows},
    plan::{EstimatorCell, Plan, Task},
    prepared_record::Preparation,
};

/// Maximum number of samples between two points of a trace at which its errors are evaluated; it is much shorter than
/// any memory length.
const MAX_ERROR_SPACING_SAMPLES: usize = 4;

/// Number of replications whose fits are searched in one batch. A run of 82 s at 100 Hz takes 1 MB.
const BATCH_REPLICATIONS: usize = 50;

/// A block: consecutive replications of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Block {
    /// Number of the block in the study.
    pub index: u64,
    /// Index of the cell.
    pub cell: usize,
    /// Number of the first replication.
    pub first: u64,
    /// Number of replications.
    pub count: u64,
}

/// Returns all blocks of a plan in order.
pub(crate) fn blocks(plan: &Plan) -> Vec<Block> {
    let mut all: Vec<Block> = Vec::new();
    for (cell, of) in plan.cells.iter().enumerate() {
        let mut first = 0;
        while first < of.replications {
            let count = plan.block.min(of.replications - first);
            all.push(Block {
                index: all.len() as u64,
                cell,
                first,
                count,
            });
            first += count;
        }
    }
    all
}

/// Runs a block. `done` is called with the number of newly completed estimates. Returns `None` if `should_continue`
/// returns false.
pub(crate) fn run_block(
    plan: &Plan,
    schemas: &Schemas,
    block: &Block,
    done: &(dyn Fn(u64) + Sync),
    should_continue: &(dyn Fn() -> bool + Sync),
) -> Option<BlockTables> {
    let cell = &plan.cells[block.cell];
    let mut cell_run = CellRun {
        plan,
        estimators: plan
            .estimators_of(cell)
            .map(|(_, estimator)| (estimator, estimator.task_for(&cell.resolved)))
            .collect(),
        noise_free_output: None,
        rows: EstimateRows::new(plan, cell, schemas),
    };
    let simulator = match Simulator::new(cell.resolved.scenario()) {
        Ok(simulator) => simulator,
        Err(error) => {
            for replication in block.first..block.first + block.count {
                cell_run.record_failures(replication, &error.to_string(), done);
            }
            return Some(cell_run.rows.into_tables(schemas));
        }
    };
    let all: Vec<u64> = (block.first..block.first + block.count).collect();
    for replications in all.chunks(BATCH_REPLICATIONS) {
        let run = |&replication: &u64| {
            let run_seed = RunSeed {
                seed: plan.seed,
                cell: cell.index,
                replication,
            };
            let record = simulator.run(run_seed, false).map_err(|error| error.to_string());
            (replication, record)
        };
        let runs: Vec<Run> = replications.iter().map(run).collect();
        cell_run.estimate_all(&simulator, &runs, done, should_continue)?;
    }
    Some(cell_run.rows.into_tables(schemas))
}

/// The number of a replication and its record, or the reason why there is no record.
type Run = (u64, Result<Record, String>);

/// Applies the estimators of a cell to its runs.
struct CellRun<'a> {
    plan: &'a Plan,
    estimators: Vec<(&'a EstimatorCell, Task)>,
    /// Output of the run without remnant, simulated when an estimator first needs it.
    noise_free_output: Option<Vec<f64>>,
    rows: EstimateRows<'a>,
}

impl<'a> CellRun<'a> {
    /// Applies all estimators to these runs. `should_continue` is called before each estimator, because some take 0.1
    /// s; if it returns false, the result is `None`.
    fn estimate_all(
        &mut self,
        simulator: &Simulator,
        runs: &[Run],
        done: &(dyn Fn(u64) + Sync),
        should_continue: &(dyn Fn() -> bool + Sync),
    ) -> Option<()> {
        let estimators = self.estimators.clone();
        let records: Vec<&Record> = runs.iter().filter_map(|(_, run)| run.as_ref().ok()).collect();
        let fits = BatchFits::of(&estimators, &records, should_continue)?;
        let mut records = records.into_iter().enumerate();
        for (replication, run) in runs {
            if let Err(reason) = run {
                self.record_failures(*replication, reason, done);
                continue;
            }
            let (index, record) = records.next()?;
            self.rows.start_replication();
            for (place, (estimator, task)) in estimators.iter().enumerate() {
                if !should_continue() {
                    return None;
                }
                self.rows.start_row(estimator, *replication);
                let fit = fits.fit_of(place, index);
                let outcome = match task {
                    Task::Describe => self.write_noise_levels(simulator, record),
                    task => Preparation::of(estimator)
                        .apply(record)
                        .and_then(|record| self.estimate(task, fit, &record, estimator, *replication)),
                };
                if let Err(reason) = outcome {
                    self.rows.write_failure(&reason);
                }
                done(1);
            }
        }
        Some(())
    }

    fn estimate(
        &mut self,
        task: &Task,
        fit: Option<&Result<Fit, String>>,
        record: &Record,
        estimator: &'a EstimatorCell,
        replication: u64,
    ) -> Result<(), String> {
        let text = |error: IdentError| error.to_string();
        let records = std::slice::from_ref(record);
        match task {
            Task::Describe => {}
            Task::Fit(options) => {
                let fit = match fit {
                    Some(fit) => fit.clone()?,
                    None => options.fit(records).map_err(text)?,
                };
                let operator = fit.operator().map_err(|reason| reason.to_string());
                self.rows.write_fit_row(estimator, &fit, record, operator)?;
            }
            Task::GreyBox(options) => {
                let grey = options.fit(records).map_err(text)?;
                let operator = grey.operator(0).map_err(|reason| reason.to_string());
                self.rows
                    .write_fit_row(estimator, grey.polynomial_fit(0), record, operator)?;
                self.rows.write_termination(grey.termination());
            }
            Task::Analysis(asked) => self.analyse(asked, record, estimator)?,
            Task::Track(options) => {
                let kept = self.plan.trace_every.unwrap_or(MAX_ERROR_SPACING_SAMPLES);
                let every = greatest_common_divisor(kept, MAX_ERROR_SPACING_SAMPLES);
                // If the start fit failed, the recursion reports the error itself.
                let start = fit.and_then(|fit| fit.as_ref().ok());
                let trace = track_from(record, options, every, start).map_err(text)?;
                self.rows.write_track_row(&trace, record);
                if self.plan.trace_every.is_some() {
                    self.rows.write_trace_rows(&trace, kept / every, estimator, replication);
                }
            }
        }
        Ok(())
    }

    /// Analyses a record as `hoid identify` does.
    fn analyse(
        &mut self,
        asked: &ResolvedRequest,
        record: &Record,
        estimator: &'a EstimatorCell,
    ) -> Result<(), String> {
        let text = |error: AnalysisError| error.to_string();
        let recording = Recordings::from_records([record.clone()]);
        match asked {
            ResolvedRequest::Operator(how) => {
                let found = how.run(recording).map_err(text)?;
                self.rows.write_operator_row(&found)?;
                self.rows.write_verdict(&found.verdict);
            }
            ResolvedRequest::Change(how) => {
                let found = how.run(recording).map_err(text)?;
                self.rows.write_change_row(&found)?;
                self.rows.write_verdict(&found.verdict);
            }
            ResolvedRequest::Remnant(how) => {
                let found = how.run(recording).map_err(text)?;
                self.write_polynomial_row(estimator, found.fit.polynomial_fit(0), &found.data.records[0])?;
                self.rows.write_verdict(&found.verdict);
            }
            ResolvedRequest::Polynomials(how) => {
                let found = how.run(recording).map_err(text)?;
                self.write_polynomial_row(estimator, &found.fit.fit, &found.data.records[0])?;
                self.rows.write_verdict(&found.verdict);
            }
        }
        Ok(())
    }

    fn write_polynomial_row(&mut self, estimator: &'a EstimatorCell, fit: &Fit, record: &Record) -> Result<(), String> {
        let operator = fit.operator().map_err(|reason| reason.to_string());
        self.rows.write_fit_row(estimator, fit, record, operator)
    }

    fn record_failures(&mut self, replication: u64, reason: &str, done: &(dyn Fn(u64) + Sync)) {
        for (estimator, _) in self.estimators.clone() {
            self.rows.start_row(estimator, replication);
            self.rows.write_failure(reason);
            done(1);
        }
    }

    /// Computes the noise levels of a run by comparison with the same run without remnant.
    fn write_noise_levels(&mut self, simulator: &Simulator, record: &Record) -> Result<(), String> {
        let u0 = match self.noise_free_output.take() {
            Some(known) => known,
            None => {
                let silent = vec![0.0; simulator.sample_count()];
                let signals = simulator.signals(&silent).map_err(|error| error.to_string())?;
                signals.u[signals.u.len() - record.len()..].to_vec()
            }
        };
        self.rows.write_noise_row(record, &u0);
        self.noise_free_output = Some(u0);
        Ok(())
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}
