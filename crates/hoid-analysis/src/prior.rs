//! Prior knowledge of a person, in the text form that users write.

use std::path::Path;

use hoid_ident::{IdentError, family::OperatorPrior};
use hoid_io::{IoError, is_fit_file, parse_fit, read_fit};

use crate::AnalysisError;

/// Parses `population`, `none`, `NAME=CENTRE:SPREAD,...`, or another fit, given as a file or as JSON.
///
/// # Errors
/// [`AnalysisError::Option`]; [`AnalysisError::Io`] for a file that cannot be read.
pub fn parse_prior(text: &str) -> Result<OperatorPrior, AnalysisError> {
    let refuse = |reason: String| AnalysisError::Option { name: "prior", reason };
    let (found, source) = match text {
        json if json.trim_start().starts_with('{') => (parse_fit(json, "the fit"), "an earlier fit"),
        file if is_fit_file(file) => (read_fit(Path::new(file)), file),
        _ => {
            return text.parse().map_err(|error: IdentError| match error {
                IdentError::BadOption { found, expected, .. } => refuse(format!("found {found}; expected {expected}")),
                other => other.into(),
            });
        }
    };
    let found = found.map_err(|error| match error {
        unreadable @ IoError::Unreadable { .. } => unreadable.into(),
        other => refuse(other.to_string()),
    })?;
    let parameters = found.parameters.iter();
    let prior =
        OperatorPrior::from_parameters(parameters.map(|p| (p.name.as_str(), p.estimate, p.determined)), source)?;
    if prior.entries().is_empty() {
        return Err(refuse(format!(
            "{source}: no determined parameter has a standard error"
        )));
    }
    Ok(prior)
}
