//! What is known of a person before the data, as users write it.

use std::path::Path;

use hoid_ident::{IdentError, family::OperatorPrior};
use hoid_io::{IoError, is_fit_file, read_fit};

use crate::AnalysisError;

/// `population`, `none`, `NAME=CENTRE:SPREAD,...`, or the JSON of another fit.
///
/// # Errors
/// [`AnalysisError::Prior`], and for a file that cannot be read [`AnalysisError::Io`].
pub fn prior_of_text(text: &str) -> Result<OperatorPrior, AnalysisError> {
    let refuse = |reason: String| AnalysisError::Prior { reason };
    if !is_fit_file(text) {
        return text.parse().map_err(|error: IdentError| refuse(error.to_string()));
    }
    let found = read_fit(Path::new(text)).map_err(|error| match error {
        unreadable @ IoError::Unreadable { .. } => unreadable.into(),
        other => refuse(other.to_string()),
    })?;
    let parameters = found.parameters.iter();
    let prior = OperatorPrior::of_parameters(parameters.map(|p| (p.name.as_str(), p.estimate, p.determined)), text)?;
    if prior.entries().is_empty() {
        return Err(refuse(format!(
            "{text}: no parameter in it is determined and has an error"
        )));
    }
    Ok(prior)
}
