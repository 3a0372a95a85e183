//! Those who have not shown the token: one thread for all of them, that never waits for any.
//!
//! While there are none it waits for the next one. Else it takes what comes, looks at each once (a head that is whole,
//! one that is too long or too late, a peer that is gone), and pauses for [`PAUSE`] where nothing has happened. Who has
//! come is examined before anyone gives way: so the page, whose head comes at once, is heard however many others come
//! and go, and the oldest of [`MOST`] that carry no information is closed for the next.

use std::{
    collections::VecDeque,
    io::{self, ErrorKind, Read as _},
    net::{TcpListener, TcpStream},
    thread,
    time::{Duration, Instant},
};

use super::http::{Reply, Request};

/// Most of them at once, and those that are taken before all are examined.
const MOST: usize = 256;
const AT_ONCE: usize = 64;
/// Longest time that the head of a request may take to come, all of it.
const PATIENCE: Duration = Duration::from_secs(5);
/// Pause where nothing happens, and where the system gives no connection.
const PAUSE: Duration = Duration::from_millis(1);
const BACK_OFF: Duration = Duration::from_millis(50);

/// A connection whose head is not whole.
struct Stranger {
    stream: TcpStream,
    head: Vec<u8>,
    came: Instant,
}

/// Known properties of a stranger after a look.
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
                Ok(n) => self.head.extend_from_slice(&part[..n]),
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

/// Receives for as long as the program runs; `admitted` takes a request with its connection, or gives the reason not.
pub fn receive(listener: &TcpListener, mut admitted: impl FnMut(Request, TcpStream) -> Result<(), (Reply, TcpStream)>) {
    let mut all: VecDeque<Stranger> = VecDeque::new();
    loop {
        let mut idle = match take(listener, &mut all) {
            Ok(came) => came == 0,
            // No descriptor is left: who carries no information makes room.
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
                // It is shorter than what a connection holds; who does not take it needs none.
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

/// Takes those who have come; waits for one where there are none.
fn take(listener: &TcpListener, all: &mut VecDeque<Stranger>) -> io::Result<usize> {
    let first = all.is_empty();
    listener.set_nonblocking(!first)?;
    for came in 0..AT_ONCE {
        let stream = match listener.accept() {
            Ok((stream, _)) => stream,
            Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(came),
            // A peer that is gone already.
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
