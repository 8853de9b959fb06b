//! The little of HTTP that the page needs: one GET request a connection, a bounded head, no body.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// The longest head of a request that is read, bytes.
const LONGEST_HEAD: usize = 8192;
/// Within which the whole head must arrive.
const HEAD_TIMEOUT: Duration = Duration::from_secs(5);

/// A request's head.
pub struct Request {
    /// Without the query.
    pub path: String,
    /// The value of `token` in the query.
    pub token: Option<String>,
    headers: Vec<(String, String)>,
}

impl Request {
    /// Reads a head; `None` where it is none, too long or too late.
    pub fn read(stream: &mut TcpStream) -> Option<Self> {
        Self::read_within(stream, HEAD_TIMEOUT)
    }

    fn read_within(stream: &mut TcpStream, timeout: Duration) -> Option<Self> {
        let late = Instant::now() + timeout;
        let mut head = Vec::new();
        let mut byte = [0];
        // Byte by byte, so that what follows the head (a WebSocket's first frame) stays in the stream.
        while !head.ends_with(b"\r\n\r\n") {
            let left = late.saturating_duration_since(Instant::now());
            // No time at all is no timeout that a socket takes: an error too.
            stream.set_read_timeout(Some(left)).ok()?;
            if head.len() == LONGEST_HEAD || stream.read(&mut byte).ok()? == 0 {
                return None;
            }
            head.push(byte[0]);
        }
        Self::parse(std::str::from_utf8(&head).ok()?)
    }

    fn parse(head: &str) -> Option<Self> {
        let mut lines = head.split("\r\n");
        let mut words = lines.next()?.split(' ');
        if words.next()? != "GET" {
            return None;
        }
        let target = words.next()?;
        let (path, query) = target.split_once('?').unwrap_or((target, ""));
        let token = query
            .split('&')
            .find_map(|pair| pair.strip_prefix("token="))
            .map(str::to_owned);
        let headers = lines
            .filter_map(|line| line.split_once(':'))
            .map(|(name, value)| (name.to_ascii_lowercase(), value.trim().to_owned()))
            .collect();
        Some(Self {
            path: path.to_owned(),
            token,
            headers,
        })
    }

    /// A header's value; the name in lower case.
    pub fn header(&self, name: &str) -> Option<&str> {
        let found = self.headers.iter().find(|(key, _)| key == name);
        found.map(|(_, value)| value.as_str())
    }
}

/// Answers and ends the connection; who has gone away is no error.
pub fn answer(stream: &mut TcpStream, status: &str, kind: &str, body: &[u8]) {
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\
         Cache-Control: no-store\r\nReferrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\n\
         Content-Security-Policy: default-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; \
         frame-ancestors 'none'\r\n\r\n",
        body.len()
    );
    let _ = stream
        .write_all(head.as_bytes())
        .and_then(|()| stream.write_all(body));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_head_gives_path_token_and_headers() {
        let request =
            Request::parse("GET /socket?x=1&token=abc HTTP/1.1\r\nHost: 127.0.0.1:1\r\n\r\n")
                .unwrap();
        assert_eq!(request.path, "/socket");
        assert_eq!(request.token.as_deref(), Some("abc"));
        assert_eq!(request.header("host"), Some("127.0.0.1:1"));
        assert_eq!(request.header("origin"), None);
    }

    #[test]
    fn a_head_that_trickles_in_is_given_up_as_a_whole() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let sender = std::thread::spawn(move || {
            let mut stream = TcpStream::connect(address).unwrap();
            // A byte now and then keeps every single read in time; it ends once nobody reads any more.
            while stream.write_all(b"G").is_ok() {
                std::thread::sleep(Duration::from_millis(5));
            }
        });
        let (mut stream, _) = listener.accept().unwrap();
        let timeout = Duration::from_millis(50);
        assert!(Request::read_within(&mut stream, timeout).is_none());
        drop(stream);
        sender.join().unwrap();
    }

    #[test]
    fn other_methods_and_no_requests_are_refused() {
        for head in ["POST / HTTP/1.1\r\n\r\n", "GET", "", "\r\n\r\n"] {
            assert!(Request::parse(head).is_none(), "{head:?}");
        }
    }
}
