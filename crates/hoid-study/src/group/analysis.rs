//! What is done with one run (sections V.B and VI of the reference text).
//!
//! nk, and for Box-Jenkins nd and T_n, are chosen beforehand: on each of two sub-batches every delay in the range is fitted, and nk is the
//! average of the two best, rounded. With these, ARX and Box-Jenkins models are fitted to the sub-batches and to the whole run, and the recursions
//! start from the fit of the first sub-batch. A row says what was estimated in which window; what fails is a row with its reason.

use std::path::Path;

use hoid_ident::{
    Estimator, Fit, GreyBox, OrderRanges, choose_orders,
    order_search::Criterion,
    tracking::{Method, StartAt, Trace, TrackOptions, track},
};
use hoid_io::{ColumnKind, ColumnSchema, OutputTable, ReadOptions, Repair, TableSchema, read_record};
use hoid_model::{Detrend, Record, Structure, remnant::RemnantDiscretisation, uncertainty::Estimate};

use super::manifest::{Detrending, Manifest, RunEntry};
use crate::{
    columns::{OPERATOR, Rows},
    statistics::median,
};

/// Most coefficients of a polynomial in the tables.
const MOST_ND: usize = 20;

/// The tables of one run.
pub(super) struct RunTables {
    pub estimates: OutputTable,
    pub traces: OutputTable,
}

/// One estimate a row, in long form.
pub(super) fn estimates_schema() -> TableSchema {
    use ColumnKind::{Real, Text};
    schema(&[
        ("subject", Text),
        ("condition", Text),
        ("run", Text),
        ("window", Text),
        ("from_s", Real),
        ("to_s", Real),
        ("estimator", Text),
        ("parameter", Text),
        ("value", Real),
        ("standard_error", Real),
        ("status", Text),
        ("reason", Text),
    ])
}

/// Names of the parameters of traces: those of RLS, of Box-Jenkins models and of the operator.
pub(super) fn trace_names(nd: usize) -> Vec<String> {
    let fixed = ["a1", "a2", "b0", "b1", "f1", "f2"].map(str::to_owned);
    let d = (1..=nd.min(MOST_ND)).map(|i| format!("d{i}"));
    fixed.into_iter().chain(d).chain(OPERATOR.map(str::to_owned)).collect()
}

/// One kept point of a recursion a row.
pub(super) fn traces_schema(nd: usize) -> TableSchema {
    use ColumnKind::{Real, Text};
    let mut columns = vec![
        ("subject", Text),
        ("condition", Text),
        ("run", Text),
        ("estimator", Text),
        ("t", Real),
    ];
    let names: Vec<String> = trace_names(nd)
        .into_iter()
        .flat_map(|name| [format!("{name}_se"), name])
        .collect();
    let mut names: Vec<&str> = names.iter().map(String::as_str).collect();
    names.sort_unstable();
    columns.extend(names.into_iter().map(|name| (name, Real)));
    schema(&columns)
}

fn schema(columns: &[(&str, ColumnKind)]) -> TableSchema {
    TableSchema {
        comments: Vec::new(),
        columns: columns
            .iter()
            .map(|(name, kind)| ColumnSchema {
                name: (*name).to_owned(),
                kind: *kind,
            })
            .collect(),
    }
}

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
    rows: Rows,
    traces: Rows,
}

/// Analyses a run; `base` is the directory of the manifest.
pub(super) fn analyse(manifest: &Manifest, base: &Path, entry: &RunEntry) -> RunTables {
    let mut bench = Bench {
        manifest,
        entry,
        rows: Rows::new(&estimates_schema()),
        traces: Rows::new(&traces_schema(manifest.analysis.nd.1)),
    };
    match read(manifest, base, entry) {
        Ok(record) => bench.analyse(&record),
        Err(reason) => bench.failed(None, "read", &reason),
    }
    RunTables {
        estimates: bench.rows.into_table(Vec::new()),
        traces: bench.traces.into_table(Vec::new()),
    }
}

/// The record of a run as the manifest wants it.
pub(super) fn read(manifest: &Manifest, base: &Path, entry: &RunEntry) -> Result<Record, String> {
    let reading = &manifest.read;
    let text = |error: hoid_io::IoError| error.to_string();
    let options = ReadOptions {
        input: Some(reading.input.parse().map_err(text)?),
        output: reading.output.parse().map_err(text)?,
        sampling_hz: reading.sampling_hz,
        span_s: (reading.from_s, reading.to_s),
        repair: Repair {
            resample: reading.resample,
            fill: reading.fill,
        },
    };
    let read = read_record(&base.join(&entry.file), &options).map_err(text)?;
    Ok(read.record.detrended(match reading.detrend {
        Detrending::None => Detrend::None,
        Detrending::Mean => Detrend::Mean,
        Detrending::Linear => Detrend::Linear,
    }))
}

impl Bench<'_> {
    fn analyse(&mut self, record: &Record) {
        let windows = self.windows(record);
        for (name, value) in [("rms_e", rms(record.input())), ("rms_u", rms(record.output()))] {
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
                        ..TrackOptions::new(method, structure, orders)
                    };
                    match track(record, &options, self.manifest.analysis.trace_every) {
                        Ok(trace) => self.trace_rows(&trace, &windows),
                        Err(error) => self.failed(None, &method.name().to_uppercase(), &error.to_string()),
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
            window("whole", (begin, end)),
        ]
    }

    /// Orders chosen on the sub-batches; rows tell what each of them wanted.
    fn orders(
        &mut self,
        record: &Record,
        structure: Structure,
        windows: &[Window; 3],
    ) -> Result<hoid_model::Orders, String> {
        let ts = record.sample_time().s();
        let (least, most) = self.manifest.analysis.delay_s;
        let samples = |delay_s: f64| (delay_s / ts).round() as usize + 1;
        let mut ranges = OrderRanges::from(structure.operator_orders(1));
        ranges.nk = samples(least)..=samples(most);
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
                Ok(fit) => match fit.operator(0) {
                    Ok(operator) => {
                        for (name, _, estimate) in operator.rows() {
                            self.row(Some(*window), LABEL, name, estimate);
                        }
                    }
                    Err(reason) => self.not_convertible(*window, LABEL, &reason.to_string()),
                },
                Err(reason) => self.failed(Some(*window), LABEL, &reason),
            }
        }
    }

    /// The kept points of a trace from where it moves, and its medians in the sub-batches.
    fn trace_rows(&mut self, trace: &Trace, windows: &[Window; 3]) {
        let label = trace.options().method.name().to_uppercase();
        let names = trace.parameter_names();
        let mut columns: Vec<(String, Vec<f64>)> = names
            .iter()
            .cloned()
            .chain(OPERATOR.map(str::to_owned))
            .map(|n| (n, Vec::new()))
            .collect();
        // Before it moves, a trace is the fit that it starts from.
        let from_s = trace.updated_from_s() - 0.5 * trace.sample_time().s();
        let moving: Vec<usize> = (0..trace.len()).filter(|k| trace.times_s()[*k] >= from_s).collect();
        for &k in &moving {
            let rows = &mut self.traces;
            rows.begin();
            rows.text("subject", &self.entry.subject);
            rows.text("condition", &self.entry.condition);
            rows.text("run", &self.entry.run);
            rows.text("estimator", &label);
            rows.real("t", trace.times_s()[k]);
            let mut values: Vec<Estimate> = trace.parameters(k);
            match trace.operator(k) {
                Ok(operator) => values.extend(operator.rows()[..5].iter().map(|(_, _, estimate)| *estimate)),
                Err(_) => values.extend([Estimate::fixed(f64::NAN); 5]),
            }
            for ((name, column), estimate) in columns.iter_mut().zip(values) {
                column.push(estimate.value);
                rows.real(name, estimate.value);
                if let Some(se) = estimate.standard_error {
                    rows.real(&format!("{name}_se"), se);
                }
            }
        }
        for window in &windows[..2] {
            for (name, column) in &columns {
                let inside: Vec<f64> = moving
                    .iter()
                    .zip(column)
                    .filter(|(k, _)| (window.from_s..window.to_s).contains(&trace.times_s()[**k]))
                    .map(|(_, v)| *v)
                    .collect();
                let middle = median(&inside);
                if middle.is_finite() {
                    self.row(Some(*window), &label, name, Estimate::fixed(middle));
                }
            }
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
