//! Clients that have not presented the token: a single thread handles all of them and never blocks on any client.
//!
//! While no client is connected, the thread waits for the next connection. Otherwise it accepts connections, examines
//! each client once (complete head, head too long or too late, connection closed by the client), and pauses for
//! [`IDLE_PAUSE`] if nothing has happened. New connections are examined before any connection is closed. The page,
//! whose head arrives at once, is therefore served regardless of the number of other clients. If there are more than
//! [`MAX_PENDING`] incomplete connections, the oldest ones are closed.

use std::{
    collections::VecDeque,
    io::{self, ErrorKind, Read as _},
    net::{TcpListener, TcpStream},
    thread,
    time::{Duration, Instant},
};

use super::http::{Reply, Request};

/// Maximum number of connections with an incomplete head, and number of connections accepted before all are examined.
const MAX_PENDING: usize = 256;
const MAX_ACCEPTED_PER_ROUND: usize = 64;
/// Time within which a complete head must arrive.
const HEAD_TIMEOUT: Duration = Duration::from_secs(5);
/// Pause if nothing has happened, and pause if the operating system provides no connection.
const IDLE_PAUSE: Duration = Duration::from_millis(1);
const RETRY_PAUSE: Duration = Duration::from_millis(50);

/// A connection with an incomplete head.
struct PendingConnection {
    stream: TcpStream,
    head: Vec<u8>,
    accepted_at: Instant,
}

/// Result of an examination of a connection.
enum ReadState {
    Incomplete,
    Closed,
    Complete(Result<Request, Reply>),
}

impl PendingConnection {
    fn read_available(&mut self) -> ReadState {
        let mut part = [0; 2048];
        loop {
            if let Some(message) = Request::of(&self.head) {
                return ReadState::Complete(message);
            }
            match self.stream.read(&mut part) {
                Ok(0) => return ReadState::Closed,
                Ok(n) => self.head.extend(part.iter().take(n)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(_) => return ReadState::Closed,
            }
        }
        if self.accepted_at.elapsed() > HEAD_TIMEOUT {
            return ReadState::Complete(Err(Reply::refusal(408, "the request did not arrive in time")));
        }
        ReadState::Incomplete
    }
}

/// Accepts connections while the program runs. `admitted` takes over a request with its connection, or returns the
/// refusal.
pub fn accept_requests(
    listener: &TcpListener,
    mut admitted: impl FnMut(Request, TcpStream) -> Result<(), (Reply, TcpStream)>,
) {
    let mut all: VecDeque<PendingConnection> = VecDeque::new();
    loop {
        let mut idle = match accept_pending(listener, &mut all) {
            Ok(accepted) => accepted == 0,
            // If no file descriptor is left, the oldest incomplete connection is closed.
            Err(_) => {
                drop(all.pop_front());
                thread::sleep(RETRY_PAUSE);
                false
            }
        };
        let mut waiting = VecDeque::with_capacity(all.len());
        for mut pending in all.drain(..) {
            let message = match pending.read_available() {
                ReadState::Incomplete => {
                    waiting.push_back(pending);
                    continue;
                }
                ReadState::Closed => continue,
                ReadState::Complete(message) => message,
            };
            idle = false;
            let stream = pending.stream;
            let refused = match message {
                Ok(request) => admitted(request, stream).err(),
                Err(reply) => Some((reply, stream)),
            };
            if let Some((reply, mut stream)) = refused {
                // The reply fits into the send buffer; if the client does not read the reply, the error is ignored.
                let _ = reply.write(&mut stream);
            }
        }
        all = waiting;
        while all.len() > MAX_PENDING {
            drop(all.pop_front());
        }
        if idle {
            thread::sleep(IDLE_PAUSE);
        }
    }
}

/// Accepts pending connections; waits for one if no client is connected.
fn accept_pending(listener: &TcpListener, all: &mut VecDeque<PendingConnection>) -> io::Result<usize> {
    let first = all.is_empty();
    listener.set_nonblocking(!first)?;
    for accepted in 0..MAX_ACCEPTED_PER_ROUND {
        let stream = match listener.accept() {
            Ok((stream, _)) => stream,
            Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(accepted),
            // The client has already closed the connection.
            Err(error) if matches!(error.kind(), ErrorKind::ConnectionAborted | ErrorKind::Interrupted) => continue,
            Err(error) => return Err(error),
        };
        if stream.set_nonblocking(true).is_ok() {
            all.push_back(PendingConnection {
                stream,
                head: Vec::new(),
                accepted_at: Instant::now(),
            });
        }
        if first {
            return Ok(1);
        }
    }
    Ok(MAX_ACCEPTED_PER_ROUND)
}
