//! One block of a study: some replications of a cell, with all estimators of the cell.

use hoid_ident::{Fit, IdentError};
use hoid_io::OutputTable;
use hoid_model::{
    Record,
    remnant::RemnantDiscretisation,
    scenario::RemnantStrength,
    uncertainty::{Estimate, OperatorEstimate},
};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{Trace, track_from};

use crate::{
    batch_fits::BatchFits,
    columns::{OPERATOR, Rows, Schemas, TRACED, extra_axes},
    merit::{ChangeMeasures, TraceErrors, Truth, variance},
    plan::{Cell, EstimatorCell, Plan, Task},
    prepared::Preparation,
};

/// Samples between two points of a trace at which its errors are taken: far less than any memory.
const ERRORS_EVERY: usize = 4;

/// Replications whose fits are made side by side; a run of the text takes a megabyte.
const AT_A_TIME: usize = 50;

/// Some replications of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Block {
    /// Number of the block in the study.
    pub index: u64,
    /// Number of its cell.
    pub cell: usize,
    /// First replication.
    pub first: u64,
    /// Replications.
    pub count: u64,
}

/// All blocks of a plan in their order.
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

/// The rows of a block.
pub(crate) struct BlockTables {
    pub fits: OutputTable,
    pub traces: Option<OutputTable>,
}

/// Runs a block. `done` is told of each estimate; none when `go_on` says no.
pub(crate) fn run_block(
    plan: &Plan,
    schemas: &Schemas,
    block: &Block,
    done: &(dyn Fn(u64) + Sync),
    go_on: &(dyn Fn() -> bool + Sync),
) -> Option<BlockTables> {
    let cell = &plan.cells[block.cell];
    let mut bench = Bench {
        plan,
        cell,
        extra: extra_axes(plan),
        estimators: plan
            .estimators_of(cell)
            .map(|(_, estimator)| (estimator, estimator.task_for(&cell.resolved)))
            .collect(),
        truth: Truth::of(cell),
        without_remnant: None,
        vafs: Vec::new(),
        fits: Rows::new(&schemas.fits),
        traces: schemas.traces.as_ref().map(Rows::new),
    };
    let simulator = match Simulator::new(cell.resolved.scenario()) {
        Ok(simulator) => simulator,
        Err(error) => {
            for replication in block.first..block.first + block.count {
                bench.fail_all(replication, &error.to_string(), done);
            }
            return Some(bench.tables(schemas));
        }
    };
    let all: Vec<u64> = (block.first..block.first + block.count).collect();
    for replications in all.chunks(AT_A_TIME) {
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
        bench.estimate_all(&simulator, &runs, done, go_on)?;
    }
    Some(bench.tables(schemas))
}

/// A replication and its record, or why there is none.
type Run = (u64, Result<Record, String>);

struct Bench<'a> {
    plan: &'a Plan,
    cell: &'a Cell,
    extra: Vec<String>,
    estimators: Vec<(&'a EstimatorCell, Task)>,
    truth: Option<Truth>,
    /// Output of the run without remnant, once somebody asks.
    without_remnant: Option<Vec<f64>>,
    /// VAF of the estimators on this replication, by name and nk.
    vafs: Vec<(&'a str, usize, f64)>,
    fits: Rows,
    traces: Option<Rows>,
}

impl<'a> Bench<'a> {
    /// Estimates of these runs. Nothing when `go_on` says no: it is asked before each estimator, some of which take a tenth of a second.
    fn estimate_all(
        &mut self,
        simulator: &Simulator,
        runs: &[Run],
        done: &(dyn Fn(u64) + Sync),
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Option<()> {
        let estimators = self.estimators.clone();
        let records: Vec<&Record> = runs.iter().filter_map(|(_, run)| run.as_ref().ok()).collect();
        let fits = BatchFits::of(&estimators, &records, go_on)?;
        let mut records = records.into_iter().enumerate();
        for (replication, run) in runs {
            if let Err(reason) = run {
                self.fail_all(*replication, reason, done);
                continue;
            }
            let (index, record) = records.next()?;
            self.vafs.clear();
            for (place, (estimator, task)) in estimators.iter().enumerate() {
                if !go_on() {
                    return None;
                }
                self.begin(estimator, *replication);
                let fit = fits.of_run(place, index);
                let outcome = match task {
                    Task::Describe => self.describe(simulator, record),
                    task => Preparation::of(estimator)
                        .of_record(record)
                        .and_then(|record| self.estimate(task, fit, &record, estimator, *replication)),
                };
                if let Err(reason) = outcome {
                    self.fits.text("status", "failed");
                    self.fits.text("reason", &reason);
                }
                done(1);
            }
        }
        Some(())
    }

    fn tables(self, schemas: &Schemas) -> BlockTables {
        BlockTables {
            fits: self.fits.into_table(schemas.fits.comments.clone()),
            traces: self
                .traces
                .zip(schemas.traces.as_ref())
                .map(|(rows, schema)| rows.into_table(schema.comments.clone())),
        }
    }

    fn fail_all(&mut self, replication: u64, reason: &str, done: &(dyn Fn(u64) + Sync)) {
        for (estimator, _) in self.estimators.clone() {
            self.begin(estimator, replication);
            self.fits.text("status", "failed");
            self.fits.text("reason", reason);
            done(1);
        }
    }

    /// What was simulated and what is estimated.
    fn begin(&mut self, estimator: &EstimatorCell, replication: u64) {
        let (cell, rows) = (self.cell, &mut self.fits);
        let scenario = cell.resolved.scenario();
        rows.begin();
        rows.whole("cell", cell.index);
        rows.text("scenario", &cell.scenario);
        rows.text("condition", &cell.condition);
        rows.whole("remnant_order", scenario.remnant.order as u64);
        if let RemnantStrength::Level { level, definition } = scenario.remnant.strength {
            rows.real("noise_level", level);
            rows.text("noise_definition", definition.name());
        }
        rows.real("T_n_true", scenario.remnant.time_constant_s);
        rows.real("sample_time_s", scenario.sample_time.s());
        for name in &self.extra {
            let axis = cell.axes.iter().chain(&estimator.axes).find(|axis| axis.key == *name);
            rows.text(name, axis.map_or("", |axis| axis.value.as_str()));
        }
        rows.whole("replication", replication);
        rows.text("estimator", &estimator.label);
        rows.text("name", &estimator.name);
        rows.text("method", estimator.method());
        if let Some(structure) = estimator.structure() {
            rows.text("structure", structure.name());
            let orders = estimator.orders(&cell.resolved);
            for (name, n) in [
                ("na", orders.na),
                ("nb", orders.nb),
                ("nc", orders.nc),
                ("nd", orders.nd),
                ("nf", orders.nf),
                ("nk", orders.nk),
            ] {
                rows.real(name, n as f64);
            }
        }
        rows.text("start", &estimator.start);
        rows.whole("decimate", estimator.decimate as u64);
        let (from, to) = estimator.span_s.unwrap_or((0.0, scenario.measurement_s));
        rows.real("from_s", from);
        rows.real("to_s", to);
    }

    fn describe(&mut self, simulator: &Simulator, record: &Record) -> Result<(), String> {
        let u0 = match self.without_remnant.take() {
            Some(known) => known,
            None => {
                let silent = vec![0.0; simulator.samples()];
                let signals = simulator.signals(&silent).map_err(|error| error.to_string())?;
                signals.u[signals.u.len() - record.len()..].to_vec()
            }
        };
        let u = record.output();
        let difference: Vec<f64> = u.iter().zip(&u0).map(|(u, u0)| u - u0).collect();
        let power = variance(u);
        let n = record.channel("n").unwrap_or_default();
        let rows = &mut self.fits;
        rows.real("noise_level_obtained", (power - variance(&u0)) / power);
        rows.real("noise_level_response", variance(&difference) / power);
        rows.real("noise_level_remnant", variance(n) / power);
        for (name, values) in [("rms_e", record.input()), ("rms_u", u), ("rms_n", n)] {
            rows.real(
                name,
                (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt(),
            );
        }
        rows.text("status", "ok");
        self.without_remnant = Some(u0);
        Ok(())
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
                self.fit_row(estimator, &fit, record, operator)?;
            }
            Task::GreyBox(options) => {
                let grey = options.fit(records).map_err(text)?;
                let operator = grey.operator(0).map_err(|reason| reason.to_string());
                self.fit_row(estimator, grey.polynomial_fit(0), record, operator)?;
                self.fits.text("termination", &grey.termination().reason.to_string());
                self.fits.whole("converged", u64::from(grey.termination().converged()));
                self.fits.whole("iterations", grey.termination().iterations as u64);
            }
            Task::Track(options) => {
                let kept = self.plan.trace_every.unwrap_or(ERRORS_EVERY);
                let every = greatest_common_divisor(kept, ERRORS_EVERY);
                // What went wrong with the start fit is told by the recursion.
                let start = fit.and_then(|fit| fit.as_ref().ok());
                let trace = track_from(record, options, every, start).map_err(text)?;
                self.track_row(&trace, record);
                if self.plan.trace_every.is_some() {
                    self.trace_rows(&trace, kept / every, estimator, replication);
                }
            }
        }
        Ok(())
    }

    fn fit_row(
        &mut self,
        estimator: &'a EstimatorCell,
        fit: &Fit,
        record: &Record,
        operator: Result<OperatorEstimate, String>,
    ) -> Result<(), String> {
        let simulated = fit.simulate(record).map_err(|error| error.to_string())?;
        let vaf = hoid_ident::validation::vaf(&record.output()[simulated.first..], &simulated.values);
        let nk = fit.orders().nk;
        let other = estimator
            .versus
            .as_ref()
            .and_then(|name| self.vafs.iter().find(|v| v.0 == *name && v.1 == nk));
        let delta = other.map_or(f64::NAN, |other| vaf - other.2);
        self.vafs.push((&estimator.name, nk, vaf));
        let rows = &mut self.fits;
        rows.real("delta_vaf", delta);
        rows.text("termination", &fit.termination().reason.to_string());
        rows.whole("converged", u64::from(fit.termination().converged()));
        rows.whole("iterations", fit.termination().iterations as u64);
        rows.real("loss", fit.loss());
        rows.real("innovation_variance", fit.innovation_variance());
        rows.real("vaf", vaf);
        if let Some(truth) = &self.truth {
            rows.real("response_error", truth.error_percent(fit));
        }
        for (name, estimate) in fit.parameters() {
            set(rows, &name, estimate);
        }
        if fit.orders().nd > 0 {
            if let Ok(remnant) = fit.remnant(RemnantDiscretisation::ZeroOrderHold) {
                set(rows, "T_n", remnant.t_n_s);
                set(rows, "K_n", remnant.k_n);
            }
            if let Ok(remnant) = fit.remnant(RemnantDiscretisation::BackwardEuler) {
                rows.real("T_n_backward_euler", remnant.t_n_s.value);
                rows.real("K_n_backward_euler", remnant.k_n.value);
            }
        }
        match operator {
            Ok(operator) => {
                for (name, _, estimate) in operator.rows() {
                    set(rows, name, estimate);
                }
                rows.text("status", "ok");
            }
            Err(reason) => {
                rows.text("status", "not convertible");
                rows.text("reason", &reason);
            }
        }
        Ok(())
    }

    fn track_row(&mut self, trace: &Trace, record: &Record) {
        let errors = TraceErrors::of(trace, record, self.cell);
        let rows = &mut self.fits;
        for (i, name) in TRACED.iter().enumerate() {
            rows.real(&format!("rms_{name}"), errors.rms_percent[i]);
            rows.real(&format!("settle50_{name}"), errors.settled_s[0][i]);
            rows.real(&format!("settle90_{name}"), errors.settled_s[1][i]);
        }
        if self.plan.changes {
            let measures = ChangeMeasures::of(trace, record, self.cell);
            for (i, name) in TRACED.iter().enumerate() {
                rows.real(&format!("before_{name}"), measures.before_percent[i]);
                rows.real(&format!("after_{name}"), measures.after_percent[i]);
                rows.real(&format!("covered_{name}"), measures.covered_percent[i]);
                rows.real(&format!("covered_through_{name}"), measures.covered_through_percent[i]);
            }
            rows.real("false_alarms", measures.false_alarms);
            rows.real("hours", measures.hours);
            rows.real("found", measures.found_percent);
            rows.real("lag", measures.lag_s);
        }
        rows.whole("diverged", u64::from(errors.diverged));
        rows.whole("steps_shortened", trace.counts().shortened);
        rows.real("share_not_convertible", errors.share_not_convertible);
        if let Some(start) = trace.start() {
            rows.text("termination", &start.termination().reason.to_string());
            rows.whole("converged", u64::from(start.termination().converged()));
            rows.whole("iterations", start.termination().iterations as u64);
        }
        let Some(last) = trace.len().checked_sub(1) else { return };
        rows.real("innovation_variance", trace.innovation_variance()[last]);
        for (name, estimate) in trace.parameter_names().iter().zip(trace.parameters(last)) {
            set(rows, name, estimate);
        }
        match trace.operator(last) {
            Ok(operator) => {
                for (name, _, estimate) in operator.rows() {
                    set(rows, name, estimate);
                }
                rows.text("status", "ok");
            }
            Err(reason) => {
                rows.text("status", "not convertible");
                rows.text("reason", &reason.to_string());
            }
        }
    }

    fn trace_rows(&mut self, trace: &Trace, step: usize, estimator: &EstimatorCell, replication: u64) {
        let Some(rows) = &mut self.traces else { return };
        let with_errors = self.plan.standard_errors;
        let place = |rows: &Rows, name: &str| (rows.position(name), rows.position(&format!("{name}_se")));
        let theta: Vec<_> = trace.parameter_names().iter().map(|name| place(rows, name)).collect();
        let operator = OPERATOR.map(|name| place(rows, name));
        let put = |rows: &mut Rows, (value, error): (Option<usize>, Option<usize>), estimate: Estimate| {
            if let Some(position) = value {
                rows.real_at(position, estimate.value);
            }
            if let (Some(position), Some(se)) = (error, estimate.standard_error) {
                rows.real_at(position, se);
            }
        };
        for k in (step - 1..trace.len()).step_by(step) {
            rows.begin();
            rows.whole("cell", self.cell.index);
            rows.whole("replication", replication);
            rows.text("estimator", &estimator.label);
            rows.real("t", trace.times_s()[k]);
            if with_errors {
                for (places, estimate) in theta.iter().zip(trace.parameters(k)) {
                    put(rows, *places, estimate);
                }
            } else {
                for (places, value) in theta.iter().zip(trace.theta(k)) {
                    put(rows, *places, Estimate::fixed(*value));
                }
            }
            let operator_of_row = if with_errors {
                trace.operator(k)
            } else {
                trace.operator_values(k)
            };
            if let Ok(found) = operator_of_row {
                for (places, (_, _, estimate)) in operator.iter().zip(found.rows()) {
                    put(rows, *places, estimate);
                }
            }
        }
    }
}

fn set(rows: &mut Rows, name: &str, estimate: Estimate) {
    rows.real(name, estimate.value);
    if let Some(se) = estimate.standard_error {
        rows.real(&format!("{name}_se"), se);
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}
