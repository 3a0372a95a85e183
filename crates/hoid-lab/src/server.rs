//! The server of the page: HTTP on 127.0.0.1, and the sockets of its pages.
//!
//! It serves one page, its data and the pages of results, and nothing to anybody else: the address
//! holds a random token, and a request is refused unless its `Host` is the address of the server, its
//! `Origin`, where it has one, is that too, and it is a GET of bounded length. A socket must have an
//! origin. Nothing that a page says names a file.
//!
//! | refused | status |
//! |---|---|
//! | another host or origin, no token or another one | 403 |
//! | a path that is none | 404 |
//! | another method than GET | 405 |
//! | a head of more than 16 KiB | 431 |
//! | more than 64 connections with the token at once | 503 |
//!
//! **Strangers.** A head has 5 s in all to come. Connections that have not shown the token yet are at
//! most 32; where one more comes, the oldest of them is closed: who is slow gives way, and the page,
//! whose head comes at once, is always heard. Where the system has no descriptor or thread left, the
//! loop waits a moment and goes on.

mod http;
mod socket;

use std::{
    collections::VecDeque,
    net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use data_encoding::{BASE64, HEXLOWER};
use sha2::{Digest, Sha256};

use crate::{LabError, lab::Lab};
use http::{Reply, Request};

/// Most connections at once of those that have not shown the token, and of those that have.
const STRANGERS: usize = 32;
const KNOWN: usize = 64;
/// Longest time that the head of a request may take to come, all of it.
const PATIENCE: Duration = Duration::from_secs(5);
/// Wait where the system gives no connection.
const BACK_OFF: Duration = Duration::from_millis(50);

/// The page, built of `page/` by `npm run build`.
const PAGE: &str = include_str!("../page/dist/lab.html");

/// A server that listens.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    token: String,
    /// The token of [`Server::address_once`], until it is shown.
    once: Mutex<Option<String>>,
    policy: String,
    lab: Arc<Lab>,
    strangers: Strangers,
    known: AtomicUsize,
}

/// Connections that have not shown the token, the oldest first.
#[derive(Default)]
struct Strangers(Mutex<VecDeque<(u64, TcpStream)>>);

impl Strangers {
    fn all(&self) -> MutexGuard<'_, VecDeque<(u64, TcpStream)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// One more; false where there is no descriptor for it.
    fn enter(&self, number: u64, stream: &TcpStream) -> bool {
        let Ok(own) = stream.try_clone() else {
            self.give_way();
            return false;
        };
        let mut all = self.all();
        all.push_back((number, own));
        let many = all.len() > STRANGERS;
        drop(all);
        if many {
            self.give_way();
        }
        true
    }

    /// The oldest is closed.
    fn give_way(&self) {
        if let Some((_, oldest)) = self.all().pop_front() {
            // It is gone already where this fails.
            let _ = oldest.shutdown(Shutdown::Both);
        }
    }

    /// It is over, or has shown the token.
    fn leave(&self, number: u64) {
        self.all().retain(|(known, _)| *known != number);
    }
}

/// A connection that has shown the token, counted for as long as it is answered.
struct Known<'a>(&'a AtomicUsize);

impl<'a> Known<'a> {
    fn enter(all: &'a AtomicUsize) -> Self {
        all.fetch_add(1, Ordering::Relaxed);
        Self(all)
    }
}

impl Drop for Known<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Server {
    /// Listens on a port of 127.0.0.1, a free one where none is given.
    ///
    /// # Errors
    /// [`LabError::Server`].
    pub fn new(lab: Lab, port: Option<u16>) -> Result<Self, LabError> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port.unwrap_or(0))).map_err(|error| {
            let asked = port.map_or("no port is free".to_owned(), |port| {
                format!("port {port} cannot be had")
            });
            LabError::Server(format!("{asked}: {error}; leave --port out for any free one"))
        })?;
        let address = listener
            .local_addr()
            .map_err(|error| LabError::Server(error.to_string()))?;
        Ok(Self {
            listener,
            address,
            token: random_token()?,
            once: Mutex::new(None),
            policy: policy(PAGE),
            lab: Arc::new(lab),
            strangers: Strangers::default(),
            known: AtomicUsize::new(0),
        })
    }

    /// The address to open, token included.
    pub fn address(&self) -> String {
        format!("http://{}/{}/", self.address, self.token)
    }

    /// An address for a browser that is started with it, which others may read in the list of processes:
    /// it leads to [`Server::address`] once, and then nowhere.
    ///
    /// # Errors
    /// [`LabError::Server`] where the system gives no random numbers.
    pub fn address_once(&self) -> Result<String, LabError> {
        let token = random_token()?;
        let address = format!("http://{}/{token}/", self.address);
        *self.once.lock().unwrap_or_else(PoisonError::into_inner) = Some(token);
        Ok(address)
    }

    /// True the first time that the token of [`Server::address_once`] is shown.
    fn is_once(&self, token: &str) -> bool {
        let mut once = self.once.lock().unwrap_or_else(PoisonError::into_inner);
        once.take_if(|known| same(known, token)).is_some()
    }

    /// Serves for as long as the program runs.
    pub fn serve(self) {
        let server = Arc::new(self);
        for (number, stream) in (0_u64..).zip(server.listener.incoming()) {
            let Ok(stream) = stream else {
                // No descriptor is left, or the peer is gone.
                server.strangers.give_way();
                thread::sleep(BACK_OFF);
                continue;
            };
            if !server.strangers.enter(number, &stream) {
                continue;
            }
            let own = Arc::clone(&server);
            let made = thread::Builder::new().spawn(move || {
                own.answer(stream, number);
                own.strangers.leave(number);
            });
            if made.is_err() {
                server.strangers.leave(number);
                thread::sleep(BACK_OFF);
            }
        }
    }

    fn answer(&self, mut stream: TcpStream, number: u64) {
        let timed = stream
            .set_read_timeout(Some(PATIENCE))
            .and(stream.set_write_timeout(Some(PATIENCE)));
        if timed.and(stream.set_nodelay(true)).is_err() {
            return;
        }
        let request = Request::read(&mut stream, Instant::now() + PATIENCE);
        let routed = request.and_then(|request| self.routed(&request));
        let _known = match &routed {
            Ok(_) => {
                self.strangers.leave(number);
                Some(Known::enter(&self.known))
            }
            Err(_) => None,
        };
        let many = self.known.load(Ordering::Relaxed) > KNOWN;
        let reply = match routed {
            Ok(_) if many => Reply::refused(503, "too many connections"),
            Ok(Route::Socket(key)) => return socket::run(stream, &key, &self.lab),
            Ok(Route::Reply(reply)) | Err(reply) => reply,
        };
        // A page that is gone needs no answer.
        let _ = reply.write(&mut stream);
    }

    fn routed(&self, request: &Request) -> Result<Route, Reply> {
        let own = |authority: &str| {
            let port = self.address.port();
            authority == format!("127.0.0.1:{port}") || authority == format!("localhost:{port}")
        };
        if !request.host.as_deref().is_some_and(own) {
            return Err(Reply::refused(403, "another host"));
        }
        let foreign = |origin: &str| !origin.strip_prefix("http://").is_some_and(own);
        if request.origin.as_deref().is_some_and(foreign) {
            return Err(Reply::refused(403, "another origin"));
        }
        let (token, rest) = request
            .path
            .trim_start_matches('/')
            .split_once('/')
            .unwrap_or((&request.path, ""));
        if request.method == "GET" && rest.is_empty() && self.is_once(token) {
            return Ok(Route::Reply(Reply::moved(&self.address())));
        }
        if !same(token, &self.token) {
            return Err(Reply::refused(403, "no token: open the address that hoid lab printed"));
        }
        if request.method != "GET" {
            return Err(Reply::refused(405, "only GET"));
        }
        let parts: Vec<&str> = rest.split('/').collect();
        let file = |found: Result<Option<(Vec<u8>, &'static str)>, LabError>| match found {
            Ok(Some((body, kind))) => Ok(Route::Reply(Reply::file(body, kind))),
            Ok(None) => Err(Reply::refused(404, "not found")),
            Err(error) => Err(Reply::refused(500, &error.to_string())),
        };
        match parts.as_slice() {
            [""] | ["experimenter"] => Ok(Route::Reply(Reply::page(PAGE, &self.policy))),
            ["socket"] => match &request.socket_key {
                Some(key) if request.origin.is_some() => Ok(Route::Socket(key.clone())),
                _ => Err(Reply::refused(403, "no socket, or none of this page")),
            },
            ["export.zip"] => file(self.lab.export()),
            ["data", name] => file(self.lab.data(name)),
            ["reports", names @ ..] => file(self.lab.report(names)),
            _ => Err(Reply::refused(404, "not found")),
        }
    }
}

enum Route {
    Socket(String),
    Reply(Reply),
}

fn random_token() -> Result<String, LabError> {
    let mut random = [0; 16];
    getrandom::fill(&mut random)
        .map_err(|error| LabError::Server(format!("the system gives no random numbers for the token: {error}")))?;
    Ok(HEXLOWER.encode(&random))
}

/// Equal, in a time that does not tell where they differ.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0
}

/// The policy of the page: its own script and style by their hashes, its own socket and data, nothing
/// else.
fn policy(page: &str) -> String {
    let hash = |tag: &str| {
        let inside = page
            .split_once(&format!("<{tag}>"))
            .and_then(|(_, rest)| rest.split_once(&format!("</{tag}>")));
        let text = inside.map_or("", |(inside, _)| inside);
        format!("'sha256-{}'", BASE64.encode(&Sha256::digest(text.as_bytes())))
    };
    format!(
        "default-src 'none'; script-src {}; style-src {}; connect-src 'self'; img-src data:; base-uri 'none'; \
         form-action 'none'; frame-ancestors 'none'",
        hash("script"),
        hash("style")
    )
}
