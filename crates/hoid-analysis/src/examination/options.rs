//! Information about a file that the user gives before the file is examined.

use hoid_io::{TimeChoice, TrialChoice};
use hoid_model::ContinuousTransferFunction;

/// Options given by the user; the given values are not searched for.
#[derive(Debug, Clone, Default)]
pub struct ExaminationOptions {
    /// Column of the input, or a difference of two columns.
    pub input: Option<String>,
    /// Column of the output.
    pub output: Option<String>,
    /// Column of the excitation; `none` if there is none.
    pub excitation: Option<String>,
    /// Controlled element, as typed and as parsed.
    pub controlled_element: Option<(String, ContinuousTransferFunction)>,
    /// Time column and its unit; found automatically if `None`.
    pub time: Option<TimeChoice>,
    /// Trials of the file; determined from a time that restarts if `None`.
    pub trial: Option<TrialChoice>,
    /// Sampling frequency (in Hz); determined from the column t if `None`.
    pub sampling_hz: Option<f64>,
    /// Start of the span to use, s.
    pub from_s: Option<f64>,
    /// End of the span to use, s.
    pub to_s: Option<f64>,
    /// Number of samples by which the output was recorded later than the input.
    pub offset_samples: Option<f64>,
}
