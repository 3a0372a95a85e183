//! `hoid stream --udp` on loopback.
#![allow(clippy::unwrap_used)]

mod common;

use std::{
    io::{BufRead, BufReader, Read},
    net::UdpSocket,
    process::{Child, ChildStderr, Command, Stdio},
    time::Duration,
};

use hoid_model::{
    Record,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};
use serde_json::Value;
use tempfile::TempDir;

use common::{bad, good};

/// Far beyond what an answer takes.
const PATIENCE: Duration = Duration::from_secs(60);
/// Long for an answer that does not come.
const SHORT: Duration = Duration::from_millis(100);
const NUMBERS: usize = 19;

/// A stream that is running, and the socket of the one who asks.
struct Stream {
    child: Child,
    said: BufReader<ChildStderr>,
    socket: UdpSocket,
}

impl Stream {
    fn new(arguments: &[&str]) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.set_read_timeout(Some(PATIENCE)).unwrap();
        let answers = socket.local_addr().unwrap().port();
        let mut child = Command::new(env!("CARGO_BIN_EXE_hoid"))
            .args(["stream", "--fs", "100", "--udp", &format!("0:{answers}")])
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut said = BufReader::new(child.stderr.take().unwrap());
        // The system has chosen the port: it is said.
        let port = loop {
            let mut line = String::new();
            assert!(said.read_line(&mut line).unwrap() > 0, "the stream has ended");
            if let Some((_, rest)) = line.split_once("listening on 127.0.0.1:") {
                break rest.split(',').next().unwrap().parse::<u16>().unwrap();
            }
        };
        socket.connect(("127.0.0.1", port)).unwrap();
        Self { child, said, socket }
    }

    fn send(&self, bytes: &[u8]) {
        self.socket.send(bytes).unwrap();
    }

    fn answer(&self) -> Vec<u8> {
        let mut bytes = vec![0; 1 << 16];
        let length = self.receive(&mut bytes).unwrap();
        bytes.truncate(length);
        bytes
    }

    /// Answers come from the port that listens.
    fn receive(&self, bytes: &mut [u8]) -> Option<usize> {
        self.socket.recv(bytes).ok()
    }

    fn line(&self) -> Value {
        serde_json::from_slice(&self.answer()).unwrap()
    }

    fn estimate(&self) -> (u32, [f64; NUMBERS], i32, u32) {
        let bytes = self.answer();
        assert_eq!((bytes.len(), &bytes[..4]), (168, b"hoid".as_slice()));
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let number = |i: usize| f64::from_le_bytes(bytes[8 + 8 * i..16 + 8 * i].try_into().unwrap());
        (word(4), std::array::from_fn(number), word(160).cast_signed(), word(164))
    }

    /// Interrupts the stream; what it has said.
    fn end(mut self) -> String {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        let mut said = String::new();
        self.said.read_to_string(&mut said).unwrap();
        assert_eq!(self.child.wait().unwrap().code(), Some(0), "{said}");
        said
    }
}

fn sample(sequence: u32, t: f64, e: f64, u: f64) -> Vec<u8> {
    let mut bytes = b"hoid".to_vec();
    bytes.extend_from_slice(&sequence.to_le_bytes());
    bytes.extend([t, e, u, f64::NAN].iter().flat_map(|n| n.to_le_bytes()));
    bytes
}

fn record() -> Record {
    let simulator = Simulator::new(&Scenario::condition(Condition::C4)).unwrap();
    let seed = RunSeed {
        seed: 3,
        ..RunSeed::default()
    };
    simulator.run(seed, false).unwrap()
}

/// The last row of a trace by column.
fn last_row(trace: &str) -> impl Fn(&str) -> f64 {
    let lines: Vec<&str> = trace.lines().filter(|line| !line.starts_with('#')).collect();
    let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let (names, row) = (cells(lines[0]), cells(lines[lines.len() - 1]));
    move |name: &str| {
        let place = names
            .iter()
            .position(|n| n == name)
            .unwrap_or_else(|| panic!("{name}: {names:?}"));
        row[place].parse().unwrap_or(f64::NAN)
    }
}

/// 82 s as structs, then the same as lines: the digits of `hoid track`.
#[cfg(unix)]
#[test]
fn datagrams_give_the_digits_of_track() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    good(d, &["simulate", "--condition", "C4", "--seed", "3", "--out", "c.csv"]);
    let element = ["--controlled-element", "90/(s(s+6))"];
    good(d, &[&["track", "c.csv", "--out", "t.csv"][..], &element].concat());
    let trace = std::fs::read_to_string(d.join("t.csv")).unwrap();
    let expected = last_row(&trace);
    let record = record();
    let stream = Stream::new(&element);
    let mut found = None;
    for (k, (e, u)) in (0..).zip(record.input().iter().zip(record.output())) {
        stream.send(&sample(k, f64::NAN, *e, *u));
        found = Some(stream.estimate());
    }
    let (sequence, numbers, level, ready) = found.unwrap();
    assert_eq!((sequence, ready), (8191, 1));
    assert!((0..=2).contains(&level));
    let names = [
        "K_e",
        "K_e_se",
        "T_L",
        "T_L_se",
        "K_e_dot",
        "K_e_dot_se",
        "omega_nm",
        "omega_nm_se",
        "zeta_nm",
        "zeta_nm_se",
        "tau_e",
        "tau_e_se",
        "crossover_rad_s",
        "crossover_rad_s_se",
        "phase_margin_deg",
        "phase_margin_deg_se",
        "innovation",
    ];
    for (name, number) in names.into_iter().zip(&numbers[1..]) {
        assert_eq!(
            number.to_bits(),
            expected(name).to_bits(),
            "{name}: {number} {}",
            expected(name)
        );
    }
    assert!((numbers[0] - 81.91).abs() < 1e-9 && numbers[18].is_nan());
    let said = stream.end();
    assert!(
        said.contains("8192 samples: 0 skipped") && said.contains("0 lines dropped"),
        "{said}"
    );

    let stream = Stream::new(&["--every", "64"]);
    let mut line = Value::Null;
    for (k, (e, u)) in record.input().iter().zip(record.output()).enumerate() {
        stream.send(format!("{e:?},{u:?}").as_bytes());
        if (k + 1) % 64 == 0 {
            line = stream.line();
        }
    }
    let value = &line["operator"]["K_e"];
    assert_eq!(value["value"].as_f64().unwrap(), expected("K_e"), "{line}");
    stream.end();
}

/// Lost, doubled and late samples are told by their sequence, as by a column t.
#[cfg(unix)]
#[test]
fn lost_samples_are_bridged_and_counted() {
    let stream = Stream::new(&[]);
    let wave = |k: u32| (0.1 * f64::from(k)).sin();
    for k in (0..100).chain(105..200) {
        stream.send(&sample(k, f64::NAN, wave(k), wave(k + 3)));
        assert_eq!(stream.estimate().0, k);
    }
    for k in [199, 150] {
        stream.send(&sample(k, f64::NAN, 0.0, 0.0));
        stream.estimate();
    }
    // A line asks how it stands.
    stream.send(b"2.00,0.1,0.2");
    let line = stream.line();
    assert_eq!((&line["skipped"], &line["dropped"]), (&5.into(), &2.into()), "{line}");
    let said = stream.end();
    assert!(
        said.contains("201 samples: 5 skipped for a fault in e or u (5 of them missing)"),
        "{said}"
    );
}

/// Nothing that comes from outside ends the stream or is taken for a sample.
#[cfg(unix)]
#[test]
fn hostile_datagrams_are_counted() {
    let stream = Stream::new(&[]);
    stream.send(b"t,e,u\n0.00,0.1,0.2\n0.01,0.2,0.1\n");
    assert_eq!(
        (stream.line()["t"].as_f64(), stream.line()["t"].as_f64()),
        (Some(0.0), Some(0.01))
    );
    let long = vec![b'7'; 60_000];
    let whole = sample(3, 0.03, 0.0, 0.0);
    let hostile: [&[u8]; 9] = [
        b"\xff\xfe\x00",
        b"hoid",
        &whole[..39],
        b"garbage",
        b"1,2,3,4,5,6",
        b"t,y,z",
        &long,
        b"nan,1,2",
        b"{\"t\": 1}",
    ];
    for bytes in hostile {
        stream.send(bytes);
    }
    // Nothing at all, and what says nothing, is not even counted.
    stream.send(b"");
    stream.send(b"# a comment\n\n");
    stream.socket.set_read_timeout(Some(SHORT)).unwrap();
    assert_eq!(stream.receive(&mut [0; 16]), None, "no answer for what is no sample");
    stream.socket.set_read_timeout(Some(PATIENCE)).unwrap();
    // Values that are none are samples with a fault.
    stream.send(&sample(2, f64::NAN, f64::INFINITY, f64::NAN));
    assert!(stream.estimate().1[17].is_nan());
    stream.send(b"0.03,0.1,0.2");
    let line = stream.line();
    assert_eq!(
        (&line["dropped"], &line["skipped"]),
        (&hostile.len().into(), &1.into()),
        "{line}"
    );
    assert!(stream.end().contains("4 samples"), "the others are none");
}

#[test]
fn places_that_cannot_be_are_refused() {
    let directory = TempDir::new().unwrap();
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    for (places, reason) in [
        ("5005", "5005:5006"),
        ("5005:5005", "another port"),
        (&format!("{port}:9"), "cannot be listened on"),
    ] {
        let (code, message) = bad(directory.path(), &["stream", "--fs", "100", "--udp", places]);
        assert!(code > 0 && message.contains(reason), "{message}");
    }
}
