//! The golden set: recorded answers of the program, which show the effect of a modification.
//!
//! `fixtures/golden/calls.toml` lists the inputs and the calls, `fixtures/golden/command-line/` contains their answers.
//! Inputs are simulated in a temporary folder. `python/tests/test_golden.py` reads the same list.
//! `HOID_UPDATE_GOLDEN=1 cargo test -p hoid-cli --test golden` updates the answers.
#![allow(clippy::unwrap_used)]

mod answer;
mod compare;
mod inputs;
mod manifest;

use std::{
    fs,
    path::{Path, PathBuf},
};

use rayon::prelude::*;
use serde_json::Value;

use manifest::{Call, Manifest};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/golden")
}

#[test]
fn answers_match_the_golden_files() {
    let manifest: Manifest = toml::from_str(&fs::read_to_string(folder().join("calls.toml")).unwrap()).unwrap();
    let at = tempfile::TempDir::new().unwrap();
    inputs::write(at.path(), &manifest.inputs);
    let kept = folder().join("command-line");
    let renew = std::env::var_os("HOID_UPDATE_GOLDEN").is_some();
    if renew {
        fs::create_dir_all(&kept).unwrap();
    }
    let calls = manifest.calls.par_iter();
    let changes: Vec<String> = calls
        .flat_map_iter(|call| {
            let now = answer::of(at.path(), call);
            let file = kept.join(format!("{}.json", call.name));
            if renew {
                fs::write(&file, compare::line_per_key(&now)).unwrap();
                return Vec::new();
            }
            let was = fs::read_to_string(&file).map_or(Value::Null, |text| serde_json::from_str(&text).unwrap());
            let tolerance = call.tolerance.unwrap_or(manifest.tolerance);
            compare::changes(&call.name, &was, &now, tolerance)
        })
        .collect();
    assert!(
        changes.is_empty(),
        "{} answers changed; where that is meant, report it in the commit and renew them by HOID_UPDATE_GOLDEN=1:\n{}",
        changes.len(),
        changes.join("\n")
    );
}

#[test]
fn every_golden_file_belongs_to_a_call() {
    let manifest: Manifest = toml::from_str(&fs::read_to_string(folder().join("calls.toml")).unwrap()).unwrap();
    let kept_of = |of: &str, has: &dyn Fn(&Call) -> bool| {
        let mut names: Vec<String> = manifest
            .calls
            .iter()
            .filter(|call| has(call))
            .map(|call| format!("{}.json", call.name))
            .collect();
        names.sort();
        let twice = names.windows(2).find(|pair| pair[0] == pair[1]);
        assert!(twice.is_none(), "{twice:?}");
        let mut files: Vec<String> = fs::read_dir(folder().join(of))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        files.sort();
        assert_eq!(files, names, "{of}");
    };
    kept_of("command-line", &|_| true);
    kept_of("python", &|call| call.python.is_some());
}
