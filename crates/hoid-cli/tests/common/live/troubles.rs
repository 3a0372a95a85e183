//! Readers that stop, restarts of either side, clock jumps and hostile datagrams: nothing crashes, and lost samples are
//! counted. Each function returns the samples sent, the answers, and the summary of the stream.

use std::{net::UdpSocket, path::Path, time::Duration};

use super::{
    Draw, Summary,
    paced::{call_at_rate, measure_pipes},
    sample, send_signal,
    udp::{LONG_TIMEOUT, Stream, as_struct},
};

/// Sampling rate, Hz.
const RATE_HZ: usize = 1000;
const SLOW_RATE_HZ: usize = 100;

/// Result of a case.
pub struct Outcome {
    pub what: &'static str,
    pub sent: usize,
    pub answered: usize,
    pub summary: Summary,
}

fn outcome(what: &'static str, sent: usize, answered: usize, stream: Stream) -> Outcome {
    Outcome {
        what,
        sent,
        answered,
        summary: Summary::of(&stream.end()),
    }
}

/// Runs all cases.
pub fn run_all_cases(program: &Path, pause: Duration, hostile: usize, draw: &mut Draw) -> Vec<Outcome> {
    vec![
        reader_of_pipe_stops(program, pause, draw),
        reader_of_udp_stops(program, pause, draw),
        stream_stops(program, pause, draw),
        sender_restarts(program, draw),
        stream_restarts(program, draw),
        clock_jumps(program, draw),
        hostile_datagrams(program, hostile, draw),
    ]
}

/// A full pipe blocks the sender, so every sample is answered.
pub fn reader_of_pipe_stops(program: &Path, pause: Duration, draw: &mut Draw) -> Outcome {
    let n = (2.0 * pause.as_secs_f64() * RATE_HZ as f64) as usize + 500;
    let tally = measure_pipes(program, RATE_HZ, n, draw, pause);
    assert_eq!((tally.lost_count(), tally.summary.samples), (0, n));
    assert_eq!((tally.summary.skipped, tally.summary.dropped), (0, 0));
    Outcome {
        what: "the reader of the pipe stops",
        sent: n,
        answered: tally.trips.len(),
        summary: tally.summary,
    }
}

/// Sends further samples until one of them is answered; returns the total number of samples, and of
/// answers received meanwhile.
fn send_until_answered(stream: &Stream, sent: usize, mut send: impl FnMut(usize)) -> (usize, usize) {
    let (mut sent, mut answered) = (sent, 0);
    stream
        .socket
        .set_read_timeout(Some(Duration::from_millis(200)))
        .unwrap();
    let mut bytes = [0; 256];
    let mut last = None;
    loop {
        send(sent);
        sent += 1;
        while let Some(length) = stream.receive(&mut bytes) {
            assert_eq!(length, 168);
            let sequence = u32::from_le_bytes(bytes[4..8].try_into().unwrap());
            assert!(last.is_none_or(|last| last < sequence), "in order, and each once");
            last = Some(sequence);
            answered += 1;
            if sequence as usize + 1 == sent {
                return (sent, answered);
            }
        }
    }
}

/// Answers that are not received are lost, but no samples are lost.
pub fn reader_of_udp_stops(program: &Path, pause: Duration, draw: &mut Draw) -> Outcome {
    let stream = Stream::new(program, RATE_HZ, &[]);
    let mut send = |k: usize| {
        let (e, u) = sample(k as f64 / RATE_HZ as f64, draw);
        stream.send(&as_struct(k as u32, f64::NAN, e, u));
    };
    let n = (pause.as_secs_f64() * RATE_HZ as f64) as usize;
    call_at_rate(RATE_HZ, n, &mut send);
    let (sent, answered) = send_until_answered(&stream, n, send);
    let outcome = outcome("the reader of UDP stops", sent, answered, stream);
    let summary = outcome.summary;
    assert_eq!((summary.samples, summary.dropped), (sent, 0));
    assert!(answered <= sent - summary.missing);
    outcome
}

/// Samples lost by the system while the stream was stopped are detected by their sequence numbers.
pub fn stream_stops(program: &Path, pause: Duration, draw: &mut Draw) -> Outcome {
    let stream = Stream::new(program, RATE_HZ, &[]);
    let mut send = |k: usize| {
        let (e, u) = sample(k as f64 / RATE_HZ as f64, draw);
        stream.send(&as_struct(k as u32, f64::NAN, e, u));
    };
    send(0);
    assert_eq!(stream.receive_estimate().0, 0);
    send_signal(&stream.child, "-STOP");
    let n = (pause.as_secs_f64() * RATE_HZ as f64) as usize;
    call_at_rate(RATE_HZ, n, |k| send(k + 1));
    send_signal(&stream.child, "-CONT");
    let (sent, answered) = send_until_answered(&stream, n + 1, send);
    let outcome = outcome("the stream stays constant", sent, answered + 1, stream);
    let summary = outcome.summary;
    assert_eq!((summary.samples, summary.dropped), (sent, 0));
    assert!(outcome.answered <= sent - summary.missing);
    outcome
}

/// A sender that restarts its sequence at zero is accepted after ten samples.
pub fn sender_restarts(program: &Path, draw: &mut Draw) -> Outcome {
    let mut stream = Stream::new(program, SLOW_RATE_HZ, &[]);
    let ask = |stream: &Stream, draw: &mut Draw| {
        for k in 0..200 {
            let (e, u) = sample(k as f64 / SLOW_RATE_HZ as f64, draw);
            stream.send(&as_struct(k, f64::NAN, e, u));
            assert_eq!(stream.receive_estimate().0, k);
        }
    };
    ask(&stream, draw);
    let place = stream.socket.local_addr().unwrap();
    // The old socket is closed before its port is used again.
    stream.socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    stream.socket = UdpSocket::bind(place).unwrap();
    stream.socket.connect(("127.0.0.1", stream.port)).unwrap();
    stream.socket.set_read_timeout(Some(LONG_TIMEOUT)).unwrap();
    ask(&stream, draw);
    let outcome = outcome("the sender starts again", 400, 400, stream);
    assert_eq!((outcome.summary.dropped, outcome.summary.missing), (9, 9));
    outcome
}

/// A stream that was killed and restarted answers from its first sample on; samples sent in the meantime are lost.
pub fn stream_restarts(program: &Path, draw: &mut Draw) -> Outcome {
    let stream = Stream::new(program, SLOW_RATE_HZ, &[]);
    let datagram = |k: u32, draw: &mut Draw| {
        let (e, u) = sample(f64::from(k) / SLOW_RATE_HZ as f64, draw);
        as_struct(k, f64::NAN, e, u)
    };
    for k in 0..100 {
        stream.send(&datagram(k, draw));
        assert_eq!(stream.receive_estimate().0, k);
    }
    let (port, socket) = stream.kill();
    let mut refused = 0;
    for k in 100..150 {
        // The system reports a missing listener only at the next call.
        refused += usize::from(socket.send(&datagram(k, draw)).is_err());
    }
    assert!(refused > 0);
    // This clears errors that the system has not reported yet.
    let _ = socket.take_error();
    let stream = Stream::at(program, SLOW_RATE_HZ, port, socket, &[]);
    for k in 150..250 {
        stream.send(&datagram(k, draw));
        assert_eq!(stream.receive_estimate().0, k);
    }
    let outcome = outcome("the stream is killed and starts again", 250, 200, stream);
    assert_eq!((outcome.summary.samples, outcome.summary.skipped), (100, 0));
    outcome
}

/// A forward jump of the time is a gap; a backward jump is accepted after ten samples.
pub fn clock_jumps(program: &Path, draw: &mut Draw) -> Outcome {
    let stream = Stream::new(program, SLOW_RATE_HZ, &[]);
    let mut sequence = 0;
    // The time jumps forward by 5 s, back by 4 s, and forward by an hour, of which 10 s are filled.
    for begin_s in [0.0, 6.0, 3.0, 3600.0] {
        for k in 0..100 {
            let (e, u) = sample(f64::from(k) / SLOW_RATE_HZ as f64, draw);
            stream.send(&as_struct(sequence, begin_s + f64::from(k) / SLOW_RATE_HZ as f64, e, u));
            assert_eq!(stream.receive_estimate().0, sequence);
            sequence += 1;
        }
    }
    let outcome = outcome("the clock jumps", 400, 400, stream);
    assert_eq!((outcome.summary.dropped, outcome.summary.missing), (9, 500 + 9 + 1000));
    outcome
}

/// Datagrams that are not samples are dropped and counted; the samples between them are answered.
pub fn hostile_datagrams(program: &Path, hostile: usize, draw: &mut Draw) -> Outcome {
    let stream = Stream::new(program, SLOW_RATE_HZ, &[]);
    let mut sent = 0;
    for k in 0..hostile {
        stream.send(&invalid_datagram(draw));
        if k % 8 == 7 {
            let (e, u) = sample(f64::from(sent) / SLOW_RATE_HZ as f64, draw);
            stream.send(&as_struct(sent, f64::NAN, e, u));
            assert_eq!(stream.receive_estimate().0, sent);
            sent += 1;
        }
    }
    let outcome = outcome("hostile datagrams", hostile + sent as usize, sent as usize, stream);
    assert_eq!(outcome.summary.dropped, hostile);
    assert_eq!((outcome.summary.samples, outcome.summary.skipped), (sent as usize, 0));
    outcome
}

fn invalid_datagram(draw: &mut Draw) -> Vec<u8> {
    let length = 1 + draw.integer_below(300);
    let any: Vec<u8> = (0..length).map(|_| draw.bits() as u8).collect();
    let text: String = any.iter().map(|byte| char::from(b'a' + byte % 26)).collect();
    match draw.integer_below(6) {
        // No text starts with these bytes.
        0 => [&[0xff], any.as_slice()].concat(),
        1 => {
            let mut whole = as_struct(7, f64::NAN, 0.1, 0.1);
            whole.truncate(4 + draw.integer_below(36));
            whole
        }
        2 => [as_struct(7, f64::NAN, 0.1, 0.1), any].concat(),
        3 => text.into_bytes(),
        4 => format!("{{\"t\": {length}, \"{text}\": 1").into_bytes(),
        _ => format!("nan,{length},{text}").into_bytes(),
    }
}
