//! A running `hoid stream`, for its tests and for `cargo xtask slow latency`.
//!
//! | file | contents |
//! |---|---|
//! | `udp` | a stream over UDP and the socket of its client |
//! | `paced` | samples at a fixed rate, and the latency of their answers |
//! | `troubles` | readers that stop, restarts of either side, clock jumps, hostile datagrams |

#[path = "../draw.rs"]
mod draw;
pub mod paced;
pub mod troubles;
pub mod udp;

use std::{
    io::{BufReader, Read},
    process::{Child, ChildStderr, Command},
};

pub use draw::Draw;

/// Returns e and u at t: sinusoids with noise.
pub fn sample(t_s: f64, draw: &mut Draw) -> (f64, f64) {
    let waves = |at: f64| (0.9 * at).sin() + 0.5 * (2.3 * at).sin() + 0.2 * (7.1 * at).sin();
    (waves(t_s), 0.1 * waves(t_s - 0.3) + 0.05 * (2.0 * draw.uniform() - 1.0))
}

/// Summary of a stream at its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Summary {
    pub samples: usize,
    pub skipped: usize,
    pub missing: usize,
    pub dropped: usize,
}

impl Summary {
    /// Parses
    /// `8192 samples: 5 skipped for a fault in e or u (5 of them missing), 0 steps shortened; 2 lines dropped.`
    pub fn of(said: &str) -> Self {
        let line = said
            .lines()
            .find(|line| line.contains(" samples: "))
            .unwrap_or_else(|| panic!("{said}"));
        let before = |words: &str| -> usize {
            let (start, _) = line.split_once(words).unwrap_or_else(|| panic!("{line}"));
            start
                .rsplit(|c: char| !c.is_ascii_digit())
                .next()
                .unwrap()
                .parse()
                .unwrap()
        };
        Self {
            samples: before(" samples:"),
            skipped: before(" skipped"),
            missing: before(" of them missing"),
            dropped: before(" line"),
        }
    }
}

/// Sends a signal to a child process.
pub fn send_signal(child: &Child, name: &str) {
    let id = child.id().to_string();
    assert!(Command::new("kill").args([name, &id]).status().unwrap().success());
}

/// Returns the remaining messages of a program, which must end successfully, or with code 1 and an error.
pub fn remaining_output(child: &mut Child, said: &mut BufReader<ChildStderr>) -> String {
    let mut words = String::new();
    said.read_to_string(&mut words).unwrap();
    let code = i32::from(words.contains("error: "));
    assert_eq!(child.wait().unwrap().code(), Some(code), "{words}");
    words
}
