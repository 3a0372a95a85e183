//! Samples at a fixed rate, and the latency of their answers.
//!
//! Each sample is sent at its time, regardless of earlier answers. The latency is the time from the call that sends a
//! sample to the return of the call that receives its answer. It includes both ways through the system, the estimate,
//! and delays due to other processes.

use std::{
    io::{BufRead, BufReader, Write},
    net::UdpSocket,
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use super::{
    Draw, Summary, remaining_output, sample,
    udp::{Stream, as_struct},
};

/// Timeout of an answer.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);

/// Number of samples sent, and latencies of the answered samples.
pub struct Tally {
    pub sent: usize,
    pub trips: Vec<Duration>,
    /// Summary reported by the stream.
    pub summary: Summary,
}

impl Tally {
    pub fn lost_count(&self) -> usize {
        self.sent - self.trips.len()
    }

    /// Returns the time within which this share of the answers arrived.
    pub fn latency_quantile(&self, share: f64) -> Duration {
        let mut sorted = self.trips.clone();
        sorted.sort_unstable();
        let last = sorted.len() - 1;
        sorted[((share * last as f64).ceil() as usize).min(last)]
    }
}

/// Calls a function at each time k/rate.
pub fn call_at_rate(rate_hz: usize, n: usize, mut call: impl FnMut(usize)) {
    let start_time = Instant::now();
    for k in 0..n {
        let due = Duration::from_secs_f64(k as f64 / rate_hz as f64);
        thread::sleep(due.saturating_sub(start_time.elapsed()));
        call(k);
    }
}

/// Sends structs over UDP.
pub fn measure_udp(program: &Path, rate_hz: usize, n: usize, draw: &mut Draw) -> Tally {
    let stream = Stream::new(program, rate_hz, &[]);
    let socket = stream.socket.try_clone().unwrap();
    let receiver = thread::spawn(move || receive_answers(&socket, n));
    let mut sent = Vec::with_capacity(n);
    call_at_rate(rate_hz, n, |k| {
        let (e, u) = sample(k as f64 / rate_hz as f64, draw);
        let bytes = as_struct(k as u32, f64::NAN, e, u);
        sent.push(Instant::now());
        stream.send(&bytes);
    });
    let received = receiver.join().unwrap();
    let trips = received.into_iter().map(|(k, at)| at - sent[k as usize]).collect();
    Tally {
        sent: n,
        trips,
        summary: Summary::of(&stream.end()),
    }
}

/// Receives up to n answers until a timeout; returns their sequence numbers and arrival times.
pub fn receive_answers(socket: &UdpSocket, n: usize) -> Vec<(u32, Instant)> {
    socket.set_read_timeout(Some(ANSWER_TIMEOUT)).unwrap();
    let mut all = Vec::with_capacity(n);
    let mut bytes = [0; 256];
    while all.len() < n {
        let Ok(length) = socket.recv(&mut bytes) else { break };
        let at = Instant::now();
        assert_eq!(length, 168);
        all.push((u32::from_le_bytes(bytes[4..8].try_into().unwrap()), at));
    }
    all
}

/// Sends lines through pipes. The reader pauses once, for `pause`, after the first hundred answers.
pub fn measure_pipes(program: &Path, rate_hz: usize, n: usize, draw: &mut Draw, pause: Duration) -> Tally {
    let mut child: Child = Command::new(program)
        .args(["stream", "--fs", &rate_hz.to_string()])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let output = BufReader::new(child.stdout.take().unwrap());
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let receiver = thread::spawn(move || {
        let mut all = Vec::with_capacity(n);
        for line in output.lines() {
            assert!(line.unwrap().starts_with("{\"t\":"));
            all.push(Instant::now());
            if all.len() == 100 {
                thread::sleep(pause);
            }
        }
        all
    });
    let mut sent = Vec::with_capacity(n);
    call_at_rate(rate_hz, n, |k| {
        let t_s = k as f64 / rate_hz as f64;
        let (e, u) = sample(t_s, draw);
        let line = format!("{t_s:?},{e:?},{u:?}\n");
        sent.push(Instant::now());
        input.write_all(line.as_bytes()).unwrap();
    });
    drop(input);
    let received = receiver.join().unwrap();
    Tally {
        sent: n,
        trips: received.into_iter().zip(sent).map(|(at, sent)| at - sent).collect(),
        summary: Summary::of(&remaining_output(&mut child, &mut stderr)),
    }
}
