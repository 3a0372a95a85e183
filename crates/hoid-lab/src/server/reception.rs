//! Clients that have not presented the token: one thread for all of them, which never waits for any.
//!
//! While there are none it waits for the next one. Otherwise it accepts connections, examines each once (a complete
//! head, one that is too long or too late, a closed peer), and pauses for [`PAUSE`] if nothing has happened. New
//! connections are examined before any is closed: so the page, whose head arrives at once, is served however many
//! others connect, and the oldest of [`MOST`] incomplete ones is closed for the next.

use std::{
    collections::VecDeque,
    io::{self, ErrorKind, Read as _},
    net::{TcpListener, TcpStream},
    thread,
    time::{Duration, Instant},
};

use super::http::{Reply, Request};

/// Maximum number of them, and of those accepted before all are examined.
const MOST: usize = 256;
const AT_ONCE: usize = 64;
/// Timeout of a complete head.
const PATIENCE: Duration = Duration::from_secs(5);
/// Pause if nothing happens, or if the system provides no connection.
const PAUSE: Duration = Duration::from_millis(1);
const BACK_OFF: Duration = Duration::from_millis(50);

/// A connection with an incomplete head.
struct Stranger {
    stream: TcpStream,
    head: Vec<u8>,
    came: Instant,
}

/// State of a stranger after an examination.
enum Look {
    Waits,
    Gone,
    Said(Result<Request, Reply>),
}

impl Stranger {
    fn look(&mut self) -> Look {
        let mut part = [0; 2048];
        loop {
            if let Some(said) = Request::of(&self.head) {
                return Look::Said(said);
            }
            match self.stream.read(&mut part) {
                Ok(0) => return Look::Gone,
                Ok(n) => self.head.extend(part.iter().take(n)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(_) => return Look::Gone,
            }
        }
        if self.came.elapsed() > PATIENCE {
            return Look::Said(Err(Reply::refused(408, "the request did not come in time")));
        }
        Look::Waits
    }
}

/// Accepts connections while the program runs; `admitted` takes a request with its connection, or returns the refusal.
pub fn receive(listener: &TcpListener, mut admitted: impl FnMut(Request, TcpStream) -> Result<(), (Reply, TcpStream)>) {
    let mut all: VecDeque<Stranger> = VecDeque::new();
    loop {
        let mut idle = match take(listener, &mut all) {
            Ok(came) => came == 0,
            // No descriptor is left: an incomplete connection is closed.
            Err(_) => {
                drop(all.pop_front());
                thread::sleep(BACK_OFF);
                false
            }
        };
        let mut waiting = VecDeque::with_capacity(all.len());
        for mut stranger in all.drain(..) {
            let said = match stranger.look() {
                Look::Waits => {
                    waiting.push_back(stranger);
                    continue;
                }
                Look::Gone => continue,
                Look::Said(said) => said,
            };
            idle = false;
            let stream = stranger.stream;
            let refused = match said {
                Ok(request) => admitted(request, stream).err(),
                Err(reply) => Some((reply, stream)),
            };
            if let Some((reply, mut stream)) = refused {
                // It fits into the send buffer; a client that does not read it needs none.
                let _ = reply.write(&mut stream);
            }
        }
        all = waiting;
        while all.len() > MOST {
            drop(all.pop_front());
        }
        if idle {
            thread::sleep(PAUSE);
        }
    }
}

/// Accepts waiting connections; waits for one if there are none.
fn take(listener: &TcpListener, all: &mut VecDeque<Stranger>) -> io::Result<usize> {
    let first = all.is_empty();
    listener.set_nonblocking(!first)?;
    for came in 0..AT_ONCE {
        let stream = match listener.accept() {
            Ok((stream, _)) => stream,
            Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(came),
            // A peer that is already closed.
            Err(error) if matches!(error.kind(), ErrorKind::ConnectionAborted | ErrorKind::Interrupted) => continue,
            Err(error) => return Err(error),
        };
        if stream.set_nonblocking(true).is_ok() {
            all.push_back(Stranger {
                stream,
                head: Vec::new(),
                came: Instant::now(),
            });
        }
        if first {
            return Ok(1);
        }
    }
    Ok(AT_ONCE)
}
