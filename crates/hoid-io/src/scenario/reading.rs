//! Reading and validation of scenario files.

use std::path::Path;

use hoid_model::{FamilyScenario, scenario::Scenario};

use super::error::ScenarioFileError;
use super::family_keys::FamilyFile;
use super::keys::File;
use super::values::{Source, line_of};
use crate::wording::escape_control_characters;

/// A scenario of the thesis task or of the operator family.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyScenario {
    /// The task of the thesis, or a similar task.
    Reference(Box<Scenario>),
    /// An operator of the family, from a file with the key `form`.
    Family(Box<FamilyScenario>),
}

/// Reads and checks a scenario of either kind. A scenario without a `name` is named after its file.
///
/// # Errors
/// [`ScenarioFileError`], which names the file and, if known, the line and the key.
pub fn read_any_scenario(path: &Path) -> Result<AnyScenario, ScenarioFileError> {
    let (text, shown, name) = text_of(path)?;
    parse_any_scenario(&text, &shown, &name)
}

/// Parses a scenario of either kind from text; `path` appears in messages, and `name` is used if the text gives no
/// name.
///
/// # Errors
/// As [`read_any_scenario`].
pub fn parse_any_scenario(text: &str, path: &str, name: &str) -> Result<AnyScenario, ScenarioFileError> {
    if !has_form(text) {
        return Ok(AnyScenario::Reference(Box::new(parse_scenario(text, path, name)?)));
    }
    let file: FamilyFile = toml::from_str(text).map_err(|error| syntax_error(text, path, &error))?;
    let source = Source { text, path };
    let scenario = source.family_scenario(file, name)?;
    scenario.resolve().map_err(|error| source.model_error(error))?;
    Ok(AnyScenario::Family(Box::new(scenario)))
}

/// True if the text has the key `form` and therefore describes an operator of the family.
fn has_form(text: &str) -> bool {
    text.parse::<toml::Table>()
        .is_ok_and(|table| table.contains_key("form"))
}

/// Reads and checks a scenario. A scenario without a `name` is named after its file.
///
/// # Errors
/// [`ScenarioFileError`], which names the file and, if known, the line and the key.
pub fn read_scenario(path: &Path) -> Result<Scenario, ScenarioFileError> {
    let (text, shown, name) = text_of(path)?;
    parse_scenario(&text, &shown, &name)
}

/// Returns the text of a file, its path for messages, and the default name of its scenario.
fn text_of(path: &Path) -> Result<(String, String, String), ScenarioFileError> {
    let shown = path.display().to_string();
    let text = crate::input_file::settings_text(path).map_err(|error| ScenarioFileError::Unreadable {
        path: shown.clone(),
        reason: error.to_string(),
    })?;
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned());
    let name = stem.unwrap_or_else(|| shown.clone());
    Ok((text, shown, name))
}

/// Parses a scenario from text; `path` appears in messages, and `name` is used if the text gives no name.
///
/// # Errors
/// As [`read_scenario`].
pub fn parse_scenario(text: &str, path: &str, name: &str) -> Result<Scenario, ScenarioFileError> {
    if has_form(text) {
        return Err(Source { text, path }.keys_error(
            "the `form` key describes an operator of the family, which `hoid simulate --scenario` can simulate but a \
             study cannot use; remove `form` to use the operator K_e (T_L s + 1)",
        ));
    }
    let file: File = toml::from_str(text).map_err(|error| syntax_error(text, path, &error))?;
    let source = Source { text, path };
    let scenario = source.scenario(file, name)?;
    scenario.resolve().map_err(|error| source.model_error(error))?;
    Ok(scenario)
}

fn syntax_error(text: &str, path: &str, error: &toml::de::Error) -> ScenarioFileError {
    ScenarioFileError::Syntax {
        path: path.to_owned(),
        line: error.span().map_or(1, |span| line_of(text, span.start)),
        reason: escape_control_characters(error.message().trim_end()),
    }
}

/// Returns the JSON schema of scenario files of the operator family.
pub fn family_scenario_schema() -> String {
    let schema = schemars::schema_for!(FamilyFile);
    format!("{:#}", schema.as_value())
}

/// Returns the JSON schema of scenario files of the thesis task.
pub fn scenario_schema() -> String {
    let schema = schemars::schema_for!(File);
    format!("{:#}", schema.as_value())
}
