//! Prior knowledge of a file before it is examined, as `hoid info` and `hoid group init` take it.

use clap::Args;
use hoid::analysis::ExaminationOptions;
use hoid::model::ContinuousTransferFunction;

use super::reading::ClockArgs;

/// Options that are otherwise detected.
#[derive(Debug, Args)]
pub struct ExaminationArgs {
    /// Input column (tracking error), or a difference such as r-y [default: by name]
    #[arg(long, value_name = "COLUMN", allow_hyphen_values = true)]
    pub input: Option<String>,
    /// Output column (control) [default: by name]
    #[arg(long, value_name = "COLUMN", allow_hyphen_values = true)]
    pub output: Option<String>,
    /// Excitation column, or none [default: the column with a line spectrum]
    #[arg(long, value_name = "COLUMN|none")]
    pub excitation: Option<String>,
    /// Controlled element, such as 90/(s(s+6)) or 90/1,6,0: finds how many samples late the control was recorded, if
    /// every target and disturbance is recorded
    #[arg(long, value_name = "ELEMENT", value_parser = parse_element, allow_hyphen_values = true)]
    pub controlled_element: Option<(String, ContinuousTransferFunction)>,
    #[command(flatten)]
    pub clock: ClockArgs,
    /// Start of the span to use, s [default: whole periods of the excitation]
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub from: Option<f64>,
    /// End of the span to use, s
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub to: Option<f64>,
}

impl ExaminationArgs {
    /// Returns these options for the library.
    pub fn to_options(&self) -> ExaminationOptions {
        ExaminationOptions {
            input: self.input.clone(),
            output: self.output.clone(),
            excitation: self.excitation.clone(),
            controlled_element: self.controlled_element.clone(),
            time: self.clock.time.clone(),
            trial: self.clock.trial.clone(),
            sampling_hz: self.clock.fs,
            from_s: self.from,
            to_s: self.to,
            offset_samples: None,
        }
    }
}

/// Parses a controlled element; returns its text and the transfer function.
fn parse_element(text: &str) -> Result<(String, ContinuousTransferFunction), String> {
    let element = text
        .parse::<ContinuousTransferFunction>()
        .map_err(|error| error.to_string())?;
    Ok((text.to_owned(), element))
}
