//! What is done with one run (sections V.B and VI of the reference text).
//!
//! nk, and for Box-Jenkins nd and T_n, are chosen beforehand: on each of two sub-batches every delay in the range is fitted, and nk is the
//! average of the two best, rounded. With these, ARX and Box-Jenkins models are fitted to the sub-batches and to the whole run, and the recursions
//! start from the fit of the first sub-batch. A row says what was estimated in which window; what fails is a row with its reason.
//!
//! Beside the fits of single runs stands one of all runs of a person in a condition that does not change: a Box-Jenkins model with initial states of each run,
//! the delay that fits best, and the greatest order of the noise model that the manifest allows. In a closed loop a noise model that is too small biases the
//! operator, and one run is too short for a great one.

use std::path::Path;

use hoid_ident::{
    Estimator, Fit, GreyBox, OrderRanges, choose_orders, frequency::Crossover, order_selection::Criterion,
};
use hoid_io::{OutputTable, TableSchema};
use hoid_model::{
    Complex64, ContinuousTransferFunction, Record, Structure, remnant::RemnantDiscretisation, uncertainty::Estimate,
};
use hoid_track::{Method, StartAt, TrackOptions, track};

use super::{
    frequency::transfer_function,
    manifest::{ConditionFacts, Manifest, RunEntry},
    reading::{ReadFile, account, read_files},
    responses::{followed_phases_deg, grid, responses_schema},
    tables::{real, schema, text},
    traces::{self, TraceColumns},
};
use crate::{columns::Rows, statistics::median};

/// The tables of one run.
pub(super) struct RunTables {
    pub estimates: OutputTable,
    pub responses: OutputTable,
    pub traces: OutputTable,
    /// What was done to its files and what is wrong with their sampling, by the name of the table; none of all runs at once.
    pub account: Vec<(&'static str, OutputTable)>,
}

/// One estimate a row, in long form.
pub(super) fn estimates_schema() -> TableSchema {
    schema(
        text(&["subject", "condition", "run", "window"])
            .chain(real(&["from_s", "to_s"]))
            .chain(text(&["estimator", "parameter"]))
            .chain(real(&["value", "standard_error"]))
            .chain(text(&["status", "reason"])),
    )
}

/// Name of the span that is the whole run.
const WHOLE: &str = "whole";

/// A span of the run with its name.
#[derive(Clone, Copy)]
struct Window {
    name: &'static str,
    from_s: f64,
    to_s: f64,
}

struct Bench<'a> {
    manifest: &'a Manifest,
    entry: &'a RunEntry,
    /// What is known of its condition.
    facts: ConditionFacts,
    element: Option<ContinuousTransferFunction>,
    columns: TraceColumns,
    rows: Rows,
    responses: Rows,
    traces: Rows,
}

/// Analyses a run; `base` is the directory of the manifest.
pub(super) fn analyse(manifest: &Manifest, base: &Path, entry: &RunEntry) -> RunTables {
    let mut bench = Bench::new(manifest, entry);
    let files = read_files(manifest, base, entry);
    let account = account(entry, &files);
    match run_of(files) {
        Ok(run) => bench.analyse(&run),
        Err(reason) => bench.failed(None, "read", &reason),
    }
    RunTables {
        account: account.into(),
        ..bench.tables()
    }
}

/// Name of the run that is all of them.
const ALL: &str = "all";

/// Fits all runs of a person in a condition at once.
pub(super) fn analyse_together(manifest: &Manifest, base: &Path, entries: &[&RunEntry]) -> RunTables {
    const LABEL: &str = "BJ, all runs";
    let all = RunEntry {
        run: ALL.to_owned(),
        ..entries[0].clone()
    };
    let mut bench = Bench::new(manifest, &all);
    let records: Vec<Record> = entries
        .iter()
        .filter_map(|entry| read(manifest, base, entry).ok())
        .map(|run| run.record)
        .collect();
    // What cannot be read is told by its own run.
    if let Some(first) = records.first() {
        let window = bench.windows(first)[2];
        match bench.together(&records) {
            Ok(fit) => bench.fit_rows(window, LABEL, &fit, first),
            Err(reason) => bench.failed(Some(window), LABEL, &reason),
        }
    }
    bench.tables()
}

/// A run as the manifest wants it.
pub(super) struct Run {
    pub record: Record,
    /// Where the second file begins, s, for a run that is joined of two.
    seam_s: Option<f64>,
}

/// Reads a run.
pub(super) fn read(manifest: &Manifest, base: &Path, entry: &RunEntry) -> Result<Run, String> {
    run_of(read_files(manifest, base, entry))
}

/// The run in one file, or joined of two.
fn run_of(files: Vec<ReadFile<'_>>) -> Result<Run, String> {
    let mut run: Option<Run> = None;
    for (_, read) in files {
        let record = read?.record;
        run = Some(match run {
            None => Run { record, seam_s: None },
            Some(first) => Run {
                seam_s: Some(first.record.time_s(first.record.len())),
                record: first.record.joined(&record).map_err(|error| error.to_string())?,
            },
        });
    }
    run.ok_or_else(|| "no file is named".to_owned())
}

impl<'a> Bench<'a> {
    fn new(manifest: &'a Manifest, entry: &'a RunEntry) -> Self {
        let facts = manifest.conditions.get(&entry.condition).cloned().unwrap_or_default();
        let columns = TraceColumns::of(&manifest.analysis);
        Self {
            manifest,
            entry,
            element: facts
                .controlled_element
                .as_deref()
                .and_then(|e| transfer_function(e).ok()),
            facts,
            rows: Rows::new(&estimates_schema()),
            responses: Rows::new(&responses_schema()),
            traces: Rows::new(&columns.schema()),
            columns,
        }
    }

    fn tables(self) -> RunTables {
        RunTables {
            estimates: self.rows.into_table(Vec::new()),
            responses: self.responses.into_table(Vec::new()),
            traces: self.traces.into_table(Vec::new()),
            account: Vec::new(),
        }
    }

    fn analyse(&mut self, run: &Run) {
        let record = &run.record;
        let windows = self.windows(record);
        let change = run.seam_s.or(self.facts.change_s).map(|at| ("change_s", at));
        let of_record = [("rms_e", rms(record.input())), ("rms_u", rms(record.output()))];
        for (name, value) in of_record.into_iter().chain(change) {
            self.row(Some(windows[2]), "record", name, Estimate::fixed(value));
        }
        for structure in [Structure::Arx, Structure::BoxJenkins] {
            let label = label_of(structure);
            let orders = match self.orders(record, structure, &windows) {
                Ok(orders) => orders,
                Err(reason) => {
                    self.failed(None, label, &reason);
                    continue;
                }
            };
            for window in windows {
                match record
                    .span(window.from_s, window.to_s)
                    .map_err(|e| e.to_string())
                    .and_then(|part| {
                        Estimator::new(structure, orders)
                            .fit(&[part])
                            .map_err(|e| e.to_string())
                    }) {
                    Ok(fit) => self.fit_rows(window, label, &fit, record),
                    Err(reason) => self.failed(Some(window), label, &reason),
                }
            }
            for method in self.manifest.analysis.methods.clone() {
                let method = Method::from(method);
                if method.usual_structure() == structure {
                    let options = TrackOptions {
                        start: StartAt::Span(Some((windows[0].from_s, windows[0].to_s))),
                        ..TrackOptions::new(method.clone(), structure, orders)
                    };
                    match track(record, &options, self.manifest.analysis.trace_every) {
                        Ok(trace) => {
                            traces::write(&mut self.traces, &self.columns, self.entry, &trace);
                            for window in &windows[..2] {
                                for (name, values) in traces::values_within(&trace, window.from_s, window.to_s) {
                                    let middle = median(&values);
                                    if middle.is_finite() {
                                        self.row(
                                            Some(*window),
                                            &traces::label_of(&method),
                                            &name,
                                            Estimate::fixed(middle),
                                        );
                                    }
                                }
                            }
                        }
                        Err(error) => self.failed(None, &traces::label_of(&method), &error.to_string()),
                    }
                }
            }
        }
        if self.manifest.analysis.grey_box {
            self.grey_box(record, &windows);
        }
    }

    fn windows(&self, record: &Record) -> [Window; 3] {
        let (begin, end) = (
            record.time_s(0),
            record.time_s(0) + record.len() as f64 * record.sample_time().s(),
        );
        let eighth = (end - begin) / 8.0;
        let [first, last] = self
            .manifest
            .analysis
            .windows_s
            .unwrap_or([(begin, begin + 3.0 * eighth), (end - 3.0 * eighth, end)]);
        let window = |name, (from_s, to_s)| Window { name, from_s, to_s };
        [
            window("first", first),
            window("last", last),
            window(WHOLE, (begin, end)),
        ]
    }

    /// Orders chosen on the sub-batches; rows tell what each of them wanted.
    fn orders(
        &mut self,
        record: &Record,
        structure: Structure,
        windows: &[Window; 3],
    ) -> Result<hoid_model::Orders, String> {
        let mut ranges = self.ranges(record, structure);
        if structure == Structure::BoxJenkins {
            ranges.nd = self.manifest.analysis.nd.0..=self.manifest.analysis.nd.1;
        }
        let template = Estimator::new(structure, structure.operator_orders(1));
        let mut wanted = Vec::new();
        let mut t_n = Vec::new();
        for window in &windows[..2] {
            let part = record.span(window.from_s, window.to_s).map_err(|e| e.to_string())?;
            let choice = choose_orders(&template, &ranges, Criterion::Bic, &[part]).map_err(|e| e.to_string())?;
            let orders = choice.fit.orders();
            self.row(
                Some(*window),
                label_of(structure),
                "nk_of_window",
                Estimate::fixed(orders.nk as f64),
            );
            if let Ok(remnant) = choice.fit.remnant(RemnantDiscretisation::ZeroOrderHold) {
                t_n.push(remnant.t_n_s.value);
            }
            wanted.push(orders);
        }
        let nk = (wanted.iter().map(|o| o.nk).sum::<usize>() as f64 / wanted.len() as f64).round() as usize;
        let nd = wanted.iter().map(|o| o.nd).max().unwrap_or(0);
        self.row(None, label_of(structure), "nk", Estimate::fixed(nk as f64));
        if structure == Structure::BoxJenkins {
            self.row(None, label_of(structure), "nd", Estimate::fixed(nd as f64));
            let mean = t_n.iter().sum::<f64>() / t_n.len() as f64;
            if mean.is_finite() {
                self.row(None, label_of(structure), "T_n", Estimate::fixed(mean));
            }
        }
        Ok(hoid_model::Orders {
            nk,
            nd,
            ..structure.operator_orders(nk)
        })
    }

    /// The operator's orders with the delays of the manifest.
    fn ranges(&self, record: &Record, structure: Structure) -> OrderRanges {
        let (least, most) = self.manifest.analysis.delay_s;
        let samples = |delay_s: f64| (delay_s / record.sample_time().s()).round() as usize + 1;
        let mut ranges = OrderRanges::from(structure.operator_orders(1));
        ranges.nk = samples(least)..=samples(most);
        ranges
    }

    /// The fit of all runs.
    fn together(&self, records: &[Record]) -> Result<Fit, String> {
        let structure = Structure::BoxJenkins;
        let mut ranges = self.ranges(&records[0], structure);
        let nd = self.manifest.analysis.nd.1;
        ranges.nd = nd..=nd;
        let template = Estimator::new(structure, structure.operator_orders(1));
        let choice = choose_orders(&template, &ranges, Criterion::Bic, records).map_err(|e| e.to_string())?;
        Ok(choice.fit)
    }

    fn fit_rows(&mut self, window: Window, label: &str, fit: &Fit, record: &Record) {
        for (name, estimate) in fit.parameters() {
            self.row(Some(window), label, &name, estimate);
        }
        self.row(
            Some(window),
            label,
            "innovation_variance",
            Estimate::fixed(fit.innovation_variance()),
        );
        if let Ok(part) = record.span(window.from_s, window.to_s)
            && let Ok(simulated) = fit.simulate(&part)
        {
            let vaf = hoid_ident::validation::vaf(&part.output()[simulated.first..], &simulated.values);
            self.row(Some(window), label, "vaf", Estimate::fixed(vaf));
        }
        self.response_rows(window, label, fit, record.sample_time().s());
        match fit.operator() {
            Ok(operator) => {
                for (name, _, estimate) in operator.rows() {
                    self.row(Some(window), label, name, estimate);
                }
            }
            Err(reason) => self.not_convertible(window, label, &reason.to_string()),
        }
    }

    fn grey_box(&mut self, record: &Record, windows: &[Window; 3]) {
        const LABEL: &str = "grey box";
        for window in windows {
            let found = record
                .span(window.from_s, window.to_s)
                .map_err(|e| e.to_string())
                .and_then(|part| {
                    let options = GreyBox {
                        delay_range_s: self.manifest.analysis.delay_s,
                        ..GreyBox::new(1..=4)
                    };
                    options.fit(&[part]).map_err(|e| e.to_string())
                });
            match found {
                Ok(fit) => {
                    self.response_rows(*window, LABEL, fit.polynomial_fit(0), record.sample_time().s());
                    match fit.operator(0) {
                        Ok(operator) => {
                            for (name, _, estimate) in operator.rows() {
                                self.row(Some(*window), LABEL, name, estimate);
                            }
                        }
                        Err(reason) => self.not_convertible(*window, LABEL, &reason.to_string()),
                    }
                }
                Err(reason) => self.failed(Some(*window), LABEL, &reason),
            }
        }
    }

    /// Frequency response of the fit of the whole run, and crossover and phase margin with the controlled element, where that is known.
    fn response_rows(&mut self, window: Window, label: &str, fit: &Fit, sample_time_s: f64) {
        if window.name != WHOLE {
            return;
        }
        let omega = grid(sample_time_s);
        let advance = self.facts.offset_samples * sample_time_s;
        let response: Vec<Complex64> = omega
            .iter()
            .map(|w| fit.model().response(*w) * Complex64::from_polar(1.0, w * advance))
            .collect();
        for ((w, h), phase_deg) in omega.iter().zip(&response).zip(followed_phases_deg(&response)) {
            let rows = &mut self.responses;
            rows.begin();
            rows.text("subject", &self.entry.subject);
            rows.text("condition", &self.entry.condition);
            rows.text("run", &self.entry.run);
            rows.text("estimator", label);
            rows.real("omega_rad_s", *w);
            rows.real("magnitude_db", 20.0 * h.norm().log10());
            rows.real("phase_deg", phase_deg);
        }
        let Some(element) = &self.element else { return };
        let open_loop: Vec<Complex64> = omega
            .iter()
            .zip(&response)
            .map(|(w, h)| h * element.response(*w))
            .collect();
        if let Some(found) = Crossover::of(&omega, &open_loop, 0.0) {
            self.row(
                Some(window),
                label,
                "crossover_rad_s",
                Estimate::fixed(found.omega_rad_s),
            );
            self.row(
                Some(window),
                label,
                "phase_margin_deg",
                Estimate::fixed(found.phase_margin_deg),
            );
        }
    }

    fn begin(&mut self, window: Option<Window>, estimator: &str) {
        let rows = &mut self.rows;
        rows.begin();
        rows.text("subject", &self.entry.subject);
        rows.text("condition", &self.entry.condition);
        rows.text("run", &self.entry.run);
        rows.text("estimator", estimator);
        if let Some(window) = window {
            rows.text("window", window.name);
            rows.real("from_s", window.from_s);
            rows.real("to_s", window.to_s);
        }
    }

    fn row(&mut self, window: Option<Window>, estimator: &str, parameter: &str, estimate: Estimate) {
        self.begin(window, estimator);
        self.rows.text("parameter", parameter);
        self.rows.real("value", estimate.value);
        if let Some(se) = estimate.standard_error {
            self.rows.real("standard_error", se);
        }
        self.rows.text("status", "ok");
    }

    fn not_convertible(&mut self, window: Window, estimator: &str, reason: &str) {
        self.begin(Some(window), estimator);
        self.rows.text("status", "not convertible");
        self.rows.text("reason", reason);
    }

    fn failed(&mut self, window: Option<Window>, estimator: &str, reason: &str) {
        self.begin(window, estimator);
        self.rows.text("status", "failed");
        self.rows.text("reason", reason);
    }
}

fn label_of(structure: Structure) -> &'static str {
    if structure == Structure::Arx { "ARX" } else { "BJ" }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}
