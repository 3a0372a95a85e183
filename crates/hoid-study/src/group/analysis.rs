//! What is done with one run.
//!
//! nk, and for Box-Jenkins nd and T_n, are chosen beforehand: on each of two sub-batches every
//! delay in the range is fitted, and nk is the average of the two best, rounded. With these, ARX
//! and Box-Jenkins models are fitted to the sub-batches and to the whole run, and the recursions
//! start from the fit of the first sub-batch. A row says what was estimated in which window; what
//! fails is a row with its reason.
//!
//! Beside the fits of single runs stands one of all runs of a person in a condition that does not
//! change: a Box-Jenkins model with initial states of each run, the delay that fits best, and the
//! greatest order of the noise model that the manifest allows. In a closed loop a noise model that
//! is too small biases the operator, and one run is too short for a great one.

use std::path::Path;

use hoid_ident::{Estimator, Fit, GreyBox, choose_orders, order_selection::Criterion};
use hoid_model::{Record, Structure, uncertainty::Estimate};
use hoid_track::{StartAt, TrackOptions, track};

use super::{
    analysis_settings::AnalysisSettings,
    manifest::{Manifest, RunEntry},
    reading::{Run, account, read_files, read_run, run_of},
    run_orders::{self, label_of},
    run_rows::{RunRows, RunTables},
    traces,
    windows::{Window, windows},
};
use crate::statistics::median;

/// Analyses a run; `base` is the directory of the manifest.
pub(super) fn analyse(manifest: &Manifest, base: &Path, entry: &RunEntry) -> RunTables {
    let mut analysis = RunAnalysis::new(manifest, entry);
    let files = read_files(manifest, base, entry);
    let account = account(entry, &files);
    match run_of(files) {
        Ok(run) => analysis.analyse(&run),
        Err(reason) => analysis.rows.failed(None, "read", &reason),
    }
    RunTables {
        account: account.into(),
        ..analysis.rows.into_tables()
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
    let mut analysis = RunAnalysis::new(manifest, &all);
    let records: Vec<Record> = entries
        .iter()
        .filter_map(|entry| read_run(manifest, base, entry).ok())
        .map(|run| run.record)
        .collect();
    // The run of a file that cannot be read says so.
    if let Some(first) = records.first() {
        let window = windows(&manifest.analysis, first)[2];
        match analysis.together(&records) {
            Ok(fit) => analysis.rows.fit_rows(window, LABEL, &fit, first),
            Err(reason) => analysis.rows.failed(Some(window), LABEL, &reason),
        }
    }
    analysis.rows.into_tables()
}

/// The analysis of a run: how it is done, and what it has found so far.
struct RunAnalysis<'a> {
    settings: &'a AnalysisSettings,
    rows: RunRows<'a>,
}

impl<'a> RunAnalysis<'a> {
    fn new(manifest: &'a Manifest, entry: &'a RunEntry) -> Self {
        Self {
            settings: &manifest.analysis,
            rows: RunRows::new(manifest, entry),
        }
    }

    fn analyse(&mut self, run: &Run) {
        let record = &run.record;
        let windows = windows(self.settings, record);
        let change = run.seam_s.or(self.rows.condition.change_s).map(|at| ("change_s", at));
        let of_record = [("rms_e", rms(record.input())), ("rms_u", rms(record.output()))];
        for (name, value) in of_record.into_iter().chain(change) {
            self.rows.row(Some(windows[2]), "record", name, Estimate::fixed(value));
        }
        for structure in [Structure::Arx, Structure::BoxJenkins] {
            let label = label_of(structure);
            let orders = match run_orders::choose(self.settings, record, structure, &windows, &mut self.rows) {
                Ok(orders) => orders,
                Err(reason) => {
                    self.rows.failed(None, label, &reason);
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
                    Ok(fit) => self.rows.fit_rows(window, label, &fit, record),
                    Err(reason) => self.rows.failed(Some(window), label, &reason),
                }
            }
            // Their names were checked with the manifest.
            for method in self.settings.recursions().unwrap_or_default() {
                if method.usual_structure() == structure {
                    let options = TrackOptions {
                        start: StartAt::Span(Some((windows[0].from_s, windows[0].to_s))),
                        ..TrackOptions::new(method.clone(), structure, orders)
                    };
                    match track(record, &options, self.settings.trace_every) {
                        Ok(trace) => {
                            self.rows.trace_rows(&trace);
                            for window in &windows[..2] {
                                for (name, values) in traces::values_within(&trace, window.from_s, window.to_s) {
                                    let middle = median(&values);
                                    if middle.is_finite() {
                                        self.rows.row(
                                            Some(*window),
                                            &traces::label_of(&method),
                                            &name,
                                            Estimate::fixed(middle),
                                        );
                                    }
                                }
                            }
                        }
                        Err(error) => self.rows.failed(None, &traces::label_of(&method), &error.to_string()),
                    }
                }
            }
        }
        if self.settings.grey_box {
            self.grey_box(record, &windows);
        }
    }

    /// The fit of all runs.
    fn together(&self, records: &[Record]) -> Result<Fit, String> {
        let structure = Structure::BoxJenkins;
        let mut ranges = run_orders::ranges(self.settings, &records[0], structure);
        let nd = self.settings.nd.1;
        ranges.nd = nd..=nd;
        let template = Estimator::new(structure, structure.operator_orders(1));
        let choice = choose_orders(&template, &ranges, Criterion::Bic, records).map_err(|e| e.to_string())?;
        Ok(choice.fit)
    }

    fn grey_box(&mut self, record: &Record, windows: &[Window; 3]) {
        const LABEL: &str = "grey box";
        for window in windows {
            let found = record
                .span(window.from_s, window.to_s)
                .map_err(|e| e.to_string())
                .and_then(|part| {
                    let options = GreyBox {
                        delay_range_s: self.settings.delay_s,
                        ..GreyBox::new(1..=4)
                    };
                    options.fit(&[part]).map_err(|e| e.to_string())
                });
            match found {
                Ok(fit) => {
                    self.rows
                        .response_rows(*window, LABEL, fit.polynomial_fit(0), record.sample_time().s());
                    self.rows.operator_rows(*window, LABEL, fit.operator(0));
                }
                Err(reason) => self.rows.failed(Some(*window), LABEL, &reason),
            }
        }
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}
