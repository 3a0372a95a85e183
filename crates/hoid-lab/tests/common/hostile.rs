//! Invalid messages to a lab, damaged session files, changed settings and results, and trackers restored from modified
//! numbers with a valid checksum: each gives an answer, and none causes a panic, not even one that is caught.
//!
//! Case `k` of a seed is the same on every machine.
#![allow(clippy::unwrap_used)]

use std::{
    fs,
    path::{Path, PathBuf},
    sync::mpsc::channel,
};

use hoid_io::file_names;
use hoid_lab::{
    Config, Lab, Mode,
    config::{Condition, Signal},
    session::{Session, Stem},
    verify::check,
    wire::FromPage,
};
use hoid_model::{
    Record, Structure,
    scenario::{Condition as OfText, Scenario},
};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{Method, Sample, Stage, TrackOptions, Tracker, WarmUp, sealed};
use serde_json::{Value, json};

use crate::{
    draw::Draw,
    person::{self, Person},
    texts::{self, Text},
};

/// Number of ticks of a run.
const TICKS_PER_RUN: usize = 500;
/// Number of messages to one lab.
const MESSAGES_PER_LAB: usize = 200;
/// Number of samples for a restored tracker.
const RESTORED_SAMPLES: usize = 25;

/// Numbers at which indices, lengths and sums fail.
const EXTREME_NUMBERS: [f64; 16] = [
    0.0,
    -0.0,
    -1.0,
    0.5,
    1.0,
    3.0,
    1e3,
    1e6,
    4_294_967_296.0,
    1e18,
    1e300,
    -1e300,
    5e-324,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

/// Returns one of these numbers, or a JSON value that is not a number.
fn extreme_value(draw: &mut Draw) -> Value {
    match draw.integer_below(12) {
        0 => Value::Null,
        1 => json!("x".repeat(1 << draw.integer_below(12))),
        2 => json!([]),
        3 => json!({}),
        4 => json!(u64::MAX),
        5 => json!(i64::MIN),
        6 => json!(draw.integer_below(TICKS_PER_RUN)),
        7 => json!([1.0, 1.0, 1e300, 1.0]),
        8 => json!(true),
        _ => json!(EXTREME_NUMBERS[draw.integer_below(EXTREME_NUMBERS.len())]),
    }
}

/// State of the tests.
pub struct HostileTest {
    directory: tempfile::TempDir,
    session: PathBuf,
    files: Vec<String>,
    person: Person,
    message_count: usize,
    record: Record,
    texts: Vec<Text>,
    trackers: Vec<(TrackOptions, Vec<f64>)>,
    warm_up: Vec<f64>,
}

fn config() -> Config {
    Config {
        condition: vec![Condition {
            target: Some(Signal::default()),
            measurement_s: 0.3,
            run_in_s: 0.2,
            runs: 2,
            ..Condition::default()
        }],
        ..Config::default()
    }
}

impl HostileTest {
    pub fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let out = directory.path().join("good");
        let mut good = Person::start_session(&out, config());
        good.start_next_run(1).unwrap();
        good.track(1, 0..TICKS_PER_RUN).unwrap();
        good.finish(1).unwrap();
        good.start_next_run(2).unwrap();
        good.track(2, 0..100).unwrap();
        drop(good);
        let session = out.join("sub-P01/ses-01");
        let record = Simulator::new(&Scenario::condition(OfText::C4)).unwrap();
        let record = record.run(RunSeed::default(), false).unwrap();
        let (trackers, warm_up) = saved_trackers(&record);
        let texts = texts::valid_texts(&record);
        assert!(
            texts
                .iter()
                .all(|text| text.is_accepted(&directory.path().join("good.toml")))
        );
        Self {
            files: file_names(&session).unwrap(),
            session,
            person: Person::start_session(&directory.path().join("lab-0"), config()),
            directory,
            message_count: 0,
            texts,
            record,
            trackers,
            warm_up,
        }
    }

    /// Runs a case. Of four cases, one tests a tracker, one tests messages, one tests session files, and one tests
    /// settings or a result.
    pub fn run_case(&mut self, seed: u64, number: u64) {
        let mut draw = Draw(seed ^ number.wrapping_mul(0xd134_2543_de82_ef95));
        match number % 4 {
            0 => self.send_messages(&mut draw),
            1 => self.open_damaged_session(&mut draw),
            2 => self.restore_tracker(&mut draw),
            _ => {
                let text = &self.texts[draw.integer_below(self.texts.len())];
                text.read_modified(&mut draw, &self.directory.path().join("changed.toml"));
            }
        }
    }

    /// Sends some messages to a lab in the state left by earlier messages.
    fn send_messages(&mut self, draw: &mut Draw) {
        if self.message_count % MESSAGES_PER_LAB == MESSAGES_PER_LAB - 1 {
            let out = self.directory.path().join(format!("lab-{}", self.message_count));
            self.person = Person::start_session(&out, config());
        }
        self.message_count += 1;
        let number = 1 + draw.integer_below(3);
        for _ in 0..1 + draw.integer_below(6) {
            let (first, length) = (draw.integer_below(TICKS_PER_RUN), draw.integer_below(60));
            let mut message = match draw.integer_below(10) {
                0 => json!({"type": "hello", "role": "person", "browser": {"screen": "1 x 1"}}),
                1 => json!({"type": "consent", "subject": "P02", "agreed": true, "cc0": true}),
                2 => json!({"type": "resume", "session": "sub-P01/ses-01"}),
                3 | 4 => json!({"type": "next"}),
                5 | 6 => person::begin_message(number),
                7 => person::batch_message(number, [0, first][draw.integer_below(2)], &vec![0.5; length]),
                8 => json!({"type": "finish", "number": number, "counted": {"synthetic_events": 0.0}}),
                _ => json!({"type": "abort", "number": number}),
            };
            if message["type"] == "batch" && draw.integer_below(2) == 0 {
                message["batch"]["events"] = json!([[3, 2.5, 2.75, 512.0], [4, 3.5, 3.75, 400.0]]);
                message["batch"]["frames"] = json!([[1.0, 2.0, 2, 0.5]]);
            }
            if draw.integer_below(2) == 0 {
                mutate_json(&mut message, draw);
            }
            let mut text = message.to_string().into_bytes();
            if draw.integer_below(8) == 0 {
                mutate_bytes(&mut text, draw);
            }
            // Invalid messages are rejected at once.
            if let Ok(message) = serde_json::from_slice::<FromPage>(&text) {
                let _ = self.person.lab.receive(self.person.page, message);
            }
        }
    }

    /// Opens, evaluates and shows a session with one modified file.
    fn open_damaged_session(&mut self, draw: &mut Draw) {
        let at = self.directory.path().join("damaged/sub-P01/ses-01");
        let _ = fs::remove_dir_all(&at);
        fs::create_dir_all(&at).unwrap();
        for name in &self.files {
            fs::copy(self.session.join(name), at.join(name)).unwrap();
        }
        for _ in 0..1 + draw.integer_below(2) {
            damage(&at.join(&self.files[draw.integer_below(self.files.len())]), draw);
        }
        let shown = |folder: &Path| {
            let out = folder.ancestors().nth(2).unwrap();
            let Ok(lab) = Lab::open(out, config(), Mode::Replay(folder.to_owned()), None) else {
                return;
            };
            let page = lab.join(channel().0);
            let hello = serde_json::from_value(json!({"type": "hello", "role": "experimenter"})).unwrap();
            let _ = lab.receive(page, hello);
            for name in ["1.json", "2.json"] {
                let _ = lab.data(name);
            }
            let _ = lab.export();
        };
        shown(&at);
        if let Ok(session) = Session::open(&at) {
            let _ = (session.next_run(), session.next_run_number());
            for (_, stem) in Stem::find_all(&at).unwrap() {
                let _ = check(&stem);
            }
        }
    }

    /// Restores a tracker or a warm-up from modified numbers with a valid checksum.
    fn restore_tracker(&mut self, draw: &mut Draw) {
        let which = draw.integer_below(self.trackers.len() + 1);
        let saved = self.trackers.get(which).map_or(&self.warm_up, |(_, numbers)| numbers);
        let mut numbers = saved[..saved.len() - 1].to_vec();
        for _ in 0..1 + draw.integer_below(4) {
            let at = draw.integer_below(numbers.len());
            match draw.integer_below(8) {
                0 => numbers[at] = f64::from_bits(numbers[at].to_bits() ^ (1 << draw.integer_below(64))),
                1 => numbers[at] = f64::from_bits(draw.bits()),
                2 => numbers.swap(at, draw.integer_below(saved.len() - 1)),
                3 => numbers[at] += 1.0,
                _ => numbers[at] = EXTREME_NUMBERS[draw.integer_below(EXTREME_NUMBERS.len())],
            }
        }
        let sample_time = self.record.sample_time();
        let numbers = sealed(numbers);
        let from = 2700 + draw.integer_below(1000);
        let sample = |k: usize| Sample {
            e: self.record.input()[k],
            u: if k % 20 == 3 { f64::NAN } else { self.record.output()[k] },
            reference: None,
        };
        let Some((options, _)) = self.trackers.get(which) else {
            if let Some(warm_up) = WarmUp::restore(sample_time, &numbers) {
                let mut live = Stage::Collecting(warm_up);
                let default = TrackOptions::default_for(Method::adaptive(), 29);
                for k in from..from + RESTORED_SAMPLES {
                    live.update(sample(k), true, &|_| Ok((default.clone(), None)));
                }
                live.save();
            }
            return;
        };
        if let Ok(mut tracker) = Tracker::restore(options, sample_time, &numbers) {
            for k in from..from + RESTORED_SAMPLES {
                tracker.update(sample(k), true);
            }
            let _ = (
                tracker.operator(),
                tracker.covariance(),
                tracker.response(3.0),
                tracker.save(),
            );
        }
    }
}

/// Returns saved trackers after a run, and a warm-up.
fn saved_trackers(record: &Record) -> (Vec<(TrackOptions, Vec<f64>)>, Vec<f64>) {
    let span = record.span(0.0, 20.0).unwrap();
    let bj = Structure::BoxJenkins;
    let of = |method| TrackOptions::new(method, bj, bj.operator_orders(29));
    let all = [
        TrackOptions::new(Method::rls(), Structure::Arx, Structure::Arx.operator_orders(29)),
        of(Method::rpem()),
        of(Method::rpem()).with(&[("track_delay", "0.2..0.35")]).unwrap(),
        of(hoid_survey::physical())
            .with(&[("track_delay", "0.2..0.35")])
            .unwrap(),
        of(hoid_survey::multiple_model()),
        TrackOptions::default_for(Method::adaptive(), 29)
            .with(&[("replay", "5")])
            .unwrap(),
        of(hoid_survey::ekf()),
        of(hoid_survey::ukf()),
        of(hoid_survey::fused()),
        of(hoid_survey::window()).with(&[("refit", "200")]).unwrap(),
    ];
    let sample = |k: usize| Sample {
        e: record.input()[k],
        u: record.output()[k],
        reference: None,
    };
    let run = |options: TrackOptions| {
        let mut tracker = Tracker::new(&options, Some(&span), record.sample_time()).unwrap();
        (2000..2700).for_each(|k| {
            tracker.update(sample(k), true);
        });
        let numbers = tracker.save();
        (options, numbers)
    };
    let default = of(hoid_survey::physical());
    let mut live = Stage::new(&default, 2000, record.sample_time()).unwrap();
    for k in 0..100 {
        live.update(sample(k), true, &|_| Ok((default.clone(), None)));
    }
    (all.into_iter().map(run).collect(), live.save().1)
}

/// Modifies, removes or adds one value of a message.
pub fn mutate_json(value: &mut Value, draw: &mut Draw) {
    let deeper = draw.integer_below(4) > 0;
    match value {
        Value::Object(map) if deeper && !map.is_empty() => {
            let key = map.keys().nth(draw.integer_below(map.len())).cloned().unwrap();
            match draw.integer_below(8) {
                0 => drop(map.remove(&key)),
                1 => drop(map.insert(format!("{key}x"), json!(1))),
                _ => mutate_json(&mut map[&key], draw),
            }
        }
        Value::Array(all) if deeper && !all.is_empty() => {
            let at = draw.integer_below(all.len());
            match draw.integer_below(4) {
                0 => drop(all.remove(at)),
                1 => all.insert(at, all[at].clone()),
                _ => mutate_json(&mut all[at], draw),
            }
        }
        other => *other = extreme_value(draw),
    }
}

/// Modifies a byte, the end, a part or a number of the text.
pub fn mutate_bytes(text: &mut Vec<u8>, draw: &mut Draw) {
    if text.is_empty() {
        return;
    }
    let at = draw.integer_below(text.len());
    let end = (at + 1 + draw.integer_below(40)).min(text.len());
    match draw.integer_below(6) {
        0 => text[at] ^= 1 << draw.integer_below(8),
        1 => text.truncate(at),
        2 => drop(text.drain(at..end)),
        3 => {
            let part = text[at..end].to_vec();
            text.splice(at..at, part);
        }
        _ => {
            let is_number = |byte: &u8| byte.is_ascii_digit() || b"+-.e".contains(byte);
            let Some(start) = (at..text.len()).find(|k| text[*k].is_ascii_digit()) else {
                return;
            };
            let length = text[start..].iter().take_while(|byte| is_number(byte)).count();
            text.splice(start..start + length, extreme_value(draw).to_string().into_bytes());
        }
    }
}

/// Removes or modifies a file: a value if it is JSON, otherwise bytes.
fn damage(path: &Path, draw: &mut Draw) {
    let Ok(mut whole) = fs::read(path) else { return };
    let json = serde_json::from_slice::<Value>(&whole);
    match json {
        _ if draw.integer_below(12) == 0 => return drop(fs::remove_file(path)),
        Ok(mut value) if draw.integer_below(4) > 0 => {
            (0..1 + draw.integer_below(2)).for_each(|_| mutate_json(&mut value, draw));
            whole = value.to_string().into_bytes();
        }
        _ => (0..1 + draw.integer_below(3)).for_each(|_| mutate_bytes(&mut whole, draw)),
    }
    fs::write(path, whole).unwrap();
}
