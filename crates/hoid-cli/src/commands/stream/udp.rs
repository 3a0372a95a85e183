//! The socket of `hoid stream --udp`.

use std::{
    fmt, io,
    net::{IpAddr, SocketAddr, UdpSocket},
};

use crate::{args::UdpPlaces, error::CliError};

/// Maximum size of a datagram, bytes.
const LARGEST: usize = 1 << 16;

/// Buffer for a datagram.
pub fn room() -> Vec<u8> {
    vec![0; LARGEST]
}

/// A socket that receives samples, and the address of its answers.
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
    /// [`CliError::Stream`] for an address that the system does not provide.
    pub fn bind(places: &UdpPlaces) -> Result<Self, CliError> {
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

    /// The next datagram.
    ///
    /// # Errors
    /// [`CliError::Stream`] if the socket fails.
    pub fn receive<'b>(&self, bytes: &'b mut [u8]) -> Result<&'b [u8], CliError> {
        loop {
            match self.socket.recv(bytes) {
                Ok(length) => return Ok(&bytes[..length]),
                // An answer that could not be delivered is reported here.
                Err(error) if is_passing(&error) => {}
                Err(error) => return Err(CliError::Stream(format!("the socket cannot be read: {error}"))),
            }
        }
    }

    /// Sends an answer; one that cannot be sent is lost, as datagrams may be.
    pub fn send(&self, bytes: &[u8]) {
        let _ = self.socket.send_to(bytes, self.output);
    }
}

fn is_passing(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionRefused, ConnectionReset, Interrupted, WouldBlock};
    // On Windows a datagram larger than the buffer is also an error.
    matches!(
        error.kind(),
        ConnectionRefused | ConnectionReset | Interrupted | WouldBlock
    )
}
