//! `hoid info`: contents of a file, before any identification.

use std::collections::BTreeMap;

use hoid::analysis::{FileExamination, Role};
use hoid::ident::faults::repair;
use hoid::io::{ColumnSurvey, FileSurvey, SamplingSurvey, ValueSurvey};
use hoid::model::numbers::count_with_noun;
use hoid::model::{Fault, FaultHandling};
use hoid::report::numbers;
use serde_json::{Value, json};

use crate::{args::InfoArgs, error::CliError, json, output, text};

pub fn run(args: &InfoArgs) -> Result<(), CliError> {
    let look = FileExamination::at(&args.file, &args.examination.to_options())?;
    let file = args.file.display().to_string();
    let faults = find_faults(&look);
    if args.json {
        let mut object = file_survey_json(&look.survey);
        object["faults"] = faults.iter().map(|fault| json::fault(&file, &fault.into())).collect();
        object["look"] = survey_json(&look, &file);
        json::print(&object)?;
    } else {
        let mut text = survey_text(&file, &look.survey);
        if !faults.is_empty() {
            text.push_str("\nFaults of e and u:\n");
        }
        for fault in &faults {
            text.push_str(&format!("  {fault}\n"));
        }
        text.push_str(&layout_and_next_command(&look, &file));
        output::show(&text)?;
    }
    Ok(())
}

/// Returns the faults of e and u; empty if the file does not contain a valid record of both.
fn find_faults(look: &FileExamination) -> Vec<Fault> {
    let seen = look.summary.as_ref().ok();
    let repaired = seen.and_then(|seen| repair(&seen.record, FaultHandling::Report).ok());
    repaired.map_or_else(Vec::new, |repaired| repaired.faults)
}

/// Returns the layout of the file and the next command to use.
fn layout_and_next_command(look: &FileExamination, file: &str) -> String {
    let role = |role: &Role| format!("{} ({})", role.column, role.reason);
    let mut rows = vec![("input", role(&look.roles.input)), ("output", role(&look.roles.output))];
    // The printed table of columns already gives the units that it found.
    let has_unit = |path: &str| look.survey.columns.iter().any(|c| c.path == path && !c.unit.is_empty());
    let units: Vec<String> = look
        .units()
        .iter()
        .filter(|(column, _)| !has_unit(column))
        .map(|(column, unit)| format!("{column} in {unit}"))
        .collect();
    if !units.is_empty() {
        rows.push(("units", units.join(", ")));
    }
    match &look.summary {
        Ok(seen) => {
            let periods = seen.periods.as_ref();
            rows.push((
                "excitation",
                periods.map_or_else(String::clone, |found| found.description.clone()),
            ));
            let lag = seen.lag.as_ref().map(|lag| lag.as_ref());
            rows.extend(lag.map(|lag| ("lateness", lag.map_or_else(String::clone, |lag| lag.evidence.clone()))));
        }
        Err(reason) => rows.push(("no record", reason.to_string())),
    }
    let mut text = "\nRecord summary:\n".to_owned();
    for (name, words) in rows {
        text.push_str(&format!("  {name:10}  {words}\n"));
    }
    text.push_str(&match look.advice() {
        Some(advice) => {
            let repaired = if look.summary.is_ok() {
                ""
            } else {
                ", with the remedy above"
            };
            format!("Next{repaired}: {}\n", advice.command("identify", file))
        }
        None => {
            "Next: hoid identify with the columns of error and control: --input COLUMN --output COLUMN\n".to_owned()
        }
    });
    text
}

/// Returns the survey as a JSON object.
fn survey_json(look: &FileExamination, file: &str) -> Value {
    let role = |role: &Role| json!({"column": role.column, "why": role.reason, "certain": role.is_certain});
    let seen = look.summary.as_ref().ok();
    let excitation = match seen.map(|seen| &seen.periods) {
        Some(Ok(found)) => json!({
            "column": found.channel,
            "why": found.description,
            "period_s": json::number(found.period_s),
            "from_s": json::number(found.span_s.0),
            "to_s": json::number(found.span_s.1),
            "lines_rad_s": found.excitation.omega_rad_s(),
        }),
        Some(Err(reason)) => json!({"column": null, "why": reason}),
        None => Value::Null,
    };
    let lateness = match seen.and_then(|seen| seen.lag.as_ref()) {
        Some(Ok(lag)) => json!({"samples": lag.samples, "seconds": json::number(lag.seconds), "why": lag.evidence}),
        Some(Err(reason)) => json!({"samples": null, "seconds": null, "why": reason}),
        None => Value::Null,
    };
    json!({
        "input": role(&look.roles.input),
        "output": role(&look.roles.output),
        "units": look.units().into_iter().collect::<BTreeMap<_, _>>(),
        "excitation": excitation,
        "lateness": lateness,
        "no_record": look.summary.as_ref().err().map(ToString::to_string),
        "next": look.advice().map(|advice| advice.command("identify", file)),
    })
}

fn survey_text(file: &str, found: &FileSurvey) -> String {
    let mut text = format!("{file}: {}, {} columns\n", found.format, found.columns.len());
    for sampling in &found.samplings {
        text.push_str(&sampling_line(sampling));
    }
    // Most files give no units, and an empty column would make the table too wide for a screen.
    let has_units = found.columns.iter().any(|column| !column.unit.is_empty());
    let mut headings = vec!["column", "unit", "type", "rows", "min", "max", "mean", "deviation"];
    headings.retain(|heading| has_units || *heading != "unit");
    let mut table = text::table(&headings);
    let mut sketches = Vec::new();
    for column in &found.columns {
        let rows = if column.rows == 0 {
            String::new()
        } else {
            column.rows.to_string()
        };
        let mut cells = vec![column.path.clone()];
        if has_units {
            cells.push(column.unit.clone());
        }
        cells.extend([column.kind.clone(), rows]);
        if let Some(v) = &column.values {
            cells.extend([v.min, v.max, v.mean, v.deviation].map(numbers::format_plain));
            sketches.push((column, v));
        }
        table.add_row(cells);
    }
    text.push_str(&format!("{table}\n"));
    let width = sketches
        .iter()
        .map(|(column, _)| column.path.chars().count())
        .max()
        .unwrap_or(0);
    for (column, values) in sketches {
        let remarks = remarks(values);
        let line = format!("{:width$}  {}  {remarks}", column.path, values.sketch);
        text.push_str(&format!("{}\n", line.trim_end()));
    }
    if !found.quality_issues.is_empty() {
        text.push_str("\nProblems:\n");
    }
    for issue in &found.quality_issues {
        text.push_str(&format!("  {issue}\n    remedy: {}\n", issue.kind.remedy()));
    }
    for note in &found.notes {
        text.push_str(&format!("Note: {note}.\n"));
    }
    text
}

fn sampling_line(s: &SamplingSurvey) -> String {
    let mut line = format!(
        "{}: {} rows from {} to {} s, {:.4} Hz (sample time {:.6} s), jitter {:.2e} s",
        s.path,
        s.rows,
        numbers::format_plain(s.span_s.0),
        numbers::format_plain(s.span_s.1),
        1.0 / s.sample_time_s,
        s.sample_time_s,
        s.jitter_s
    );
    if let Some(first) = s.first_gap_s {
        line.push_str(&format!(
            ", {} ({}, the first after {first} s)",
            count_with_noun(s.gaps, "gap"),
            count_with_noun(s.missing, "sample")
        ));
    } else {
        line.push_str(", no gaps");
    }
    if s.not_increasing > 0 {
        line.push_str(&format!(
            ", t does not increase in {}",
            count_with_noun(s.not_increasing, "row")
        ));
    }
    if s.repeated > 0 {
        line.push_str(&format!(
            ", {} identical to the previous row",
            count_with_noun(s.repeated, "row")
        ));
    }
    line.push('\n');
    line
}

/// Describes suspicious values in a column.
fn remarks(v: &ValueSurvey) -> String {
    let mut remarks = Vec::new();
    if v.missing > 0 {
        remarks.push(format!("{} missing", v.missing));
    }
    if v.constant {
        remarks.push(String::from("constant"));
    }
    if let Some(quantum) = v.quantum {
        remarks.push(format!("quantised in steps of {}", numbers::format_plain(quantum)));
    }
    for (rows, end) in [(v.saturated_low, v.min), (v.saturated_high, v.max)] {
        if rows > 0 {
            let rows = count_with_noun(rows, "row");
            remarks.push(format!("saturated at {} in {rows}", numbers::format_plain(end)));
        }
    }
    remarks.join(", ")
}

fn file_survey_json(found: &FileSurvey) -> Value {
    let column = |c: &ColumnSurvey| {
        let values = c.values.as_ref().map_or(Value::Null, |v| {
            json!({
                "missing": v.missing,
                "min": json::number(v.min),
                "max": json::number(v.max),
                "mean": json::number(v.mean),
                "deviation": json::number(v.deviation),
                "constant": v.constant,
                "quantum": json::optional(v.quantum),
                "saturated_low": v.saturated_low,
                "saturated_high": v.saturated_high,
                "sketch": v.sketch,
            })
        });
        json!({"path": c.path, "unit": c.unit, "type": c.kind, "rows": c.rows, "values": values})
    };
    let sampling = |s: &SamplingSurvey| {
        json!({
            "path": s.path,
            "rows": s.rows,
            "first_s": json::number(s.span_s.0),
            "last_s": json::number(s.span_s.1),
            "sample_time": json::number(s.sample_time_s),
            "jitter_s": json::number(s.jitter_s),
            "gaps": s.gaps,
            "missing": s.missing,
            "first_gap_s": json::optional(s.first_gap_s),
            "not_increasing": s.not_increasing,
            "repeated": s.repeated,
        })
    };
    json!({
        "format": found.format,
        "samplings": found.samplings.iter().map(sampling).collect::<Vec<_>>(),
        "columns": found.columns.iter().map(column).collect::<Vec<_>>(),
        "trouble": json::list(&found.quality_issues),
        "notes": found.notes,
    })
}
