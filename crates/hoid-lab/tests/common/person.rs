//! A page that follows the protocol, without a server. The person does not move the device, so e equals the target.
// Each test file uses only part of this module.
#![allow(dead_code, clippy::unwrap_used)]

use std::{
    ops::Range,
    path::Path,
    sync::mpsc::{Receiver, channel},
};

use hoid_lab::{Config, Lab, Mode, lab::OutgoingMessage, wire::FromPage};
use serde_json::{Value, json};

/// Number of ticks of a batch.
const TICKS_PER_BATCH: usize = 50;

pub struct Person {
    pub lab: Lab,
    pub page: u64,
    received: Receiver<OutgoingMessage>,
    target: Vec<f64>,
}

impl Person {
    /// Starts a session with consent.
    pub fn start_session(out: &Path, config: Config) -> Self {
        let lab = Lab::open(out, config, Mode::Sessions, None).unwrap();
        let (sender, received) = channel();
        let page = lab.join(sender);
        let person = Self {
            lab,
            page,
            received,
            target: Vec::new(),
        };
        person.send(json!({"type": "hello", "role": "person"})).unwrap();
        let consent = json!({"type": "consent", "subject": "P01", "agreed": true, "cc0": false});
        person.send(consent).unwrap();
        person
    }

    pub fn send(&self, message: Value) -> Result<(), String> {
        let message: FromPage = serde_json::from_value(message).map_err(|error| error.to_string())?;
        self.lab.receive(self.page, message).map_err(|error| error.to_string())
    }

    /// Starts the next run, which has this number.
    pub fn start_next_run(&mut self, number: usize) -> Result<(), String> {
        self.send(json!({"type": "next"}))?;
        let tables = self.received.try_iter().filter_map(|outgoing| match outgoing {
            OutgoingMessage::Binary(bytes) => Some(bytes),
            OutgoingMessage::Text(_) => None,
        });
        let eight = |eight: &[u8]| f64::from_le_bytes(eight.try_into().unwrap());
        self.target = tables.last().unwrap().chunks_exact(8).map(eight).collect();
        self.send(begin_message(number))
    }

    /// Sends ticks of a run.
    pub fn track(&self, number: usize, ticks: Range<usize>) -> Result<(), String> {
        ticks.step_by(TICKS_PER_BATCH).try_for_each(|first| {
            self.send(batch_message(
                number,
                first,
                &self.target[first..first + TICKS_PER_BATCH],
            ))
        })
    }

    pub fn finish(&self, number: usize) -> Result<(), String> {
        self.send(json!({"type": "finish", "number": number}))
    }

    /// Returns the state of the session, as last sent to the page.
    pub fn state(&self) -> Value {
        let states = self.received.try_iter().filter_map(|outgoing| match outgoing {
            OutgoingMessage::Text(text) => serde_json::from_str::<Value>(&text).ok(),
            OutgoingMessage::Binary(_) => None,
        });
        states.filter(|state| state["type"] == "state").last().unwrap()
    }
}

pub fn begin_message(number: usize) -> Value {
    json!({"type": "begin", "number": number, "device": "mouse", "clock": "injected", "refresh_ms": 16.7, "zero_ms": 1.0,
        "input": {"centre": 512.0, "span": 300.0, "dead": 0.0, "gain": 1.0}})
}

/// Returns a batch of ticks with the hand at rest.
pub fn batch_message(number: usize, first: usize, e: &[f64]) -> Value {
    json!({"type": "batch", "number": number,
        "batch": {"first": first, "u": vec![0.0; e.len()], "e": e, "events": [], "frames": []}})
}
