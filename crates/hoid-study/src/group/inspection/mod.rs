//! Inspection of the files of a group before the analysis ([`FileExamination`]). The results are written to the
//! manifest together with their evidence, for the user to check. Settings given by the user are kept.
//!
//! | file | contents |
//! |---|---|
//! | `evidence` | findings in the files |
//! | `first_fit` | form and order of the noise model of the first run |

mod evidence;
mod first_fit;

use std::path::Path;

use hoid_analysis::{ExaminationOptions, FileExamination, RecordSummary};

pub use evidence::Evidence;

use super::{condition_settings::ConditionSettings, manifest::Manifest};
use crate::StudyError;

/// Completes a manifest by inspecting the first run of each condition.
///
/// # Errors
/// [`StudyError::Io`] if the first file cannot be read. Properties that cannot be determined are reported in the
/// evidence.
pub fn inspect(
    manifest: &mut Manifest,
    directory: &Path,
    known: &ExaminationOptions,
) -> Result<Vec<Evidence>, StudyError> {
    let mut evidence = Vec::new();
    let first = FileExamination::at(&directory.join(&manifest.runs[0].file), known)?;
    let shown = manifest.runs[0].file.display().to_string();
    let names: Vec<&str> = first.survey.columns.iter().map(|column| column.path.as_str()).collect();
    evidence.push(Evidence::new(
        "[read]",
        "",
        format!("the columns of {shown} are {}", names.join(", ")),
    ));
    let units: Vec<String> = first
        .units()
        .iter()
        .map(|(column, unit)| format!("{column} {unit}"))
        .collect();
    evidence.push(Evidence::new(
        "[read]",
        "",
        if units.is_empty() {
            "the files state no units: gains are in units of output per unit of input".to_owned()
        } else {
            format!("units in the file: {}", units.join(", "))
        },
    ));
    let (input, output) = (first.roles.input.clone(), first.roles.output.clone());
    evidence.push(Evidence::new("[read]", "input", input.reason));
    evidence.push(Evidence::new("[read]", "output", output.reason));
    // All files are read with the columns found in the first file.
    let of_all = ExaminationOptions {
        input: Some(input.column.clone()),
        output: Some(output.column.clone()),
        ..known.clone()
    };
    (manifest.read.input, manifest.read.output) = (input.column, output.column);
    manifest.read.trial = known.trial.as_ref().map(ToString::to_string);
    manifest.read.time = known.time.as_ref().map(ToString::to_string);
    manifest.read.sampling_hz = known.sampling_hz;
    (manifest.read.from_s, manifest.read.to_s) = (known.from_s, known.to_s);
    let mut of_first = first.summary.as_ref().ok().map(|seen| seen.record.clone());
    let mut first = Some(first);

    let mut conditions: Vec<String> = Vec::new();
    for run in &manifest.runs {
        if !conditions.contains(&run.condition) {
            conditions.push(run.condition.clone());
        }
    }
    let mut spans: Vec<(f64, f64)> = Vec::new();
    for condition in &conditions {
        let Some(run) = manifest.runs.iter().find(|run| run.condition == *condition) else {
            continue;
        };
        // The first run of the manifest is also the first run of its condition.
        let look = first
            .take()
            .map_or_else(|| FileExamination::at(&directory.join(&run.file), &of_all), Ok);
        let seen = match look.and_then(|look| look.summary) {
            Ok(seen) => seen,
            Err(reason) => {
                evidence.push(Evidence::new("", "", format!("not examined: {reason}")));
                continue;
            }
        };
        let table = format!("[conditions.{}]", toml_key(condition));
        let settings = inspect_condition(&seen, condition, &table, known, &mut evidence, &mut spans);
        // A run without a condition name has no table in the manifest.
        if !condition.is_empty() && settings != ConditionSettings::default() {
            manifest.conditions.insert(condition.clone(), settings);
        }
    }
    // The span is written only if it is the same in all conditions.
    if let (None, None, Some(first)) = (known.from_s, known.to_s, spans.first())
        && spans.iter().all(|span| span == first)
    {
        (manifest.read.from_s, manifest.read.to_s) = (Some(first.0), Some(first.1));
        evidence.push(Evidence::new(
            "[read]",
            "from_s",
            "the longest span of whole periods of the excitation",
        ));
    }
    let (from_s, to_s) = (manifest.read.from_s, manifest.read.to_s);
    if (from_s, to_s) != (None, None) {
        of_first = of_first.and_then(|record| {
            let end_s = record.time_s(record.len());
            record
                .span(from_s.unwrap_or(record.time_s(0)), to_s.unwrap_or(end_s))
                .ok()
        });
    }
    if let Some(record) = of_first {
        let found = first_fit::fit_first_run(&record);
        if let Some(nd) = found.nd {
            manifest.analysis.nd = nd;
        }
        evidence.extend(found.evidence);
    }
    Ok(evidence)
}

/// Examines the first run of a condition and returns the settings found.
fn inspect_condition(
    seen: &RecordSummary,
    condition: &str,
    table: &str,
    known: &ExaminationOptions,
    evidence: &mut Vec<Evidence>,
    spans: &mut Vec<(f64, f64)>,
) -> ConditionSettings {
    let mut settings = ConditionSettings::default();
    if let Some((text, _)) = &known.controlled_element {
        settings.controlled_element = Some(text.clone());
    }
    match &seen.periods {
        Ok(found) => {
            settings.excitation = Some(found.channel.clone());
            settings.period_s = Some(found.period_s);
            spans.push(found.span_s);
            evidence.push(Evidence::new(table, "excitation", found.description.clone()));
        }
        Err(reason) => evidence.push(Evidence::new(
            if condition.is_empty() { "" } else { table },
            "",
            format!("no excitation: {reason}"),
        )),
    }
    if let Some(samples) = known.offset_samples {
        settings.offset_samples = samples;
    } else if let Some(Ok(lag)) = &seen.lag {
        settings.offset_samples = lag.samples;
        evidence.push(Evidence::new(table, "offset_samples", lag.evidence.clone()));
    }
    settings
}

/// Writes a name as a TOML key of a table heading.
fn toml_key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !name.is_empty() && name.chars().all(bare) {
        name.to_owned()
    } else {
        format!("{name:?}")
    }
}

/// Returns the text of a manifest with the evidence as comments above the lines concerned.
#[must_use]
pub fn with_comments(text: &str, evidence: &[Evidence]) -> String {
    let mut written = String::from(
        "# Made by `hoid group init` from the names and contents of the files: review it, then run\n\
         #   hoid group . --out results\n",
    );
    let comment = |written: &mut String, table: &str, key: &str| {
        for one in evidence.iter().filter(|one| one.table == table && one.key == key) {
            written.push_str(&format!(
                "# {}\n",
                hoid_io::escape_control_characters(&one.text).replace('\n', " ")
            ));
        }
    };
    let mut table = String::new();
    comment(&mut written, "", "");
    written.push('\n');
    for line in text.lines() {
        if line.starts_with('[') {
            line.clone_into(&mut table);
            comment(&mut written, &table, "");
        } else if let Some((key, _)) = line.split_once(" = ") {
            comment(&mut written, &table, key.trim());
        }
        written.push_str(line);
        written.push('\n');
    }
    written
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evidence_is_written_as_comments_above_its_key() {
        let text = "name = \"x\"\n\n[read]\ninput = \"e\"\noutput = \"u\"\n\n[conditions.a]\nexcitation = \"d\"\n";
        let evidence = [
            Evidence::new("[read]", "input", "by its name"),
            Evidence::new("[conditions.a]", "excitation", "10 lines"),
            Evidence::new("[read]", "", "columns t, e, u"),
        ];
        let written = with_comments(text, &evidence);
        assert!(
            written.contains("# columns t, e, u\n[read]\n# by its name\ninput = \"e\"\noutput"),
            "{written}"
        );
        assert!(written.contains("# 10 lines\nexcitation"), "{written}");
        // Comments do not change the settings.
        let read = |text: &str| toml::from_str::<toml::Table>(text).unwrap();
        assert_eq!(read(&written), read(text));
    }

    #[test]
    fn names_are_quoted_as_keys_if_needed() {
        assert_eq!(toml_key("so-2"), "so-2");
        assert_eq!(toml_key("so 2"), "\"so 2\"");
        assert_eq!(toml_key(""), "\"\"");
    }
}
