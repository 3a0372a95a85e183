//! The server of the page: HTTP on 127.0.0.1, and WebSockets for the pages.
//!
//! The server provides one page, its data and the pages of results, to authorised clients only. The path of each
//! request starts with a random token. A request is accepted only if its `Host` is the address of the server, if its
//! `Origin`, when present, is also that address, and if it is a GET request of limited length. A request for a socket
//! must have an origin. No message from a page contains a file name.
//!
//! | rejected request | status |
//! |---|---|
//! | wrong host or origin, missing or wrong token | 403 |
//! | an invalid path | 404 |
//! | a method other than GET | 405 |
//! | a head of more than 16 KiB | 431 |
//! | more than 64 simultaneous connections with the token | 503 |
//!
//! **Strangers** are clients that have not presented the token (`reception`): their request head must arrive within 5
//! s, at most 256 of them are kept (the oldest is closed first), and they have no threads of their own.

mod http;
mod reception;
mod socket;

use std::{
    net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

use data_encoding::{BASE64, HEXLOWER};
use sha2::{Digest, Sha256};
use socket2::SockRef;

use crate::{LabError, lab::Lab};
use http::{Reply, Request};

/// Number of connections that the operating system queues until they are accepted. With the value of 128 in the
/// standard library, a burst of strangers fills the queue, and the page must then retry its connection after a second.
const CONNECTION_QUEUE_LENGTH: i32 = 4096;
/// Maximum number of simultaneous connections with the token.
const MAX_CONNECTIONS: usize = 64;
/// Timeout for reading from and writing to an authorised connection.
const IO_TIMEOUT: Duration = Duration::from_secs(5);

/// The page, built from `page/` by `npm run build`.
const PAGE: &str = include_str!("../page/dist/lab.html");

/// A server that listens on a port of 127.0.0.1.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    token: String,
    /// Token of [`Server::single_use_address`] until it is used.
    single_use_token: Mutex<Option<String>>,
    policy: String,
    lab: Arc<Lab>,
    connection_count: AtomicUsize,
}

/// A connection with the token, counted while it is served.
struct AuthorisedConnection(Arc<Server>);

impl AuthorisedConnection {
    /// Admits another connection if the limit allows it.
    fn accept(server: &Arc<Server>) -> Option<Self> {
        let before = server.connection_count.fetch_add(1, Ordering::Relaxed);
        let known = Self(Arc::clone(server));
        (before < MAX_CONNECTIONS).then_some(known)
    }
}

impl Drop for AuthorisedConnection {
    fn drop(&mut self) {
        self.0.connection_count.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Server {
    /// Listens on the given port of 127.0.0.1, or on a free port if none is given.
    ///
    /// # Errors
    /// [`LabError::Server`].
    pub fn new(lab: Lab, port: Option<u16>) -> Result<Self, LabError> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port.unwrap_or(0))).map_err(|error| {
            let asked = port.map_or("no port is free".to_owned(), |port| {
                format!("port {port} is not available")
            });
            LabError::Server(format!("{asked}: {error}; leave --port out to use any free port"))
        })?;
        let address = SockRef::from(&listener)
            .listen(CONNECTION_QUEUE_LENGTH)
            .and_then(|()| listener.local_addr())
            .map_err(|error| LabError::Server(error.to_string()))?;
        Ok(Self {
            listener,
            address,
            token: random_token()?,
            single_use_token: Mutex::new(None),
            policy: content_security_policy(PAGE),
            lab: Arc::new(lab),
            connection_count: AtomicUsize::new(0),
        })
    }

    /// Returns the address to open, including the token.
    pub fn address(&self) -> String {
        format!("http://{}/{}/", self.address, self.token)
    }

    /// Returns an address with which a browser can be started. Other users may read it in the list of processes; it
    /// therefore redirects to [`Server::address`] only once.
    ///
    /// # Errors
    /// [`LabError::Server`] if the operating system provides no random numbers.
    pub fn single_use_address(&self) -> Result<String, LabError> {
        let token = random_token()?;
        let address = format!("http://{}/{token}/", self.address);
        *self.single_use_token.lock().unwrap_or_else(PoisonError::into_inner) = Some(token);
        Ok(address)
    }

    /// True for the first use of the token from [`Server::single_use_address`].
    fn take_single_use_token(&self, token: &str) -> bool {
        let mut single_use_token = self.single_use_token.lock().unwrap_or_else(PoisonError::into_inner);
        single_use_token
            .take_if(|known| equal_in_constant_time(known, token))
            .is_some()
    }

    /// Serves requests while the program runs.
    pub fn serve(self) {
        let server = Arc::new(self);
        reception::accept_requests(&server.listener, |request, stream| {
            let busy = |words: &str| Reply::refusal(503, words);
            if let Err(reply) = server.check_origin(&request) {
                return Err((reply, stream));
            }
            let Some(known) = AuthorisedConnection::accept(&server) else {
                return Err((busy("too many connections"), stream));
            };
            // The stream moves into the thread; if the thread cannot be created, the copy is used for the reply.
            let other = stream.try_clone();
            let made = thread::Builder::new().spawn(move || known.0.respond(stream, &request));
            match (made, other) {
                (Err(_), Ok(stream)) => Err((busy("the system cannot start a thread for the connection"), stream)),
                _ => Ok(()),
            }
        });
    }

    fn respond(&self, mut stream: TcpStream, request: &Request) {
        let timed = stream
            .set_nonblocking(false)
            .and(stream.set_read_timeout(Some(IO_TIMEOUT)))
            .and(stream.set_write_timeout(Some(IO_TIMEOUT)));
        if timed.and(stream.set_nodelay(true)).is_err() {
            return;
        }
        let reply = match self.route(request) {
            Ok(Route::Socket(key)) => return socket::run(stream, &key, &self.lab),
            Ok(Route::Reply(reply)) | Err(reply) => reply,
        };
        // If the page has been closed, the error is ignored.
        let _ = reply.write(&mut stream);
    }

    /// Checks that a request comes from the page of this server.
    fn check_origin(&self, request: &Request) -> Result<(), Reply> {
        let own = |authority: &str| {
            let port = self.address.port();
            authority == format!("127.0.0.1:{port}") || authority == format!("localhost:{port}")
        };
        if !request.host.as_deref().is_some_and(own) {
            return Err(Reply::refusal(403, "another host"));
        }
        let foreign = |origin: &str| !origin.strip_prefix("http://").is_some_and(own);
        if request.origin.as_deref().is_some_and(foreign) {
            return Err(Reply::refusal(403, "another origin"));
        }
        let (token, rest) = request.token_and_path();
        if request.method == "GET" && rest.is_empty() && self.take_single_use_token(token) {
            return Err(Reply::redirect(&self.address()));
        }
        if !equal_in_constant_time(token, &self.token) {
            return Err(Reply::refusal(403, "no token: open the address that hoid lab printed"));
        }
        if request.method != "GET" {
            return Err(Reply::refusal(405, "only GET"));
        }
        Ok(())
    }

    /// Returns the resource for an admitted request.
    fn route(&self, request: &Request) -> Result<Route, Reply> {
        let parts: Vec<&str> = request.token_and_path().1.split('/').collect();
        let file = |found: Result<Option<(Vec<u8>, &'static str)>, LabError>| match found {
            Ok(Some((body, kind))) => Ok(Route::Reply(Reply::file(body, kind))),
            Ok(None) => Err(Reply::refusal(404, "not found")),
            Err(error) => Err(Reply::refusal(500, &error.to_string())),
        };
        match parts.as_slice() {
            [""] | ["experimenter"] => Ok(Route::Reply(Reply::page(PAGE, &self.policy))),
            ["socket"] => match &request.socket_key {
                Some(key) if request.origin.is_some() => Ok(Route::Socket(key.clone())),
                _ => Err(Reply::refusal(403, "not a WebSocket request from this page")),
            },
            ["export.zip"] => file(self.lab.export()),
            ["data", name] => file(self.lab.data(name)),
            ["reports", names @ ..] => file(self.lab.report(names)),
            _ => Err(Reply::refusal(404, "not found")),
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
        .map_err(|error| LabError::Server(format!("the system provides no random numbers for the token: {error}")))?;
    Ok(HEXLOWER.encode(&random))
}

/// Compares two strings in constant time.
fn equal_in_constant_time(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0
}

/// Returns the content security policy of the page: only its own script and style, identified by their hashes, and its
/// own socket and data are permitted.
fn content_security_policy(page: &str) -> String {
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
