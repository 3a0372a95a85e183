//! The kernel on microcontrollers: built for Cortex-M4F and RISC-V, run under QEMU, and compared digit by digit with
//! the host and with `hoid track`.
//!
//! If a program is missing, the step is skipped and the command that installs the program is reported.

use std::{
    env, fs,
    path::Path,
    process::{Command, Stdio},
};

use crate::process::{TEST_BUILD_ARGUMENTS, cargo, installed_targets, output, target_directory};

/// Target that is built and run; `RISC_V_TARGET` is only built.
pub const CORTEX_TARGET: &str = "thumbv7em-none-eabihf";
const RISC_V_TARGET: &str = "riscv32imac-unknown-none-elf";
/// Default length of the run under QEMU (s); QEMU runs at a fiftieth of the host's speed.
const DEFAULT_RUN_S: usize = 15;
const RATE_HZ: usize = 100;

/// Builds and runs the kernel and compares the results; `--all` runs the whole 82 s under QEMU as well.
pub fn embedded(arguments: &[String]) -> Result<(), String> {
    let all = match arguments {
        [] => false,
        [one] if one == "--all" => true,
        _ => return Err("usage: cargo xtask embedded [--all]".to_owned()),
    };
    let installed = installed_targets();
    for target in [CORTEX_TARGET, RISC_V_TARGET] {
        if !installed.iter().any(|one| one == target) {
            println!("skipped: hoid on {target} (rustup target add {target})");
            continue;
        }
        cargo(&["build", "--release", "-p", "hoid-core", "--target", target], &[])?;
    }
    let target = target_directory();
    let directory = target.join("embedded");
    fs::create_dir_all(&directory).map_err(|e| format!("{}: {e}", directory.display()))?;
    let track = track_run(&target, &directory)?;
    let host =
        output(Command::new(target.join("debug").join(executable_name("hoid-embedded"))).current_dir(&directory))?;
    check_trace("the host", &host, &track)?;

    if !installed.iter().any(|one| one == CORTEX_TARGET) {
        return Ok(());
    }
    cargo(
        &["build", "--release", "-p", "hoid-embedded", "--target", CORTEX_TARGET],
        &[],
    )?;
    let program = target.join(CORTEX_TARGET).join("release/hoid-embedded");
    let emulator = "qemu-system-arm";
    let there = Command::new(emulator).arg("--version").stdout(Stdio::null()).status();
    if !there.is_ok_and(|status| status.success()) {
        println!("skipped: hoid on {CORTEX_TARGET} under QEMU (apt-get install {emulator})");
        return Ok(());
    }
    if !all {
        shorten(&directory.join("run.csv"))?;
    }
    let board = output(
        Command::new(emulator)
            .args([
                "-M",
                "mps2-an386",
                "-nographic",
                "-semihosting-config",
                "enable=on,target=native",
            ])
            .arg("-kernel")
            .arg(&program)
            .current_dir(&directory),
    )?;
    check_trace(CORTEX_TARGET, &board, &track)?;
    if let Ok(size) = output(Command::new("size").arg(&program)) {
        print!("{size}");
    }
    Ok(())
}

/// Returns the trace of `hoid track` for a run of C4, and writes its e and u to `run.csv`.
fn track_run(target: &Path, directory: &Path) -> Result<String, String> {
    cargo(&TEST_BUILD_ARGUMENTS, &[])?;
    let hoid = || {
        let mut command = Command::new(target.join("debug").join(executable_name("hoid")));
        command.current_dir(directory).stdout(Stdio::null());
        command
    };
    output(hoid().args(["simulate", "--condition", "C4", "--seed", "1", "--out", "c4.csv"]))?;
    output(hoid().args([
        "track",
        "c4.csv",
        "--nk",
        "29",
        "--replay",
        "0",
        "--guard",
        "no",
        "--every",
        "1",
        "--out",
        "trace.csv",
    ]))?;
    let read = |file: &str| fs::read_to_string(directory.join(file)).map_err(|e| format!("{file}: {e}"));
    let samples = columns(&read("c4.csv")?, &["e", "u"])?;
    let samples: String = samples.iter().map(|row| format!("{}\n", row.join(","))).collect();
    fs::write(directory.join("run.csv"), samples).map_err(|e| format!("run.csv: {e}"))?;
    read("trace.csv")
}

/// Shortens a file of samples to the first [`DEFAULT_RUN_S`] seconds.
fn shorten(file: &Path) -> Result<(), String> {
    let said = |e: std::io::Error| format!("{}: {e}", file.display());
    let text = fs::read_to_string(file).map_err(said)?;
    let kept: String = text
        .lines()
        .take(DEFAULT_RUN_S * RATE_HZ)
        .map(|line| format!("{line}\n"))
        .collect();
    fs::write(file, kept).map_err(said)
}

/// Returns the named columns of a table whose comment lines start with `#`.
fn columns(table: &str, names: &[&str]) -> Result<Vec<Vec<String>>, String> {
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let indices = names.iter().map(|name| {
        let place = header.iter().position(|column| column == name);
        place.ok_or_else(|| format!("there is no column {name}"))
    });
    let indices: Vec<usize> = indices.collect::<Result<_, String>>()?;
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        indices
            .iter()
            .map(|place| cells.get(*place).copied().unwrap_or_default().to_owned())
            .collect()
    };
    Ok(lines.map(row).collect())
}

/// Checks that each output line equals a row of the trace to the last digit.
fn check_trace(place: &str, told: &str, track: &str) -> Result<(), String> {
    let table: Vec<&str> = told.lines().filter(|line| !line.starts_with('#')).collect();
    let names: Vec<&str> = table.first().copied().unwrap_or_default().split(',').collect();
    let rows = columns(track, &names)?;
    for line in &table[1..] {
        let cells: Vec<&str> = line.split(',').collect();
        let row = rows.iter().find(|row| row[0] == cells[0]);
        let row = row.ok_or_else(|| format!("{place}: hoid track has no row at t = {}", cells[0]))?;
        if row.iter().zip(&cells).any(|(a, b)| a != b) {
            return Err(format!("{place}: {line}\nhoid track: {}", row.join(",")));
        }
    }
    if table.len() < DEFAULT_RUN_S {
        return Err(format!(
            "{place} printed only {} lines, expected at least {DEFAULT_RUN_S}",
            table.len()
        ));
    }
    println!("{place}: {} lines with the same digits as hoid track", table.len() - 1);
    told.lines()
        .filter(|line| line.starts_with('#'))
        .for_each(|line| println!("{line}"));
    Ok(())
}

fn executable_name(program: &str) -> String {
    format!("{program}{}", env::consts::EXE_SUFFIX)
}
