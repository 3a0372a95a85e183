//! Tracker on a processor without an operating system: reads samples of e and u from the file `run.csv` and writes one
//! estimate per second to standard output.
//!
//! | file | contents |
//! |---|---|
//! | `run.rs` | code common to all targets: input lines, filter, estimates |
//! | `board.rs` | entry point, file access and output on a processor without an operating system, by semihosting |
//!
//! On the host it is an ordinary program; the results on both targets can therefore be compared digit by digit
//! (`cargo xtask embedded`). No memory is allocated; the filter is on the stack.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;
mod run;

#[cfg(not(target_os = "none"))]
fn main() -> Result<(), String> {
    use std::io::{Read, Write, stdout};

    let path = run::FILE_NAME.to_string_lossy();
    let mut file = std::fs::File::open(&*path).map_err(|e| format!("{path}: {e}"))?;
    let mut out = stdout().lock();
    run::run(
        |bytes| file.read(bytes).map_err(|_| run::UNREADABLE_MESSAGE),
        |line| writeln!(out, "{line}").map_err(|_| "standard output takes no more"),
    )?;
    writeln!(out, "# state {} bytes", run::STATE_BYTES).map_err(|e| e.to_string())
}
