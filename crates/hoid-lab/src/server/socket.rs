//! The socket of a page: it passes messages from the page to the lab, and messages from the lab to the page. One thread
//! does both; it waits for messages from the page for 10 ms at a time.

use std::{
    io::{ErrorKind, Write as _},
    net::TcpStream,
    sync::mpsc::channel,
    time::Duration,
};

use tungstenite::{
    Error, Message, WebSocket,
    handshake::derive_accept_key,
    protocol::{Role, WebSocketConfig},
};

use crate::{
    LabError,
    lab::{Lab, OutgoingMessage},
    wire::{FromPage, MAX_MESSAGE_BYTES, ToPage},
};

const POLL_INTERVAL: Duration = Duration::from_millis(10);

pub fn run(mut stream: TcpStream, key: &str, lab: &Lab) {
    let accept = derive_accept_key(key.as_bytes());
    let head = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accept}\r\n\r\n"
    );
    if stream
        .write_all(head.as_bytes())
        .and(stream.set_read_timeout(Some(POLL_INTERVAL)))
        .is_err()
    {
        return;
    }
    let limits = WebSocketConfig::default()
        .max_message_size(Some(MAX_MESSAGE_BYTES))
        .max_frame_size(Some(MAX_MESSAGE_BYTES));
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, Some(limits));
    let (sender, receiver) = channel();
    let id = lab.join(sender);
    loop {
        let mut sent = Ok(());
        while let (Ok(outgoing), true) = (receiver.try_recv(), sent.is_ok()) {
            sent = socket.send(match outgoing {
                OutgoingMessage::Text(text) => Message::text(text),
                OutgoingMessage::Binary(bytes) => Message::binary(bytes),
            });
        }
        if sent.is_err() {
            break;
        }
        let answer = match socket.read() {
            Ok(Message::Text(text)) => process_message(lab, id, text.as_str()),
            Ok(Message::Binary(_)) => Err(LabError::Message("a binary frame".to_owned())),
            Ok(Message::Close(_)) => break,
            Ok(_) => Ok(()),
            Err(Error::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Ok(()),
            Err(_) => break,
        };
        if let Err(error) = answer {
            let words = ToPage::Refused {
                words: error.to_string(),
                elsewhere: false,
            };
            let sent = serde_json::to_string(&words).map(|text| socket.send(Message::text(text)));
            // A page that violates the protocol is not the page of this program and is disconnected.
            if matches!(error, LabError::Message(_)) || !matches!(sent, Ok(Ok(()))) {
                break;
            }
        }
    }
    // The page leaves before the socket is closed: if it reconnects afterwards, its run has already ended.
    lab.leave(id);
    let _ = socket.close(None);
    let _ = socket.flush();
}

fn process_message(lab: &Lab, id: u64, text: &str) -> Result<(), LabError> {
    let message: FromPage = serde_json::from_str(text)
        .map_err(|error| LabError::Message(hoid_io::escape_control_characters(&error.to_string())))?;
    lab.receive(id, message)
}
