//! Checks the dependencies between the crates against ARCHITECTURE.md.
#![allow(clippy::unwrap_used)]

use std::{collections::BTreeMap, process::Command};

use serde_json::Value;

/// The crates of the workspace on which each crate may depend.
const ALLOWED_DEPENDENCIES: [(&str, &[&str]); 23] = [
    ("hoid-numerics", &[]),
    ("hoid-core", &["hoid-numerics"]),
    ("hoid-embedded", &["hoid-core"]),
    ("hoid-model", &["hoid-core"]),
    (
        "hoid-ident",
        &["hoid-numerics", "hoid-core", "hoid-lanes", "hoid-model"],
    ),
    ("hoid-lanes", &[]),
    (
        "hoid-track",
        &["hoid-numerics", "hoid-core", "hoid-ident", "hoid-model"],
    ),
    (
        "hoid-survey",
        &["hoid-numerics", "hoid-core", "hoid-ident", "hoid-model", "hoid-track"],
    ),
    ("hoid-sim", &["hoid-core", "hoid-lanes", "hoid-model"]),
    ("hoid-io", &["hoid-model"]),
    (
        "hoid-analysis",
        &["hoid-numerics", "hoid-model", "hoid-ident", "hoid-io", "hoid-track"],
    ),
    (
        "hoid-ffi",
        &[
            "hoid-ident",
            "hoid-io",
            "hoid-model",
            "hoid-sim",
            "hoid-survey",
            "hoid-track",
        ],
    ),
    (
        "hoid-thesis",
        &[
            "hoid-numerics",
            "hoid-model",
            "hoid-ident",
            "hoid-sim",
            "hoid-io",
            "hoid-track",
            "hoid-study",
            "hoid-report",
        ],
    ),
    (
        "hoid-challenge",
        &[
            "hoid-model",
            "hoid-ident",
            "hoid-sim",
            "hoid-survey",
            "hoid-track",
            "hoid-io",
        ],
    ),
    (
        "hoid-evidence",
        &[
            "hoid",
            "hoid-core",
            "hoid-ident",
            "hoid-model",
            "hoid-report",
            "hoid-sim",
            "hoid-study",
            "hoid-thesis",
            "hoid-survey",
            "hoid-track",
        ],
    ),
    (
        "hoid-study",
        &[
            "hoid-numerics",
            "hoid-analysis",
            "hoid-model",
            "hoid-ident",
            "hoid-sim",
            "hoid-survey",
            "hoid-track",
            "hoid-io",
        ],
    ),
    (
        "hoid-design",
        &[
            "hoid-numerics",
            "hoid-model",
            "hoid-ident",
            "hoid-io",
            "hoid-analysis",
            "hoid-study",
        ],
    ),
    (
        "hoid-report",
        &[
            "hoid-numerics",
            "hoid-analysis",
            "hoid-design",
            "hoid-model",
            "hoid-ident",
            "hoid-io",
            "hoid-study",
            "hoid-track",
        ],
    ),
    (
        "hoid-lab",
        &[
            "hoid-numerics",
            "hoid-analysis",
            "hoid-model",
            "hoid-ident",
            "hoid-sim",
            "hoid-io",
            "hoid-survey",
            "hoid-track",
            "hoid-study",
        ],
    ),
    (
        "hoid",
        &[
            "hoid-numerics",
            "hoid-analysis",
            "hoid-core",
            "hoid-design",
            "hoid-model",
            "hoid-ident",
            "hoid-lanes",
            "hoid-sim",
            "hoid-io",
            "hoid-study",
            "hoid-thesis",
            "hoid-survey",
            "hoid-track",
            "hoid-report",
        ],
    ),
    ("hoid-cli", &["hoid", "hoid-lab"]),
    (
        "hoid-python",
        &[
            "hoid-analysis",
            "hoid-design",
            "hoid-model",
            "hoid-ident",
            "hoid-sim",
            "hoid-study",
            "hoid-io",
            "hoid-report",
            "hoid-thesis",
            "hoid-survey",
            "hoid-track",
        ],
    ),
    ("xtask", &[]),
];

fn packages() -> Vec<Value> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

#[test]
fn crates_depend_only_downwards() {
    let allowed: BTreeMap<&str, &[&str]> = ALLOWED_DEPENDENCIES.into_iter().collect();
    let packages = packages();
    assert_eq!(
        packages.len(),
        ALLOWED_DEPENDENCIES.len(),
        "a new crate needs a line here and in ARCHITECTURE.md"
    );
    for package in &packages {
        let name = package["name"].as_str().unwrap();
        let may = allowed
            .get(name)
            .unwrap_or_else(|| panic!("{name} needs a line here and in ARCHITECTURE.md"));
        for dependency in package["dependencies"].as_array().unwrap() {
            let to = dependency["name"].as_str().unwrap();
            // Tests may depend on all crates.
            let for_tests = dependency["kind"] == "dev";
            if to.starts_with("hoid") && !for_tests {
                assert!(may.contains(&to), "{name} must not depend on {to}");
            }
        }
    }
}

#[test]
fn kernel_depends_only_on_libm() {
    let packages = packages();
    for (name, expected) in [
        ("hoid-core", &["hoid-numerics", "libm"][..]),
        ("hoid-numerics", &["libm"]),
    ] {
        let package = packages.iter().find(|p| p["name"] == name).unwrap();
        let dependencies: Vec<&str> = package["dependencies"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|d| d["kind"] != "dev")
            .map(|d| d["name"].as_str().unwrap())
            .collect();
        assert_eq!(dependencies, expected);
    }
}
