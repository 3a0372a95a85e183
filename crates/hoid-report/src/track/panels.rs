//! The figures of the page about recursive estimates, drawn from traces.

use std::collections::BTreeMap;

use hoid_model::{
    GainUnit, Record,
    uncertainty::{Estimate, OperatorEstimate},
};
use hoid_numerics::statistics::finite_quantile;
use hoid_track::{FurtherOperator, StartSource, Trace};

use super::{
    coefficients::{Coefficient, fit_coefficients, must_join_poles, trace_coefficients},
    evaluated_trace::{EvaluatedTrace, operator_estimate, operator_names, unit},
    truth,
};
use crate::{
    figures::{CurveKind, Ordinate, TraceCurve, TraceGrid, TracePanel},
    numbers::Z_95,
};

/// Number that is drawn for each estimate: its value or its standard error.
#[derive(Clone, Copy, PartialEq, Eq)]
enum PlottedPart {
    Value,
    Error,
}

/// Curve of estimates with their band, or of their standard errors.
fn curve(method: usize, times_s: &[f64], estimates: &[Option<Estimate>], shown: PlottedPart) -> TraceCurve {
    let error = |e: &Option<Estimate>| e.and_then(|e| e.standard_error).unwrap_or(f64::NAN);
    let value = |e: &Option<Estimate>| e.map_or(f64::NAN, |e| e.value);
    let edges = |e: &Option<Estimate>| (value(e) - Z_95 * error(e), value(e) + Z_95 * error(e));
    TraceCurve {
        kind: CurveKind::Estimate,
        method,
        level: 0,
        times_s: times_s.to_vec(),
        values: estimates
            .iter()
            .map(|e| {
                if shown == PlottedPart::Value {
                    value(e)
                } else {
                    error(e)
                }
            })
            .collect(),
        band: if shown == PlottedPart::Value {
            estimates.iter().map(edges).collect()
        } else {
            Vec::new()
        },
    }
}

fn batch_curve(
    method: usize,
    (from_s, to_s): (f64, f64),
    estimate: Estimate,
    shown: PlottedPart,
) -> Option<TraceCurve> {
    let level = match shown {
        PlottedPart::Value => estimate.value,
        PlottedPart::Error => estimate.standard_error?,
    };
    Some(TraceCurve {
        kind: CurveKind::Batch,
        method,
        level: 0,
        times_s: vec![from_s, to_s],
        values: vec![level; 2],
        band: Vec::new(),
    })
}

fn truth_curve(record: &Record, values: Vec<f64>) -> TraceCurve {
    TraceCurve {
        kind: CurveKind::Truth,
        method: 0,
        level: 0,
        times_s: record.times_s(),
        values,
        band: Vec::new(),
    }
}

/// Symbol, for the legend, of a quantity that changed, with its subscript.
fn legend_symbol(name: &str) -> &str {
    match name {
        "K_e_dot" => "K_\u{117}",
        "omega_nm" => "\u{3c9}_{nm}",
        "zeta_nm" => "\u{3b6}_{nm}",
        "tau_e" => "\u{3c4}_e",
        "K_f" => "K_f",
        "K_f_dot" => "K_\u{1e1f}",
        "tau_f" => "\u{3c4}_f",
        other => other,
    }
}

/// Combines the panels with the legend, the shaded spans of the start fits and the times from which the estimates are
/// updated.
fn grid(traces: &[EvaluatedTrace<'_>], record: &Record, panels: Vec<TracePanel>) -> TraceGrid {
    let mut shaded_s: Vec<(f64, f64)> = Vec::new();
    let mut marks_s: Vec<f64> = Vec::new();
    for trace in traces.iter().map(|t| t.section.trace) {
        if let (StartSource::Span(span), true) = (&trace.options().start, trace.start().is_some()) {
            let start_s = record.time_s(0);
            let third = start_s + record.len() as f64 * record.sample_time().s() / 3.0;
            let span = span.unwrap_or((start_s, third));
            if !shaded_s.contains(&span) {
                shaded_s.push(span);
            }
        }
        let from = trace.updated_from_s();
        if from > record.time_s(0) && !marks_s.contains(&from) {
            marks_s.push(from);
        }
    }
    let mut changes: Vec<(f64, String)> = Vec::new();
    for (t, change) in traces.iter().flat_map(|t| t.section.trace.changes()) {
        let what = change.changed_quantities();
        let what: Vec<&str> = what.into_iter().map(legend_symbol).collect();
        let what = if what.is_empty() { vec!["the response"] } else { what };
        changes.push((*t, what.join(", ")));
    }
    changes.sort_by(|a, b| a.0.total_cmp(&b.0));
    TraceGrid {
        changes,
        panels,
        columns: 1,
        methods: traces.iter().map(|t| t.section.name.clone()).collect(),
        shaded_spans_s: shaded_s,
        marks_s,
        ..TraceGrid::default()
    }
}

/// Panels of the response and the loop: gain and phase at the frequencies of the traces, crossover and phase margin
/// with the controlled element, and the level of the remnant. `None` if neither frequencies nor a controlled element
/// were given.
pub fn response_grid(traces: &[EvaluatedTrace<'_>], record: &Record) -> Option<TraceGrid> {
    let mut panels = Vec::new();
    let mut add = |name: String, unit: &str, of: &dyn Fn(&Trace, usize) -> Option<Estimate>| {
        let curves: Vec<TraceCurve> = (traces.iter().enumerate())
            .map(|(method, t)| {
                let trace = t.section.trace;
                let estimates: Vec<Option<Estimate>> = (0..trace.len()).map(|row| of(trace, row)).collect();
                curve(method, trace.times_s(), &estimates, PlottedPart::Value)
            })
            .collect();
        panels.push(TracePanel {
            name,
            unit: unit.to_owned(),
            curves,
            ordinate: Ordinate::Robust,
        });
    };
    let mut frequencies: Vec<f64> = Vec::new();
    for omega in traces.iter().flat_map(|t| &t.section.trace.options().at_rad_s) {
        if !frequencies.contains(omega) {
            frequencies.push(*omega);
        }
    }
    for omega in &frequencies {
        let response = |trace: &Trace, row: usize| {
            let index = trace.options().at_rad_s.iter().position(|w| w == omega)?;
            trace.response(row, index)
        };
        add(format!("|H({omega})|"), "dB", &|trace, row| {
            Some(response(trace, row)?.gain_db())
        });
        add(format!("\u{2220}H({omega})"), "deg", &|trace, row| {
            Some(response(trace, row)?.phase_deg())
        });
    }
    if traces.iter().any(|t| t.section.trace.options().further.is_some()) {
        for omega in &frequencies {
            add(format!("|F({omega})|"), "dB", &|trace, row| {
                Some(trace.further_response(row, *omega)?.gain_db())
            });
            add(format!("\u{2220}F({omega})"), "deg", &|trace, row| {
                Some(trace.further_response(row, *omega)?.phase_deg())
            });
        }
    }
    let with_element = traces
        .iter()
        .any(|t| t.section.trace.options().controlled_element.is_some());
    if with_element {
        add("\u{3c9}_c".to_owned(), "rad/s", &|trace, row| {
            Some(trace.open_loop(row)?.ok()?.crossover_rad_s)
        });
        add("\u{3c6}_m".to_owned(), "deg", &|trace, row| {
            Some(trace.open_loop(row)?.ok()?.phase_margin_deg)
        });
    }
    if panels.is_empty() {
        return None;
    }
    panels.push(remnant_panel(traces, record));
    Some(grid(traces, record, panels))
}

/// Panel of the tracked standard deviation of the innovations.
fn remnant_panel(traces: &[EvaluatedTrace<'_>], record: &Record) -> TracePanel {
    let level = |(method, t): (usize, &EvaluatedTrace<'_>)| TraceCurve {
        kind: CurveKind::Estimate,
        method,
        level: 0,
        times_s: t.section.trace.times_s().to_vec(),
        values: innovation_standard_deviations(t),
        band: Vec::new(),
    };
    TracePanel {
        name: "\u{3c3}_\u{3b5}".to_owned(),
        unit: record.output_channel().unit.clone(),
        curves: traces.iter().enumerate().map(level).collect(),
        ordinate: Ordinate::Robust,
    }
}

/// Standard deviation of the innovation in each row.
fn innovation_standard_deviations(t: &EvaluatedTrace<'_>) -> Vec<f64> {
    let variances = t.section.trace.innovation_variance().iter();
    variances.map(|v| if *v >= 0.0 { v.sqrt() } else { f64::NAN }).collect()
}

/// The parameters of the operator over time, one panel for each.
pub fn operator_grid(traces: &[EvaluatedTrace<'_>], record: &Record) -> TraceGrid {
    let mut panels = operator_panels(traces, record, PlottedPart::Value);
    panels.extend(further_input_panels(traces));
    grid(traces, record, panels)
}

fn operator_panels(traces: &[EvaluatedTrace<'_>], record: &Record, shown: PlottedPart) -> Vec<TracePanel> {
    let gain = GainUnit::of(record);
    let panel = |name: &'static str| {
        let mut curves = Vec::new();
        for (method, t) in traces.iter().enumerate() {
            let estimate = |o: &Result<OperatorEstimate, _>| o.as_ref().ok().and_then(|o| operator_estimate(o, name));
            let estimates: Vec<Option<Estimate>> = t.operators.iter().map(estimate).collect();
            curves.push(curve(method, t.section.trace.times_s(), &estimates, shown));
        }
        for (method, t) in traces.iter().enumerate() {
            for line in &t.section.batch {
                let estimate = line.fit.operator().ok().and_then(|o| operator_estimate(&o, name));
                curves.extend(estimate.and_then(|e| batch_curve(method, (line.from_s, line.to_s), e, shown)));
            }
        }
        if let (PlottedPart::Value, Some(values)) = (shown, record.channel(name)) {
            curves.push(truth_curve(record, values.to_vec()));
        }
        TracePanel {
            name: name.to_owned(),
            unit: gain.unit(name, unit(name)),
            curves,
            ordinate: ordinate(shown),
        }
    };
    operator_names(traces).into_iter().map(panel).collect()
}

/// One panel for each parameter of the response to a further input; none if no method estimates them.
fn further_input_panels(traces: &[EvaluatedTrace<'_>]) -> Vec<TracePanel> {
    let operators: Vec<Vec<Option<FurtherOperator>>> = traces
        .iter()
        .map(|t| {
            (0..t.section.trace.len())
                .map(|row| t.section.trace.further_operator(row))
                .collect()
        })
        .collect();
    if operators.iter().flatten().all(Option::is_none) {
        return Vec::new();
    }
    let panel = |(i, name): (usize, &str)| {
        let curve = |(method, t): (usize, &EvaluatedTrace<'_>)| {
            let of = |found: &Option<FurtherOperator>| found.map(|found| found.parameters()[i]);
            let estimates: Vec<Option<Estimate>> = operators[method].iter().map(of).collect();
            curve(method, t.section.trace.times_s(), &estimates, PlottedPart::Value)
        };
        TracePanel {
            name: name.to_owned(),
            unit: unit(name).to_owned(),
            curves: traces.iter().enumerate().map(curve).collect(),
            ordinate: Ordinate::Robust,
        }
    };
    FurtherOperator::NAMES.into_iter().enumerate().map(panel).collect()
}

fn ordinate(shown: PlottedPart) -> Ordinate {
    match shown {
        PlottedPart::Value => Ordinate::Robust,
        PlottedPart::Error => Ordinate::Logarithmic,
    }
}

/// The coefficients over time, one panel for each. If some methods have the poles in A and others in F, the
/// coefficients of the poles share panels.
pub fn coefficient_grid(traces: &[EvaluatedTrace<'_>], record: &Record) -> TraceGrid {
    grid(traces, record, coefficient_panels(traces, record, PlottedPart::Value))
}

/// Standard errors over time: of the parameters of the operator if all methods estimate these, otherwise of the
/// coefficients.
pub fn error_grid(traces: &[EvaluatedTrace<'_>], record: &Record) -> TraceGrid {
    let panels = if all_are_physical(traces) {
        operator_panels(traces, record, PlottedPart::Error)
    } else {
        coefficient_panels(traces, record, PlottedPart::Error)
    };
    grid(traces, record, panels)
}

/// True if all methods estimate the parameters of the operator.
pub fn all_are_physical(traces: &[EvaluatedTrace<'_>]) -> bool {
    traces.iter().all(|t| t.section.trace.options().method.is_physical())
}

fn coefficient_panels(traces: &[EvaluatedTrace<'_>], record: &Record, shown: PlottedPart) -> Vec<TracePanel> {
    let all: Vec<_> = traces.iter().map(|t| t.section.trace).collect();
    let joined = must_join_poles(&all);
    let mut curves: BTreeMap<Coefficient, [Vec<TraceCurve>; 3]> = BTreeMap::new();
    for (method, t) in traces.iter().enumerate() {
        let trace = t.section.trace;
        let rows: Vec<Vec<Estimate>> = (0..trace.len()).map(|row| trace.parameters(row)).collect();
        for (i, coefficient) in trace_coefficients(trace).into_iter().enumerate() {
            let estimates: Vec<Option<Estimate>> = rows.iter().map(|r| r.get(i).copied()).collect();
            let [estimated, ..] = curves.entry(coefficient.panel_coefficient(joined)).or_default();
            estimated.push(curve(method, trace.times_s(), &estimates, shown));
        }
        for line in &t.section.batch {
            for (coefficient, (_, estimate)) in fit_coefficients(line.fit).into_iter().zip(line.fit.parameters()) {
                // A coefficient that occurs in no trace has no panel.
                if let Some([_, batch, _]) = curves.get_mut(&coefficient.panel_coefficient(joined)) {
                    batch.extend(batch_curve(method, (line.from_s, line.to_s), estimate, shown));
                }
            }
        }
        if shown == PlottedPart::Value {
            for (coefficient, values) in truth::coefficients(record, trace) {
                let [.., known] = curves.entry(coefficient.panel_coefficient(joined)).or_default();
                let curve = truth_curve(record, values);
                if known.is_empty() {
                    known.push(curve);
                }
            }
        }
    }
    let panel = |(coefficient, parts): (Coefficient, [Vec<TraceCurve>; 3])| TracePanel {
        name: coefficient.panel_name(joined),
        unit: String::new(),
        curves: parts.into_iter().flatten().collect(),
        ordinate: ordinate(shown),
    };
    curves.into_iter().map(panel).collect()
}

/// Innovations over time, with bounds of two standard deviations on either side; one panel for each method.
pub fn innovation_grid(traces: &[EvaluatedTrace<'_>], record: &Record) -> TraceGrid {
    let panel = |(method, t): (usize, &EvaluatedTrace<'_>)| {
        let trace = t.section.trace;
        let sigma = innovation_standard_deviations(t);
        let typical = finite_quantile(&sigma, 0.9).unwrap_or(0.0);
        let sizes: Vec<f64> = trace.innovation().iter().map(|e| e.abs()).collect();
        let reach = (4.0 * typical).max(finite_quantile(&sizes, 0.99).unwrap_or(0.0));
        let line = |kind, values: Vec<f64>| TraceCurve {
            kind,
            method,
            level: 0,
            times_s: trace.times_s().to_vec(),
            values,
            band: Vec::new(),
        };
        TracePanel {
            name: "\u{3b5}".to_owned(),
            unit: record.output_channel().unit.clone(),
            curves: vec![
                line(CurveKind::Estimate, trace.innovation().to_vec()),
                line(CurveKind::Bound, sigma.iter().map(|s| 2.0 * s).collect()),
                line(CurveKind::Bound, sigma.iter().map(|s| -2.0 * s).collect()),
            ],
            ordinate: Ordinate::Within(-reach, reach),
        }
    };
    let panels = traces.iter().enumerate().map(panel).collect();
    grid(traces, record, panels)
}

/// Number of shortened steps over time; `None` if no step was shortened.
pub fn shortened_step_grid(traces: &[EvaluatedTrace<'_>], record: &Record) -> Option<TraceGrid> {
    let most = traces.iter().map(|t| t.section.trace.counts().shortened).max()?;
    if most == 0 {
        return None;
    }
    let curve = |(method, t): (usize, &EvaluatedTrace<'_>)| TraceCurve {
        kind: CurveKind::Steps,
        method,
        level: 0,
        times_s: t.section.trace.times_s().to_vec(),
        values: t.section.trace.steps_shortened().iter().map(|s| *s as f64).collect(),
        band: Vec::new(),
    };
    let panel = TracePanel {
        name: "steps".to_owned(),
        unit: "-".to_owned(),
        curves: traces.iter().enumerate().map(curve).collect(),
        ordinate: Ordinate::Within(0.0, most as f64),
    };
    Some(grid(traces, record, vec![panel]))
}
