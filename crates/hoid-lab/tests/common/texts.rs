//! Settings and results in which values or bytes are changed: scenarios, a plan, a manifest, an experiment, a fit.
// Each test file uses only part of this module.
#![allow(clippy::unwrap_used)]

use std::{fs, path::Path};

use hoid_analysis::{Identification, Polynomials, Recordings, json::BatchResult};
use hoid_io::{AnyScenario, parse_any_scenario, parse_fit};
use hoid_lab::Config;
use hoid_model::{Record, Structure};
use hoid_study::{PLANS, Plan, group::Manifest};
use serde_json::Value;

use crate::{
    draw::Draw,
    hostile::{mutate_bytes, mutate_json},
};

const SCENARIOS: [&str; 3] = [
    include_str!("../../../../fixtures/scenario/full.toml"),
    include_str!("../../../../fixtures/scenario/person.toml"),
    include_str!("../../../../fixtures/scenario/pursuit.toml"),
];

const MANIFEST: &str = include_str!("../../../../fixtures/group/tracking.toml");

/// Reads text, which may be stored at a path, as a command does before it computes; true if the text is accepted.
type Reader = fn(&str, &Path) -> bool;

/// A valid input and its reader.
pub struct Text {
    text: String,
    is_json: bool,
    reader: Reader,
}

/// Returns the valid inputs, including a fit of this record.
pub fn valid_texts(record: &Record) -> Vec<Text> {
    let toml = |text: &str, reader: Reader| Text {
        text: text.to_owned(),
        is_json: false,
        reader,
    };
    let found = Identification::of(Polynomials {
        orders: [("nk".to_owned(), 29..=29)].into(),
        ..Polynomials::new(Structure::Arx)
    });
    let found = found.run(Recordings::from_records([record.clone()])).unwrap();
    let fit = Text {
        text: found.to_json().unwrap(),
        is_json: true,
        reader: |text, _| {
            let _ = BatchResult::from_json(text);
            parse_fit(text, "fit.json").is_ok()
        },
    };
    let mut all: Vec<Text> = SCENARIOS.map(|text| toml(text, accepts_scenario)).into();
    all.push(toml(PLANS[0].text, |text, _| Plan::parse(text, "plan.toml").is_ok()));
    all.push(toml(MANIFEST, |text, _| Manifest::parse(text, "group.toml").is_ok()));
    all.push(toml(&Config::default().text().unwrap(), |text, path| {
        fs::write(path, text).unwrap();
        Config::read(path).is_ok()
    }));
    all.push(fit);
    all
}

fn accepts_scenario(text: &str, _: &Path) -> bool {
    match parse_any_scenario(text, "scenario.toml", "scenario") {
        Ok(AnyScenario::Reference(scenario)) => scenario.resolve().is_ok(),
        Ok(AnyScenario::Family(scenario)) => scenario.resolve().is_ok(),
        Err(_) => false,
    }
}

impl Text {
    /// True if the text is accepted as it is.
    pub fn is_accepted(&self, path: &Path) -> bool {
        (self.reader)(&self.text, path)
    }

    /// Reads the text after some changes.
    pub fn read_modified(&self, draw: &mut Draw, path: &Path) {
        let mut text = self.text.clone();
        if draw.integer_below(3) > 0 {
            text = self.with_other_values(draw).unwrap_or(text);
        }
        if draw.integer_below(2) == 0 {
            let mut raw = text.into_bytes();
            (0..1 + draw.integer_below(3)).for_each(|_| mutate_bytes(&mut raw, draw));
            text = String::from_utf8_lossy(&raw).into_owned();
        }
        (self.reader)(&text, path);
    }

    /// Replaces some values; `None` if a value cannot be written in this form.
    fn with_other_values(&self, draw: &mut Draw) -> Option<String> {
        let mut value: Value = if self.is_json {
            serde_json::from_str(&self.text).ok()?
        } else {
            toml::from_str(&self.text).ok()?
        };
        (0..1 + draw.integer_below(3)).for_each(|_| mutate_json(&mut value, draw));
        if self.is_json {
            Some(value.to_string())
        } else {
            toml::to_string(&value).ok()
        }
    }
}
