//! The addresses of `hoid stream --udp`.

use std::{
    net::{IpAddr, Ipv4Addr, SocketAddr},
    str::FromStr,
};

/// Addresses of the incoming samples and of the answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UdpAddresses {
    pub input: SocketAddr,
    pub output: SocketAddr,
}

/// `IN:OUT`, each a port, or an address and a port.
impl FromStr for UdpAddresses {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || {
            format!(
                "{text:?} is not a pair of ports; write 5005:5006 for ports on this computer, or \
                 0.0.0.0:5005:192.168.1.7:5006 with addresses (IPv4)"
            )
        };
        let parts: Vec<&str> = text.trim().split(':').collect();
        let here = "127.0.0.1";
        let [from, input, to, output] = match *parts.as_slice() {
            [input, output] => [here, input, here, output],
            [input, to, output] if input.parse::<u16>().is_ok() => [here, input, to, output],
            [from, input, output] => [from, input, here, output],
            [from, input, to, output] => [from, input, to, output],
            _ => return Err(wrong()),
        };
        let place = |address: &str, port: &str| {
            let address = address.parse::<Ipv4Addr>().ok()?;
            let port = port.parse::<u16>().ok()?;
            Some(SocketAddr::new(IpAddr::V4(address), port))
        };
        let (input, output) = (place(from, input), place(to, output));
        let (Some(input), Some(output)) = (input, output) else {
            return Err(wrong());
        };
        if output.port() == 0 {
            return Err(format!(
                "{text:?}: nothing can listen on port 0; give another output port"
            ));
        }
        // A socket on 0.0.0.0 listens on every address of this computer, and a datagram sent to 0.0.0.0 also arrives at
        // this computer.
        let is_here = |ip: IpAddr| ip.is_loopback() || ip.is_unspecified();
        let heard = input.ip() == output.ip()
            || (input.ip().is_unspecified() || output.ip().is_unspecified())
                && is_here(input.ip())
                && is_here(output.ip());
        if input.port() == output.port() && heard {
            return Err(format!(
                "{text:?}: answers would come back as samples; give another output port"
            ));
        }
        Ok(Self { input, output })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn udp_addresses_are_parsed() {
        let of = |text: &str| {
            text.parse::<UdpAddresses>()
                .map(|p| (p.input.to_string(), p.output.to_string()))
        };
        for (text, input, output) in [
            ("5005:5006", "127.0.0.1:5005", "127.0.0.1:5006"),
            ("5005:10.0.0.7:5005", "127.0.0.1:5005", "10.0.0.7:5005"),
            ("0.0.0.0:5005:5006", "0.0.0.0:5005", "127.0.0.1:5006"),
            ("0.0.0.0:5005:10.0.0.7:5006", "0.0.0.0:5005", "10.0.0.7:5006"),
            (" 0:9 ", "127.0.0.1:0", "127.0.0.1:9"),
        ] {
            assert_eq!(of(text), Ok((input.to_owned(), output.to_owned())));
        }
        for wrong in [
            "",
            "5005",
            "5005:5005",
            "5005:0",
            "0.0.0.0:5005:5005",
            "0.0.0.0:5005:127.0.0.1:5005",
            "5005:0.0.0.0:5005",
            "a:b",
            "1:70000",
            "1:2:3:4:5",
            "1.2.3:4:5",
            "-1:5",
        ] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }
}
