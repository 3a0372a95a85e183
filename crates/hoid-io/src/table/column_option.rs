//! The options with which users request columns.

/// Option with which a column was requested.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ColumnOption {
    /// Input and output.
    Signals,
    /// The time.
    Time,
    /// The column that numbers the trials.
    Trial,
    /// Further columns that are kept.
    Kept,
}

impl ColumnOption {
    /// Returns instructions for selecting a column with this option.
    pub(crate) fn remedy(self) -> &'static str {
        match self {
            Self::Signals => "select columns with --input and --output as NAME, -NAME or NAME-NAME",
            Self::Time => "select the time column with --time COLUMN or COLUMN:UNIT",
            Self::Trial => "select trials with --trial COLUMN or COLUMN=VALUE",
            Self::Kept => "name the columns to keep with --columns NAME,NAME, or none",
        }
    }
}
