//! Text output for a trace.

use hoid::analysis::TrackingResult;
use hoid::model::numbers::count_with_noun;
use hoid::model::{GainUnit, uncertainty::Estimate};
use hoid::report::numbers;
use hoid::track::{FURTHER_RESPONSES_RAD_S, FurtherOperator, Response, operator_parameter};

use crate::{error::CliError, text};

/// Number of rows of the trace that are printed.
const ROWS_SHOWN: usize = 8;

/// Number of coefficients printed if there is no operator.
const COEFFICIENTS_SHOWN: usize = 6;

/// Returns a summary of a trace; `verbose` adds details.
///
/// # Errors
/// Errors in evaluating the quality of the start fit.
pub fn page(tracked: &TrackingResult, out: Option<&str>, verbose: bool) -> Result<String, CliError> {
    let mut page = text::verdict(&tracked.verdict);
    page.push_str(&estimate_table(tracked));
    page.push_str(&further_response_table(tracked));
    let errors = tracked.relative_errors();
    if !errors.is_empty() {
        let each: Vec<String> = errors
            .iter()
            .map(|(name, e)| format!("{name} {:.1} %", 100.0 * e))
            .collect();
        page.push_str(&format!(
            "RMS relative error, compared with the true values in the record, from {:.2} s on: {}.\n",
            tracked.trace.times_s()[tracked.first_updated_row()],
            each.join(", ")
        ));
    }
    page.push_str(&crossover_text(tracked));
    page.push_str(&change_list(tracked));
    page.push_str(&count_text(tracked));
    if let Some(choice) = &tracked.choice {
        page.push_str(&text::delay(choice));
    }
    page.push_str(&covariance_text(tracked));
    page.push_str(&text::records(
        &tracked.data.names,
        &tracked.data.records,
        &tracked.data.accounts,
        verbose,
    ));
    match out {
        Some(out) => page.push_str(&format!("Trace: {out}\n")),
        None => page.push_str("To write every row with its standard errors, use --out TRACE.csv\n"),
    }
    if verbose {
        page.push_str(&details(tracked)?);
    } else {
        page.push_str(text::MORE_HINT);
    }
    Ok(page)
}

/// Returns the candidates tried, the start fit and the settings.
fn details(tracked: &TrackingResult) -> Result<String, CliError> {
    let mut page = String::new();
    if let Some(choice) = &tracked.choice {
        page.push('\n');
        page.push_str(&text::candidates(choice));
    }
    if let (Some(fit), Some(span)) = (tracked.trace.start(), &tracked.span) {
        let q = fit.quality(std::slice::from_ref(span))?;
        page.push_str(&format!(
            "\nStart: batch fit of {:.2} to {:.2} s, {}; VAF simulation {:.2} %, prediction {:.2} %.\n",
            span.time_s(0),
            span.time_s(span.len()),
            fit.title(),
            q.vaf_simulation,
            q.vaf_prediction
        ));
    }
    page.push_str(&text::settings(&tracked.settings));
    Ok(page)
}

/// Returns the start covariances tried on a second run, if a second run was given.
fn covariance_text(tracked: &TrackingResult) -> String {
    let Some((file, choice)) = tracked.chosen_covariance() else {
        return String::new();
    };
    let mut rows = text::table(&["P0", "VAF in %", ""]);
    for (p, vaf) in &choice.candidates {
        let taken = if *p == choice.covariance { "chosen" } else { "" };
        rows.add_row(vec![format!("{p} I"), format!("{vaf:.2}"), taken.to_owned()]);
    }
    format!(
        "\nStart covariance, chosen by the VAF of the trace on {file} ({:.2} to {:.2} s):\n{rows}\n",
        choice.span_s.0, choice.span_s.1
    )
}

/// Returns the rows that are printed, evenly spaced over the rows in which the estimate is updated.
fn printed_rows(tracked: &TrackingResult) -> Vec<usize> {
    let Some(last) = tracked.trace.len().checked_sub(1) else {
        return Vec::new();
    };
    let first = tracked.first_updated_row();
    let shown = ROWS_SHOWN.min(last - first + 1);
    let mut picked: Vec<usize> = (0..shown)
        .map(|i| first + (last - first) * i / (shown - 1).max(1))
        .collect();
    picked.dedup();
    picked
}

/// Returns a table of the estimate at a few times.
fn estimate_table(tracked: &TrackingResult) -> String {
    let trace = &tracked.trace;
    if trace.is_empty() {
        return String::new();
    }
    let with_operator = tracked.has_operator();
    let gain = GainUnit::of(tracked.record());
    let units = ["", "s", "s", "rad/s", "", "s"];
    let suppose = tracked.trace.options().method.is_self_starting();
    let mut has_undetermined = false;
    let mut header = vec!["t in s".to_owned()];
    if with_operator {
        let named = tracked.trace.operator_columns().into_iter().zip(units);
        header.extend(named.map(|(n, u)| match gain.unit(n, u) {
            unit if unit.is_empty() => n.to_owned(),
            unit => format!("{n} ({unit})"),
        }));
    } else {
        header.extend(trace.parameter_names().into_iter().take(COEFFICIENTS_SHOWN));
    }
    let mut rows = text::table(&header.iter().map(String::as_str).collect::<Vec<_>>()).into_time_series();
    for row in printed_rows(tracked) {
        let mut cells = vec![format!("{:.2}", trace.times_s()[row])];
        if with_operator {
            let of = |name| operator_parameter(&tracked.operators[row], name);
            let determined = tracked.operators[row].as_ref().map(|o| trace.determinations(o));
            let determined = determined.unwrap_or_default();
            cells.extend(tracked.trace.operator_columns().into_iter().map(|n| {
                let open = suppose && determined.iter().any(|(name, yes)| *name == n && !yes);
                match open {
                    true => in_parentheses(&plus_minus(of(n)), &mut has_undetermined),
                    false => plus_minus(of(n)),
                }
            }));
        } else {
            let all = trace.parameters(row);
            cells.extend(all.into_iter().take(COEFFICIENTS_SHOWN).map(|e| plus_minus(Some(e))));
        }
        rows.add_row(cells);
    }
    format!(
        "Estimate by {} with one standard error; the trace has all {} rows.\n{rows}\n{}",
        trace.options().method.name(),
        trace.len(),
        undetermined_legend(has_undetermined)
    )
}

/// Returns an undetermined value in parentheses, and sets the flag that they need a legend.
fn in_parentheses(value: &str, has_undetermined: &mut bool) -> String {
    *has_undetermined = true;
    format!("({value})")
}

fn undetermined_legend(has_undetermined: bool) -> &'static str {
    match has_undetermined {
        true => "In parentheses: not determined by the data so far.\n",
        false => "",
    }
}

/// Returns the response to the further input at a few times; empty for a model with one input.
fn further_response_table(tracked: &TrackingResult) -> String {
    let trace = &tracked.trace;
    let Some(further) = &trace.options().further else {
        return String::new();
    };
    let at = match trace.options().at_rad_s.as_slice() {
        [] => &FURTHER_RESPONSES_RAD_S,
        given => given,
    };
    let mut header = vec!["t in s".to_owned()];
    let mut has_undetermined = false;
    let has_parameters = (0..trace.len()).any(|row| trace.further_operator(row).is_some());
    if has_parameters {
        let [k_f, k_f_dot, tau_f] = FurtherOperator::NAMES;
        header.extend([k_f.to_owned(), k_f_dot.to_owned(), format!("{tau_f} (s)")]);
    }
    header.extend(
        at.iter()
            .flat_map(|omega| [format!("dB at {omega} rad/s"), format!("deg at {omega} rad/s")]),
    );
    let mut rows = text::table(&header.iter().map(String::as_str).collect::<Vec<_>>()).into_time_series();
    for row in printed_rows(tracked) {
        let mut cells = vec![format!("{:.2}", trace.times_s()[row])];
        if has_parameters {
            let found = trace.further_operator(row);
            let determined = found.map(|operator| trace.further_determinations(&operator));
            cells.extend((0..FurtherOperator::NAMES.len()).map(|i| {
                let estimate = plus_minus(found.map(|operator| operator.parameters()[i]));
                match determined.is_some_and(|determined| !determined[i]) {
                    true => in_parentheses(&estimate, &mut has_undetermined),
                    false => estimate,
                }
            }));
        }
        for omega in at {
            let found = trace.further_response(row, *omega);
            cells.push(plus_minus(found.as_ref().map(Response::gain_db)));
            cells.push(plus_minus(found.as_ref().map(Response::phase_deg)));
        }
        rows.add_row(cells);
    }
    format!(
        "Response to {}.\n{rows}\n{}",
        further.channel,
        undetermined_legend(has_undetermined)
    )
}

/// Returns the crossover and phase margin at the end of the trace; empty without a controlled element.
fn crossover_text(tracked: &TrackingResult) -> String {
    let (Some(row), Some((rows, reason))) = (tracked.trace.len().checked_sub(1), tracked.rows_without_crossover())
    else {
        return String::new();
    };
    let mut words = match tracked.trace.open_loop(row) {
        Some(Ok(found)) => {
            format!(
                "Open loop at {:.2} s: crossover {} rad/s, phase margin {} deg.\n",
                tracked.trace.times_s()[row],
                text::plus_minus(&found.crossover_rad_s),
                text::plus_minus(&found.phase_margin_deg)
            ) + &tracked
                .trace
                .loop_shape()
                .map_or_else(String::new, |shape| text::loop_shape(shape, false))
        }
        _ => String::new(),
    };
    if let Some(reason) = reason {
        words.push_str(&format!(
            "{rows} of {} rows have no crossover, mostly because {}.\n",
            tracked.trace.len(),
            reason.as_text()
        ));
    }
    words
}

/// Returns the list of the declared changes.
fn change_list(tracked: &TrackingResult) -> String {
    let trace = &tracked.trace;
    if trace.change_odds().is_empty() {
        return String::new();
    }
    if trace.changes().is_empty() {
        return "No change was declared.\n".to_owned();
    }
    let mut lines = String::new();
    for (t, c) in trace.changes() {
        let changed = c.changed_quantities();
        lines.push_str(&format!(
            "Change at {:.2} s, declared at {t:.2} s: {}; log odds {:.1}.\n",
            t - c.seconds_ago,
            if changed.is_empty() {
                "no single quantity changed by more than two standard errors".to_owned()
            } else {
                changed.join(", ")
            },
            c.odds
        ));
    }
    lines
}

fn count_text(tracked: &TrackingResult) -> String {
    let c = tracked.trace.counts();
    let mut text = format!(
        "{} samples; {} skipped for a fault in e or u; {} shortened to stay stable or within bounds.\n",
        c.samples,
        c.skipped,
        count_with_noun(c.shortened, "step")
    );
    if c.held > 0 || c.restarts > 0 {
        text.push_str(&format!(
            "{} held back by the guard; the estimate was restarted {}.\n",
            count_with_noun(c.held, "sample"),
            count_with_noun(c.restarts, "time")
        ));
    }
    if tracked.has_operator() {
        let none = tracked.unconverted_rows();
        text.push_str(&format!(
            "{} of {} rows have no operator",
            none.rows,
            tracked.trace.len()
        ));
        text.push_str(&match none.reason {
            Some(reason) => format!(", mostly because {reason}.\n"),
            None => ".\n".to_owned(),
        });
    }
    text
}

fn plus_minus(e: Option<Estimate>) -> String {
    e.map_or_else(|| numbers::DASH.to_owned(), |e| text::plus_minus(&e))
}
