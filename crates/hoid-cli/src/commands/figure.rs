//! Figures as files: which endings there are, and how one is written.

use std::path::Path;

use hoid_io::write_atomically;
use hoid_report::figures::with_width_mm;

use crate::{error::CliError, output};

/// Whether a figure can be written in the format that its name says: known before anything is read.
///
/// # Errors
/// [`CliError::Usage`].
pub fn check(path: &Path) -> Result<(), CliError> {
    match path.extension() {
        Some(ending) if ending.eq_ignore_ascii_case("svg") => Ok(()),
        _ => Err(CliError::Usage(format!(
            "--figure {}: figures are written as .svg; name the file so, and convert it to PDF or PNG with a program such as \
             Inkscape or a browser",
            path.display()
        ))),
    }
}

/// Writes a figure, with a width on paper where one was given.
///
/// # Errors
/// Those of writing.
pub fn write(path: &Path, svg: &str, width_mm: Option<f64>) -> Result<(), CliError> {
    let sized;
    let svg = match width_mm {
        Some(mm) => {
            sized = with_width_mm(svg, mm);
            &sized
        }
        None => svg,
    };
    write_atomically(path, |file| file.write_all(svg.as_bytes()))?;
    output::notice("", format!("figure: {}", path.display()));
    Ok(())
}
