//! Rendering of the page as HTML text.

use minijinja::context;

use super::{estimates, report::GroupReport, time_courses};
use crate::{ReportError, page};

impl GroupReport<'_> {
    /// Returns the page as HTML text, which contains all styles and figures. Equal data give identical bytes.
    ///
    /// # Errors
    /// [`ReportError::Template`] if a template cannot be rendered, which is a defect of this crate.
    pub fn to_html(&self) -> Result<String, ReportError> {
        let title = match self.subject {
            Some(subject) => format!("{}: subject {subject}", self.manifest.name),
            None => self.manifest.name.clone(),
        };
        page::render(
            "group.html",
            context! {
                title,
                settings => page::settings_rows(&self.settings),
                notes => self.notes(),
                verdict => self.verdict(),
                unreadable_runs => self.unreadable_runs(),
                people_headings => self.people_headings(),
                people => self.people(),
                headings => estimates::headings(),
                averages => self.averages(),
                delays => self.delays(),
                failures => self.failures(),
                margins => self.margins(),
                agreement => self.agreement(),
                describing_functions => self.describing_functions(),
                recursions => time_courses::methods(),
                settling => self.settling_rows(),
                figures => self.figures_over_time(),
            },
        )
    }

    fn notes(&self) -> Vec<String> {
        let left_out = self.manifest.runs.iter().filter(|run| !run.counts).count();
        if left_out == 0 {
            return Vec::new();
        }
        let all = self.manifest.runs.len();
        vec![format!("Runs excluded (counts = false): {left_out} of {all}.")]
    }
}
