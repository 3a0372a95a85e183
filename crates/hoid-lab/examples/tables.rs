//! `cargo xtask lab-page`: writes an experiment as the tables of its runs, in JSON, for a page without a server. Usage:
//! `tables [lab.toml]`.
//!
//! Runs are in the order of the first person. Tables are little-endian doubles in base 64.
#![allow(clippy::print_stdout)]

use std::{env, error::Error, path::Path};

use data_encoding::BASE64;
use hoid_lab::{Config, order::plan, task::Task};
use serde_json::json;

/// Default consent text of the page, which stores no data.
const CONSENT: &str = "You will follow a moving target by hand for a minute and a half. Stop at any time by the key \
Escape or by closing the window. Do not take part if moving patterns make you unwell.";

fn main() -> Result<(), Box<dyn Error>> {
    let config = match env::args().nth(1) {
        Some(path) => Config::read(Path::new(&path))?,
        None => Config {
            consent: CONSENT.to_owned(),
            ..Config::default()
        },
    };
    let method = Config::default().method;
    if config.method != method {
        return Err(format!(
            "method is {:?}, expected {method:?}: the page alone has no other",
            config.method
        )
        .into());
    }
    let mut runs = Vec::new();
    for (k, planned) in plan(&config, 0).iter().enumerate() {
        let condition = &config.condition[planned.condition];
        let task = Task::new(condition, planned.condition as u64, k as u64 + 1)?;
        let element = condition.task_definition()?.constant_element()?;
        runs.push(json!({
            "condition": condition,
            "element": element.map(|element| element.to_string()),
            "training": planned.training,
            "run_in": task.run_in,
            "ticks": task.ticks,
            "phases": task.phases,
            "target": encode_base64(&task.target),
            "disturbance": encode_base64(&task.disturbance),
        }));
    }
    let experiment = json!({"name": config.name, "consent": config.consent, "live": config.live, "runs": runs});
    println!("{experiment}");
    Ok(())
}

fn encode_base64(values: &[f64]) -> String {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    BASE64.encode(&bytes)
}
