//! The pages of a finished group, made from the tables in its directory and written to the same directory.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use hoid_io::{OutputTable, read_table};
use hoid_study::group::{GroupSummary, Manifest};

use super::{
    report::GroupReport,
    tables::{FrequencyTables, GroupTables, texts},
};
use crate::{ReportError, page};

/// Maximum number of runs whose preparation and problems are listed.
const MAX_LISTED_RUNS: usize = 24;

/// The tables in the directory of a group.
struct Tables {
    estimates: OutputTable,
    averages: OutputTable,
    delays: OutputTable,
    traces: OutputTable,
    settling: OutputTable,
    responses: OutputTable,
    /// Lines, margins and agreement; `None` without a periodic excitation.
    frequencies: Option<[OutputTable; 3]>,
}

impl Tables {
    fn read(out: &Path) -> Result<Self, ReportError> {
        let read = |name: &str| read_table(&out.join(format!("{name}.parquet")));
        let described = out.join("frequency-margins.parquet").exists();
        let of_lines = || -> Result<_, hoid_io::IoError> {
            Ok([
                read("describing-functions")?,
                read("frequency-margins")?,
                read("agreement")?,
            ])
        };
        Ok(Self {
            estimates: read("estimates")?,
            averages: read("averages")?,
            delays: read("delays")?,
            traces: read("trace-averages")?,
            settling: read("settling")?,
            responses: read("response-averages")?,
            frequencies: described.then(of_lines).transpose()?,
        })
    }

    fn as_group_tables(&self) -> GroupTables<'_> {
        GroupTables {
            estimates: &self.estimates,
            averages: &self.averages,
            delays: &self.delays,
            traces: &self.traces,
            settling: &self.settling,
            responses: &self.responses,
            frequencies: self
                .frequencies
                .as_ref()
                .map(|[lines, margins, agreement]| FrequencyTables {
                    lines,
                    margins,
                    agreement,
                }),
        }
    }
}

/// Smallest width of a figure with several columns, mm; the text then has 6 pt, as journals require.
const PAGE_WIDTH_MM: f64 = 137.0;

/// Draws the describing functions of a finished group with the fitted operators, one figure for each condition, and
/// returns pairs of name and SVG text; empty if no condition has a periodic excitation. If `width_mm` is too narrow for
/// several columns, each subject has a separate figure, so that the text stays legible.
///
/// # Errors
/// The errors of [`write_group_pages`].
pub fn group_figures(
    manifest: &Manifest,
    out: &Path,
    width_mm: Option<f64>,
) -> Result<Vec<(String, String)>, ReportError> {
    let tables = Tables::read(out)?;
    let report = GroupReport {
        manifest,
        summary: &GroupSummary::read(manifest, out)?,
        tables: tables.as_group_tables(),
        settings: Vec::new(),
        subject: None,
    };
    Ok(report.describing_figures(width_mm.is_some_and(|width| width < PAGE_WIDTH_MM)))
}

/// Writes the page of the group and one page for each subject to the directory of the tables; `path` is the path of the
/// manifest.
///
/// # Errors
/// [`ReportError::Io`] or [`ReportError::Study`] if tables are missing or a page cannot be written;
/// [`ReportError::Template`] if a template cannot be rendered, which is a defect of this crate.
pub fn write_group_pages(manifest: &Manifest, path: &Path, out: &Path) -> Result<Vec<PathBuf>, ReportError> {
    let read = Tables::read(out)?;
    let tables = read.as_group_tables();
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
    let table = |name: &str| read_table(&out.join(format!("{name}.parquet")));
    settings.extend(preparation_rows(&table("preparation")?, &table("trouble")?));
    let names = page_names(&subjects);
    let mut pages = Vec::new();
    let of_subjects = subjects.iter().zip(names).map(|(subject, name)| (Some(*subject), name));
    for (subject, name) in std::iter::once((None, "report.html".to_owned())).chain(of_subjects) {
        let report = GroupReport {
            manifest,
            summary: &summary,
            tables,
            settings: settings.clone(),
            subject,
        };
        pages.push(page::write_page(out, &name, &report.to_html()?)?);
    }
    Ok(pages)
}

/// Maximum number of characters of a subject in the file name of a page; with a number appended, the name is valid on
/// every file system.
const MAX_NAME_LENGTH: usize = 80;

/// The file name of the page of each subject. Characters other than ASCII letters and digits become `-`. A number is
/// appended if the name of another subject is the same or differs only in case, which some file systems ignore.
fn page_names(subjects: &[&str]) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let name_of = |subject: &&str| {
        let cut: String = subject.chars().take(MAX_NAME_LENGTH).collect();
        let plain = cut.replace(|c: char| !c.is_ascii_alphanumeric(), "-");
        let numbered = (1_u64..).map(|n| match n {
            1 => format!("subject-{plain}.html"),
            n => format!("subject-{plain}-{n}.html"),
        });
        let free = numbered
            .into_iter()
            .find(|name| taken.insert(name.to_ascii_lowercase()));
        free.unwrap_or_default()
    };
    subjects.iter().map(name_of).collect()
}

/// Preparation of the runs and problems of their sampling; all files with the same text are combined in one row.
fn preparation_rows(preparation: &OutputTable, trouble: &OutputTable) -> Vec<(String, String)> {
    let mut rows: Vec<(String, String)> = Vec::new();
    for (table, what) in [(preparation, "preparation"), (trouble, "sampling problems")] {
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
    // The complete lists are in the tables of the directory.
    let more = rows.len().saturating_sub(MAX_LISTED_RUNS);
    rows.truncate(MAX_LISTED_RUNS);
    if more > 0 {
        rows.push((
            "more runs".to_owned(),
            format!("{more}; preparation.csv and trouble.csv list all of them"),
        ));
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subjects_have_distinct_page_names() {
        let long = "x".repeat(300);
        let subjects = [
            "S1",
            "s1",
            "S 1",
            "S-1",
            "S-1-2",
            "S_1",
            "Åsa",
            "Ása",
            "",
            &long,
            &format!("{long}y"),
        ];
        let names = page_names(&subjects);
        assert_eq!(names[0], "subject-S1.html");
        assert_eq!(names[1], "subject-s1-2.html");
        assert_eq!(names[2], "subject-S-1.html");
        let distinct: BTreeSet<String> = names.iter().map(|name| name.to_ascii_lowercase()).collect();
        assert_eq!(distinct.len(), subjects.len(), "{names:?}");
        assert!(names.iter().all(|name| name.len() < 120 && name.is_ascii()));
    }
}
