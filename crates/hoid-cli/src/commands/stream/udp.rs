//! The socket of `hoid stream --udp`.

use std::{
    fmt, io,
    net::{IpAddr, SocketAddr, UdpSocket},
};

use crate::{args::UdpAddresses, error::CliError};

/// Maximum size of a datagram, bytes.
const MAX_DATAGRAM_BYTES: usize = 1 << 16;

/// Returns a buffer for a datagram.
pub fn datagram_buffer() -> Vec<u8> {
    vec![0; MAX_DATAGRAM_BYTES]
}

/// A socket that receives samples, and the address to which answers are sent.
pub struct Udp {
    socket: UdpSocket,
    output: SocketAddr,
}

impl fmt::Display for Udp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.socket.local_addr() {
            Ok(input) => write!(f, "listening on {input}, answering to {}", self.output),
            Err(_) => write!(f, "answering to {}", self.output),
        }
    }
}

impl Udp {
    /// # Errors
    /// [`CliError::Stream`] if the system does not provide the address.
    pub fn bind(places: &UdpAddresses) -> Result<Self, CliError> {
        let socket = UdpSocket::bind(places.input).map_err(|error| {
            CliError::Stream(format!(
                "cannot listen on {}: {error}; is another stream using it?",
                places.input
            ))
        })?;
        let own = |ip: IpAddr| UdpSocket::bind((ip, 0)).is_ok();
        if places.input.ip().is_unspecified() && places.input.port() == places.output.port() && own(places.output.ip())
        {
            return Err(CliError::Stream(format!(
                "{} is an address of this computer, and answers there would come back as samples; choose another port \
                 for them",
                places.output
            )));
        }
        Ok(Self {
            socket,
            output: places.output,
        })
    }

    /// Receives the next datagram.
    ///
    /// # Errors
    /// [`CliError::Stream`] if the socket fails.
    pub fn receive<'b>(&self, bytes: &'b mut [u8]) -> Result<&'b [u8], CliError> {
        loop {
            match self.socket.recv(bytes) {
                Ok(length) => return Ok(&bytes[..length]),
                // The system reports here that an earlier answer could not be delivered.
                Err(error) if is_transient(&error) => {}
                Err(error) => return Err(CliError::Stream(format!("the socket cannot be read: {error}"))),
            }
        }
    }

    /// Sends an answer; like any datagram, it may be lost.
    pub fn send(&self, bytes: &[u8]) {
        let _ = self.socket.send_to(bytes, self.output);
    }
}

fn is_transient(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionRefused, ConnectionReset, Interrupted, WouldBlock};
    // On Windows, a datagram larger than the buffer is reported as an error, too.
    matches!(
        error.kind(),
        ConnectionRefused | ConnectionReset | Interrupted | WouldBlock
    )
}
