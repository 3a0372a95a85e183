//! What is known of a group before its files are looked at, and what is found in them.

use hoid_model::ContinuousTransferFunction;

/// What is known already, and therefore not looked for.
#[derive(Debug, Clone, Default)]
pub struct Known {
    /// Column of the input, or a difference.
    pub input: Option<String>,
    /// Column of the output.
    pub output: Option<String>,
    /// Column of the excitation; `none` where there is none.
    pub excitation: Option<String>,
    /// The controlled element, as it was typed, and as it is meant.
    pub controlled_element: Option<(String, ContinuousTransferFunction)>,
    /// Sampling frequency, Hz; that of the column t where it is left out.
    pub sampling_hz: Option<f64>,
    /// Begin of the span that counts, s.
    pub from_s: Option<f64>,
    /// End of the span that counts, s.
    pub to_s: Option<f64>,
    /// Samples by which the output is recorded later than the input that it answers.
    pub offset_samples: Option<f64>,
}

/// What was found, for the line of the manifest that begins with `key`: below the table `table`.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Table of the manifest, as `[read]`; empty for its head.
    pub table: String,
    /// Key in that table; empty for the table itself.
    pub key: &'static str,
    /// What was found, and how.
    pub words: String,
}

impl Evidence {
    pub(super) fn new(table: impl Into<String>, key: &'static str, words: impl Into<String>) -> Self {
        Self {
            table: table.into(),
            key,
            words: words.into(),
        }
    }
}
