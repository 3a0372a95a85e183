//! The templates of the pages, and how they are filled.

use minijinja::{Environment, UndefinedBehavior, Value, context};

use crate::ReportError;

const TEMPLATES: [(&str, &str); 6] = [
    ("report.html", include_str!("../templates/report.html")),
    ("track.html", include_str!("../templates/track.html")),
    ("group.html", include_str!("../templates/group.html")),
    ("reproduction.html", include_str!("../templates/reproduction.html")),
    ("parts.html", include_str!("../templates/parts.html")),
    ("style.css", include_str!("../templates/style.css")),
];

/// The page of a template with its values.
///
/// # Errors
/// [`ReportError::Template`] for a defect of this crate.
pub fn render(name: &str, values: Value) -> Result<String, ReportError> {
    let defect = |e: minijinja::Error| ReportError::Template { reason: e.to_string() };
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::SemiStrict);
    for (name, source) in TEMPLATES {
        environment.add_template(name, source).map_err(defect)?;
    }
    environment
        .get_template(name)
        .map_err(defect)?
        .render(values)
        .map_err(defect)
}

/// Names and values for the table of settings.
pub fn facts(pairs: &[(String, String)]) -> Vec<Value> {
    pairs.iter().map(|(label, text)| context! { label, text }).collect()
}
