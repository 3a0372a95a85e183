//! The estimates of one run as table rows: coefficients, operator, responses, and failures with their reasons.

use hoid_ident::{Fit, frequency::Crossover};
use hoid_io::{OutputTable, TableSchema};
use hoid_model::{
    Complex64, ContinuousTransferFunction, NotConvertible, PolynomialModel, Record, Verdict, VerdictLevel,
    uncertainty::{Estimate, OperatorEstimate},
};
use hoid_track::Trace;

use super::{
    condition_settings::ConditionSettings,
    manifest::{Manifest, RunEntry},
    manifest_names::in_manifest,
    reading::Run,
    responses::{grid_frequencies, responses_schema, unwrapped_phases_deg},
    tables::{real_columns, schema, text_columns},
    traces::{self, TraceColumns},
    windows::{WHOLE_RUN, Window},
};
use crate::columns::Rows;

/// The tables of one run.
pub(super) struct RunTables {
    pub estimates: OutputTable,
    pub responses: OutputTable,
    pub traces: OutputTable,
    /// Additional tables by name: for a run, the steps applied to its files and the problems of their sampling; for a
    /// cell, the people.
    pub account: Vec<(&'static str, OutputTable)>,
}

/// Returns the columns of the table of estimates, in long form: one estimate per row.
pub(super) fn estimates_schema() -> TableSchema {
    schema(
        text_columns(&["subject", "condition", "run", "window"])
            .chain(real_columns(&["from_s", "to_s"]))
            .chain(text_columns(&["estimator", "parameter"]))
            .chain(real_columns(&["value", "standard_error"]))
            .chain(text_columns(&["status", "reason"])),
    )
}

/// Rows of the tables of a run, written during its analysis.
pub(super) struct RunRows<'a> {
    entry: &'a RunEntry,
    /// Known properties of the condition of the run.
    pub condition: ConditionSettings,
    /// Time by which a sample of the input is later than the sample of the output in the same row, s. The phase that
    /// this lead adds to a frequency response is removed.
    pub input_lead_s: f64,
    element: Option<ContinuousTransferFunction>,
    columns: TraceColumns,
    estimates: Rows,
    responses: Rows,
    traces: Rows,
}

impl<'a> RunRows<'a> {
    pub fn new(manifest: &Manifest, entry: &'a RunEntry) -> Self {
        let condition = manifest.conditions.get(&entry.condition).cloned().unwrap_or_default();
        let columns = TraceColumns::of(&manifest.analysis);
        Self {
            entry,
            element: condition.constant_element().and_then(|e| e.parse().ok()),
            condition,
            input_lead_s: 0.0,
            estimates: Rows::new(&estimates_schema()),
            responses: Rows::new(&responses_schema()),
            traces: Rows::new(&columns.schema()),
            columns,
        }
    }

    /// Converts settings that count recorded samples to samples of a run.
    pub fn convert_sample_counts(&mut self, run: &Run) {
        self.condition.offset_samples = run.run_samples(self.condition.offset_samples);
        self.input_lead_s = run.input_lead_s;
    }

    pub fn into_tables(self) -> RunTables {
        RunTables {
            estimates: self.estimates.into_table(Vec::new()),
            responses: self.responses.into_table(Vec::new()),
            traces: self.traces.into_table(Vec::new()),
            account: Vec::new(),
        }
    }

    /// Writes coefficients, innovation variance, VAF, response and operator of a fit.
    pub fn write_fit_rows(&mut self, window: Window, label: &str, fit: &Fit, record: &Record) {
        for (name, estimate) in fit.parameters() {
            self.write_row(Some(window), label, &name, estimate);
        }
        self.write_row(
            Some(window),
            label,
            "innovation_variance",
            Estimate::fixed(fit.innovation_variance()),
        );
        if let Ok(part) = record.span(window.from_s, window.to_s)
            && let Ok(simulated) = fit.simulate(&part)
        {
            let vaf = hoid_ident::validation::vaf(&part.output()[simulated.first..], &simulated.values);
            self.write_row(Some(window), label, "vaf", Estimate::fixed(vaf));
        }
        self.write_response_rows(window, label, fit, record.sample_time().s());
        self.write_operator_rows(window, label, fit.operator());
    }

    /// Writes the operator of a fit, or the reason why the fit has no operator.
    pub fn write_operator_rows(
        &mut self,
        window: Window,
        label: &str,
        operator: Result<OperatorEstimate, NotConvertible>,
    ) {
        match operator {
            Ok(operator) => {
                for (name, _, estimate) in operator.rows() {
                    self.write_row(Some(window), label, name, estimate);
                }
            }
            Err(reason) => self.write_not_convertible(window, label, &reason.to_string()),
        }
    }

    /// Writes the frequency response of a fit of the whole run and, if the controlled element is known, the crossover
    /// and phase margin.
    pub fn write_response_rows(&mut self, window: Window, label: &str, fit: &Fit, sample_time_s: f64) {
        if window.name != WHOLE_RUN {
            return;
        }
        let advance_s = self.condition.offset_samples * sample_time_s + self.input_lead_s;
        let (omega, response) = self.write_responses(label, fit.model(), sample_time_s, advance_s);
        let Some(element) = &self.element else { return };
        let open_loop: Vec<Complex64> = omega
            .iter()
            .zip(&response)
            .map(|(w, h)| h * element.response(*w))
            .collect();
        if let Some(found) = Crossover::of(&omega, &open_loop, 0.0) {
            self.write_row(
                Some(window),
                label,
                "crossover_rad_s",
                Estimate::fixed(found.omega_rad_s),
            );
            self.write_row(
                Some(window),
                label,
                "phase_margin_deg",
                Estimate::fixed(found.phase_margin_deg),
            );
        }
    }

    /// Writes the response of a model on the frequency grid, advanced by the time `advance_s`; returns frequencies and
    /// response.
    pub fn write_responses(
        &mut self,
        label: &str,
        model: &PolynomialModel,
        sample_time_s: f64,
        advance_s: f64,
    ) -> (Vec<f64>, Vec<Complex64>) {
        let omega = grid_frequencies(sample_time_s);
        let response: Vec<Complex64> = omega
            .iter()
            .map(|w| model.response(*w) * Complex64::from_polar(1.0, w * advance_s))
            .collect();
        for ((w, h), phase_deg) in omega.iter().zip(&response).zip(unwrapped_phases_deg(&response)) {
            let rows = &mut self.responses;
            rows.start_row();
            rows.set_text("subject", &self.entry.subject);
            rows.set_text("condition", &self.entry.condition);
            rows.set_text("run", &self.entry.run);
            rows.set_text("estimator", label);
            rows.set_real("omega_rad_s", *w);
            rows.set_real("magnitude_db", 20.0 * h.norm().log10());
            rows.set_real("phase_deg", phase_deg);
        }
        (omega, response)
    }

    /// Returns the controlled element, if it is known and does not change.
    pub fn element(&self) -> Option<&ContinuousTransferFunction> {
        self.element.as_ref()
    }

    /// Writes the rows of a trace from its first update on.
    pub fn write_trace_rows(&mut self, trace: &Trace) {
        traces::write(&mut self.traces, &self.columns, self.entry, trace);
    }

    fn start_row(&mut self, window: Option<Window>, estimator: &str) {
        let rows = &mut self.estimates;
        rows.start_row();
        rows.set_text("subject", &self.entry.subject);
        rows.set_text("condition", &self.entry.condition);
        rows.set_text("run", &self.entry.run);
        rows.set_text("estimator", estimator);
        if let Some(window) = window {
            rows.set_text("window", window.name);
            rows.set_real("from_s", window.from_s);
            rows.set_real("to_s", window.to_s);
        }
    }

    /// Writes a quantity estimated in a window, or without a window for the run as a whole.
    pub fn write_row(&mut self, window: Option<Window>, estimator: &str, parameter: &str, estimate: Estimate) {
        self.start_row(window, estimator);
        self.estimates.set_text("parameter", parameter);
        self.estimates.set_real("value", estimate.value);
        if let Some(se) = estimate.standard_error {
            self.estimates.set_real("standard_error", se);
        }
        self.estimates.set_text("status", "ok");
    }

    fn write_not_convertible(&mut self, window: Window, estimator: &str, reason: &str) {
        self.write_row_without_value(Some(window), estimator, "not convertible", reason);
    }

    /// Writes the verdict on a recursion with its reasons, unless the recursion is trustworthy.
    pub fn write_verdict(&mut self, estimator: &str, verdict: &Verdict) {
        if verdict.level == VerdictLevel::Trustworthy {
            return;
        }
        let reasons: Vec<&str> = verdict.reasons().collect();
        let reasons = in_manifest(&reasons.join("; "), &self.entry.condition);
        self.write_row_without_value(None, estimator, verdict.level.name(), &reasons);
    }

    /// Writes that an estimator failed, and the reason.
    pub fn write_failure(&mut self, window: Option<Window>, estimator: &str, reason: &str) {
        let reason = in_manifest(reason, &self.entry.condition);
        self.write_row_without_value(window, estimator, "failed", &reason);
    }

    /// Writes that an estimator does not apply, and the reason.
    pub fn write_omission(&mut self, estimator: &str, reason: &str) {
        self.write_row_without_value(None, estimator, "omitted", reason);
    }

    fn write_row_without_value(&mut self, window: Option<Window>, estimator: &str, status: &str, reason: &str) {
        self.start_row(window, estimator);
        self.estimates.set_text("status", status);
        self.estimates.set_text("reason", reason);
    }
}
