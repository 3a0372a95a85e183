//! `hoid fmu`: contents of a unit, and rejected input. The run in a simulator is tested with the Python package.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use tempfile::TempDir;

use common::{failure_of, stdout_of};

/// Writes the header of a shared library for Linux with the function names of the library of hoid.
fn write_library(folder: &TempDir) {
    let mut bytes = vec![0_u8; 64];
    bytes[..6].copy_from_slice(b"\x7fELF\x02\x01");
    bytes[18] = 62;
    bytes.extend(b"\0hoid_abi_version\0fmi2Instantiate\0fmi3InstantiateCoSimulation\0");
    fs::write(folder.path().join("libhoid.so"), bytes).unwrap();
}

#[test]
fn fmu_is_complete_and_reproducible() {
    let folder = TempDir::new().unwrap();
    write_library(&folder);
    let with = |more: &[&str]| {
        let default = ["fmu", "--library", "libhoid.so", "--out", "a.fmu"];
        let printed = stdout_of(folder.path(), &[&default[..], more].concat());
        (printed, fs::read(folder.path().join("a.fmu")).unwrap())
    };
    let (printed, bytes) = with(&[]);
    assert!(printed.contains("FMI 2.0") && printed.contains("a.fmu"), "{printed}");
    assert!(bytes.starts_with(b"PK"));
    assert_eq!(with(&[]).1, bytes);
    let (printed, other) = with(&[
        "--fmi",
        "3",
        "--sample-time",
        "0.02",
        "--controlled-element",
        "90/(s(s+6))",
    ]);
    assert!(printed.contains("FMI 3.0") && printed.contains("0.02 s"), "{printed}");
    assert_ne!(other, bytes);
    let (printed, _) = with(&["--operator", "C4", "--seed", "3"]);
    assert!(printed.contains("e in, u out"), "{printed}");
    fs::write(
        folder.path().join("mine.toml"),
        "condition = \"C1\"\nsample_time_s = 0.02\n",
    )
    .unwrap();
    let (printed, _) = with(&["--operator", "mine.toml"]);
    assert!(printed.contains("0.02 s"), "{printed}");
}

#[test]
fn invalid_fmu_requests_give_the_reason() {
    let folder = TempDir::new().unwrap();
    write_library(&folder);
    fs::write(folder.path().join("text"), "text").unwrap();
    fs::write(folder.path().join("fit.json"), "{}").unwrap();
    let quick =
        "form = \"gain\"\nneuromuscular = false\n[initial]\nK = 1\ntau_e_s = 0.004\ncontrolled_element = \"1/s\"\n";
    fs::write(folder.path().join("quick.toml"), quick).unwrap();
    let of = |more: &[&str]| failure_of(folder.path(), &[&["fmu", "--out", "a.fmu"][..], more].concat());
    let with = |more: &[&str]| of(&[&["--library", "libhoid.so"][..], more].concat());
    for (arguments, reason) in [
        (&["--library", "text"][..], "cargo xtask ffi"),
        (&["--library", "nowhere.so"], "nowhere.so"),
    ] {
        let (_, message) = of(arguments);
        assert!(message.contains(reason), "{message}");
    }
    for (arguments, reason) in [
        (&["--prior", "fit.json"][..], "fit.json"),
        (&["--prior", "omega_nm=1"], "omega_nm"),
        (&["--method", "rpem", "--prior", "none"], "adaptive"),
        (&["--sample-time", "0"], "sample time"),
        (&["--operator", "nowhere.toml"], "nowhere.toml"),
        // The control of this operator would depend on the error of the same sample.
        (&["--operator", "quick.toml"], "tau_e"),
        (&["--operator", "C4", "--method", "rpem"], "--operator"),
        (&["--seed", "3"], "--operator"),
    ] {
        let (code, message) = with(arguments);
        assert!(code > 0 && message.contains(reason), "{arguments:?}: {message}");
    }
    let (_, message) = failure_of(
        folder.path(),
        &["fmu", "--out", "libhoid.so", "--library", "libhoid.so"],
    );
    assert!(message.contains("libhoid.so"), "{message}");
}
