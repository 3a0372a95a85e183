//! Request heads and replies.

use std::{
    io::{self, Write as _},
    net::TcpStream,
};

/// Maximum length of a head in bytes.
const MAX_HEAD_BYTES: usize = 16 * 1024;
/// Maximum number of lines of a head.
const MAX_LINES: usize = 64;

/// The parts of a request that are used.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Request {
    pub method: String,
    /// Path of the request without the query.
    pub path: String,
    pub host: Option<String>,
    pub origin: Option<String>,
    /// Key of a request for a WebSocket of version 13.
    pub socket_key: Option<String>,
}

impl Request {
    /// Parses the part of a head received so far and returns the request or the refusal; `None` while the head is
    /// incomplete.
    pub fn of(head: &[u8]) -> Option<Result<Self, Reply>> {
        if !head.windows(4).any(|four| four == b"\r\n\r\n") {
            let long = head.len() > MAX_HEAD_BYTES;
            return long.then(|| Err(Reply::refusal(431, "the header of the request is too long")));
        }
        Some(Self::parse(head).ok_or_else(|| Reply::refusal(400, "not an HTTP request")))
    }

    /// Returns the token, and the path after it.
    pub fn token_and_path(&self) -> (&str, &str) {
        let path = self.path.trim_start_matches('/');
        path.split_once('/').unwrap_or((&self.path, ""))
    }

    fn parse(head: &[u8]) -> Option<Self> {
        let mut headers = [httparse::EMPTY_HEADER; MAX_LINES];
        let mut parsed = httparse::Request::new(&mut headers);
        if !parsed.parse(head).ok()?.is_complete() {
            return None;
        }
        let path = parsed.path?.split('?').next()?.to_owned();
        let method = parsed.method?.to_owned();
        // A legitimate client does not send a header twice.
        let header = |name: &str| {
            let mut all = parsed.headers.iter().filter(|h| h.name.eq_ignore_ascii_case(name));
            let value = std::str::from_utf8(all.next()?.value).ok()?.trim().to_owned();
            all.next().is_none().then_some(value)
        };
        let is = |name: &str, word: &str| header(name).is_some_and(|value| value.eq_ignore_ascii_case(word));
        let socket = is("upgrade", "websocket") && is("sec-websocket-version", "13");
        Some(Self {
            method,
            path,
            host: header("host"),
            origin: header("origin"),
            socket_key: header("sec-websocket-key").filter(|_| socket),
        })
    }
}

/// Reply to a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    status: u16,
    kind: &'static str,
    policy: String,
    /// New location, for a redirection.
    location: Option<String>,
    body: Vec<u8>,
}

impl Reply {
    /// Creates a reply with the page.
    pub fn page(html: &str, policy: &str) -> Self {
        Self {
            status: 200,
            kind: "text/html; charset=utf-8",
            policy: policy.to_owned(),
            location: None,
            body: html.as_bytes().to_vec(),
        }
    }

    /// Creates a reply with a file of the session. Pages of results contain their styles and figures and no scripts.
    pub fn file(body: Vec<u8>, kind: &'static str) -> Self {
        Self {
            status: 200,
            kind,
            policy: "default-src 'none'; style-src 'unsafe-inline'; img-src 'self' data:; frame-ancestors 'none'"
                .to_owned(),
            location: None,
            body,
        }
    }

    /// Creates a refusal as text.
    pub fn refusal(status: u16, words: &str) -> Self {
        Self {
            status,
            kind: "text/plain; charset=utf-8",
            policy: "default-src 'none'".to_owned(),
            location: None,
            body: format!("{words}\n").into_bytes(),
        }
    }

    /// Creates a redirection to another address.
    pub fn redirect(address: &str) -> Self {
        Self {
            location: Some(address.to_owned()),
            ..Self::refusal(303, "see there")
        }
    }

    /// Writes the reply, after which the connection is closed.
    pub fn write(&self, stream: &mut TcpStream) -> io::Result<()> {
        let reason = match self.status {
            200 => "OK",
            303 => "See Other",
            400 => "Bad Request",
            403 => "Forbidden",
            404 => "Not Found",
            405 => "Method Not Allowed",
            408 => "Request Timeout",
            431 => "Request Header Fields Too Large",
            503 => "Service Unavailable",
            _ => "Internal Server Error",
        };
        let location = (self.location.as_ref()).map_or_else(String::new, |to| format!("Location: {to}\r\n"));
        // Isolation from other origins gives the page access to a precise clock.
        let head = format!(
            "HTTP/1.1 {} {reason}\r\n{location}Content-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n\
             Cache-Control: no-store\r\nContent-Security-Policy: {}\r\nCross-Origin-Opener-Policy: same-origin\r\n\
             Cross-Origin-Embedder-Policy: require-corp\r\nCross-Origin-Resource-Policy: same-origin\r\n\
             X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\r\n",
            self.status,
            self.kind,
            self.body.len(),
            self.policy
        );
        stream.write_all(head.as_bytes())?;
        stream.write_all(&self.body)?;
        stream.flush()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn request_heads_are_parsed_and_duplicates_ignored() {
        let head = b"GET /a/b?c HTTP/1.1\r\nHost: x:1\r\nOrigin: http://x:1\r\nUpgrade: WebSocket\r\n\
            Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: k\r\n\r\n";
        let request = Request::parse(head).unwrap();
        assert_eq!((request.path.as_str(), request.host.as_deref()), ("/a/b", Some("x:1")));
        assert_eq!(request.socket_key.as_deref(), Some("k"));
        let doubled = b"GET / HTTP/1.1\r\nHost: x\r\nHost: y\r\n\r\n";
        assert_eq!(Request::parse(doubled).unwrap().host, None);
        assert_eq!(Request::of(head).unwrap().unwrap(), request);
        for more in [&b""[..], b"GET / HTTP", &head[..head.len() - 1]] {
            assert!(Request::of(more).is_none());
        }
        assert!(Request::of(&[b'x'; MAX_HEAD_BYTES + 1]).unwrap().is_err());
        for bad in [&b"GET\r\n\r\n"[..], b"\x16\x03\x01\r\n\r\n", b"GET / HTTP/1.1\r\nHost"] {
            assert_eq!(Request::parse(bad), None);
        }
    }
}
