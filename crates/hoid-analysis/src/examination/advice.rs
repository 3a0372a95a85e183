//! Advice on how to read a file, and the command to type. Both are shown as text, so that the user makes every choice.

use hoid_ident::frequency::COMMON_EXCITATIONS;
use hoid_io::{TimeChoice, TrialChoice};

use super::{columns::Role, file::FileExamination};

/// Advice on how to read a file: the options that differ from the defaults.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Advice {
    /// Column of the input, or a difference of two columns.
    pub input: Option<String>,
    /// Column of the output.
    pub output: Option<String>,
    /// Time column and its unit.
    pub time: Option<TimeChoice>,
    /// Trials of the file.
    pub trial: Option<TrialChoice>,
    /// Sampling frequency, Hz.
    pub sampling_hz: Option<f64>,
    /// Start of the span of whole periods or of the requested span (in s); `None` for the start of the record.
    pub from_s: Option<f64>,
    /// End of the span of whole periods or of the requested span (in s); `None` for the end of the record.
    pub to_s: Option<f64>,
    /// Number of samples by which the output was recorded late.
    pub late_samples: Option<f64>,
    /// Column of the excitation.
    pub excitation: Option<String>,
    /// The controlled element.
    pub controlled_element: Option<String>,
}

impl FileExamination {
    /// Returns the advice; `None` if it is not certain which columns are error and control. If the columns do not form
    /// a record yet, the advice contains only the columns.
    pub fn advice(&self) -> Option<Advice> {
        if !self.roles.are_certain() {
            return None;
        }
        // If the column of e or u differs from its default, both columns are given: the command is then easier to read.
        let (input, output) = (&self.roles.input, &self.roles.output);
        let default = input.column == "e" && output.column == "u";
        let named = |role: &Role| (!default).then(|| role.column.clone());
        let seen = self.summary.as_ref().ok();
        let ends = seen.map(|seen| (seen.record.time_s(0), seen.record.time_s(seen.record.len())));
        let periods = seen.and_then(|seen| seen.periods.as_ref().ok());
        let (from_s, to_s) = match periods.map(|found| found.span_s).zip(ends) {
            Some(((from_s, to_s), (begin_s, end_s))) => (
                Some(from_s).filter(|t| *t != begin_s),
                Some(to_s).filter(|t| *t != end_s),
            ),
            None => (self.options.from_s, self.options.to_s),
        };
        let late = match seen.and_then(|seen| seen.lag.as_ref()) {
            Some(Ok(lag)) => Some(lag.samples),
            _ => self.options.offset_samples,
        };
        Some(Advice {
            input: named(input),
            output: named(output),
            time: self.options.time.clone(),
            trial: self.options.trial.clone(),
            sampling_hz: self.options.sampling_hz,
            from_s,
            to_s,
            late_samples: late.filter(|samples| *samples != 0.0),
            excitation: periods
                .map(|found| found.channel.clone())
                .filter(|channel| !COMMON_EXCITATIONS.contains(&channel.as_str())),
            controlled_element: self.options.controlled_element.as_ref().map(|(text, _)| text.clone()),
        })
    }
}

impl Advice {
    /// Returns the advice as command-line options.
    pub fn arguments(&self) -> Vec<String> {
        let number = |value: Option<f64>| value.map(|value| value.to_string());
        let all = [
            ("--input", self.input.clone()),
            ("--output", self.output.clone()),
            ("--time", self.time.as_ref().map(ToString::to_string)),
            ("--trial", self.trial.as_ref().map(ToString::to_string)),
            ("--fs", number(self.sampling_hz)),
            ("--from", number(self.from_s)),
            ("--to", number(self.to_s)),
            ("--offset", self.late_samples.map(|samples| format!("u={samples}"))),
            ("--excitation", self.excitation.clone()),
            ("--controlled-element", self.controlled_element.clone()),
        ];
        all.into_iter()
            .filter_map(|(name, value)| Some([name.to_owned(), value?]))
            .flatten()
            .collect()
    }

    /// Returns the command that reads the file according to the advice.
    pub fn command(&self, verb: &str, file: &str) -> String {
        let mut words = vec!["hoid".to_owned(), verb.to_owned(), file.to_owned()];
        words.extend(self.arguments());
        shell_command(&words)
    }
}

/// Joins words as typed in a shell.
pub fn shell_command(words: &[String]) -> String {
    let plain = |word: &str| {
        let is_plain = |c: char| c.is_alphanumeric() || "-_./=:,+%@".contains(c);
        !word.is_empty() && word.chars().all(is_plain)
    };
    let each = words.iter().map(|word| match plain(word) {
        true => word.clone(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    });
    each.collect::<Vec<_>>().join(" ")
}
