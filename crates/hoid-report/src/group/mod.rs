//! The page about a group of recorded runs.
//!
//! | module | what it shows |
//! |---|---|
//! | `estimates` | averages of the fits, chosen delays, what could not be estimated |
//! | `describing` | describing functions with the fits over them, and where they agree |
//! | `over_time` | recursive estimates by condition and subject, and how fast they follow a change |
//! | `pages` | the pages of a directory of tables, one for the group and one a subject |

mod describing;
mod estimates;
mod over_time;
mod pages;

use hoid_io::{ColumnValues, OutputTable};
use hoid_study::group::Manifest;
use minijinja::context;

pub use pages::write_group_pages;

use crate::{ReportError, page};

/// The tables of a finished group.
#[derive(Debug, Clone, Copy)]
pub struct GroupTables<'a> {
    /// All estimates in long form.
    pub estimates: &'a OutputTable,
    /// Averages over runs.
    pub averages: &'a OutputTable,
    /// Delays and T_n that were chosen beforehand.
    pub delays: &'a OutputTable,
    /// Averages of traces.
    pub traces: &'a OutputTable,
    /// Settling times and noise of the recursions, where a condition changes.
    pub settling: &'a OutputTable,
    /// Averages of the frequency responses of the fits.
    pub responses: &'a OutputTable,
    /// Describing functions, where the manifest names an excitation.
    pub frequencies: Option<FrequencyTables<'a>>,
}

/// The tables of the describing functions.
#[derive(Debug, Clone, Copy)]
pub struct FrequencyTables<'a> {
    /// A row a line.
    pub lines: &'a OutputTable,
    /// Crossover, margin, gain, lead, delay and noise, a row a subject and condition.
    pub margins: &'a OutputTable,
    /// How far each estimator is from it.
    pub agreement: &'a OutputTable,
}

/// The page.
#[derive(Debug)]
pub struct GroupReport<'a> {
    /// What was analysed.
    pub manifest: &'a Manifest,
    /// What came out.
    pub tables: GroupTables<'a>,
    /// What was done and with what, as name and value.
    pub settings: Vec<(String, String)>,
    /// One subject alone, or all.
    pub subject: Option<&'a str>,
}

fn texts<'a>(table: &'a OutputTable, name: &str) -> &'a [String] {
    match table.column(name) {
        Some(ColumnValues::Text(values)) => values,
        _ => &[],
    }
}

/// A name as a part of an id.
fn id_of(what: &str, name: &str) -> String {
    format!("{what}-{}", name.replace(|c: char| !c.is_ascii_alphanumeric(), "-"))
}

fn reals<'a>(table: &'a OutputTable, name: &str) -> &'a [f64] {
    match table.column(name) {
        Some(ColumnValues::Real(values)) => values,
        _ => &[],
    }
}

impl GroupReport<'_> {
    fn shows(&self, subject: &str) -> bool {
        self.subject.is_none_or(|only| only == subject)
    }

    /// Subjects, and conditions, in the order of the manifest.
    fn names(&self) -> (Vec<&str>, Vec<&str>) {
        let (mut subjects, mut conditions): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
        for run in self
            .manifest
            .runs
            .iter()
            .filter(|run| run.counts && self.shows(&run.subject))
        {
            if !subjects.contains(&run.subject.as_str()) {
                subjects.push(&run.subject);
            }
            if !conditions.contains(&run.condition.as_str()) {
                conditions.push(&run.condition);
            }
        }
        (subjects, conditions)
    }

    /// The rows of a table that are about a subject and condition.
    fn rows_of(table: &OutputTable, subject: &str, condition: &str) -> Vec<usize> {
        let (s, c) = (texts(table, "subject"), texts(table, "condition"));
        (0..s.len())
            .filter(|i| s[*i] == subject && c[*i] == condition)
            .collect()
    }

    /// The page as HTML text, with all styles and figures inside it. The same data give the same bytes.
    ///
    /// # Errors
    /// [`ReportError::Template`] for a defect of this crate.
    pub fn html(&self) -> Result<String, ReportError> {
        let title = match self.subject {
            Some(subject) => format!("{}: subject {subject}", self.manifest.name),
            None => self.manifest.name.clone(),
        };
        page::render(
            "group.html",
            context! {
                title,
                settings => page::facts(&self.settings),
                notes => self.notes(),
                headings => estimates::headings(),
                averages => self.averages(),
                delays => self.delays(),
                failures => self.failures(),
                margins => self.margins(),
                agreement => self.agreement(),
                describing => self.describing(),
                recursions => over_time::methods(),
                settling => self.settling(),
                figures => self.over_time(),
            },
        )
    }

    fn notes(&self) -> Vec<String> {
        let left_out = self.manifest.runs.iter().filter(|run| !run.counts).count();
        if left_out == 0 {
            return Vec::new();
        }
        vec![format!("{left_out} runs do not count and were left out.")]
    }
}
