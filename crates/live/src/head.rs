//! Heads of HTTP requests, and responses.

use std::io::{self, Read, Write};
use std::net::{IpAddr, TcpStream};
use std::time::{Duration, Instant};

/// Size limit of a head [bytes].
const LONGEST: usize = 8 << 10;
/// Time limit for the whole head.
const TIME: Duration = Duration::from_secs(5);

/// Request line and header fields.
#[derive(Debug)]
pub(crate) struct RequestHead {
    /// Method, such as `GET`.
    pub(crate) method: String,
    /// Path with query, if any.
    pub(crate) path: String,
    fields: Vec<(String, String)>,
}

impl RequestHead {
    /// Reads up to the empty line, byte by byte: the following data belong to the socket.
    ///
    /// # Errors
    /// The head is too long, too slow, or malformed.
    pub(crate) fn read(stream: &mut TcpStream) -> io::Result<RequestHead> {
        let (until, mut bytes, mut byte) = (Instant::now() + TIME, vec![], [0u8]);
        while !bytes.ends_with(b"\r\n\r\n") {
            let left = until.saturating_duration_since(Instant::now());
            if bytes.len() == LONGEST || left.is_zero() {
                return Err(io::Error::new(io::ErrorKind::InvalidData, "the head is too long or too slow"));
            }
            stream.set_read_timeout(Some(left))?;
            stream.read_exact(&mut byte)?;
            bytes.push(byte[0]);
        }
        RequestHead::parsed(&bytes).ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "no head"))
    }

    fn parsed(bytes: &[u8]) -> Option<RequestHead> {
        let text = std::str::from_utf8(bytes).ok()?;
        let mut lines = text.trim_end().split("\r\n");
        let mut words = lines.next()?.split(' ');
        let (method, path) = (words.next()?.to_owned(), words.next()?.to_owned());
        let field = |line: &str| {
            let (name, value) = line.split_once(':')?;
            Some((name.to_ascii_lowercase(), value.trim().to_owned()))
        };
        Some(RequestHead { method, path, fields: lines.map(field).collect::<Option<_>>()? })
    }

    /// Value of a field, by lower-case name; `None` if missing or repeated.
    pub(crate) fn field(&self, name: &str) -> Option<&str> {
        let mut found = self.fields.iter().filter(|(field, _)| field == name);
        let (_, value) = found.next()?;
        found.next().is_none().then_some(value)
    }

    /// Requested host, if it names this server at `address` and `port`: `localhost`, a loopback address
    /// or, if the server is not on loopback, any address. Other names are rejected, because DNS can make
    /// them lead here.
    pub(crate) fn host(&self, address: IpAddr, port: u16) -> Option<&str> {
        let host = self.field("host")?;
        let name = host.strip_suffix(&format!(":{port}")).or_else(|| Some(host).filter(|_| port == 80))?;
        let asked = name.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>();
        let is_own = match asked {
            Ok(asked) => asked.is_loopback() || !address.is_loopback(),
            Err(_) => name == "localhost",
        };
        is_own.then_some(host)
    }
}

/// Responds with a status only.
pub(crate) fn refuse(stream: &mut TcpStream, status: &str) -> io::Result<()> {
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Length: 0\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n"
    )
}

/// Pages allowed to embed this one in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Framing {
    /// None: a page around a frame could hijack clicks.
    None,
    /// Pages of this machine: notebooks and editors.
    OfThisMachine,
}

impl Framing {
    /// Header fields of the policy: CSP Level 3, section 6.4.2.1, `frame-ancestors`.
    fn fields(self) -> &'static str {
        match self {
            Framing::None => "X-Frame-Options: DENY\r\nContent-Security-Policy: frame-ancestors 'none'\r\n",
            Framing::OfThisMachine => {
                "Content-Security-Policy: frame-ancestors http://localhost:* http://127.0.0.1:* \
                 https://localhost:* vscode-webview:\r\n"
            }
        }
    }
}

/// Responds with the page.
pub(crate) fn answer(stream: &mut TcpStream, page: &str, framing: Framing) -> io::Result<()> {
    write!(
        stream,
        "HTTP/1.1 200 OK\r\nContent-Type: text/html; charset=utf-8\r\nContent-Length: {}\r\n\
         Cache-Control: no-store\r\nReferrer-Policy: no-referrer\r\n{}\
         X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n",
        page.len(),
        framing.fields()
    )?;
    stream.write_all(page.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn host(text: &str, address: &str) -> bool {
        let head = RequestHead::parsed(format!("GET / HTTP/1.1\r\nHost: {text}\r\n\r\n").as_bytes()).unwrap();
        head.host(address.parse().unwrap(), 8080).is_some()
    }

    #[test]
    fn only_hosts_that_cannot_be_made_to_lead_here_are_taken() {
        for own in ["127.0.0.1:8080", "localhost:8080", "[::1]:8080"] {
            assert!(host(own, "127.0.0.1"), "{own}");
        }
        for foreign in ["evil.example:8080", "127.0.0.1:8081", "127.0.0.1", "192.168.0.7:8080", ""] {
            assert!(!host(foreign, "127.0.0.1"), "{foreign}");
        }
        assert!(host("192.168.0.7:8080", "0.0.0.0") && !host("evil.example:8080", "0.0.0.0"));
    }

    #[test]
    fn fields_given_twice_are_none() {
        let head = RequestHead::parsed(b"GET / HTTP/1.1\r\nHost: a\r\nhost: b\r\nOrigin: c\r\n\r\n").unwrap();
        assert_eq!((head.field("host"), head.field("origin")), (None, Some("c")));
        assert!(RequestHead::parsed(b"nothing\r\n\r\n").is_none());
    }
}
