//! Error for a file in which the requested columns are missing but error and control are recognised under other names.
//! No column is chosen silently: the message shows which columns to request.

use std::path::Path;

use hoid_io::{ColumnExpression, ColumnOption, IoError, ReadOptions, survey};
use thiserror::Error;

use super::{advice::shell_command, columns::Roles, file::column_names};

/// A file without the requested columns, in which error and control are recognised under other names.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{}: {}", self.description(), self.as_keys())]
pub struct OtherColumns {
    /// Name of the file.
    pub file: String,
    /// Requested column that is missing.
    pub missing: String,
    /// Names of the existing columns.
    pub available: String,
    /// Column of the error; `None` if no input is requested.
    pub input: Option<String>,
    /// Column of the control.
    pub output: String,
}

impl OtherColumns {
    /// Describes the request, the existing columns, and the recognised columns.
    pub fn description(&self) -> String {
        let Self {
            file,
            missing,
            available,
            input,
            output,
        } = self;
        let error = input
            .as_ref()
            .map_or(String::new(), |input| format!("e = {input} and "));
        format!("there is no column {missing} in {file} (columns: {available}). It looks like {error}u = {output}")
    }

    /// Returns the remedy as keys and values, in the form used in a manifest and in Python.
    pub fn as_keys(&self) -> String {
        let input = self.input.as_ref().map(|input| format!("input=\"{input}\""));
        let all = input.into_iter().chain([format!("output=\"{}\"", self.output)]);
        all.collect::<Vec<_>>().join(", ")
    }

    /// Returns the remedy as a command line: the typed arguments with corrected column options.
    pub fn command(&self, typed_words: impl IntoIterator<Item = String>) -> String {
        let mut words = vec!["hoid".to_owned()];
        let mut all = typed_words.into_iter();
        while let Some(word) = all.next() {
            match word.as_str() {
                "--input" | "--output" => drop(all.next()),
                other if other.starts_with("--input=") || other.starts_with("--output=") => {}
                _ => words.push(word),
            }
        }
        for (option, column) in [("--input", self.input.as_ref()), ("--output", Some(&self.output))] {
            words.extend(
                column
                    .into_iter()
                    .flat_map(|column| [option.to_owned(), column.clone()]),
            );
        }
        shell_command(&words)
    }
}

/// Returns the columns of error and control if `error` reports that e or u is missing; `None` for another error, or if
/// the columns are not certain.
pub fn other_columns(error: &IoError, path: &Path, options: &ReadOptions) -> Option<OtherColumns> {
    let IoError::NoSuchColumn {
        file,
        missing,
        option: ColumnOption::Signals,
        available,
        ..
    } = error
    else {
        return None;
    };
    let found = survey(path).ok()?;
    let names = column_names(&found);
    // Only default names are replaced; the user typed any other name deliberately.
    let of = |column: &ColumnExpression, default: &str| {
        let found = column.is_among(&names).then(|| column.to_string());
        (found.is_some() || column.to_string() == default).then_some(found)
    };
    let input = match &options.input {
        Some(column) => Some(of(column, "e")?),
        None => None,
    };
    let output = of(&options.output, "u")?;
    let roles = Roles::of(&names, input.as_ref().and_then(Option::as_deref), output.as_deref());
    let certain = roles.output.is_certain && (roles.input.is_certain || input.is_none());
    certain.then(|| OtherColumns {
        file: file.clone(),
        missing: missing.replace('"', ""),
        available: available.clone(),
        input: input.map(|_| roles.input.column),
        output: roles.output.column,
    })
}
