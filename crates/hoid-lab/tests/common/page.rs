//! The page's engine in Node.js: the same code as in the browser.
#![allow(dead_code)]

use std::{
    io::{BufRead as _, BufReader, Write as _},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
};

use hoid_lab::{
    config::{Condition, Signal},
    plant::InputMap,
    task::{Task, held_inputs},
};
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};

/// The engine in a separate process.
pub struct Engine {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Engine {
    /// Starts the engine; `None` if Node.js is not installed.
    pub fn start() -> Option<Self> {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/page/browser-test/engine.mjs");
        let mut child = Command::new("node")
            .arg(script)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .ok()?;
        Some(Self {
            input: child.stdin.take()?,
            output: BufReader::new(child.stdout.take()?),
            child,
        })
    }

    /// Returns the answer of the engine.
    pub fn request(&mut self, question: &Value) -> Value {
        writeln!(self.input, "{question}").unwrap();
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("the engine reported {line:?}: {error}"))
    }
}

impl Drop for Engine {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The generator of `engine.mjs`: numbers from -1/2 to below 1/2.
pub struct Generator(pub u32);

impl Generator {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0) / 4_294_967_296.0 - 0.5
    }
}

/// Runs a random plant with tables and events in the page; true if every bit equals that of Rust.
pub fn is_bit_identical(engine: &mut Engine, seed: u32) -> bool {
    let mut own = Generator(seed ^ 0x5bd1_e995);
    let mut any = |low: f64, high: f64| low + (high - low) * (own.next() + 0.5);
    let poles = any(0.0, 5.0) as usize;
    let mut element = format!("{}", any(-9.0, 9.0));
    for pole in 0..=poles {
        let text = match pole {
            0 => "s".to_owned(),
            k if k % 2 == 1 => format!("({}s+1)", any(0.05, 3.0)),
            _ => format!("(s^2+{}s+{})", any(0.1, 6.0), any(1.0, 40.0)),
        };
        element.push_str(&if pole == 0 { format!("/({text}") } else { text });
    }
    element.push(')');
    let changing = any(0.0, 1.0) < 0.3;
    let condition = Condition {
        last_element: changing
            .then(|| element.replacen(&element[..3], "2.5", 1))
            .filter(|e| e.starts_with("2.5")),
        controlled_element: element,
        change_s: Some(0.4),
        rate_per_s: any(5.0, 200.0),
        measurement_s: 1.0,
        run_in_s: 0.0,
        target: Some(Signal::default()),
        ..Condition::default()
    };
    let condition = match condition.task_definition() {
        Ok(_) => condition,
        // The element after the change is invalid, so the condition is used without the change.
        Err(_) => Condition {
            last_element: None,
            ..condition
        },
    };
    let mut task = Task::new(&condition, 0, 0).unwrap();
    let map = InputMap {
        centre: any(-700.0, 700.0),
        span: any(1.0, 400.0),
        dead: any(0.0, 0.3),
        gain: any(-5.0, 5.0),
    };
    let mut tables = Generator(seed);
    let mut table = |size: f64| (0..task.ticks).map(|_| size * tables.next()).collect::<Vec<f64>>();
    (task.target, task.disturbance) = (table(8.0), table(1.0));
    let answer = engine.request(&json!({"phases": task.phases, "ticks": task.ticks, "map": map, "seed": seed}));
    let events: Vec<(usize, f64)> = (answer["events"].as_array().unwrap().iter())
        .map(|event| (event[0].as_u64().unwrap() as usize, map.u(event[1].as_f64().unwrap())))
        .collect();
    let signals = task.run(&held_inputs(&events, task.ticks));
    let mut hash = Sha256::new();
    for value in signals.u.iter().chain(&signals.e) {
        // Adding zero converts minus zero to zero.
        hash.update((value + 0.0).to_le_bytes());
    }
    answer["sha256"].as_str() == Some(data_encoding::HEXLOWER.encode(&hash.finalize()).as_str())
}
