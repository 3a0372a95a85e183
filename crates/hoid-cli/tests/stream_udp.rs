//! `hoid stream --udp` on loopback. Agreement with the digits of `hoid track` is tested with all other interfaces, in
//! `python/tests/test_places.py`.
#![allow(clippy::unwrap_used)]

mod common;
// The study uses the rest of this module.
#[cfg(unix)]
#[allow(dead_code)]
#[path = "common/live/mod.rs"]
mod live;

use std::net::UdpSocket;
#[cfg(unix)]
use std::{path::Path, time::Duration};

#[cfg(unix)]
use serde_json::Value;
use tempfile::TempDir;

use common::failure_of;
#[cfg(unix)]
use live::{
    Draw, paced, troubles,
    udp::{LONG_TIMEOUT, Stream, as_struct},
};

/// Timeout for an answer that does not come.
#[cfg(unix)]
const SHORT_TIMEOUT: Duration = Duration::from_millis(100);

#[cfg(unix)]
fn stream(arguments: &[&str]) -> Stream {
    Stream::new(Path::new(env!("CARGO_BIN_EXE_hoid")), 100, arguments)
}

#[cfg(unix)]
fn received_json(stream: &Stream) -> Value {
    serde_json::from_slice(&stream.receive_answer()).unwrap()
}

/// Lost, duplicated and late samples are detected from their sequence numbers, as from a column t.
#[cfg(unix)]
#[test]
fn lost_samples_are_bridged_and_counted() {
    let udp = stream(&[]);
    let wave = |k: u32| (0.1 * f64::from(k)).sin();
    for k in (0..100).chain(105..200) {
        udp.send(&as_struct(k, f64::NAN, wave(k), wave(k + 3)));
        assert_eq!(udp.receive_estimate().0, k);
    }
    for k in [199, 150] {
        udp.send(&as_struct(k, f64::NAN, 0.0, 0.0));
        udp.receive_estimate();
    }
    // A line of text is answered with the state of the stream.
    udp.send(b"2.00,0.1,0.2");
    let line = received_json(&udp);
    assert_eq!((&line["skipped"], &line["dropped"]), (&5.into(), &2.into()), "{line}");
    let summary = udp.end();
    assert!(
        summary.contains("201 samples: 5 skipped for a fault in e or u (5 of them missing)"),
        "{summary}"
    );
}

/// JSON objects on one or several lines are samples with the names of the channels as keys, and are answered by lines.
#[cfg(unix)]
#[test]
fn json_objects_are_samples() {
    let udp = stream(&["--input", "error", "--output", "stick"]);
    udp.send(br#"{"t": 0.00, "error": 0.1, "stick": 0.2}"#);
    assert_eq!(received_json(&udp)["t"].as_f64(), Some(0.0));
    udp.send(b"{\n  \"stick\": 0.1,\n  \"error\": null,\n  \"t\": 0.01\n}\n");
    let line = received_json(&udp);
    assert_eq!((&line["t"], &line["skipped"]), (&0.01.into(), &1.into()), "{line}");
    assert!(line["fault"].as_str().unwrap().contains("error is missing"), "{line}");
    // One sample was lost.
    udp.send(b"{\"t\": 0.03, \"error\": 0, \"stick\": 0}\n{\"t\": 0.04, \"error\": 0, \"stick\": 0}");
    let (first, second) = (received_json(&udp), received_json(&udp));
    assert_eq!((&first["skipped"], second["t"].as_f64()), (&2.into(), Some(0.04)));
    assert!(udp.end().contains("5 samples: 2 skipped"));
}

/// No external data end the stream, and none are mistaken for a sample.
#[cfg(unix)]
#[test]
fn hostile_datagrams_are_counted() {
    let udp = stream(&[]);
    udp.send(b"t,e,u\n0.00,0.1,0.2\n0.01,0.2,0.1\n");
    assert_eq!(
        (received_json(&udp)["t"].as_f64(), received_json(&udp)["t"].as_f64()),
        (Some(0.0), Some(0.01))
    );
    let long = vec![b'7'; 60_000];
    let whole = as_struct(3, 0.03, 0.0, 0.0);
    let hostile: [&[u8]; 10] = [
        b"\xff\xfe\x00",
        b"hoid",
        &whole[..39],
        b"garbage",
        b"1,2,3,4,5,6",
        b"t,y,z",
        &long,
        b"nan,1,2",
        b"{\"t\": 1}",
        b"{\"t\": 1, \"e\": {\"e\": 1}",
    ];
    for bytes in hostile {
        udp.send(bytes);
    }
    // Empty and meaningless datagrams are not counted.
    udp.send(b"");
    udp.send(b"# a comment\n\n");
    udp.socket.set_read_timeout(Some(SHORT_TIMEOUT)).unwrap();
    assert_eq!(udp.receive(&mut [0; 16]), None, "no answer for what is not a sample");
    udp.socket.set_read_timeout(Some(LONG_TIMEOUT)).unwrap();
    // Invalid values are samples with a fault.
    udp.send(&as_struct(2, f64::NAN, f64::INFINITY, f64::NAN));
    assert!(udp.receive_estimate().1[17].is_nan());
    udp.send(b"0.03,0.1,0.2");
    let line = received_json(&udp);
    assert_eq!(
        (&line["dropped"], &line["skipped"]),
        (&hostile.len().into(), &1.into()),
        "{line}"
    );
    assert!(udp.end().contains("4 samples"), "the others are none");
}

/// There are so few samples that the system keeps all of them under any load.
#[cfg(unix)]
#[test]
fn every_sample_at_a_rate_is_answered() {
    let program = Path::new(env!("CARGO_BIN_EXE_hoid"));
    let mut draw = Draw(7);
    for rate_hz in [100, 1000] {
        let udp = paced::measure_udp(program, rate_hz, 100, &mut draw);
        let pipe = paced::measure_pipes(program, rate_hz, 200, &mut draw, Duration::ZERO);
        for tally in [udp, pipe] {
            let summary = tally.summary;
            assert_eq!((tally.lost_count(), summary.samples), (0, tally.sent));
            assert_eq!((summary.skipped, summary.dropped), (0, 0));
        }
    }
}

#[cfg(unix)]
#[test]
fn stream_survives_restarts_and_clock_jumps() {
    let program = Path::new(env!("CARGO_BIN_EXE_hoid"));
    let outcomes = troubles::run_all_cases(program, Duration::from_millis(400), 600, &mut Draw(8));
    assert_eq!(outcomes.len(), 7);
}

#[test]
fn lsl_options_refer_to_python() {
    let directory = TempDir::new().unwrap();
    let arguments = ["stream", "--fs", "100", "--lsl-in", "person", "--lsl-out", "estimate"];
    let (code, message) = failure_of(directory.path(), &arguments);
    assert!(code > 0 && message.contains("pyhoid.lsl.stream"), "{message}");
}

#[test]
fn invalid_udp_addresses_are_refused() {
    let directory = TempDir::new().unwrap();
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    for (places, reason) in [
        ("5005", "5005:5006"),
        ("5005:5005", "give another output port"),
        (&format!("{port}:9"), "cannot listen on"),
    ] {
        let (code, message) = failure_of(directory.path(), &["stream", "--fs", "100", "--udp", places]);
        assert!(code > 0 && message.contains(reason), "{message}");
    }
}
