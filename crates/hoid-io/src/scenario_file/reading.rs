//! Reading and checking a scenario file.

use std::path::Path;

use hoid_model::scenario::Scenario;

use super::error::ScenarioFileError;
use super::keys::File;
use super::values::{Source, line_of};

/// Reads and checks a scenario. Without a `name` it is called as its file.
///
/// # Errors
/// [`ScenarioFileError`], which names the file and where it can the line and the key.
pub fn read_scenario(path: &Path) -> Result<Scenario, ScenarioFileError> {
    let shown = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|error| ScenarioFileError::Unreadable {
        path: shown.clone(),
        reason: error.to_string(),
    })?;
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned());
    parse_scenario(&text, &shown, &stem.unwrap_or_else(|| shown.clone()))
}

/// A scenario from the text of a file; `path` is for messages, `name` for a text that has none.
///
/// # Errors
/// As [`read_scenario`].
pub fn parse_scenario(text: &str, path: &str, name: &str) -> Result<Scenario, ScenarioFileError> {
    let file: File = toml::from_str(text).map_err(|error| ScenarioFileError::Syntax {
        path: path.to_owned(),
        line: error.span().map_or(1, |span| line_of(text, span.start)),
        reason: error.message().trim_end().to_owned(),
    })?;
    let source = Source { text, path };
    let scenario = source.scenario(file, name)?;
    scenario.resolve().map_err(|error| source.model(error))?;
    Ok(scenario)
}

/// JSON schema of a scenario file, as text.
pub fn scenario_schema() -> String {
    let schema = schemars::schema_for!(File);
    format!("{:#}", schema.as_value())
}
