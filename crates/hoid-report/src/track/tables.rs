//! The tables on a page about recursive estimates, as template values.

use std::mem::{Discriminant, discriminant};

use hoid_model::{NotConvertible, Record, uncertainty::Estimate};
use hoid_numerics::statistics::mean;
use hoid_track::Change;
use minijinja::{Value, context};

use super::{
    coefficients::{Coefficient, fit_coefficients, trace_coefficients},
    evaluated_trace::{EvaluatedTrace, operator_estimate, operator_names},
    section::BatchLine,
    truth,
};
use crate::{
    cells::{cell, html, symbol},
    numbers::{DASH, format_fixed, format_plain},
};

/// Time (in s) from which errors are evaluated; it excludes the initial transient of a recursion.
const ERROR_START_S: f64 = 10.0;

/// Returns one row per method: its description, its forgetting and its start.
pub fn methods(traces: &[EvaluatedTrace<'_>], record: &Record) -> Vec<Value> {
    let row = |t: &EvaluatedTrace<'_>| {
        let trace = t.section.trace;
        let options = trace.options();
        let model = match options.method.track_delay_s() {
            Some((from, to)) => format!(
                "{}({}), tau_e tracked from {} to {} s",
                options.structure.label(),
                options.orders,
                format_plain(from),
                format_plain(to)
            ),
            None => format!("{}({})", options.structure.label(), options.orders),
        };
        let average = match trace.averaging_rows() {
            1 => DASH.to_owned(),
            n => format!("{n} rows, delayed by {} s", format_plain(trace.averaging_delay_s())),
        };
        context! {
            name => t.section.name.clone(), method => options.method.name(), model, average,
            forgetting => options.memory_as_text(record.sample_time()),
            start => options.start_as_text(),
            moves_from => format!("{} s", format_plain(trace.updated_from_s().max(record.time_s(0)))),
        }
    };
    traces.iter().map(row).collect()
}

/// Returns one row per method: the numbers of samples used and skipped, of shortened steps, and of rows that cannot be
/// converted to an operator.
pub fn sample_count_rows(traces: &[EvaluatedTrace<'_>]) -> Vec<Value> {
    let row = |t: &EvaluatedTrace<'_>| {
        let trace = t.section.trace;
        let counts = trace.counts();
        let reasons: Vec<String> = reasons(t)
            .into_iter()
            .map(|r| format!("{} from {} s on: {}", r.rows, format_fixed(r.first_s, 2), r.text))
            .collect();
        let outside = outlier_share(t);
        context! {
            name => t.section.name.clone(), rows => trace.len(), samples => counts.samples,
            skipped => counts.skipped, shortened => counts.shortened,
            outside => outside.map_or(DASH.to_owned(), |share| format_fixed(100.0 * share, 1)),
            not_convertible => t.operators.iter().filter(|o| o.is_err()).count(),
            reasons,
        }
    };
    traces.iter().map(row).collect()
}

/// One row per declared change.
pub fn changes(trace: &EvaluatedTrace<'_>) -> Vec<Value> {
    let pair = |[before, after]: [f64; 2], digits| {
        format!("{} → {}", format_fixed(before, digits), format_fixed(after, digits))
    };
    let row = |(t, c): &(f64, Change)| {
        let changed = c.changed_quantities();
        context! {
            declared => format_fixed(*t, 2),
            since => format_fixed(t - c.seconds_ago, 2),
            odds => format_fixed(c.odds, 1),
            what => if changed.is_empty() { Value::from(DASH) } else { symbol_of(&changed.join(", ")) },
            k_e => pair(c.k_e.map(|e| e.value), 4),
            k_e_dot => pair(c.k_e_dot.map(|e| e.value), 4),
            t_l => pair(c.t_l_s, 3),
            remnant => format_fixed((c.innovation_variance[1] / c.innovation_variance[0]).sqrt(), 2),
        }
    };
    trace.section.trace.changes().iter().map(row).collect()
}

/// A reason why rows cannot be converted to an operator.
struct ConversionFailure {
    rows: usize,
    first_s: f64,
    text: String,
}

/// The reasons, with the most frequent first. Reasons that differ only in their numbers are combined under the text of
/// the first of these reasons.
fn reasons(trace: &EvaluatedTrace<'_>) -> Vec<ConversionFailure> {
    // Rows before the first estimate have the kind `None`.
    let mut found: Vec<(Option<Discriminant<NotConvertible>>, ConversionFailure)> = Vec::new();
    let of = trace.section.trace;
    let rows = of.times_s().iter().zip(&trace.operators).enumerate();
    for (row, first_s, reason) in rows.filter_map(|(row, (t, o))| Some((row, *t, o.as_ref().err()?))) {
        let kind = (!of.is_before_first_estimate(row)).then(|| discriminant(reason));
        match found.iter_mut().find(|f| f.0 == kind) {
            Some((_, known)) => known.rows += 1,
            None => {
                let text = kind.map_or_else(|| "there is no estimate yet".to_owned(), |_| reason.to_string());
                found.push((kind, ConversionFailure { rows: 1, first_s, text }));
            }
        }
    }
    let mut reasons: Vec<ConversionFailure> = found.into_iter().map(|f| f.1).collect();
    // The sort is stable: reasons with equal counts stay in chronological order.
    reasons.sort_by_key(|r| std::cmp::Reverse(r.rows));
    reasons
}

/// Share of the innovations larger than twice their standard deviation, counted from the first update of the estimate.
fn outlier_share(trace: &EvaluatedTrace<'_>) -> Option<f64> {
    let trace = trace.section.trace;
    let rows = trace
        .times_s()
        .iter()
        .zip(trace.innovation())
        .zip(trace.innovation_variance());
    let moving: Vec<bool> = rows
        .filter(|((t, e), v)| **t >= trace.updated_from_s() && e.is_finite() && **v > 0.0)
        .map(|((_, e), v)| e * e > 4.0 * v)
        .collect();
    (!moving.is_empty()).then(|| moving.iter().filter(|m| **m).count() as f64 / moving.len() as f64)
}

/// RMS relative errors in %, one row per parameter of the operator and one column per method; `None` without true
/// values.
pub fn errors(traces: &[EvaluatedTrace<'_>], record: &Record) -> Option<Value> {
    let last_s = record.time_s(record.len() - 1);
    let from_s = if last_s > ERROR_START_S {
        ERROR_START_S
    } else {
        record.time_s(0)
    };
    let rows: Vec<Value> = operator_names(traces)
        .into_iter()
        .filter(|name| record.channel(name).is_some())
        .map(|name| {
            let (label, _) = symbol(name);
            let cells: Vec<String> = traces
                .iter()
                .map(|t| relative_error(t, record, name, from_s).map_or(DASH.to_owned(), percent))
                .collect();
            context! { label, cells }
        })
        .collect();
    let left_out: Vec<String> = traces
        .iter()
        .filter_map(|t| {
            let times = t.section.trace.times_s().iter().zip(&t.operators);
            let rows: Vec<bool> = times
                .filter(|(time, _)| **time >= from_s)
                .map(|(_, o)| o.is_err())
                .collect();
            let missing = rows.iter().filter(|r| **r).count();
            (missing > 0).then(|| format!("{}: {missing} of {}", t.section.name, rows.len()))
        })
        .collect();
    (!rows.is_empty()).then(|| context! { rows, from_s => format_plain(from_s), left_out => left_out.join("; ") })
}

fn relative_error(trace: &EvaluatedTrace<'_>, record: &Record, name: &str, from_s: f64) -> Option<f64> {
    let times = trace.section.trace.times_s().iter().zip(&trace.operators);
    let squares: Vec<f64> = times
        .filter(|(t, _)| **t >= from_s)
        .filter_map(|(t, o)| {
            let estimate = operator_estimate(o.as_ref().ok()?, name)?;
            let relative = estimate.value / truth::parameter(record, name, *t)? - 1.0;
            relative.is_finite().then_some(relative * relative)
        })
        .collect();
    (!squares.is_empty()).then(|| mean(&squares).sqrt())
}

fn percent(share: f64) -> String {
    let value = 100.0 * share;
    match value {
        v if v < 1e4 => format_fixed(v, if v < 100.0 { 1 } else { 0 }),
        _ => format!("{value:.1e}"),
    }
}

/// Returns one row per batch fit of a method: the recursive estimate at the end of the span, the fit, and the true
/// value.
pub fn batch_rows(trace: &EvaluatedTrace<'_>, record: &Record) -> Vec<Value> {
    trace
        .section
        .batch
        .iter()
        .map(|line| batch_row(trace, record, line))
        .collect()
}

fn batch_row(trace: &EvaluatedTrace<'_>, record: &Record, line: &BatchLine<'_>) -> Value {
    let times = trace.section.trace.times_s();
    // The last sample of a span lies before the end of the span, up to rounding errors.
    let end = line.to_s - 0.5 * record.sample_time().s();
    let span = format!("[{}, {}] s", format_plain(line.from_s), format_plain(line.to_s));
    let Some(row) = times.partition_point(|t| *t < end).checked_sub(1) else {
        return context! { span, reason => "the trace starts later" };
    };
    let at_s = times[row];
    let (now, fit) = (&trace.operators[row], line.fit.operator());
    let mut rows = Vec::new();
    for name in operator_names(std::slice::from_ref(trace)) {
        let (label, unit) = symbol(name);
        let of = |o: Option<Estimate>| o.map_or(Value::from(DASH), cell);
        rows.push(context! {
            label, unit,
            recursive => of(now.as_ref().ok().and_then(|o| operator_estimate(o, name))),
            batch => of(fit.as_ref().ok().and_then(|o| operator_estimate(o, name))),
            truth => truth::parameter(record, name, at_s).map(format_plain),
        });
    }
    let fitted: Vec<(Coefficient, Estimate)> = fit_coefficients(line.fit)
        .into_iter()
        .zip(line.fit.parameters().into_iter().map(|p| p.1))
        .collect();
    let known = truth::coefficients(record, trace.section.trace);
    let estimates = trace.section.trace.parameters(row);
    for (coefficient, estimate) in trace_coefficients(trace.section.trace).into_iter().zip(estimates) {
        let batch = fitted.iter().find(|f| f.0 == coefficient).map(|f| f.1);
        let values = known.iter().find(|k| k.0 == coefficient).map(|k| &k.1);
        let truth = values
            .zip(truth::sample_index(record, at_s))
            .map(|(v, k)| format_plain(v[k]));
        rows.push(context! {
            label => symbol_of(&coefficient.panel_name(false)), unit => "",
            recursive => cell(estimate), batch => batch.map_or(Value::from(DASH), cell), truth,
        });
    }
    let mut remarks = Vec::new();
    if let Err(reason) = now {
        remarks.push(format!("recursive estimate not convertible: {reason}"));
    }
    if let Err(reason) = fit {
        remarks.push(format!("batch fit not convertible: {reason}"));
    }
    context! { span, at => format!("{} s", format_fixed(at_s, 2)), rows, remarks, has_truth => record.channel("K_e").is_some() }
}

/// HTML symbol of a parameter or coefficient, or of several separated by commas.
pub fn symbol_of(name: &str) -> Value {
    let one = |name: &str| match Coefficient::parse(name) {
        Some(c) => format!("<i>{}</i><sub>{}</sub>", c.letter, c.index),
        None => symbol(name).0.to_string(),
    };
    html(name.split(", ").map(one).collect::<Vec<_>>().join(", "))
}
