//! The committed header equals the header generated from the sources.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

use std::{collections::BTreeSet, fs, path::Path, process::Command};

const FOLDER: &str = env!("CARGO_MANIFEST_DIR");

fn header() -> String {
    fs::read_to_string(Path::new(FOLDER).join("include/hoid.h")).unwrap()
}

/// Compares the header with the output of cbindgen, if cbindgen is installed.
#[test]
fn header_matches_cbindgen() {
    let made = Command::new("cbindgen")
        .args(["--quiet", "--config", "cbindgen.toml", "."])
        .current_dir(FOLDER)
        .output();
    let Ok(made) = made else {
        eprintln!("skipped: cbindgen is not here (cargo install cbindgen --locked)");
        return;
    };
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    assert_eq!(
        String::from_utf8(made.stdout).unwrap(),
        header(),
        "renew it: cargo xtask ffi --header"
    );
}

/// Every function is declared with the same number of arguments, and no other function is declared.
#[test]
fn header_declares_the_functions_of_the_sources() {
    let mut in_sources = BTreeSet::new();
    for file in fs::read_dir(Path::new(FOLDER).join("src")).unwrap() {
        let path = file.unwrap().path();
        if !path.is_file() {
            continue;
        }
        let text = fs::read_to_string(path).unwrap();
        in_sources.extend(functions(&text, "extern \"C\" fn "));
    }
    let bare: String = (header().split("/*"))
        .map(|part| part.split_once("*/").map_or(part, |(_, code)| code).to_owned())
        .collect();
    let declaration = |text: &str| {
        let (before, rest) = text.split_once('(')?;
        let name = before.rsplit([' ', '*', '\n']).next()?;
        Some((name.to_owned(), arguments(rest)))
    };
    let in_header: BTreeSet<_> = bare.split(';').filter_map(declaration).collect();
    assert_eq!(in_sources, in_header);
    assert!(in_sources.len() > 15);
}

fn functions(text: &str, before: &str) -> Vec<(String, usize)> {
    let parts = text.split(before).skip(1);
    let one = |part: &str| {
        let (name, rest) = part.split_once('(')?;
        name.starts_with("hoid_").then(|| (name.to_owned(), arguments(rest)))
    };
    parts.filter_map(one).collect()
}

/// Returns the number of arguments up to the closing bracket.
fn arguments(rest: &str) -> usize {
    let inside = rest.split(')').next().unwrap();
    let each = inside.split(',').map(str::trim);
    each.filter(|argument| !argument.is_empty() && *argument != "void")
        .count()
}
