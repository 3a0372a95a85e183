//! The estimates of a cell, written as rows of the tables of fits and traces.

use hoid_analysis::IdentifiedModel;
use hoid_ident::{Fit, Series, SigmoidFit, Termination};
use hoid_io::OutputTable;
use hoid_model::{
    NamedChoice, Record, Severity, Verdict,
    remnant::RemnantDiscretisation,
    remnant_gain::NoiseDefinition,
    scenario::RemnantStrength,
    uncertainty::{Estimate, OperatorEstimate},
};
use hoid_numerics::statistics::{root_mean_square, variance};
use hoid_track::Trace;

use crate::{
    columns::{OPERATOR_PARAMETERS, Rows, Schemas, TRACED_QUANTITIES, extra_axes},
    error_measures::{ChangeMeasures, TraceErrors, TrueResponse},
    plan::{Cell, EstimatorCell, Plan},
};

/// The tables of one block.
pub(crate) struct BlockTables {
    pub fits: OutputTable,
    pub traces: Option<OutputTable>,
}

/// Rows of the tables of a block, written estimate by estimate.
pub(crate) struct EstimateRows<'a> {
    plan: &'a Plan,
    cell: &'a Cell,
    /// Axes that have a column with their name.
    axis_columns: Vec<String>,
    true_response: Option<TrueResponse>,
    /// VAF of the estimators applied so far to the current replication, by name and nk.
    vafs: Vec<(&'a str, usize, f64)>,
    fits: Rows,
    traces: Option<Rows>,
}

impl<'a> EstimateRows<'a> {
    pub fn new(plan: &'a Plan, cell: &'a Cell, schemas: &Schemas) -> Self {
        Self {
            plan,
            cell,
            axis_columns: extra_axes(plan),
            true_response: TrueResponse::of(cell),
            vafs: Vec::new(),
            fits: Rows::new(&schemas.fits),
            traces: schemas.traces.as_ref().map(Rows::new),
        }
    }

    pub fn into_tables(self, schemas: &Schemas) -> BlockTables {
        BlockTables {
            fits: self.fits.into_table(schemas.fits.comments.clone()),
            traces: self
                .traces
                .zip(schemas.traces.as_ref())
                .map(|(rows, schema)| rows.into_table(schema.comments.clone())),
        }
    }

    /// Starts a replication; `delta_vaf` compares estimators within it.
    pub fn start_replication(&mut self) {
        self.vafs.clear();
    }

    /// Starts the row of an estimate with the settings of the scenario and the estimator.
    pub fn start_row(&mut self, estimator: &EstimatorCell, replication: u64) {
        let (cell, rows) = (self.cell, &mut self.fits);
        let scenario = cell.resolved.scenario();
        rows.start_row();
        rows.set_whole("cell", cell.index);
        rows.set_text("scenario", &cell.scenario);
        rows.set_text("condition", &cell.condition);
        rows.set_whole("remnant_order", scenario.remnant.order as u64);
        if let RemnantStrength::Level { level, definition } = scenario.remnant.strength {
            rows.set_real("noise_level", level);
            rows.set_text(
                "noise_definition",
                match definition {
                    NoiseDefinition::Response => "response",
                    NoiseDefinition::Remnant => "remnant",
                },
            );
        }
        rows.set_real("T_n_true", scenario.remnant.time_constant_s);
        rows.set_real("sample_time_s", scenario.sample_time.s());
        for name in &self.axis_columns {
            let axis = cell.axes.iter().chain(&estimator.axes).find(|axis| axis.key == *name);
            rows.set_text(name, axis.map_or("", |axis| axis.value.as_str()));
        }
        rows.set_whole("replication", replication);
        rows.set_text("estimator", &estimator.label);
        rows.set_text("name", &estimator.name);
        rows.set_text("method", estimator.method());
        if let Some(structure) = estimator.structure() {
            rows.set_text("structure", structure.name());
            for (name, n) in estimator.orders(&cell.resolved).named_orders() {
                rows.set_real(name, n as f64);
            }
        }
        rows.set_text("start", &estimator.start);
        rows.set_whole("decimate", estimator.decimate as u64);
        let (from, to) = estimator.span_s.unwrap_or((0.0, scenario.measurement_s));
        rows.set_real("from_s", from);
        rows.set_real("to_s", to);
    }

    /// Records that the current estimate failed.
    pub fn write_failure(&mut self, reason: &str) {
        self.fits.set_text("status", "failed");
        self.fits.set_text("reason", reason);
    }

    /// Writes the noise levels and RMS values of a run; `u0` is the output of the same run without remnant.
    pub fn write_noise_row(&mut self, record: &Record, u0: &[f64]) {
        let u = record.output();
        let difference: Vec<f64> = u.iter().zip(u0).map(|(u, u0)| u - u0).collect();
        let power = variance(u);
        let n = record.channel("n").unwrap_or_default();
        let rows = &mut self.fits;
        rows.set_real("noise_level_obtained", (power - variance(u0)) / power);
        rows.set_real("noise_level_response", variance(&difference) / power);
        rows.set_real("noise_level_remnant", variance(n) / power);
        for (name, values) in [("rms_e", record.input()), ("rms_u", u), ("rms_n", n)] {
            rows.set_real(name, root_mean_square(values));
        }
        rows.set_text("status", "ok");
    }

    /// Writes how a search ended.
    pub fn write_termination(&mut self, termination: Termination) {
        let rows = &mut self.fits;
        rows.set_text("termination", &termination.reason.to_string());
        rows.set_whole("converged", u64::from(termination.converged()));
        rows.set_whole("iterations", termination.iterations as u64);
    }

    pub fn write_fit_row(
        &mut self,
        estimator: &'a EstimatorCell,
        fit: &Fit,
        record: &Record,
        operator: Result<OperatorEstimate, String>,
    ) -> Result<(), String> {
        let vaf = vaf(record, &fit.simulate(record).map_err(|error| error.to_string())?);
        let nk = fit.orders().nk;
        let other = estimator
            .versus
            .as_ref()
            .and_then(|name| self.vafs.iter().find(|v| v.0 == *name && v.1 == nk));
        let delta = other.map_or(f64::NAN, |other| vaf - other.2);
        self.vafs.push((&estimator.name, nk, vaf));
        self.write_termination(fit.termination());
        let rows = &mut self.fits;
        rows.set_real("delta_vaf", delta);
        rows.set_real("loss", fit.loss());
        rows.set_real("innovation_variance", fit.innovation_variance());
        rows.set_real("vaf", vaf);
        if let Some(true_response) = &self.true_response {
            rows.set_real("response_error", true_response.error_percent(fit));
        }
        for (name, estimate) in fit.parameters() {
            set_estimate(rows, &name, estimate);
        }
        if fit.orders().nd > 0 {
            if let Ok(remnant) = fit.remnant(RemnantDiscretisation::ZeroOrderHold) {
                set_estimate(rows, "T_n", remnant.t_n_s);
                set_estimate(rows, "K_n", remnant.k_n);
            }
            if let Ok(remnant) = fit.remnant(RemnantDiscretisation::BackwardEuler) {
                rows.set_real("T_n_backward_euler", remnant.t_n_s.value);
                rows.set_real("K_n_backward_euler", remnant.k_n.value);
            }
        }
        match operator {
            Ok(operator) => {
                for (name, _, estimate) in operator.rows() {
                    set_estimate(rows, name, estimate);
                }
                rows.set_text("status", "ok");
            }
            Err(reason) => {
                rows.set_text("status", "not convertible");
                rows.set_text("reason", &reason);
            }
        }
        Ok(())
    }

    /// Writes the operator found by an analysis.
    pub fn write_operator_row(&mut self, found: &IdentifiedModel) -> Result<(), String> {
        let (fit, record) = (&found.fit, &found.data.records[0]);
        let of = fit.operator(0);
        let simulated = of.polynomial_fit.simulate(record).map_err(|error| error.to_string())?;
        self.write_termination(fit.termination);
        let rows = &mut self.fits;
        rows.set_text("form", fit.form.name());
        rows.set_real("nc", fit.noise_orders.0 as f64);
        rows.set_real("nd", fit.noise_orders.1 as f64);
        rows.set_real("loss", fit.loss);
        rows.set_real("innovation_variance", fit.innovation_variance);
        rows.set_real("vaf", vaf(record, &simulated));
        if let Some(true_response) = &self.true_response {
            rows.set_real("response_error", true_response.error_percent(&of.polynomial_fit));
        }
        // An infinite T_I, which represents a pure integration, is not written.
        for p in of.parameters.iter().filter(|p| p.value.is_finite()) {
            let estimate = Estimate {
                value: p.value,
                standard_error: p.standard_error,
            };
            set_estimate(rows, &p.name, estimate);
        }
        rows.set_text("status", "ok");
        Ok(())
    }

    /// Writes the fit of an operator with changing gains: the parameters of the operator before (1) and after (2) the
    /// change, and the parameters of the fit.
    pub fn write_change_row(&mut self, found: &IdentifiedModel<SigmoidFit>) -> Result<(), String> {
        let (fit, record) = (&found.fit, &found.data.records[0]);
        let simulated = fit.simulate(record).map_err(|error| error.to_string())?;
        self.write_termination(fit.termination());
        let rows = &mut self.fits;
        rows.set_text("form", fit.form().name());
        rows.set_real("nd", fit.d().len() as f64);
        rows.set_real("loss", fit.loss());
        rows.set_real("innovation_variance", fit.innovation_variance());
        rows.set_real("vaf", vaf(record, &simulated));
        rows.set_real("change_found", f64::from(u8::from(fit.has_change())));
        for (end, operator) in [(1, fit.initial_operator()), (2, fit.last_operator())] {
            for p in &operator.parameters {
                set_estimate(rows, &format!("{}{end}", p.name), p.estimate);
            }
        }
        for p in fit.parameters() {
            set_estimate(rows, &p.name, p.estimate);
        }
        rows.set_text("status", "ok");
        Ok(())
    }

    /// Writes the verdict on the estimate and the kinds of the findings against it; notes are not written.
    pub fn write_verdict(&mut self, verdict: &Verdict) {
        let against = verdict
            .findings()
            .iter()
            .filter(|finding| finding.severity > Severity::Note);
        let kinds: Vec<&str> = against.map(|finding| finding.kind).collect();
        self.fits.set_text("verdict", verdict.level.choice_name());
        self.fits.set_text("findings", &kinds.join(", "));
    }

    pub fn write_track_row(&mut self, trace: &Trace, record: &Record) {
        if let Some(start) = trace.start() {
            self.write_termination(start.termination());
        }
        let errors = TraceErrors::of(trace, record, self.cell);
        let rows = &mut self.fits;
        for (i, name) in TRACED_QUANTITIES.iter().enumerate() {
            rows.set_real(&format!("rms_{name}"), errors.rms_percent[i]);
            rows.set_real(&format!("settle50_{name}"), errors.settling_times_s[0][i]);
            rows.set_real(&format!("settle90_{name}"), errors.settling_times_s[1][i]);
        }
        if self.plan.changes {
            let measures = ChangeMeasures::of(trace, record, self.cell);
            for (i, name) in TRACED_QUANTITIES.iter().enumerate() {
                rows.set_real(&format!("before_{name}"), measures.before_percent[i]);
                rows.set_real(&format!("after_{name}"), measures.after_percent[i]);
                rows.set_real(&format!("covered_{name}"), measures.covered_percent[i]);
                rows.set_real(&format!("covered_through_{name}"), measures.covered_through_percent[i]);
            }
            rows.set_real("false_alarms", measures.false_alarms);
            rows.set_real("hours", measures.hours);
            rows.set_real("found", measures.found_percent);
            rows.set_real("lag", measures.lag_s);
        }
        rows.set_whole("diverged", u64::from(errors.diverged));
        rows.set_whole("steps_shortened", trace.counts().shortened);
        rows.set_real("share_not_convertible", errors.share_not_convertible);
        let Some(last) = trace.len().checked_sub(1) else { return };
        rows.set_real("innovation_variance", trace.innovation_variance()[last]);
        for (name, estimate) in trace.parameter_names().iter().zip(trace.parameters(last)) {
            set_estimate(rows, name, estimate);
        }
        match trace.operator(last) {
            Ok(operator) => {
                for (name, _, estimate) in operator.rows() {
                    set_estimate(rows, name, estimate);
                }
                rows.set_text("status", "ok");
            }
            Err(reason) => {
                rows.set_text("status", "not convertible");
                rows.set_text("reason", &reason.to_string());
            }
        }
    }

    pub fn write_trace_rows(&mut self, trace: &Trace, step: usize, estimator: &EstimatorCell, replication: u64) {
        let Some(rows) = &mut self.traces else { return };
        let with_errors = self.plan.standard_errors;
        let slot = |rows: &Rows, name: &str| (rows.position(name), rows.position(&format!("{name}_se")));
        let theta: Vec<_> = trace.parameter_names().iter().map(|name| slot(rows, name)).collect();
        let operator = OPERATOR_PARAMETERS.map(|name| slot(rows, name));
        let put = |rows: &mut Rows, (value, error): (Option<usize>, Option<usize>), estimate: Estimate| {
            if let Some(position) = value {
                rows.set_real_at(position, estimate.value);
            }
            if let (Some(position), Some(se)) = (error, estimate.standard_error) {
                rows.set_real_at(position, se);
            }
        };
        for k in (step - 1..trace.len()).step_by(step) {
            rows.start_row();
            rows.set_whole("cell", self.cell.index);
            rows.set_whole("replication", replication);
            rows.set_text("estimator", &estimator.label);
            rows.set_real("t", trace.times_s()[k]);
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

/// Returns the VAF, in %: the share of the output that the simulated model explains.
fn vaf(record: &Record, simulated: &Series) -> f64 {
    hoid_ident::validation::vaf(&record.output()[simulated.first..], &simulated.values)
}

fn set_estimate(rows: &mut Rows, name: &str, estimate: Estimate) {
    rows.set_real(name, estimate.value);
    if let Some(se) = estimate.standard_error {
        rows.set_real(&format!("{name}_se"), se);
    }
}
