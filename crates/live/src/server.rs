//! Server of the page and its socket.

use std::io::{self, Read, Write};
use std::net::{IpAddr, Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::panic::{self, AssertUnwindSafe};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::Duration;

use pliant::simulation::Snapshot;
use pliant_record::Recorded;
use pliant_scene::Source;
use pliant_scene::experiment::{Experiment, ExperimentCommand};
use pliant_view::page::{LiveLink, LiveSocket};
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket};

use crate::LiveError;
use crate::head::{Framing, RequestHead, answer, refuse};
use crate::outbox::{Outbox, Outgoing};
use crate::page::LivePage;
use crate::session::{Incoming, LiveSession, LiveSettings};
use crate::token::Token;

/// Limit on waiting commands; beyond it reading pauses.
const COMMANDS: usize = 256;
/// Size limit of a message that is read and rejected [bytes]; a longer one closes the socket.
const LARGEST: usize = 1 << 20;
/// Limit on simultaneous connections.
const CONNECTIONS: usize = 32;
/// Time limit for a page to receive data.
const STALLED: Duration = Duration::from_secs(10);

/// Options of a live server.
#[derive(Clone, Debug)]
pub struct LiveOptions {
    /// Listening address.
    pub address: IpAddr,
    /// Port; 0 for a random one.
    pub port: u16,
    /// Simulated seconds per second; `None` for maximum speed.
    pub speed: Option<f64>,
    /// True to start paused.
    pub paused: bool,
    /// Recording from the start, below `folder`.
    pub record: Option<PathBuf>,
    /// Directory that contains all recordings.
    pub folder: PathBuf,
    /// Initial state; `None` for that of the scene.
    pub state: Option<Snapshot>,
    /// True if pages of this machine (notebooks, editors) may embed the page in a frame.
    pub in_frames: bool,
}

impl Default for LiveOptions {
    fn default() -> LiveOptions {
        LiveOptions {
            address: Ipv4Addr::LOCALHOST.into(),
            port: 0,
            speed: Some(1.0),
            paused: false,
            record: None,
            folder: PathBuf::new(),
            state: None,
            in_frames: false,
        }
    }
}

/// Summary of a served scene at its end.
#[derive(Clone, Debug)]
pub struct LiveSummary {
    /// Scene, including changes by commands.
    pub source: Source,
    /// Final state.
    pub state: Snapshot,
    /// Number of steps attempted, over all resets.
    pub steps: u64,
    /// Simulated time at the end [s].
    pub time: f64,
    /// Completed recordings.
    pub recorded: Vec<Recorded>,
}

/// Server of a scene, before it runs.
pub struct LiveServer {
    listener: TcpListener,
    door: Arc<Door>,
    session: LiveSession,
}

/// Shared data for answering requests.
struct Door {
    own: SocketAddr,
    token: Token,
    socket: LiveSocket,
    page: String,
    frames: Framing,
    outbox: Arc<Outbox>,
    commands: SyncSender<Incoming>,
    connections: AtomicUsize,
    closed: AtomicBool,
}

impl LiveServer {
    /// Assembles the scene and listens.
    ///
    /// # Errors
    /// [`LiveError`]: the scene cannot be simulated, the state does not fit it, its page cannot be built,
    /// the recording cannot be started, or the port is taken.
    pub fn new(source: Source, options: &LiveOptions) -> Result<LiveServer, LiveError> {
        let mut experiment = Experiment::new(source)?;
        if let Some(state) = &options.state {
            let state = Box::new(state.clone());
            experiment.execute(&ExperimentCommand::Place { state })?;
        }
        let address = SocketAddr::new(options.address, options.port);
        let what = || format!("cannot listen at {address}");
        let listener = TcpListener::bind(address).map_err(LiveError::system(what()))?;
        let bound = listener.local_addr().map_err(LiveError::system(what()))?;
        let own = match bound.ip().is_unspecified() {
            true => SocketAddr::new(Ipv4Addr::LOCALHOST.into(), bound.port()),
            false => bound,
        };
        let token = Token::random()?;
        let socket = LiveSocket { host: own.to_string(), path: format!("/{}/socket", token.text()) };
        let LivePage { html: page, title, measures } =
            LivePage::new(&mut experiment, &LiveLink::Socket(socket.clone()))?;
        let (commands, queue) = sync_channel(COMMANDS);
        let outbox = Arc::new(Outbox::default());
        let LiveOptions { speed, paused, folder, .. } = options.clone();
        let settings = LiveSettings { title, measures, speed, paused, folder, records_anew: false };
        let mut session = LiveSession::new(experiment, settings, Arc::clone(&outbox), queue);
        if let Some(path) = &options.record {
            session.record(path)?;
        }
        let (connections, closed) = (AtomicUsize::new(0), AtomicBool::new(false));
        let frames = if options.in_frames { Framing::OfThisMachine } else { Framing::None };
        let door = Door { own: bound, token, socket, page, frames, outbox, commands, connections, closed };
        Ok(LiveServer { listener, door: Arc::new(door), session })
    }

    /// Address of the page.
    pub fn url(&self) -> String {
        format!("http://{}/{}/", self.door.socket.host, self.door.token.text())
    }

    /// Runs the scene and answers requests until `stop` is set.
    ///
    /// # Errors
    /// The last recording cannot be finished.
    pub fn run(self, stop: &Arc<AtomicBool>) -> Result<LiveSummary, LiveError> {
        let LiveServer { listener, door, session } = self;
        let accepting = Arc::clone(&door);
        let accepts = std::thread::spawn(move || accept(&listener, &accepting));
        let summary = run(session, stop);
        door.closed.store(true, Ordering::Relaxed);
        door.outbox.close();
        // Wakes the accepting thread; if this fails, the thread ends with the process.
        let socket: Option<SocketAddr> = door.socket.host.parse().ok();
        if socket.is_some_and(|socket| TcpStream::connect(socket).is_ok()) {
            let _ = accepts.join();
        }
        summary
    }
}

/// Runs a scene until `stop` is set.
fn run(mut session: LiveSession, stop: &Arc<AtomicBool>) -> Result<LiveSummary, LiveError> {
    session.experiment_mut().set_stop(Some(Arc::clone(stop)));
    // Finishes the recording with its log however the loop ends.
    let ended = panic::catch_unwind(AssertUnwindSafe(|| {
        while !stop.load(Ordering::Relaxed) {
            let wait = session.wait();
            session.turn(wait);
        }
    }));
    let recording = session.end_recording();
    if let Err(cause) = ended {
        panic::resume_unwind(cause);
    }
    recording?;
    let (experiment, recorded) = session.into_parts();
    let (steps, state) = (experiment.log().steps, experiment.simulation().snapshot());
    Ok(LiveSummary { source: experiment.source().clone(), steps, time: state.time, state, recorded })
}

fn accept(listener: &TcpListener, door: &Arc<Door>) {
    for stream in listener.incoming() {
        if door.closed.load(Ordering::Relaxed) {
            return;
        }
        let Ok(stream) = stream else { continue };
        if door.connections.fetch_add(1, Ordering::Relaxed) >= CONNECTIONS {
            door.connections.fetch_sub(1, Ordering::Relaxed);
            continue;
        }
        let door = Arc::clone(door);
        std::thread::spawn(move || {
            // An error of a closed connection cannot be reported.
            let _ = door.serve(stream);
            door.connections.fetch_sub(1, Ordering::Relaxed);
        });
    }
}

impl Door {
    fn serve(self: &Arc<Door>, mut stream: TcpStream) -> io::Result<()> {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(STALLED))?;
        let head = RequestHead::read(&mut stream)?;
        let Some(host) = head.host(self.own.ip(), self.own.port()) else {
            return refuse(&mut stream, "421 Misdirected Request");
        };
        let (token, rest) = head.path.trim_start_matches('/').split_once('/').unwrap_or_default();
        if head.method != "GET" || !self.token.is(token) || !["", "socket"].contains(&rest) {
            return refuse(&mut stream, "404 Not Found");
        }
        if rest.is_empty() {
            let asks = |host: &str| format!("connect-src ws://{host}");
            let page = match host == self.socket.host {
                true => return answer(&mut stream, &self.page, self.frames),
                false => self.page.replacen(&asks(&self.socket.host), &asks(host), 1),
            };
            return answer(&mut stream, &page, self.frames);
        }
        if head.field("origin") != Some(&format!("http://{host}")) {
            return refuse(&mut stream, "403 Forbidden");
        }
        let Some(key) = head.field("sec-websocket-key") else {
            return refuse(&mut stream, "426 Upgrade Required");
        };
        let Some(page) = self.outbox.connect() else { return refuse(&mut stream, "409 Conflict") };
        let talked = self.talk(stream, key, page);
        self.outbox.disconnect(page);
        talked
    }

    /// Sends and receives until the page is gone.
    fn talk(self: &Arc<Door>, mut stream: TcpStream, key: &str, page: u64) -> io::Result<()> {
        write!(
            stream,
            "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
             Sec-WebSocket-Accept: {}\r\n\r\n",
            derive_accept_key(key.as_bytes())
        )?;
        stream.set_read_timeout(None)?;
        let outgoing = stream.try_clone()?;
        let door = Arc::clone(self);
        std::thread::spawn(move || {
            let ended = outgoing.try_clone();
            door.send(outgoing, page);
            // The receiving half waits for the page.
            let _ = ended.map(|stream| stream.shutdown(Shutdown::Both));
        });
        self.receive(stream, page);
        Ok(())
    }

    /// Sends messages for `page` until the page or the connection is gone.
    fn send(&self, stream: TcpStream, page: u64) {
        let mut socket = WebSocket::from_raw_socket(stream, Role::Server, None);
        while let Some(message) = self.outbox.next(page) {
            let message = match message {
                Outgoing::Text(text) => Message::text(text),
                Outgoing::Frame(frame) => Message::binary(frame),
                Outgoing::Pong(data) => Message::Pong(data.into()),
            };
            if socket.send(message).is_err() {
                break;
            }
        }
        let _ = socket.close(None);
        let _ = socket.flush();
        self.outbox.disconnect(page);
    }

    /// Passes on messages from `page` until it is gone.
    fn receive(&self, stream: TcpStream, page: u64) {
        let config = WebSocketConfig::default().max_message_size(Some(LARGEST)).max_frame_size(Some(LARGEST));
        let mut socket = WebSocket::from_raw_socket(ReadHalf(stream), Role::Server, Some(config));
        while let Ok(message) = socket.read() {
            let incoming = match message {
                Message::Text(text) => Incoming::read(page, &text, &self.outbox),
                Message::Binary(_) => Incoming { page, request: Err((None, "a command is a text".into())) },
                Message::Ping(data) => {
                    self.outbox.pong(page, data.to_vec());
                    continue;
                }
                _ => continue,
            };
            // A full queue pauses reading: the page waits, and no command is lost.
            if !self.outbox.has_room(page) || self.commands.send(incoming).is_err() {
                return;
            }
        }
    }
}

/// Reading half of a stream. Automatic answers of the protocol are dropped: only one half may write, or
/// frames would be interleaved.
struct ReadHalf(TcpStream);

impl Read for ReadHalf {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.read(buffer)
    }
}

impl Write for ReadHalf {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        Ok(buffer.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
