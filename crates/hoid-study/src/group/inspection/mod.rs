//! A look at the files of a group before they are analysed: which columns are error and control,
//! what excites the loop and in which span of whole periods, by how much the control was recorded
//! late, and what a first fit says of form and noise model. What is found stands in the manifest
//! with the evidence beside it, to be looked through by a person; what was asked for is not looked
//! for.
//!
//! | file | what it finds |
//! |---|---|
//! | `evidence` | what is known already, and what was found |
//! | `columns` | error and control by the names that people give them |
//! | `periods` | the excitation, its period and lines, and the longest span of whole periods |
//! | `lag` | by how many samples the control was recorded later than the output of the controlled element |
//! | `first_fit` | form and order of the noise model of the first run |

mod columns;
mod evidence;
mod first_fit;
mod lag;
mod periods;

use std::path::Path;

use hoid_io::{ReadOptions, read_record, survey};
use hoid_model::Record;

pub use evidence::{Evidence, Known};

use super::{condition_settings::ConditionSettings, manifest::Manifest};
use crate::StudyError;

/// Completes a manifest by what its files say: the first run of each condition is looked at.
///
/// # Errors
/// [`StudyError::Io`] where the first file cannot be read at all; what cannot be found is said in
/// the evidence.
pub fn inspect(manifest: &mut Manifest, directory: &Path, known: &Known) -> Result<Vec<Evidence>, StudyError> {
    let mut evidence = Vec::new();
    let first = directory.join(&manifest.runs[0].file);
    let surveyed = survey(&first)?;
    let names: Vec<&str> = surveyed.columns.iter().map(|column| column.path.as_str()).collect();
    let shown = manifest.runs[0].file.display().to_string();
    let chosen = columns::choose(&names, known.input.as_deref(), known.output.as_deref());
    evidence.push(Evidence::new(
        "[read]",
        "",
        format!("the columns of {shown} are {}", names.join(", ")),
    ));
    let units: Vec<String> = surveyed
        .columns
        .iter()
        .filter(|column| !column.unit.is_empty())
        .map(|column| format!("{} {}", column.path, column.unit))
        .collect();
    evidence.push(Evidence::new(
        "[read]",
        "",
        if units.is_empty() {
            "the files say no units: gains are in units of output by input".to_owned()
        } else {
            format!("units in the file: {}", units.join(", "))
        },
    ));
    evidence.push(Evidence::new("[read]", "input", chosen.input.1));
    evidence.push(Evidence::new("[read]", "output", chosen.output.1));
    (manifest.read.input, manifest.read.output) = (chosen.input.0, chosen.output.0);
    manifest.read.sampling_hz = known.sampling_hz;
    (manifest.read.from_s, manifest.read.to_s) = (known.from_s, known.to_s);

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
        let record = match whole_record(manifest, &directory.join(&run.file)) {
            Ok(record) => record,
            Err(reason) => {
                evidence.push(Evidence::new("", "", format!("not looked at: {reason}")));
                continue;
            }
        };
        let table = format!("[conditions.{}]", key_of(condition));
        let settings = look_at(&record, condition, &table, known, &mut evidence, &mut spans);
        // A run without the name of a condition has no table of its own.
        if !condition.is_empty() && settings != ConditionSettings::default() {
            manifest.conditions.insert(condition.clone(), settings);
        }
    }
    // One span for all: what is whole in each condition.
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
    let run = directory.join(&manifest.runs[0].file);
    if let Ok(record) = spanned(manifest, &run) {
        let found = first_fit::evidence(&record);
        if let Some(nd) = found.nd {
            manifest.analysis.nd = nd;
        }
        evidence.extend(found.evidence);
    }
    Ok(evidence)
}

/// What the first run of a condition says of it.
fn look_at(
    record: &Record,
    condition: &str,
    table: &str,
    known: &Known,
    evidence: &mut Vec<Evidence>,
    spans: &mut Vec<(f64, f64)>,
) -> ConditionSettings {
    let mut settings = ConditionSettings::default();
    if let Some((text, _)) = &known.controlled_element {
        settings.controlled_element = Some(text.clone());
    }
    let found = periods::search(record, known);
    match &found {
        Ok(found) => {
            settings.excitation = Some(found.channel.clone());
            settings.period_s = Some(found.period_s);
            spans.push(found.span_s);
            evidence.push(Evidence::new(table, "excitation", found.words.clone()));
        }
        Err(reason) => evidence.push(Evidence::new(
            if condition.is_empty() { "" } else { table },
            "",
            format!("no excitation: {reason}"),
        )),
    }
    if let Some(samples) = known.offset_samples {
        settings.offset_samples = samples;
    } else if let (Ok(found), Some((_, element))) = (&found, &known.controlled_element)
        && let Some(lag) = lag::of_control(record, found, element)
    {
        settings.offset_samples = lag.samples;
        evidence.push(Evidence::new(table, "offset_samples", lag.words));
    }
    settings
}

/// A file as the manifest reads it, without its span.
fn whole_record(manifest: &Manifest, file: &Path) -> Result<Record, StudyError> {
    read_span(manifest, file, (None, None))
}

fn spanned(manifest: &Manifest, file: &Path) -> Result<Record, StudyError> {
    read_span(manifest, file, (manifest.read.from_s, manifest.read.to_s))
}

fn read_span(manifest: &Manifest, file: &Path, span_s: (Option<f64>, Option<f64>)) -> Result<Record, StudyError> {
    let options = ReadOptions {
        input: Some(manifest.read.input.parse()?),
        output: manifest.read.output.parse()?,
        sampling_hz: manifest.read.sampling_hz,
        span_s,
        ..ReadOptions::default()
    };
    Ok(read_record(file, &options)?.record)
}

/// A name as TOML writes it in the head of a table.
fn key_of(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !name.is_empty() && name.chars().all(bare) {
        name.to_owned()
    } else {
        format!("{name:?}")
    }
}

/// The text of a manifest with the evidence as comments above the lines that it belongs to.
#[must_use]
pub fn commented(text: &str, evidence: &[Evidence]) -> String {
    let mut written = String::from(
        "# Made by `hoid group init` from names and contents of the files: look it through, then\n\
         #   hoid group . --out results\n",
    );
    let comment = |written: &mut String, table: &str, key: &str| {
        for one in evidence.iter().filter(|one| one.table == table && one.key == key) {
            written.push_str(&format!("# {}\n", hoid_io::printable(&one.words).replace('\n', " ")));
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
    fn comments_stand_above_what_they_speak_of() {
        let text = "name = \"x\"\n\n[read]\ninput = \"e\"\noutput = \"u\"\n\n[conditions.a]\nexcitation = \"d\"\n";
        let evidence = [
            Evidence::new("[read]", "input", "by its name"),
            Evidence::new("[conditions.a]", "excitation", "10 lines"),
            Evidence::new("[read]", "", "columns t, e, u"),
        ];
        let written = commented(text, &evidence);
        assert!(
            written.contains("# columns t, e, u\n[read]\n# by its name\ninput = \"e\"\noutput"),
            "{written}"
        );
        assert!(written.contains("# 10 lines\nexcitation"), "{written}");
        // The comments change nothing.
        let read = |text: &str| toml::from_str::<toml::Table>(text).unwrap();
        assert_eq!(read(&written), read(text));
    }

    #[test]
    fn names_are_written_as_keys() {
        assert_eq!(key_of("so-2"), "so-2");
        assert_eq!(key_of("so 2"), "\"so 2\"");
        assert_eq!(key_of(""), "\"\"");
    }
}
