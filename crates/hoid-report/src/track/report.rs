//! The page about recursive estimates, composed of its sections.

use hoid_analysis::TrackingResult;
use hoid_model::{GainUnit, Record, Verdict};
use minijinja::{Value, context};

use super::{
    batch_fits::BatchFit,
    evaluated_trace::EvaluatedTrace,
    panels,
    section::{BatchLine, TraceSection},
    tables,
};
use crate::{
    ReportError,
    figures::{self, TraceGrid},
    fit_summary, page, settings_pairs, tables as of_fits,
};

/// Maximum number of traces on a page: more curves cannot be distinguished.
const MAX_TRACES: usize = 4;

/// Contents of the page.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackReport<'a> {
    /// Heading of the page.
    pub title: String,
    /// Inputs and processing, as pairs of name and value: command, versions, record, seed.
    pub settings: Vec<(String, String)>,
    /// The tracked record. Columns with the names of operator parameters (`K_e`, `T_L`, `K_e_dot`, `omega_nm`,
    /// `zeta_nm`, `tau_e`) contain the true values, as in every simulated record.
    pub record: &'a Record,
    /// One to four recursive estimates over the record, drawn together.
    pub traces: Vec<TraceSection<'a>>,
    /// Verdict on the traces, at the top of the page.
    pub verdict: Option<Verdict>,
    /// Remarks for the reader, such as warnings of the command.
    pub notes: Vec<String>,
}

impl<'a> TrackReport<'a> {
    /// Creates the page about a tracked recording, with batch fits for comparison.
    pub fn from_tracked(tracked: &'a TrackingResult, batch: &'a [BatchFit]) -> Self {
        let options = tracked.trace.options();
        let line = |((from_s, to_s), fit): &'a BatchFit| BatchLine {
            from_s: *from_s,
            to_s: *to_s,
            fit,
        };
        Self {
            title: format!("{} tracked by {}", tracked.record().label(), options.method.name()),
            settings: settings_pairs(&tracked.data.names, &tracked.settings, &tracked.data.accounts),
            record: tracked.record(),
            traces: vec![TraceSection {
                name: format!("{}, {}", options.method.name(), options.structure.label()),
                trace: &tracked.trace,
                batch: batch.iter().map(line).collect(),
            }],
            verdict: Some(tracked.verdict.clone()),
            notes: Vec::new(),
        }
    }
}

impl TrackReport<'_> {
    /// Returns the page as HTML text, which contains all styles and figures. Equal data give identical bytes.
    ///
    /// # Errors
    /// [`ReportError::NoTraces`], [`ReportError::TooManyTraces`], [`ReportError::EmptyTrace`];
    /// [`ReportError::Template`] if a template cannot be rendered, which is a defect of this crate.
    pub fn to_html(&self) -> Result<String, ReportError> {
        self.check_trace_count()?;
        let traces: Vec<EvaluatedTrace<'_>> = self.traces.iter().map(EvaluatedTrace::new).collect();
        let sections: Vec<Value> = traces.iter().enumerate().map(|(i, t)| self.section(i, t)).collect();
        let operator = panels::operator_grid(&traces, self.record);
        let response = panels::response_grid(&traces, self.record);
        let coefficients = panels::coefficient_grid(&traces, self.record);
        let innovation = panels::innovation_grid(&traces, self.record);
        let errors = panels::error_grid(&traces, self.record);
        let shortened = panels::shortened_step_grid(&traces, self.record);
        let draw =
            |id: &str, title: &str, grid: &TraceGrid| Value::from_safe_string(figures::trace_panels(id, title, grid));
        let values = context! {
            title => self.title.clone(),
            answer => self.verdict.as_ref().map(|v| context! { verdict => fit_summary::verdict(v) }),
            settings => page::settings_rows(&self.settings),
            notes => self.notes.clone(),
            further => self.traces.iter().find_map(|t| Some(t.trace.options().further.as_ref()?.channel.clone())),
            names => self.traces.iter().map(|t| t.name.clone()).collect::<Vec<_>>(),
            has_start => self.traces.iter().any(|t| t.trace.start().is_some()),
            has_batch => self.traces.iter().any(|t| !t.batch.is_empty()),
            has_changes => self.traces.iter().any(|t| !t.trace.changes().is_empty()),
            has_marks => !operator.marks_s.is_empty(),
            has_truth => self.record.channel("K_e").is_some(),
            methods => tables::methods(&traces, self.record),
            counts => tables::sample_count_rows(&traces),
            errors => tables::errors(&traces, self.record),
            response => response.as_ref().map(|grid| draw("response", "Response over time", grid)),
            response_beyond => response.as_ref().map(rows_beyond_axes),
            operator => draw("operator", "Parameters of the operator over time", &operator),
            operator_beyond => rows_beyond_axes(&operator),
            coefficients => draw("coefficients", "Coefficients over time", &coefficients),
            coefficients_beyond => rows_beyond_axes(&coefficients),
            innovation => draw("innovation", "Innovations over time", &innovation),
            spread => draw("errors", "Standard errors over time", &errors),
            spread_of_operator => panels::all_are_physical(&traces),
            shortened => shortened.map(|s| draw("shortened", "Shortened steps over time", &s)),
            traces => sections,
        };
        page::render("track.html", values)
    }

    /// The parameters of the operator over time, one panel for each, for custom figures with [`figures::trace_panels`].
    ///
    /// # Errors
    /// [`ReportError::NoTraces`], [`ReportError::TooManyTraces`], [`ReportError::EmptyTrace`].
    pub fn operator_grid(&self) -> Result<TraceGrid, ReportError> {
        self.check_trace_count()?;
        let traces: Vec<EvaluatedTrace<'_>> = self.traces.iter().map(EvaluatedTrace::new).collect();
        Ok(panels::operator_grid(&traces, self.record))
    }

    /// Gain, phase, crossover and margin over time, as in [`TrackReport::operator_grid`]; `None` if the traces contain
    /// none of these quantities.
    ///
    /// # Errors
    /// The errors of [`TrackReport::operator_grid`].
    pub fn response_grid(&self) -> Result<Option<TraceGrid>, ReportError> {
        self.check_trace_count()?;
        let traces: Vec<EvaluatedTrace<'_>> = self.traces.iter().map(EvaluatedTrace::new).collect();
        Ok(panels::response_grid(&traces, self.record))
    }

    /// The coefficients over time, as in [`TrackReport::operator_grid`].
    ///
    /// # Errors
    /// The errors of [`TrackReport::operator_grid`].
    pub fn coefficient_grid(&self) -> Result<TraceGrid, ReportError> {
        self.check_trace_count()?;
        let traces: Vec<EvaluatedTrace<'_>> = self.traces.iter().map(EvaluatedTrace::new).collect();
        Ok(panels::coefficient_grid(&traces, self.record))
    }

    fn check_trace_count(&self) -> Result<(), ReportError> {
        let maximum = MAX_TRACES;
        match self.traces.len() {
            0 => return Err(ReportError::NoTraces { maximum }),
            found if found > maximum => return Err(ReportError::TooManyTraces { found, maximum }),
            _ => {}
        }
        match self.traces.iter().find(|t| t.trace.is_empty()) {
            Some(empty) => Err(ReportError::EmptyTrace {
                name: empty.name.clone(),
            }),
            None => Ok(()),
        }
    }

    fn section(&self, index: usize, trace: &EvaluatedTrace<'_>) -> Value {
        let start = trace.section.trace.start();
        context! {
            name => trace.section.name.clone(),
            anchor => format!("trace-{index}"),
            start => start.map(|fit| context! {
                title => fit.title(),
                converged => fit.termination().converged(),
                coefficients => of_fits::coefficients(fit),
                operator => of_fits::operator(fit, None, &GainUnit::of(self.record)),
            }),
            watched => !trace.section.trace.change_odds().is_empty(),
            changes => tables::changes(trace),
            begins => Some(trace.section.trace.options())
                .filter(|options| options.method.is_self_starting())
                .map(hoid_track::TrackOptions::start_as_text),
            batch => tables::batch_rows(trace, self.record),
        }
    }
}

/// Number of rows of each method beyond the axes of each panel, for a caption.
fn rows_beyond_axes(grid: &TraceGrid) -> Vec<Value> {
    let of = |panel: &figures::TracePanel| -> Vec<Value> {
        let label = tables::symbol_of(&panel.name);
        let rows = panel.rows_beyond_axes().into_iter();
        rows.map(|b| {
            context! {
                label => label.clone(), name => grid.methods.get(b.method).cloned(),
                outside => b.outside, rows => b.rows,
            }
        })
        .collect()
    };
    grid.panels.iter().flat_map(of).collect()
}
