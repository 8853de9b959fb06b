//! Accepts connections on 127.0.0.1: the page's files, and one WebSocket at a time.
//!
//! REQ-091: A page of another origin, a foreign host name and a wrong token are refused.

use std::collections::VecDeque;
use std::io::ErrorKind;
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{CloseFrame, Role, WebSocketConfig, frame::coding::CloseCode};
use tungstenite::{Error, Message, WebSocket};

use super::http::{Request, answer};
use super::protocol::{LONGEST_MESSAGE, Wish};
use super::session::Session;
use host::{Model, ModelSettings};
use page::three;

/// Least time between two frames: 240 a second.
const SOONEST: Duration = Duration::from_micros(4_166);
/// Messages that are read before a frame is made; a page has one or two waiting.
const MOST_MESSAGES: usize = 64;
/// Connections that are served at once. One more takes the place of the oldest that has not said yet what it wants; where all have, it is
/// closed.
const MOST_CONNECTIONS: usize = 16;

/// Longest time that an answer waits for its reader.
const UNREAD: Duration = Duration::from_secs(5);

/// Part of a step's length after which no correction of it starts; the rest is for the last one and for the picture.
const SPENT: f64 = 0.3;

/// What the page is made of.
const FILES: [(&str, &str, &[u8]); 10] = [
    (
        "/",
        "text/html; charset=utf-8",
        include_bytes!("page/index.html"),
    ),
    (
        "/icon.svg",
        "image/svg+xml",
        include_bytes!("page/icon.svg"),
    ),
    (
        "/view.js",
        "text/javascript",
        include_bytes!("page/view.js"),
    ),
    (
        "/connection.js",
        "text/javascript",
        include_bytes!("page/connection.js"),
    ),
    (
        "/hand.js",
        "text/javascript",
        include_bytes!("page/hand.js"),
    ),
    (
        "/organ.js",
        "text/javascript",
        include_bytes!("page/organ.js"),
    ),
    (
        "/instruments.js",
        "text/javascript",
        include_bytes!("page/instruments.js"),
    ),
    (
        "/plot.js",
        "text/javascript",
        include_bytes!("page/plot.js"),
    ),
    (
        "/drawing.js",
        "text/javascript",
        include_bytes!("page/drawing.js"),
    ),
    (
        "/gltf.js",
        "text/javascript",
        include_bytes!("page/gltf.js"),
    ),
];

pub struct Server {
    model: Model,
    bundle: String,
    port: u16,
    token: String,
    /// A client steps.
    taken: AtomicBool,
    connections: AtomicUsize,
    /// Those whose request has not come, oldest first.
    silent: Mutex<VecDeque<(usize, TcpStream)>>,
}

/// The bundle, with steps for frames that keep up with the clock; `exact`: that make all their corrections.
pub fn open(bundle: &Path, threads: u32, step_ms: Option<f64>, exact: bool) -> Result<Model> {
    let settings = ModelSettings {
        threads,
        step_s: step_ms.map_or(0.0, |ms| 1e-3 * ms),
        ..ModelSettings::default()
    };
    let model = Model::open(bundle, &settings)?;
    let model = match step_ms {
        Some(_) => model,
        None => model.for_frames(),
    };
    Ok(match exact {
        true => model,
        false => model.in_real_time(SPENT),
    })
}

impl Server {
    pub fn new(bundle: &Path, model: Model, listener: &TcpListener) -> Result<Self> {
        let name = bundle.file_name().unwrap_or(bundle.as_os_str());
        // What no client could have is refused here.
        Session::new(&model)?;
        Ok(Self {
            model,
            bundle: name.to_string_lossy().into_owned(),
            port: listener.local_addr()?.port(),
            token: token()?,
            taken: AtomicBool::new(false),
            connections: AtomicUsize::new(0),
            silent: Mutex::default(),
        })
    }

    /// What to open in a browser.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.port, self.token)
    }

    /// Never returns but when the listener fails.
    pub fn serve(&self, listener: &TcpListener) {
        std::thread::scope(|scope| {
            let incoming = listener.incoming().map_while(std::result::Result::ok);
            for (number, stream) in incoming.enumerate() {
                let many = self.connections.fetch_add(1, Ordering::AcqRel) >= MOST_CONNECTIONS;
                if many && !self.give_up_silent() {
                    self.connections.fetch_sub(1, Ordering::AcqRel);
                    continue;
                }
                if let Ok(other) = stream.try_clone() {
                    self.lock_silent().push_back((number, other));
                }
                scope.spawn(move || {
                    self.connection(number, stream);
                    self.connections.fetch_sub(1, Ordering::AcqRel);
                });
            }
        });
    }

    fn lock_silent(&self) -> MutexGuard<'_, VecDeque<(usize, TcpStream)>> {
        self.silent.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ends the oldest connection whose request has not come; false where there is none.
    fn give_up_silent(&self) -> bool {
        let oldest = self.lock_silent().pop_front();
        oldest.is_some_and(|(_, stream)| stream.shutdown(Shutdown::Both).is_ok())
    }

    fn connection(&self, number: usize, mut stream: TcpStream) {
        let request = Request::read(&mut stream);
        self.lock_silent().retain(|(other, _)| *other != number);
        // Who reads nothing for so long is gone.
        let _ = stream.set_write_timeout(Some(UNREAD));
        let Some(request) = request else {
            return answer(
                &mut stream,
                "400 Bad Request",
                "text/plain",
                b"not understood\n",
            );
        };
        // A page of another site that resolves its name to 127.0.0.1 says so here.
        let own = [
            format!("127.0.0.1:{}", self.port),
            format!("localhost:{}", self.port),
        ];
        let host = request.header("host").unwrap_or_default();
        let origin = request.header("origin");
        let foreign = origin.is_some_and(|origin| {
            !own.iter()
                .any(|own| origin.strip_prefix("http://") == Some(own))
        });
        if !own.iter().any(|own| own == host) || foreign {
            return answer(
                &mut stream,
                "403 Forbidden",
                "text/plain",
                b"another origin\n",
            );
        }
        let secret = ["/", "/socket"].contains(&request.path.as_str());
        if secret && request.token.as_deref() != Some(&self.token) {
            return answer(
                &mut stream,
                "403 Forbidden",
                "text/plain",
                b"the token is wrong: open the address that `upt view` prints\n",
            );
        }
        if request.path == "/socket" {
            return self.socket(stream, &request, origin.is_some());
        }
        if request.path == "/three.js" {
            let module = three::module().as_bytes();
            return answer(&mut stream, "200 OK", "text/javascript", module);
        }
        match FILES.iter().find(|(path, _, _)| *path == request.path) {
            Some((_, kind, body)) => answer(&mut stream, "200 OK", kind, body),
            None => answer(
                &mut stream,
                "404 Not Found",
                "text/plain",
                b"no such page\n",
            ),
        }
    }

    fn socket(&self, mut stream: TcpStream, request: &Request, from_page: bool) {
        let upgrade = request.header("upgrade").unwrap_or_default();
        let (Some(key), true, true) = (
            request.header("sec-websocket-key"),
            upgrade.eq_ignore_ascii_case("websocket"),
            from_page,
        ) else {
            return answer(
                &mut stream,
                "400 Bad Request",
                "text/plain",
                b"not a WebSocket of the page\n",
            );
        };
        if self.taken.swap(true, Ordering::AcqRel) {
            return answer(
                &mut stream,
                "409 Conflict",
                "text/plain",
                b"another client is connected\n",
            );
        }
        let accepted = format!(
            "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {}\r\n\r\n",
            derive_accept_key(key.as_bytes())
        );
        if std::io::Write::write_all(&mut stream, accepted.as_bytes()).is_ok() {
            let limits = WebSocketConfig::default()
                .max_message_size(Some(LONGEST_MESSAGE))
                .max_frame_size(Some(LONGEST_MESSAGE));
            let mut socket = WebSocket::from_raw_socket(stream, Role::Server, Some(limits));
            if let Err(reason) = self.converse(&mut socket) {
                let mut reason = format!("{reason:#}");
                reason.truncate(reason.floor_char_boundary(120));
                let frame = CloseFrame {
                    code: CloseCode::Policy,
                    reason: reason.into(),
                };
                let _ = socket.close(Some(frame));
                let _ = socket.flush();
            }
        }
        self.taken.store(false, Ordering::Release);
    }

    /// Steps and streams until the client goes away; an error is what it did wrong.
    fn converse(&self, socket: &mut WebSocket<TcpStream>) -> Result<()> {
        socket.get_ref().set_nodelay(true)?;
        let mut session = Session::new(&self.model)?;
        let hello = serde_json::to_string(&session.hello(&self.bundle, &self.model))?;
        socket.send(Message::text(hello))?;
        socket.send(Message::binary(session.geometry()))?;
        // A page that is hidden asks for no frames, and may do so for ever.
        socket.get_ref().set_read_timeout(None)?;
        let mut sent = Instant::now();
        let mut steps = false;
        loop {
            // One message is waited for, the others that are there already are taken with it.
            let mut left = MOST_MESSAGES;
            let mut waits = !session.asked() && !steps;
            while left > 0 {
                socket.get_ref().set_nonblocking(!waits)?;
                match socket.read() {
                    Ok(Message::Text(text)) => {
                        let wish = Wish::parse(text.as_str()).map_err(anyhow::Error::msg)?;
                        session.take(wish)?;
                    }
                    Ok(Message::Binary(_)) => anyhow::bail!("messages must be JSON text"),
                    Ok(_) => {}
                    Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => break,
                    Err(Error::ConnectionClosed | Error::AlreadyClosed | Error::Io(_)) => {
                        return Ok(());
                    }
                    Err(error) => return Err(error.into()),
                }
                left -= 1;
                waits = false;
            }
            socket.get_ref().set_nonblocking(false)?;
            if !session.asked() {
                steps = session.go_on()?;
                continue;
            }
            let early = SOONEST.saturating_sub(sent.elapsed());
            if !early.is_zero() {
                // Newer poses come meanwhile.
                std::thread::sleep(early);
                sent = Instant::now().checked_sub(SOONEST).unwrap_or(sent);
                continue;
            }
            sent = Instant::now();
            // What the step of this frame does to the body is told before the next.
            let mut messages = session.told();
            messages.push(Message::binary(session.frame()?.to_vec()));
            steps = true;
            for message in messages {
                match socket.send(message) {
                    Ok(()) => {}
                    Err(Error::ConnectionClosed | Error::AlreadyClosed | Error::Io(_)) => {
                        return Ok(());
                    }
                    Err(error) => return Err(error.into()),
                }
            }
        }
    }
}

/// 128 random bits in hex.
fn token() -> Result<String> {
    let mut bytes = [0u8; 16];
    getrandom::fill(&mut bytes)
        .map_err(|error| anyhow::anyhow!("{error}"))
        .context("no random numbers for the token")?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}
