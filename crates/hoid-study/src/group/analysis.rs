//! Analysis of the runs of a person in a condition, jointly and one by one.
//!
//! First, all runs of a person in a condition are analysed together. If the task does not change within them, the
//! family of operators is fitted jointly to all of them ([`hoid_ident::family_estimator`]), which gives the operator of
//! the person. The orders and delay of the polynomial models (nk, and for Box-Jenkins nd and T_n) are also chosen once
//! for all of these runs (`run_orders`). In addition, a Box-Jenkins model is fitted to all runs, with separate initial
//! states for each run, the best-fitting delay, and the highest order of the noise model that the manifest allows. In a
//! closed loop, a noise model of too low an order biases the operator, and a single run is too short for a high order.
//!
//! With the chosen orders, ARX and Box-Jenkins models are fitted to the sub-batches of each run and to the whole run,
//! and the recursions start from the fit of the first sub-batch. The family is fitted to the whole run with the form of
//! the person. Each row gives one estimated quantity and its window; a failure is a row with its reason.

use std::path::Path;

use hoid_analysis::{Recordings, Tracking};
use hoid_ident::{Estimator, GreyBox, choose_orders, family::SeenChannel, order_selection::Criterion};
use hoid_io::OutputTable;
use hoid_model::{Decimation, Form, Orders, Record, Structure, uncertainty::Estimate};
use hoid_numerics::statistics::root_mean_square;
use hoid_track::{Method, TrackRequest};

use super::{
    analysis_settings::AnalysisSettings,
    block::Cell,
    family_fits,
    manifest::{Manifest, RunEntry},
    person::{ALL_RUNS, Person, PersonStatus, people_table, read_people},
    person_channel::PersonChannel,
    reading::{Pairing, Run, UnrepairedRun, account_tables, join_files, read_files, read_run},
    run_orders::{self, label_of},
    run_rows::{RunRows, RunTables},
    traces,
    windows::{Window, windows},
};
use crate::statistics::median;

/// Label of a run that could not be read.
pub(super) const READ_LABEL: &str = "read";
/// Label of the grey box.
const GREY_BOX_LABEL: &str = "grey box";
/// Label of quantities that describe the recording itself.
pub(super) const RECORD_LABEL: &str = "record";
/// Name of the table of people.
pub(super) const PEOPLE_TABLE: &str = "people";

/// Results from all runs of a person in a condition that the analysis of each run needs.
pub(super) struct CellResults {
    arx: Result<Orders, String>,
    box_jenkins: Result<Orders, String>,
    /// Form of the operator of the person; `None` if the person has no operator.
    form: Option<Form>,
    /// The further inputs to which the person responds, each with the form of its response.
    channels: Vec<SeenChannel>,
}

impl CellResults {
    /// Reads the results from two tables of the cell: its estimates and its people.
    pub fn of(estimates: &OutputTable, people: &OutputTable) -> Self {
        let people = read_people(people);
        let person = people.first();
        let channels = person.map_or(&[][..], |person| &person.channels);
        Self {
            arx: run_orders::chosen_orders(estimates, Structure::Arx),
            box_jenkins: run_orders::chosen_orders(estimates, Structure::BoxJenkins),
            form: person.and_then(|person| person.form.parse().ok()),
            channels: channels.iter().filter_map(PersonChannel::single_run_channel).collect(),
        }
    }

    /// Returns the reason why models with one input do not apply; `None` if they do.
    fn reason_against_one_input(&self) -> Option<String> {
        let names: Vec<&str> = self.channels.iter().map(|channel| channel.name.as_str()).collect();
        (!names.is_empty()).then(|| {
            let names = names.join(" and ");
            format!("the model has one input, but u also responds to {names}: the estimates would be biased")
        })
    }

    fn orders(&self, structure: Structure) -> &Result<Orders, String> {
        if structure == Structure::Arx {
            &self.arx
        } else {
            &self.box_jenkins
        }
    }
}

/// Analyses a run; `base` is the directory of the manifest.
pub(super) fn analyse(manifest: &Manifest, base: &Path, entry: &RunEntry, from_cell: &CellResults) -> RunTables {
    let mut analysis = RunAnalysis::new(manifest, entry);
    let files = read_files(manifest, base, entry, Pairing::Recorded);
    let account = account_tables(entry, &files);
    match join_files(files) {
        Ok(run) => {
            analysis.rows.convert_sample_counts(&run);
            analysis.analyse(&run, from_cell);
            if let Some(form) = from_cell.form.filter(|_| manifest.analysis.each_run) {
                let paired = read_run(manifest, base, entry, Pairing::InTheLoop);
                analysis.fit_family_to_run(paired.map(|run| run.record), form, &from_cell.channels);
            }
        }
        Err(reason) => analysis.rows.write_failure(None, READ_LABEL, &reason),
    }
    RunTables {
        account: account.into(),
        ..analysis.rows.into_tables()
    }
}

/// Analyses all runs of a person in a condition jointly.
pub(super) fn analyse_jointly(manifest: &Manifest, base: &Path, cell: &Cell<'_>) -> RunTables {
    let all = RunEntry {
        run: ALL_RUNS.to_owned(),
        ..cell.runs[0].clone()
    };
    let mut analysis = RunAnalysis::new(manifest, &all);
    let read = |pairing| -> (Vec<&RunEntry>, Vec<Run>) {
        let one = |run: &'_ RunEntry| read_run(manifest, base, run, pairing).ok();
        let runs = cell.runs.iter().filter_map(|&run| Some((run, one(run)?)));
        runs.unzip()
    };
    let (entries, runs) = read(Pairing::Recorded);
    if let Some(run) = runs.first() {
        analysis.rows.convert_sample_counts(run);
    }
    let late_samples = analysis.rows.condition.offset_samples;
    let people = match (&cell.changes, runs.is_empty()) {
        (Some(reason), _) => vec![Person::without_operator(cell.key(), PersonStatus::Changes, reason)],
        // A file that cannot be read is reported by the analysis of its run.
        (None, true) => vec![Person::without_operator(
            cell.key(),
            PersonStatus::Failed,
            "no run could be read",
        )],
        // The two pairings differ only if u is recorded late.
        (None, false) if late_samples != 0.0 => {
            let (entries, paired) = read(Pairing::InTheLoop);
            analysis.fit_family_jointly(manifest, cell.key(), &entries, &paired)
        }
        (None, false) => analysis.fit_family_jointly(manifest, cell.key(), &entries, &runs),
    };
    let records: Vec<Record> = runs.into_iter().map(|run| run.record).collect();
    let one_input = people[0].channels.iter().all(|channel| channel.form.is_none());
    if let Some(first) = records.first().filter(|_| one_input) {
        let tau_s = people[0].parameter("tau_e").map(|tau| tau.value);
        let nk = tau_s.map(|tau_s| run_orders::nk_of(tau_s, first.sample_time().s(), late_samples));
        // The names of the structures were checked with the manifest.
        for structure in analysis.settings.structures().unwrap_or_default() {
            if let Err(reason) = run_orders::choose(analysis.settings, &records, structure, nk, &mut analysis.rows) {
                analysis.rows.write_failure(None, label_of(structure), &reason);
            }
        }
        let fitted = analysis.settings.polynomials().unwrap_or_default();
        if cell.changes.is_none() && records.len() > 1 && fitted.contains(&Structure::BoxJenkins) {
            analysis.fit_box_jenkins_jointly(&records);
        }
    }
    let mut tables = analysis.rows.into_tables();
    tables.account.push((PEOPLE_TABLE, people_table(&people)));
    tables
}

/// The analysis of a run: its settings and the rows written so far.
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

    fn analyse(&mut self, run: &Run, from_cell: &CellResults) {
        let record = &run.record;
        let windows = windows(self.settings, record);
        let change = run.seam_s.or(self.rows.condition.change_s).map(|at| ("change_s", at));
        let of_record = [
            ("rms_e", root_mean_square(record.input())),
            ("rms_u", root_mean_square(record.output())),
        ];
        for (name, value) in of_record.into_iter().chain(change) {
            self.rows
                .write_row(Some(windows[2]), RECORD_LABEL, name, Estimate::fixed(value));
        }
        if let Some(reason) = from_cell.reason_against_one_input() {
            return self.report_one_input_exclusion(&reason);
        }
        // The names of structures and recursions were checked with the manifest.
        for structure in self.settings.polynomials().unwrap_or_default() {
            let label = label_of(structure);
            let orders = match from_cell.orders(structure) {
                Ok(orders) => *orders,
                Err(reason) => {
                    self.rows.write_failure(None, label, reason);
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
                    Ok(fit) => self.rows.write_fit_rows(window, label, &fit, record),
                    Err(reason) => self.rows.write_failure(Some(window), label, &reason),
                }
            }
        }
        for method in self.settings.recursions().unwrap_or_default() {
            self.track(run, &windows, &method, from_cell);
        }
        if self.settings.grey_box {
            self.fit_grey_box(record, &windows);
        }
    }

    /// Reports why the models and recursions with one input are not fitted.
    fn report_one_input_exclusion(&mut self, reason: &str) {
        for structure in self.settings.polynomials().unwrap_or_default() {
            self.rows.write_omission(label_of(structure), reason);
        }
        for method in self.settings.recursions().unwrap_or_default() {
            self.rows.write_omission(&traces::label_of(&method), reason);
        }
        if self.settings.grey_box {
            self.rows.write_omission(GREY_BOX_LABEL, reason);
        }
    }

    /// Applies a recursion to the run. A method that needs no start fit gets no prior information; any other method
    /// gets the orders chosen for the cell and starts from a fit of the first window.
    fn track(&mut self, run: &Run, windows: &[Window; 3], method: &Method, from_cell: &CellResults) {
        let label = traces::label_of(method);
        let mut tracking = Tracking {
            // The run has already been repaired and reduced to its final rate.
            rate: Decimation::Off,
            every: run.run_samples(self.settings.trace_every as f64).round().max(1.0) as usize,
            ..Tracking::of(TrackRequest::of(method.clone()))
        };
        if !method.is_self_starting() {
            let structure = method.default_structure();
            match from_cell.orders(structure) {
                Ok(orders) => {
                    let has = |name: &str| name == "nk" || structure.polynomials().contains(&name[1..]);
                    let named = orders.named_orders().into_iter().filter(|(name, _)| has(name));
                    tracking.recursion.orders = named.map(|(name, n)| (name.to_owned(), n..=n)).collect();
                    tracking.start_span_s = Some((windows[0].from_s, windows[0].to_s));
                }
                Err(reason) => return self.rows.write_failure(None, &label, reason),
            }
        }
        let tracked = match tracking.run(Recordings::from_records([run.record.clone()]), None, &|| ()) {
            Ok(tracked) => tracked,
            Err(error) => return self.rows.write_failure(None, &label, &error.to_string()),
        };
        let trace = tracked.trace;
        self.rows.write_verdict(&label, &tracked.verdict);
        self.rows.write_trace_rows(&trace);
        for window in &windows[..2] {
            for (name, values) in traces::values_within(&trace, window.from_s, window.to_s) {
                let middle = median(&values);
                if middle.is_finite() {
                    self.rows
                        .write_row(Some(*window), &label, &name, Estimate::fixed(middle));
                }
            }
        }
    }

    /// Fits one Box-Jenkins model to all runs.
    fn fit_box_jenkins_jointly(&mut self, records: &[Record]) {
        const LABEL: &str = "BJ, all runs";
        let structure = Structure::BoxJenkins;
        let mut ranges = run_orders::ranges(self.settings, &records[0], structure);
        let nd = self.settings.nd.1;
        ranges.nd = nd..=nd;
        let template = Estimator::new(structure, structure.operator_orders(1));
        let window = windows(self.settings, &records[0])[2];
        match choose_orders(&template, &ranges, Criterion::Bic, records) {
            Ok(choice) => self.rows.write_fit_rows(window, LABEL, &choice.fit, &records[0]),
            Err(error) => self.rows.write_failure(Some(window), LABEL, &error.to_string()),
        }
    }

    /// Fits the family jointly to all runs and returns the people of the fit.
    fn fit_family_jointly(
        &mut self,
        manifest: &Manifest,
        key: (&str, &str),
        entries: &[&RunEntry],
        runs: &[Run],
    ) -> Vec<Person> {
        let mut recordings = Recordings::default();
        for (entry, run) in entries.iter().zip(runs) {
            if let Some(UnrepairedRun { record, account }) = run.recorded.clone() {
                recordings.push(entry.file.display().to_string(), record, account);
            }
        }
        let found = family_fits::identification(manifest, key.1, &self.rows)
            .and_then(|how| how.run(recordings).map_err(|error| error.to_string()));
        match found {
            Ok(found) => {
                let record = &runs[0].record;
                let window = windows(self.settings, record)[2];
                family_fits::write_fit(&mut self.rows, window, family_fits::JOINT_LABEL, &found.fit, record);
                family_fits::people_of_fit(key, entries, &found, self.rows.element())
            }
            Err(reason) => {
                self.rows.write_failure(None, family_fits::JOINT_LABEL, &reason);
                vec![Person::without_operator(key, PersonStatus::Failed, &reason)]
            }
        }
    }

    /// Fits the family to one run, in the forms chosen for the person.
    fn fit_family_to_run(&mut self, record: Result<Record, String>, form: Form, channels: &[SeenChannel]) {
        let fit = record.and_then(|record| {
            let estimator = family_fits::estimator_of_run(self.settings, &self.rows.condition, form, channels)?;
            let fit = estimator.fit(std::slice::from_ref(&record));
            Ok((fit.map_err(|error| error.to_string())?, record))
        });
        match fit {
            Ok((fit, record)) => {
                let window = windows(self.settings, &record)[2];
                family_fits::write_fit(&mut self.rows, window, family_fits::SINGLE_RUN_LABEL, &fit, &record);
            }
            Err(reason) => self.rows.write_failure(None, family_fits::SINGLE_RUN_LABEL, &reason),
        }
    }

    fn fit_grey_box(&mut self, record: &Record, windows: &[Window; 3]) {
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
                    self.rows.write_response_rows(
                        *window,
                        GREY_BOX_LABEL,
                        fit.polynomial_fit(0),
                        record.sample_time().s(),
                    );
                    self.rows.write_operator_rows(*window, GREY_BOX_LABEL, fit.operator(0));
                }
                Err(reason) => self.rows.write_failure(Some(*window), GREY_BOX_LABEL, &reason),
            }
        }
    }
}
