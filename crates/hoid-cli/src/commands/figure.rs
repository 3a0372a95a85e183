//! Writing of figures to files in several formats.

use std::path::Path;

use hoid::io::write_atomically;
use hoid::report::figures::{FigureFormat, with_width_mm};

use crate::{error::CliError, output};

/// Checks, before anything is read, that a figure can be written in the format given by the name of its file.
///
/// # Errors
/// [`CliError::Usage`] if the format is not supported.
pub fn check(path: &Path) -> Result<(), CliError> {
    format_of(path).map(|_| ())
}

fn format_of(path: &Path) -> Result<FigureFormat, CliError> {
    let refused = |why: &str| CliError::Usage(format!("--figure {}: {why}", path.display()));
    let format =
        FigureFormat::of(path).ok_or_else(|| refused("expected a file name that ends in .svg, .pdf or .png"))?;
    if !format.is_built() {
        return Err(refused(
            "this build of hoid cannot write PDF or PNG; choose a file name that ends in .svg, or build hoid with \
             PDF and PNG support: cargo build --release -p hoid-cli --features pdf-png",
        ));
    }
    Ok(format)
}

/// Writes a figure, scaled to a width on paper if one is given.
///
/// # Errors
/// Errors of the conversion to the format and of writing.
pub fn write(path: &Path, svg: &str, width_mm: Option<f64>) -> Result<(), CliError> {
    let sized = width_mm.map(|mm| with_width_mm(svg, mm));
    let bytes = format_of(path)?.bytes(sized.as_deref().unwrap_or(svg))?;
    write_atomically(path, |file| file.write_all(&bytes))?;
    output::add_notice("", format!("figure: {}", path.display()));
    Ok(())
}
