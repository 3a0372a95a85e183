//! Prior knowledge of a file before it is examined.

use hoid_io::{TimeChoice, TrialChoice};
use hoid_model::ContinuousTransferFunction;

/// Options given by the user, which are therefore not searched for.
#[derive(Debug, Clone, Default)]
pub struct LookOptions {
    /// Column of the input, or a difference.
    pub input: Option<String>,
    /// Column of the output.
    pub output: Option<String>,
    /// Column of the excitation; `none` if there is none.
    pub excitation: Option<String>,
    /// The controlled element, as typed and as parsed.
    pub controlled_element: Option<(String, ContinuousTransferFunction)>,
    /// The column of the time and its unit; found automatically if not given.
    pub time: Option<TimeChoice>,
    /// The trials of a file; found from a time that restarts if not given.
    pub trial: Option<TrialChoice>,
    /// Sampling frequency, Hz; that of the column t if not given.
    pub sampling_hz: Option<f64>,
    /// Start of the span that is used, s.
    pub from_s: Option<f64>,
    /// End of the span that is used, s.
    pub to_s: Option<f64>,
    /// Number of samples by which the output is recorded later than the input that causes it.
    pub offset_samples: Option<f64>,
}
