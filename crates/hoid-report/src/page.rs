//! Rendering of the page templates, and writing of pages.

use std::path::{Path, PathBuf};

use hoid_io::{make_directory, write_atomically};
use minijinja::{Environment, UndefinedBehavior, Value, context};

use crate::ReportError;

const TEMPLATES: [(&str, &str); 5] = [
    ("report.html", include_str!("../templates/report.html")),
    ("track.html", include_str!("../templates/track.html")),
    ("group.html", include_str!("../templates/group.html")),
    ("parts.html", include_str!("../templates/parts.html")),
    ("style.css", include_str!("../templates/style.css")),
];

/// Renders a template of this crate with these values.
///
/// # Errors
/// [`ReportError::Template`] if the template cannot be rendered, which is a defect of this crate.
pub(crate) fn render(name: &str, values: Value) -> Result<String, ReportError> {
    render_with(&[], name, values)
}

/// Renders a template of this crate or one of `own`, the names and contents of additional templates. Additional
/// templates can use the parts and the style of the templates of this crate.
///
/// # Errors
/// [`ReportError::Template`] if the template cannot be rendered.
pub fn render_with(own: &[(&str, &str)], name: &str, values: Value) -> Result<String, ReportError> {
    let defect = |e: minijinja::Error| ReportError::Template { reason: e.to_string() };
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::SemiStrict);
    for &(name, source) in TEMPLATES.iter().chain(own) {
        environment
            .add_template_owned(name.to_owned(), source.to_owned())
            .map_err(defect)?;
    }
    environment
        .get_template(name)
        .map_err(defect)?
        .render(values)
        .map_err(defect)
}

/// Converts pairs of name and value for the table of settings.
pub(crate) fn settings_rows(pairs: &[(String, String)]) -> Vec<Value> {
    pairs.iter().map(|(label, text)| context! { label, text }).collect()
}

/// Writes a page to a directory.
///
/// # Errors
/// [`ReportError::Io`] if the page cannot be written.
pub fn write_page(directory: &Path, name: &str, html: &str) -> Result<PathBuf, ReportError> {
    let path = directory.join(name);
    write_atomically(&path, |file| file.write_all(html.as_bytes()))?;
    Ok(path)
}

/// Writes a page as `report.html` to a directory, which is created if it does not exist.
///
/// # Errors
/// [`ReportError::Io`] if the page cannot be written.
pub fn write_report(directory: &Path, html: &str) -> Result<PathBuf, ReportError> {
    make_directory(directory)?;
    write_page(directory, "report.html", html)
}
