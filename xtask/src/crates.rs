//! Rules for the dependencies of the workspace with all features, checked by `cargo metadata`: licences, unwanted
//! crates, one version of each crate, and a limited number of crates.
//!
//! A licence is an SPDX expression (Annex D: `WITH` binds more tightly than `AND`, and `AND` more tightly than `OR`);
//! the `/` of older manifests means `OR`. Security advisories need the network and are checked by the hosted workflows.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use crate::process::{cargo_command, output};

/// Licences compatible with the distribution of hoid under `MIT OR Apache-2.0`.
const ALLOWED_LICENCES: [&str; 11] = [
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "MIT",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Unwanted crates with reasons. A `*` at the end or the start of a name matches all names with that prefix or suffix.
const BANNED_CRATES: [(&str, &str); 16] = [
    (
        "*-sys",
        "it links a library that is not Rust: hoid builds with cargo alone, everywhere",
    ),
    ("cmake", "hoid builds with cargo alone"),
    ("bindgen", "hoid builds with cargo alone"),
    ("openssl", "hoid uses no network"),
    ("native-tls", "hoid uses no network"),
    ("rustls", "hoid uses no network"),
    ("reqwest", "hoid uses no network"),
    ("hyper", "hoid uses no network"),
    ("tokio", "hoid uses no network"),
    ("arrow*", "Parquet is read without it, with a fifth of the build time"),
    ("hdf5", "it links the C library; hdf5-pure reads .mat 7.3"),
    ("ndarray", "nalgebra is the only matrix crate"),
    ("serde_yaml", "it is not maintained; hoid reads TOML and JSON"),
    ("atty", "it is not maintained; use std::io::IsTerminal"),
    ("ansi_term", "it is not maintained"),
    ("lazy_static", "use std::sync::OnceLock or LazyLock"),
];
/// Crates of [`BANNED_CRATES`] that are tolerated, with reasons.
const TOLERATED_CRATES: [(&str, &str); 5] = [
    ("core-foundation-sys", "the system of macOS"),
    ("js-sys", "the browser, which hoid is not built for"),
    ("linux-raw-sys", "numbers of Linux, nothing to link"),
    ("windows-sys", "the system of Windows"),
    (
        "ndarray",
        "arrays of Python are handed over by it, in hoid-python alone",
    ),
];

/// Crates that are permitted in several versions: number of versions, and the reason.
const CRATES_WITH_SEVERAL_VERSIONS: [(&str, usize, &str); 9] = [
    ("bitflags", 2, "png, of resvg: feature pdf-png"),
    ("getrandom", 3, "const-random and ahash, of parquet"),
    (
        "glam",
        4,
        "options of nalgebra, none of which is on: named by the lock file, not built",
    ),
    ("kurbo", 2, "usvg and its font reader: feature pdf-png"),
    ("miniz_oxide", 2, "png, of resvg: feature pdf-png"),
    ("num-bigint", 2, "an option of parquet, not built"),
    ("r-efi", 2, "the versions of getrandom, on UEFI alone"),
    ("roxmltree", 2, "fontconfig-parser, of usvg: feature pdf-png"),
    ("syn", 2, "zerocopy and windows-core, and the test of imports"),
];

/// Maximum number of crates in the dependency tree of `hoid-cli` on Linux, including the crates of hoid. A further
/// crate needs a reason and a row in the table of dependencies of ARCHITECTURE.md.
const MAX_CRATES: usize = 155;

/// Checks all rules.
pub fn check() -> Result<(), String> {
    let mut metadata = cargo_command();
    metadata.args(["metadata", "--format-version", "1", "--locked", "--all-features"]);
    let metadata: Value = serde_json::from_str(&output(&mut metadata)?)
        .map_err(|error| format!("the output of cargo metadata is not JSON: {error}"))?;
    let packages = packages(&metadata);
    if packages.is_empty() {
        return Err(String::from("cargo metadata names no packages"));
    }
    let mut wrong = Vec::new();
    wrong.extend(packages.iter().filter_map(licence_problem));
    wrong.extend(packages.iter().filter_map(ban_reason));
    wrong.extend(version_problems(&packages));
    let mut tree = cargo_command();
    tree.args(["tree", "--locked", "-p", "hoid-cli", "-e", "normal", "--prefix", "none"])
        .args(["--target", "x86_64-unknown-linux-gnu", "--format", "{p}"]);
    let tree = output(&mut tree)?;
    let crates: BTreeSet<&str> = tree.lines().map(|line| line.trim_end_matches(" (*)")).collect();
    if crates.len() > MAX_CRATES {
        wrong.push(format!(
            "hoid-cli is built from {} crates, expected at most {MAX_CRATES}: leave one out, or raise MAX_CRATES in \
             xtask/src/crates.rs with the reason in ARCHITECTURE.md",
            crates.len()
        ));
    }
    if wrong.is_empty() {
        println!(
            "{} crates in all, {} in hoid-cli: licences, bans and versions follow the rules",
            packages.len(),
            crates.len()
        );
        return Ok(());
    }
    Err(format!("{}\n(the rules are in xtask/src/crates.rs)", wrong.join("\n")))
}

/// A crate outside the workspace.
struct Package {
    name: String,
    version: String,
    licence: Option<String>,
    source: String,
}

fn packages(metadata: &Value) -> Vec<Package> {
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let package = |value: &Value| {
        Some(Package {
            name: text(&value["name"])?,
            version: text(&value["version"])?,
            licence: text(&value["license"]),
            // Crates of the workspace have no source and are omitted.
            source: text(&value["source"])?,
        })
    };
    let all = metadata["packages"].as_array();
    all.into_iter().flatten().filter_map(package).collect()
}

/// Returns the problem with the origin or the licence of a crate; `None` if there is none.
fn licence_problem(package: &Package) -> Option<String> {
    let Package {
        name, version, source, ..
    } = package;
    if !source.starts_with("registry+https://github.com/rust-lang/crates.io-index") {
        return Some(format!("{name} {version} comes from {source}, expected crates.io"));
    }
    let Some(licence) = &package.licence else {
        return Some(format!(
            "{name} {version} states no licence by name: take another crate"
        ));
    };
    match is_permitted_licence(licence) {
        Some(true) => None,
        Some(false) => Some(format!(
            "{name} {version} is under {licence}, expected {}: take another crate",
            ALLOWED_LICENCES.join(", ")
        )),
        None => Some(format!("{name} {version}: {licence:?} is not a licence expression")),
    }
}

/// True if a licence expression permits the distribution of the crate; `None` if it cannot be parsed.
fn is_permitted_licence(expression: &str) -> Option<bool> {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut rest = words.as_slice();
    let allowed = parse_or(&mut rest)?;
    rest.is_empty().then_some(allowed)
}

fn parse_or(rest: &mut &[&str]) -> Option<bool> {
    let mut allowed = parse_and(rest)?;
    while consume(rest, "OR") {
        allowed |= parse_and(rest)?;
    }
    Some(allowed)
}

fn parse_and(rest: &mut &[&str]) -> Option<bool> {
    let mut allowed = parse_term(rest)?;
    while consume(rest, "AND") {
        allowed &= parse_term(rest)?;
    }
    Some(allowed)
}

fn parse_term(rest: &mut &[&str]) -> Option<bool> {
    if consume(rest, "(") {
        let allowed = parse_or(rest)?;
        return consume(rest, ")").then_some(allowed);
    }
    let (name, behind) = rest.split_first()?;
    if ["OR", "AND", "WITH", ")"].contains(name) {
        return None;
    }
    *rest = behind;
    let mut licence = (*name).to_owned();
    if consume(rest, "WITH") {
        let (exception, behind) = rest.split_first()?;
        *rest = behind;
        licence = format!("{licence} WITH {exception}");
    }
    Some(ALLOWED_LICENCES.contains(&licence.as_str()))
}

fn consume(rest: &mut &[&str], word: &str) -> bool {
    match rest.split_first() {
        Some((first, behind)) if *first == word => {
            *rest = behind;
            true
        }
        _ => false,
    }
}

/// Returns the reason why a crate is unwanted; `None` if it is not.
fn ban_reason(package: &Package) -> Option<String> {
    let name = package.name.as_str();
    if TOLERATED_CRATES.iter().any(|(known, _)| *known == name) {
        return None;
    }
    let matches = |pattern: &str| match (pattern.strip_prefix('*'), pattern.strip_suffix('*')) {
        (Some(end), _) => name.ends_with(end),
        (_, Some(start)) => {
            name == start
                || name
                    .strip_prefix(start)
                    .is_some_and(|rest| rest.starts_with(['-', '_']))
        }
        _ => name == pattern,
    };
    let (_, why) = BANNED_CRATES.iter().find(|(pattern, _)| matches(pattern))?;
    Some(format!("{name} {} is banned: {why}", package.version))
}

/// Returns the crates with more versions than permitted, and outdated entries of [`CRATES_WITH_SEVERAL_VERSIONS`].
fn version_problems(packages: &[Package]) -> Vec<String> {
    let mut versions: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for package in packages {
        versions.entry(&package.name).or_default().insert(&package.version);
    }
    let stated = |name: &str| {
        CRATES_WITH_SEVERAL_VERSIONS
            .iter()
            .find(|(known, ..)| *known == name)
            .map_or(1, |(_, n, _)| *n)
    };
    let mut wrong: Vec<String> = versions
        .iter()
        .filter(|(name, found)| found.len() > stated(name))
        .map(|(name, found)| {
            let found: Vec<&str> = found.iter().copied().collect();
            format!(
                "{name} is present in {} versions ({}), expected {}: cargo tree --duplicates shows which crates need them",
                found.len(),
                found.join(", "),
                stated(name)
            )
        })
        .collect();
    wrong.extend(CRATES_WITH_SEVERAL_VERSIONS.iter().filter_map(|(name, n, _)| {
        let found = versions.get(name).map_or(0, BTreeSet::len);
        (found < *n).then(|| format!("{name} is present in {found} versions, but SEVERAL has {n}: lower it"))
    }));
    wrong
}

#[cfg(test)]
mod tests {
    use super::*;

    fn package(name: &str, version: &str, licence: Option<&str>) -> Package {
        Package {
            name: name.into(),
            version: version.into(),
            licence: licence.map(str::to_owned),
            source: "registry+https://github.com/rust-lang/crates.io-index".into(),
        }
    }

    #[test]
    fn licence_expressions_are_evaluated() {
        for (expression, expected) in [
            ("MIT", Some(true)),
            ("MIT/Apache-2.0", Some(true)),
            ("GPL-3.0-only", Some(false)),
            ("GPL-3.0-only OR MIT", Some(true)),
            ("MIT AND GPL-3.0-only", Some(false)),
            ("MIT OR GPL-3.0-only AND LGPL-3.0-only", Some(true)),
            ("(MIT OR GPL-3.0-only) AND Unicode-3.0", Some(true)),
            ("(MIT OR Apache-2.0) AND MPL-2.0", Some(false)),
            ("Apache-2.0 WITH LLVM-exception", Some(true)),
            ("GPL-2.0 WITH Classpath-exception-2.0", Some(false)),
            ("", None),
            ("MIT OR", None),
            ("(MIT", None),
            ("MIT Apache-2.0", None),
        ] {
            assert_eq!(is_permitted_licence(expression), expected, "{expression}");
        }
        assert!(licence_problem(&package("a", "1.0.0", None)).is_some_and(|said| said.contains("states no licence")));
        let mut foreign = package("a", "1.0.0", Some("MIT"));
        assert_eq!(licence_problem(&foreign), None);
        foreign.source = "git+https://example.org/a".into();
        assert!(licence_problem(&foreign).is_some_and(|said| said.contains("expected crates.io")));
    }

    #[test]
    fn banned_crates_and_their_families_are_found() {
        for name in ["openssl-sys", "openssl", "arrow", "arrow-array", "lazy_static"] {
            assert!(ban_reason(&package(name, "1.0.0", None)).is_some(), "{name}");
        }
        for name in ["arrowhead", "sysinfo", "hdf5-pure", "linux-raw-sys"] {
            assert_eq!(ban_reason(&package(name, "1.0.0", None)), None, "{name}");
        }
    }

    #[test]
    fn second_version_must_be_declared() {
        let two = [package("a", "1.0.0", None), package("a", "2.0.0", None)];
        let said = version_problems(&two);
        assert!(
            said.iter()
                .any(|said| said.contains("a is present in 2 versions (1.0.0, 2.0.0)")),
            "{said:?}"
        );
        let stale = version_problems(&two[..1]);
        assert_eq!(stale.len(), CRATES_WITH_SEVERAL_VERSIONS.len(), "{stale:?}");
    }
}
