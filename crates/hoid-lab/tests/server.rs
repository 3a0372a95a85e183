//! The server with unauthorised clients, and a session with a page that follows the protocol.
#![allow(clippy::unwrap_used)]

use std::{
    io::{Read as _, Write as _},
    net::TcpStream,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use hoid_lab::{
    Config, Lab, Mode, Server,
    config::{Condition, Signal},
    plant::InputMap,
    session::Session,
};
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket, client, handshake::client::generate_key, http::Request};

struct ServedLab {
    host: String,
    token: String,
}

fn config() -> Config {
    Config {
        condition: vec![Condition {
            target: Some(Signal::default()),
            measurement_s: 1.0,
            run_in_s: 0.5,
            runs: 2,
            ..Condition::default()
        }],
        ..Config::default()
    }
}

fn serve_lab(out: &Path, mode: Mode) -> ServedLab {
    let server = Server::new(Lab::open(out, config(), mode, None).unwrap(), None).unwrap();
    serve_on_thread(server)
}

fn serve_on_thread(server: Server) -> ServedLab {
    let address = server.address();
    thread::spawn(move || server.serve());
    let mut parts = address
        .strip_prefix("http://")
        .unwrap()
        .trim_end_matches('/')
        .split('/');
    ServedLab {
        host: parts.next().unwrap().to_owned(),
        token: parts.next().unwrap().to_owned(),
    }
}

impl ServedLab {
    /// Sends a request unchanged and returns the reply.
    fn send_raw(&self, request: &[u8]) -> String {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        // The server may reject the request before it has been written completely.
        let _ = stream.write_all(request);
        let mut reply = Vec::new();
        let _ = stream.read_to_end(&mut reply);
        String::from_utf8_lossy(&reply).into_owned()
    }

    fn get(&self, path: &str, headers: &str) -> String {
        self.send_raw(format!("GET {path} HTTP/1.1\r\nHost: {}\r\n{headers}\r\n", self.host).as_bytes())
    }

    fn open_page(&self) -> Page {
        let request = Request::builder()
            .uri(format!("ws://{}/{}/socket", self.host, self.token))
            .header("Host", &self.host)
            .header("Origin", format!("http://{}", self.host))
            .header("Connection", "Upgrade")
            .header("Upgrade", "websocket")
            .header("Sec-WebSocket-Version", "13")
            .header("Sec-WebSocket-Key", generate_key())
            .body(())
            .unwrap();
        let stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        Page(client(request, stream).unwrap().0)
    }
}

fn status(reply: &str) -> &str {
    reply.split(' ').nth(1).unwrap_or("closed")
}

#[test]
fn requests_without_the_token_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = serve_lab(dir.path(), Mode::Sessions);
    let own = format!("/{}/", at.token);
    let page = at.get(&own, "");
    assert_eq!(status(&page), "200");
    for header in [
        "Cross-Origin-Opener-Policy: same-origin",
        "Cross-Origin-Embedder-Policy: require-corp",
        "Content-Security-Policy: default-src 'none'; script-src 'sha256-",
    ] {
        assert!(page.contains(header), "{header}");
    }
    let wrong = "0".repeat(at.token.len());
    let socket =
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: eA==\r\n";
    for (path, headers, expected) in [
        ("/", "", "403"),
        (&format!("/{wrong}/"), "", "403"),
        (&own, "Origin: http://example.org\r\n", "403"),
        (&own, "Origin: null\r\n", "403"),
        (&format!("{own}socket"), socket, "403"),
        (
            &format!("{own}socket"),
            &format!("{socket}Origin: https://example.org\r\n"),
            "403",
        ),
        (&format!("{own}none"), "", "404"),
        (&format!("{own}export.zip"), "", "404"),
        (&format!("{own}data/1.json"), "", "404"),
        (&format!("{own}reports/../lab.toml"), "", "404"),
        (&format!("{own}reports/%2e%2e/lab.toml"), "", "404"),
        (&format!("{own}reports/..%2f..%2fetc/passwd"), "", "404"),
    ] {
        assert_eq!(status(&at.get(path, headers)), expected, "{path} {headers}");
    }
    let other = format!("GET {own} HTTP/1.1\r\nHost: example.org\r\n\r\n");
    assert_eq!(status(&at.send_raw(other.as_bytes())), "403");
    let post = format!("POST {own} HTTP/1.1\r\nHost: {}\r\nContent-Length: 0\r\n\r\n", at.host);
    assert_eq!(status(&at.send_raw(post.as_bytes())), "405");
    let long = format!("GET {own} HTTP/1.1\r\nX: {}\r\n\r\n", "x".repeat(20_000));
    assert!(["431", "closed"].contains(&status(&at.send_raw(long.as_bytes()))));
    assert_eq!(status(&at.send_raw(b"\x16\x03\x01 not http\r\n\r\n")), "400");
}

/// A page of the program, without a browser.
struct Page(WebSocket<TcpStream>);

impl Page {
    fn send(&mut self, message: &Value) {
        self.0.send(Message::text(message.to_string())).unwrap();
    }

    /// Returns the next message of this type; other messages are skipped.
    fn receive(&mut self, kind: &str) -> Value {
        loop {
            if let Message::Text(text) = self.0.read().unwrap() {
                let message: Value = serde_json::from_str(text.as_str()).unwrap();
                if message["type"] == kind {
                    return message;
                }
            }
        }
    }

    fn send_hello(&mut self, role: &str) -> Value {
        self.send(&json!({"type": "hello", "role": role, "browser": {"user_agent": "test"}}));
        self.receive("state")
    }

    fn give_consent(&mut self) {
        self.send(&json!({"type": "consent", "subject": "P01", "agreed": true, "cc0": false}));
        while self.receive("state")["phase"] != "runs" {}
    }

    /// Starts the next run and returns its number.
    fn start_run(&mut self) -> u64 {
        self.send(&json!({"type": "next"}));
        let number = self.receive("run")["number"].as_u64().unwrap();
        assert!(matches!(self.0.read().unwrap(), Message::Binary(_)));
        let map = InputMap {
            centre: 0.0,
            span: 1.0,
            dead: 0.0,
            gain: 3.0,
        };
        self.send(
            &json!({"type": "begin", "number": number, "input": map, "device": "mouse", "clock": "injected",
            "refresh_ms": 10.0, "zero_ms": 1.0}),
        );
        while self.receive("state")["running"] != number {}
        number
    }
}

/// Returns a batch of ticks of a person who does not move the device, so e equals the target.
fn batch_message(number: u64, first: usize, target: &[f64]) -> Value {
    let e: Vec<f64> = target[first..first + 50].to_vec();
    let frame = json!([first as f64 + 0.5, first as f64 + 0.5, first, e[0]]);
    json!({"type": "batch", "number": number, "batch": {"first": first, "u": vec![0.0; 50], "e": e, "events": [],
        "frames": [frame]}})
}

#[test]
fn complete_run_sends_a_live_estimate() {
    let dir = tempfile::tempdir().unwrap();
    let at = serve_lab(dir.path(), Mode::Sessions);
    let (mut person, mut other) = (at.open_page(), at.open_page());
    assert_eq!(person.send_hello("person")["phase"], "consent");
    other.send_hello("experimenter");
    person.give_consent();
    let number = person.start_run();
    let target = hoid_lab::task::Task::new(&config().condition[0], 0, number)
        .unwrap()
        .target;
    for first in (0..1500).step_by(50) {
        person.send(&batch_message(number, first, &target));
    }
    let live = other.receive("live");
    assert_eq!(live["number"], number);
    person.send(&json!({"type": "finish", "number": number, "counted": {}}));
    let verdict = person.receive("verdict");
    assert_eq!(verdict["done"]["verdict"], "verified", "{verdict}");
    // A second window cannot control the session.
    other.send(&json!({"type": "next"}));
    assert!(
        other.receive("refused")["words"]
            .as_str()
            .unwrap()
            .contains("view-only")
    );
    let zip = at.get(&format!("/{}/export.zip", at.token), "");
    assert!(status(&zip) == "200" && zip.contains("sub-P01/ses-01/lab.toml"));
    let data = at.get(&format!("/{}/data/{number}.json", at.token), "");
    assert!(data.contains("\"verdict\":\"verified\""));
    assert!(dir.path().join("group.toml").exists());
}

#[test]
fn closing_the_window_interrupts_the_run() {
    let dir = tempfile::tempdir().unwrap();
    let at = serve_lab(dir.path(), Mode::Sessions);
    let mut person = at.open_page();
    person.send_hello("person");
    person.give_consent();
    let number = person.start_run();
    let target = hoid_lab::task::Task::new(&config().condition[0], 0, number)
        .unwrap()
        .target;
    person.send(&batch_message(number, 0, &target));
    // A second window does not take over a current run.
    let mut second = at.open_page();
    second.send(&json!({"type": "hello", "role": "person"}));
    assert!(
        second.receive("refused")["words"]
            .as_str()
            .unwrap()
            .contains("another window")
    );
    // When the first window is closed, the session continues in the second.
    drop(person);
    second.receive("yours");
    loop {
        let state = second.receive("state");
        if state["running"].is_null() {
            assert_eq!(state["done"][0]["how"], "interrupted");
            assert_eq!(state["next"], 0);
            break;
        }
    }
    assert_eq!(second.start_run(), 2);
    let folder = dir.path().join("sub-P01/ses-01");
    assert!(
        Session::read(&folder).unwrap().finished_runs[0]
            .reasons
            .contains("50 of 1500 ticks")
    );
}

#[test]
fn invalid_messages_end_the_connection() {
    let dir = tempfile::tempdir().unwrap();
    let at = serve_lab(dir.path(), Mode::Sessions);
    let closed = |message: Message| {
        let mut page = at.open_page();
        page.send_hello("person");
        page.give_consent();
        let number = page.start_run();
        let text = message.to_string().replace("NUMBER", &number.to_string());
        let message = if message.is_text() {
            Message::text(text)
        } else {
            message
        };
        // A message that is too large may be rejected while it is sent.
        let _ = page.0.send(message);
        loop {
            match page.0.read() {
                Err(tungstenite::Error::Io(error)) if error.kind() == std::io::ErrorKind::WouldBlock => {
                    panic!("the connection is still there")
                }
                Ok(Message::Close(_)) | Err(_) => return,
                Ok(Message::Text(text)) => assert!(!text.contains("\"type\":\"verdict\""), "{text}"),
                Ok(_) => {}
            }
        }
    };
    closed(Message::text("no json"));
    closed(Message::text("{\"type\": \"unknown\"}"));
    closed(Message::text("{\"type\": \"next\", \"more\": 1}"));
    closed(Message::binary(vec![1, 2, 3]));
    closed(Message::text("x".repeat(2 << 20)));
    closed(Message::text(
        "{\"type\":\"batch\",\"number\":NUMBER,\"batch\":{\"first\":7,\"u\":[1],\"e\":[1],\"events\":[],\"frames\":[]}}",
    ));
    closed(Message::text(
        "{\"type\":\"batch\",\"number\":NUMBER,\"batch\":{\"first\":18446744073709551615,\"u\":[1],\"e\":[1],\"events\":[],\"frames\":[]}}",
    ));
    closed(Message::text(
        "{\"type\":\"batch\",\"number\":NUMBER,\"batch\":{\"first\":0,\"u\":[null],\"e\":[1],\"events\":[],\"frames\":[]}}",
    ));
}

#[test]
fn second_server_of_an_experiment_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let _at = serve_lab(dir.path(), Mode::Sessions);
    let second = Lab::open(dir.path(), config(), Mode::Sessions, None);
    assert!(second.is_err_and(|error| error.to_string().contains("another process is using")));
}

/// Connections that the server has not accepted yet are queued. The system drops connections if its queue is full, and
/// the client retries after a second.
#[cfg(target_os = "linux")]
#[test]
fn burst_of_connections_is_queued() {
    const BURST: usize = 500;
    let most = std::fs::read_to_string("/proc/sys/net/core/somaxconn").unwrap();
    if most.trim().parse::<usize>().unwrap() < BURST {
        eprintln!("skipped: the system keeps {} connections at most", most.trim());
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let server = Server::new(Lab::open(dir.path(), config(), Mode::Sessions, None).unwrap(), None).unwrap();
    let address = server.address();
    let host = address.trim_start_matches("http://").split('/').next().unwrap();
    let (host, before_the_second) = (host.parse().unwrap(), Duration::from_millis(900));
    let waiting = (0..BURST).map(|_| TcpStream::connect_timeout(&host, before_the_second));
    let waiting: Vec<TcpStream> = waiting.map_while(Result::ok).collect();
    assert_eq!(waiting.len(), BURST);
}

/// As many connections as the system allows, each of which sends one byte at intervals, are closed to admit the page.
#[test]
fn slow_connections_do_not_block_the_page() {
    let dir = tempfile::tempdir().unwrap();
    let at = serve_lab(dir.path(), Mode::Sessions);
    let mut slow = Vec::new();
    for k in 0..400 {
        let Ok(mut stream) = TcpStream::connect(&at.host) else {
            continue;
        };
        let _ = stream.write_all(b"GET / HTTP/1.1\r\nX: ");
        slow.push(stream);
        if k % 50 == 49 {
            let reply = at.get(&format!("/{}/", at.token), "");
            assert_eq!(status(&reply), "200", "behind {k} slow ones");
        }
    }
    for stream in &mut slow {
        let _ = stream.write_all(b"y");
    }
    let reply = at.get(&format!("/{}/", at.token), "");
    assert_eq!(status(&reply), "200");
}

/// A thousand connections of strangers, each of which reconnects as soon as it is closed, send nothing, half a head,
/// heads without the token or without an end, requests for sockets, or arbitrary bytes. The page receives a reply each
/// time, and the longest time is printed (less than a second if the machine is otherwise idle).
#[test]
fn hostile_connections_do_not_block_the_page() {
    let dir = tempfile::tempdir().unwrap();
    let at = serve_lab(dir.path(), Mode::Sessions);
    let over = Arc::new(AtomicBool::new(false));
    let connection_count = Arc::new(AtomicUsize::new(0));
    let (strangers, each) = (8, 125);
    let threads: Vec<_> = (0..strangers)
        .map(|stranger| {
            let (host, over, connection_count) = (at.host.clone(), Arc::clone(&over), Arc::clone(&connection_count));
            thread::spawn(move || {
                let connect = |k: usize| -> Option<TcpStream> {
                    connection_count.fetch_add(1, Ordering::Relaxed);
                    let mut stream = TcpStream::connect(&host).ok()?;
                    stream.set_nonblocking(true).ok()?;
                    let said: &[u8] = match k % 6 {
                        0 => b"",
                        1 => b"GET / HTTP/1.1\r\nX: ",
                        2 => b"GET /token/ HTTP/1.1\r\nHost: elsewhere\r\n\r\n",
                        3 => &[b'x'; 20_000],
                        4 => b"GET /socket HTTP/1.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\r\n",
                        _ => &[0, 255, 13, 10, 13, 10, 7],
                    };
                    let _ = stream.write_all(said);
                    Some(stream)
                };
                let mut all: Vec<Option<TcpStream>> = (0..each).map(|k| connect(k + stranger)).collect();
                while !over.load(Ordering::Relaxed) {
                    for (k, place) in all.iter_mut().enumerate() {
                        let closed = place.as_mut().is_none_or(|stream| {
                            let mut reply = [0; 64];
                            match stream.read(&mut reply) {
                                Ok(read) => read == 0,
                                Err(error) => error.kind() != std::io::ErrorKind::WouldBlock,
                            }
                        });
                        if closed {
                            *place = connect(k + stranger);
                        }
                    }
                    thread::sleep(Duration::from_millis(10));
                }
            })
        })
        .collect();
    thread::sleep(Duration::from_millis(300));
    // The page receives replies throughout, until strangers have been rejected and have reconnected.
    let start = Instant::now();
    let (mut asked, mut slowest) = (0, Duration::ZERO);
    while asked < 20
        || (connection_count.load(Ordering::Relaxed) <= strangers * each && start.elapsed() < Duration::from_secs(60))
    {
        let start_time = Instant::now();
        let reply = at.get(&format!("/{}/", at.token), "");
        assert_eq!(status(&reply), "200");
        slowest = slowest.max(start_time.elapsed());
        asked += 1;
        thread::sleep(Duration::from_millis(50));
    }
    eprintln!(
        "the page is answered {asked} times, in {} ms at most",
        slowest.as_millis()
    );
    over.store(true, Ordering::Relaxed);
    threads.into_iter().for_each(|thread| thread.join().unwrap());
    let connection_count = connection_count.load(Ordering::Relaxed);
    assert!(connection_count > strangers * each, "{connection_count} strangers");
}

/// The address for starting a browser is visible in the list of processes, so it works only once.
#[test]
fn browser_address_works_only_once() {
    let dir = tempfile::tempdir().unwrap();
    let server = Server::new(Lab::open(dir.path(), config(), Mode::Sessions, None).unwrap(), None).unwrap();
    let once = server.single_use_address().unwrap();
    let at = serve_on_thread(server);
    assert!(!once.contains(&at.token), "{once}");
    let path = once.strip_prefix(&format!("http://{}", at.host)).unwrap();
    let reply = at.get(path, "");
    assert_eq!(status(&reply), "303");
    assert!(
        reply.contains(&format!("Location: http://{}/{}/\r\n", at.host, at.token)),
        "{reply}"
    );
    assert_eq!(status(&at.get(path, "")), "403");
}
