//! The pages of a finished group, made of the tables in its directory and written beside them.

use std::path::{Path, PathBuf};

use hoid_io::{OutputTable, read_table};
use hoid_study::group::{GroupSummary, Manifest};

use super::{
    report::GroupReport,
    tables::{FrequencyTables, GroupTables, texts},
};
use crate::{ReportError, page};

/// Runs whose preparation and trouble the pages list.
const MOST_LISTED: usize = 24;

/// Writes the page of the group and one for each subject into the directory of its tables; `path`
/// is where the manifest was read.
///
/// # Errors
/// [`ReportError::Io`], [`ReportError::Study`] for tables that are not there and pages that cannot be written;
/// [`ReportError::Template`] for a defect of this crate.
pub fn write_group_pages(manifest: &Manifest, path: &Path, out: &Path) -> Result<Vec<PathBuf>, ReportError> {
    let read = |name: &str| read_table(&out.join(format!("{name}.parquet")));
    let (estimates, averages, delays) = (read("estimates")?, read("averages")?, read("delays")?);
    let (traces, settling, responses) = (read("trace-averages")?, read("settling")?, read("response-averages")?);
    let frequencies = if out.join("frequency-margins.parquet").exists() {
        Some([
            read("describing-functions")?,
            read("frequency-margins")?,
            read("agreement")?,
        ])
    } else {
        None
    };
    let tables = GroupTables {
        estimates: &estimates,
        averages: &averages,
        delays: &delays,
        traces: &traces,
        settling: &settling,
        responses: &responses,
        frequencies: frequencies.as_ref().map(|[lines, margins, agreement]| FrequencyTables {
            lines,
            margins,
            agreement,
        }),
    };
    let summary = GroupSummary::read(manifest, out)?;
    let counting: Vec<_> = manifest.runs.iter().filter(|run| run.counts).collect();
    let mut subjects: Vec<&str> = Vec::new();
    for run in &counting {
        if !subjects.contains(&run.subject.as_str()) {
            subjects.push(&run.subject);
        }
    }
    let mut settings = vec![
        ("made by".to_owned(), format!("hoid {}", env!("CARGO_PKG_VERSION"))),
        ("manifest".to_owned(), path.display().to_string()),
        ("runs".to_owned(), counting.len().to_string()),
        (
            "input, output".to_owned(),
            format!("{}, {}", manifest.read.input, manifest.read.output),
        ),
        (
            "operator".to_owned(),
            format!("form {}, prior {}", manifest.analysis.form, manifest.analysis.prior),
        ),
        (
            "delay searched (ARX, BJ)".to_owned(),
            format!("{} to {} s", manifest.analysis.delay_s.0, manifest.analysis.delay_s.1),
        ),
        (
            "nd searched (BJ)".to_owned(),
            format!("{} to {}", manifest.analysis.nd.0, manifest.analysis.nd.1),
        ),
    ];
    settings.extend(account(&read("preparation")?, &read("trouble")?));
    let mut pages = Vec::new();
    for subject in std::iter::once(None).chain(subjects.iter().map(|s| Some(*s))) {
        let report = GroupReport {
            manifest,
            summary: &summary,
            tables,
            settings: settings.clone(),
            subject,
        };
        let plain = |name: &str| name.replace(|c: char| !c.is_ascii_alphanumeric(), "-");
        let name = subject.map_or("report.html".to_owned(), |subject| {
            format!("subject-{}.html", plain(subject))
        });
        pages.push(page::write_page(out, &name, &report.to_html()?)?);
    }
    Ok(pages)
}

/// What was done to the runs and what is wrong with their sampling: a row for all files of which the
/// same is said.
fn account(preparation: &OutputTable, trouble: &OutputTable) -> Vec<(String, String)> {
    let mut rows: Vec<(String, String)> = Vec::new();
    for (table, what) in [(preparation, "preparation"), (trouble, "sampling trouble")] {
        let mut files: Vec<(&str, String)> = Vec::new();
        for (file, words) in texts(table, "file").iter().zip(texts(table, "what")) {
            match files.iter_mut().find(|(known, _)| known == file) {
                Some((_, all)) => all.push_str(&format!("; {words}")),
                None => files.push((file, words.clone())),
            }
        }
        let mut alike: Vec<(Vec<&str>, String)> = Vec::new();
        for (file, words) in files {
            match alike.iter_mut().find(|(_, known)| *known == words) {
                Some((all, _)) => all.push(file),
                None => alike.push((vec![file], words)),
            }
        }
        rows.extend(alike.into_iter().map(|(files, words)| {
            let of = match files.as_slice() {
                [file] => (*file).to_owned(),
                [first, ..] => format!("{} files, the first {first}", files.len()),
                [] => String::new(),
            };
            (format!("{what} of {of}"), words)
        }));
    }
    // Long lists are in the tables.
    let more = rows.len().saturating_sub(MOST_LISTED);
    rows.truncate(MOST_LISTED);
    if more > 0 {
        rows.push((
            "more runs".to_owned(),
            format!("{more}; all of them are in preparation.csv and trouble.csv"),
        ));
    }
    rows
}
