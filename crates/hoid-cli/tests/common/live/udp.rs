//! A stream over UDP and the socket of its client.

use std::{
    io::{BufRead, BufReader},
    net::UdpSocket,
    path::Path,
    process::{Child, ChildStderr, Command, Stdio},
    time::Duration,
};

use super::{remaining_output, send_signal};

/// Timeout, much longer than the latency of an answer.
pub const LONG_TIMEOUT: Duration = Duration::from_secs(60);
const NUMBER_COUNT: usize = 19;

/// A running stream.
pub struct Stream {
    pub child: Child,
    said: BufReader<ChildStderr>,
    /// Port at which the stream listens.
    pub port: u16,
    pub socket: UdpSocket,
}

impl Stream {
    /// Starts a stream at a port that the system selects.
    pub fn new(program: &Path, rate_hz: usize, arguments: &[&str]) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        Self::at(program, rate_hz, 0, socket, arguments)
    }

    /// Starts a stream at this port, with answers to this socket; for port 0 the system selects a port.
    pub fn at(program: &Path, rate_hz: usize, port: u16, socket: UdpSocket, arguments: &[&str]) -> Self {
        socket.set_read_timeout(Some(LONG_TIMEOUT)).unwrap();
        let answers = socket.local_addr().unwrap().port();
        let mut child = Command::new(program)
            .args(["stream", "--fs", &rate_hz.to_string()])
            .args(["--udp", &format!("{port}:{answers}")])
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut said = BufReader::new(child.stderr.take().unwrap());
        // If the system selects the port, the stream reports the port.
        let port = loop {
            let mut line = String::new();
            assert!(said.read_line(&mut line).unwrap() > 0, "the stream has ended");
            if let Some((_, rest)) = line.split_once("listening on 127.0.0.1:") {
                break rest.split(',').next().unwrap().parse::<u16>().unwrap();
            }
        };
        socket.connect(("127.0.0.1", port)).unwrap();
        Self {
            child,
            said,
            port,
            socket,
        }
    }

    pub fn send(&self, bytes: &[u8]) {
        self.socket.send(bytes).unwrap();
    }

    pub fn receive_answer(&self) -> Vec<u8> {
        let mut bytes = vec![0; 1 << 16];
        let length = self.receive(&mut bytes).unwrap();
        bytes.truncate(length);
        bytes
    }

    /// Receives an answer, which must come from the listening port.
    pub fn receive(&self, bytes: &mut [u8]) -> Option<usize> {
        self.socket.recv(bytes).ok()
    }

    pub fn receive_estimate(&self) -> (u32, [f64; NUMBER_COUNT], i32, u32) {
        let bytes = self.receive_answer();
        assert_eq!((bytes.len(), &bytes[..4]), (168, b"hoid".as_slice()));
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let number = |i: usize| f64::from_le_bytes(bytes[8 + 8 * i..16 + 8 * i].try_into().unwrap());
        (word(4), std::array::from_fn(number), word(160).cast_signed(), word(164))
    }

    /// Interrupts the stream and returns its messages.
    pub fn end(mut self) -> String {
        send_signal(&self.child, "-INT");
        remaining_output(&mut self.child, &mut self.said)
    }

    /// Kills the stream; returns its port and the socket.
    pub fn kill(mut self) -> (u16, UdpSocket) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
        (self.port, self.socket)
    }
}

/// Returns a sample as a struct; t is NaN if the sequence number gives the time.
pub fn as_struct(sequence: u32, t: f64, e: f64, u: f64) -> Vec<u8> {
    let mut bytes = b"hoid".to_vec();
    bytes.extend_from_slice(&sequence.to_le_bytes());
    bytes.extend([t, e, u, f64::NAN].iter().flat_map(|n| n.to_le_bytes()));
    bytes
}
