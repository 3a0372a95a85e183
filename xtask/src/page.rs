//! Generated passages in pages of the book and of `research/notes`.

use std::{fs, path::Path};

/// Writes a text between the markers of its passage in a page; a dry run leaves the page unchanged.
///
/// # Errors
/// The reason, if the page cannot be read or written, or does not contain these markers.
pub fn update_section(page: &str, passage: &str, text: &str, dry: bool) -> Result<(), String> {
    if dry {
        return Ok(());
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/src").join(page);
    let said = |e: std::io::Error| format!("{}: {e}", path.display());
    let old = fs::read_to_string(&path).map_err(said)?;
    let new = replace_section(&old, passage, text).map_err(|reason| format!("{}: {reason}", path.display()))?;
    fs::write(&path, new).map_err(said)
}

fn replace_section(page: &str, passage: &str, text: &str) -> Result<String, String> {
    let (begin, end) = (
        format!("<!-- generated: {passage} -->"),
        format!("<!-- end: {passage} -->"),
    );
    let parts = page
        .split_once(&begin)
        .and_then(|(before, rest)| Some((before, rest.split_once(&end)?.1)));
    let Some((before, after)) = parts else {
        return Err(format!("found no {begin} ... {end}; put them where the table belongs"));
    };
    Ok(format!("{before}{begin}\n\n{}\n\n{end}{after}", text.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_generated_section_is_replaced() {
        let page = "a\n<!-- generated: x -->\nold\n<!-- end: x -->\nb\n";
        let once = replace_section(page, "x", "new\n").unwrap();
        assert_eq!(once, "a\n<!-- generated: x -->\n\nnew\n\n<!-- end: x -->\nb\n");
        assert_eq!(replace_section(&once, "x", "new").unwrap(), once);
        assert!(replace_section(page, "y", "new").is_err());
    }
}
