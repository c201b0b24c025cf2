//! Running scenes over their socket: commands, refusals, recordings.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use pliant_scene::Source;
use pliant_scene::experiment::{CommandLog, Experiment, ExperimentCommand};
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

use super::Bench;

/// A cantilever of 4 x 1 cells under its weight; vertex 9 is the upper corner of its free end.
const BEAM: &str = r#"
dimension = 2
[time]
integrator = "implicit-euler"
step = 0.05
duration = 1.0
[world]
gravity = [0.0, -9.81]
[[body]]
name = "beam"
mesh = { grid = { cells = [4, 1], spacing = 0.25 } }
elastic = { corotated = { young = 2e6, poisson = 0.3 } }
mass = { density = 1000.0 }
pin = [{ name = "clamp", vertices = [0, 5] }]
"#;
const YOUNG: &str = "body.0.elastic.corotated.young";

/// A scene that is served. It does not outlive its test.
struct Served {
    child: Child,
    host: String,
    token: String,
}

impl Served {
    fn start(bench: &Bench, arguments: &[&str]) -> Served {
        let mut command = Command::new(super::PLIANT);
        command.args(["live", "scene.toml", "--no-open"]).args(arguments);
        command.current_dir(bench.directory.path()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("http://").unwrap_or_else(|| panic!("no address: {line}"));
        let mut parts = address.split('/').map(str::to_owned);
        Served { child, host: parts.next().unwrap(), token: parts.next().unwrap() }
    }

    fn path(&self, last: &str) -> String {
        format!("/{}/{last}", self.token)
    }

    /// The answer to a request of these lines.
    fn ask(&self, path: &str, fields: &[(&str, &str)]) -> String {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let fields: String = fields.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        // A request that is refused may be cut off before all of it is written.
        let _ = write!(stream, "GET {path} HTTP/1.1\r\n{fields}\r\n");
        let mut answer = vec![];
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    /// The status of the answer to a request for the socket.
    fn status(&self, path: &str, host: &str, origin: Option<&str>) -> String {
        let mut fields = vec![("Host", host), ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ==")];
        fields.extend(origin.map(|origin| ("Origin", origin)));
        self.ask(path, &fields).split(' ').nth(1).unwrap_or_default().to_owned()
    }

    fn page(&self) -> Page {
        let stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
        let mut request = format!("ws://{}{}", self.host, self.path("socket")).into_client_request().unwrap();
        request.headers_mut().insert("Origin", format!("http://{}", self.host).parse().unwrap());
        let (socket, _) = tungstenite::client(request, stream).unwrap();
        Page { socket, last: 0, steps: 0 }
    }

    /// Ends it as Ctrl-C does.
    fn interrupt(mut self) -> i32 {
        Command::new("kill").args(["-INT", &self.child.id().to_string()]).status().unwrap();
        let deadline = Instant::now() + Duration::from_secs(30);
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.code().unwrap();
            }
            assert!(Instant::now() < deadline, "it goes on after Ctrl-C");
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A page without a picture.
struct Page {
    socket: WebSocket<TcpStream>,
    /// Number of the last command.
    last: u64,
    /// Step of the last frame.
    steps: u64,
}

impl Page {
    fn read(&mut self) -> Message {
        self.socket.read().unwrap()
    }

    /// The next text of this type.
    fn next(&mut self, kind: &str) -> Value {
        loop {
            let Message::Text(text) = self.read() else { continue };
            let value: Value = serde_json::from_str(&text).unwrap();
            if value["type"] == kind {
                return value;
            }
        }
    }

    /// The next state in which `holds`.
    fn state(&mut self, holds: impl Fn(&Value) -> bool) -> Value {
        loop {
            let state = self.next("state");
            if holds(&state) {
                return state;
            }
        }
    }

    /// The state after the last command.
    fn settled(&mut self) -> Value {
        let last = self.last;
        self.state(|state| state["command"].as_u64() >= Some(last))
    }

    /// Positions in the next frame after the last command.
    fn positions(&mut self) -> Vec<f32> {
        loop {
            let Message::Binary(bytes) = self.read() else { continue };
            let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
            assert_eq!((word(0), word(24), word(28)), (0x4D52_5450, 10, 2));
            assert_eq!(bytes.len() as u32, 40 + 4 * (10 * 2 + 10 + word(32)));
            self.steps = u64::from_le_bytes(bytes[8..16].try_into().unwrap());
            if u64::from(word(4)) >= self.last {
                let floats =
                    bytes[40..].chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap()));
                return floats.take(20).collect();
            }
        }
    }

    fn send(&mut self, mut command: Value) {
        self.last += 1;
        command["command"] = self.last.into();
        self.socket.send(Message::text(command.to_string())).unwrap();
    }

    /// Sends a command; its answer.
    fn ask(&mut self, command: Value) -> Value {
        self.send(command);
        let last = self.last;
        loop {
            let reply = self.next("reply");
            if reply["command"] == last {
                return reply;
            }
        }
    }

    fn ok(&mut self, command: Value) {
        let reply = self.ask(command.clone());
        assert_eq!(reply["ok"], true, "{command}: {reply}");
    }
}

#[test]
fn pause_step_reset_and_speed_do_what_they_say() {
    let bench = Bench::new(BEAM);
    let served = Served::start(&bench, &["--paused"]);
    let mut page = served.page();
    let hello = page.next("hello");
    assert_eq!((&hello["integrator"], &hello["dimension"]), (&"implicit-euler".into(), &2.into()));
    assert_eq!((&hello["vertex_count"], &hello["state"]["paused"]), (&10.into(), &true.into()));
    assert!(hello["measures"].as_array().unwrap().contains(&"von-mises".into()), "{hello}");
    assert!(hello["controls"].as_array().unwrap().iter().any(|control| control["path"] == YOUNG), "{hello}");
    page.ok(json!({ "do": "step", "count": 3 }));
    let state = page.state(|state| state["paused"] == true);
    assert_eq!((&state["step"], &state["time"]), (&3.into(), &0.15000000000000002.into()));
    page.ok(json!({ "do": "speed", "value": null }));
    page.ok(json!({ "do": "continue" }));
    page.state(|state| state["step"].as_u64() > Some(20));
    page.ok(json!({ "do": "pause" }));
    let paused = page.settled()["step"].clone();
    page.ok(json!({ "do": "speed", "value": 0.5 }));
    let state = page.settled();
    assert_eq!((&state["step"], &state["speed"]), (&paused, &0.5.into()));
    page.ok(json!({ "do": "measure", "name": "von-mises" }));
    page.ok(json!({ "do": "reset" }));
    assert_eq!(page.settled()["step"], 0);
    let start = page.positions();
    assert_eq!((page.steps, start[18], start[19]), (0, 1.0, 0.25));
    assert_eq!(page.ask(json!({ "do": "measure", "name": "beauty" }))["ok"], false);
    assert_eq!(served.interrupt(), 0);
}

/// Stress at nodes is recovered for recordings alone.
#[test]
fn every_measure_that_the_page_offers_can_be_shown() {
    let channels = "[output]\nchannels = ['state', 'nodal-von-mises', 'zz', 'green-strain']\n[[body]]";
    let bench = Bench::new(&BEAM.replacen("[[body]]", channels, 1));
    let served = Served::start(&bench, &["--paused"]);
    let mut page = served.page();
    let hello = page.next("hello");
    let measures = hello["measures"].as_array().unwrap();
    assert!(
        measures.contains(&"green-strain xx".into()) && measures.contains(&"von-mises".into()),
        "{hello}"
    );
    for measure in measures {
        page.ok(json!({ "do": "measure", "name": measure }));
    }
    assert_eq!(served.interrupt(), 0);
}

#[test]
fn a_stiffer_beam_rises_and_a_dragged_one_follows() {
    let bench = Bench::new(BEAM);
    let served = Served::start(&bench, &["--paused"]);
    let mut page = served.page();
    let after = |page: &mut Page, commands: &[Value], steps: u64| {
        commands.iter().for_each(|command| page.send(command.clone()));
        page.ok(json!({ "do": "step", "count": steps }));
        page.state(|state| state["paused"] == true && state["fault"].is_null());
        page.ok(json!({ "do": "measure", "name": null }));
        page.positions()[19] - 0.25
    };
    let soft = after(&mut page, &[], 150);
    let stiff = after(&mut page, &[json!({ "do": "set", "path": YOUNG, "value": 4e6 })], 150);
    assert!(soft < -0.001 && (0.49..0.51).contains(&(stiff / soft)), "{soft} {stiff}");
    let grab = json!({ "do": "grab", "vertex": 9, "target": [1.0, 0.3] });
    let drags = [0.4, 0.5, 0.6].map(|z| json!({ "do": "drag", "target": [1.0, z] }));
    let pulled = after(&mut page, &[&[grab], &drags[..]].concat(), 100);
    assert!(pulled > 0.05, "{pulled}");
    let let_go = after(&mut page, &[json!({ "do": "release" })], 150);
    assert!((let_go / stiff - 1.0).abs() < 0.01, "{let_go} {stiff}");
}

#[test]
fn who_has_no_business_here_is_refused_and_nothing_ends() {
    let bench = Bench::new(BEAM);
    let served = Served::start(&bench, &["--paused"]);
    let own = format!("http://{}", served.host);
    let (socket, host, port) =
        (served.path("socket"), &served.host[..], served.host.split(':').nth(1).unwrap());
    let answer = served.ask(&served.path(""), &[("Host", host)]);
    for header in
        ["200 OK", "Referrer-Policy: no-referrer", "Cache-Control: no-store", "X-Frame-Options: DENY"]
    {
        assert!(answer.contains(header), "{header}");
    }
    assert!(
        answer
            .contains(&format!("<script type=\"application/json\" id=\"live\">{{\"socket\":\"{socket}\"}}"))
    );
    assert!(answer.contains(&format!("connect-src ws://{host}")));
    let local = format!("localhost:{port}");
    assert!(served.ask(&served.path(""), &[("Host", &local)]).contains(&format!("connect-src ws://{local}")));
    let wrong = socket.replace(&served.token, &"0".repeat(32));
    assert_eq!(served.status(&wrong, host, Some(&own)), "404");
    assert_eq!(served.status("/", host, None), "404");
    assert_eq!(served.status(&socket, &format!("evil.example:{port}"), Some(&own)), "421");
    assert_eq!(served.status(&socket, host, Some("http://evil.example")), "403");
    assert_eq!(served.status(&socket, host, None), "403");
    assert_eq!(served.ask("/x", &[("Host", host), ("X", &"y".repeat(9000))]), "");

    let mut page = served.page();
    page.next("hello");
    assert_eq!(served.status(&socket, host, Some(&own)), "409");
    for text in ["{", "[]", "{\"do\":\"pause\"}", &"x".repeat(70_000)] {
        page.socket.send(Message::text(text.to_owned())).unwrap();
        let reply = page.next("reply");
        assert_eq!((&reply["ok"], &reply["command"]), (&false.into(), &Value::Null), "{reply}");
    }
    for (command, message) in [
        (json!({ "do": "fly" }), "fly"),
        (json!({ "do": "set", "path": "body.0.elastic.corotated.poisson", "value": 0.5 }), "`poisson` = 0.5"),
        (json!({ "do": "integrator", "name": "velocity-verlet" }), "is unstable"),
        (json!({ "do": "record", "path": "../run.mcap" }), "below the working folder"),
        (json!({ "do": "record", "path": "/tmp/run.mcap" }), "below the working folder"),
        (json!({ "do": "record", "path": "a\u{1b}[2J.mcap" }), "control characters"),
        (json!({ "do": "go-back" }), "no earlier state"),
    ] {
        let reply = page.ask(command);
        assert!(reply["ok"] == false && reply["message"].as_str().unwrap().contains(message), "{reply}");
    }
    page.ok(json!({ "do": "step" }));
    // An enormous message ends the socket, not the run.
    let _ = page.socket.send(Message::text("x".repeat(2 << 20)));
    while page.socket.read().is_ok() {}
    let mut page = served.page();
    assert_eq!(page.next("hello")["state"]["step"], 1);
    assert_eq!(served.interrupt(), 0);
}

#[test]
fn a_step_that_fails_is_marked_and_gone_back_from() {
    let bench = Bench::new(
        &BEAM
            .replace("implicit-euler", "symplectic-euler")
            .replace("0.05", "2e-4")
            .replace("corotated", "neo-hookean"),
    );
    let served = Served::start(&bench, &["--paused", "--speed", "max"]);
    let mut page = served.page();
    page.ok(json!({ "do": "step", "count": 100 }));
    page.state(|state| state["step"] == 100);
    page.ok(json!({ "do": "grab", "vertex": 9, "target": [-60.0, 30.0] }));
    page.ok(json!({ "do": "continue" }));
    let failed = page.state(|state| !state["fault"].is_null());
    let fault = &failed["fault"];
    assert!(failed["paused"] == true && failed["can_go_back"] == true, "{failed}");
    assert!(fault["body"] == "beam" && fault["element"].is_u64(), "{fault}");
    assert!(fault["message"].as_str().unwrap().contains("s) failed"), "{fault}");
    page.ok(json!({ "do": "release" }));
    page.ok(json!({ "do": "go-back" }));
    let back = page.settled();
    assert!(back["fault"].is_null() && back["step"].as_u64() < failed["step"].as_u64(), "{back}");
}

/// Numbers below `bound`, without pattern.
fn number(seed: &mut u64, bound: u64) -> u64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 33) % bound
}

#[test]
fn a_recording_of_a_hundred_commands_while_it_runs_is_that_of_their_log() {
    let bench = Bench::new(BEAM);
    let served = Served::start(&bench, &["--speed", "max", "--record", "run.mcap"]);
    let mut page = served.page();
    let mut seed = 3;
    for _ in 0..100 {
        let part = number(&mut seed, 1000) as f64 / 1000.0;
        page.send(match number(&mut seed, 7) {
            0 => json!({ "do": "set", "path": YOUNG, "value": 1e6 * (1.0 + part) }),
            1 => json!({ "do": "set", "path": "world.gravity.1", "value": -10.0 * part }),
            2 => json!({ "do": "pin", "name": "beam/clamp", "on": number(&mut seed, 2) == 0 }),
            3 => json!({ "do": "grab", "vertex": number(&mut seed, 10), "target": [part, 0.5] }),
            4 => json!({ "do": "integrator", "name": if part < 0.5 { "implicit-euler" } else { "bdf2" } }),
            _ => json!({ "do": "drag", "target": [1.0, part] }),
        });
        std::thread::sleep(Duration::from_millis(2 * number(&mut seed, 5)));
    }
    let end = page.settled()["step"].as_u64().map(|step| step + 40);
    page.state(|state| state["step"].as_u64() > end);
    assert_eq!(served.interrupt(), 0);
    let text = std::fs::read_to_string(bench.path("run.commands.jsonl")).unwrap();
    let log = CommandLog::from_json_lines(&text).unwrap();
    assert!(log.commands.len() > 30 && log.steps > 40, "{} {}", log.commands.len(), log.steps);
    let source = Source::new("scene.toml", log.scene.as_str());
    let again = pliant_live::replay(source, &log, bench.directory.path(), Path::new("again.mcap")).unwrap();
    let bytes = |name: &str| std::fs::read(bench.path(name)).unwrap();
    assert!(again.frames > 10 && bytes("run.mcap") == bytes("again.mcap"), "{}", again.frames);
    bench.pliant(["info", "run.mcap"]).succeeded();
    // Neither a recording nor its log is replaced silently.
    bench.pliant(["live", "scene.toml", "--no-open", "--record", "run.mcap"]).ended_with(2).says(&["exists"]);
    bench.pliant(["live", "scene.toml", "--no-open", "--record", "../a.mcap"]).ended_with(2).says(&["below"]);
}

/// A floor under the beam, which is a body to implicit schemes alone.
fn above_floor() -> String {
    let floor = "[world]\nwalls = [{ normal = [0.0, 1.0], offset = -0.5 }]";
    BEAM.replace("[world]", floor).replace("0.05", "2e-4")
}

#[test]
fn a_page_switches_the_scheme_both_ways_above_a_floor() {
    let bench = Bench::new(&above_floor());
    let served = Served::start(&bench, &["--paused", "--record", "run.mcap"]);
    let mut page = served.page();
    let count = page.next("hello")["vertex_count"].as_u64().unwrap() as usize;
    page.ok(json!({ "do": "step", "count": 5 }));
    page.state(|state| state["step"] == 5);
    for (name, step) in [("symplectic-euler", 10), ("implicit-euler", 15)] {
        page.ok(json!({ "do": "integrator", "name": name }));
        page.ok(json!({ "do": "step", "count": 5 }));
        let state = page.state(|state| state["step"] == step);
        assert!(state["fault"].is_null() && state["recording"].is_null(), "{state}");
        let last = page.last;
        let frame = loop {
            let Message::Binary(bytes) = page.read() else { continue };
            if u64::from(u32::from_le_bytes(bytes[4..8].try_into().unwrap())) >= last {
                break bytes;
            }
        };
        assert_eq!(u32::from_le_bytes(frame[24..28].try_into().unwrap()) as usize, count, "{name}");
    }
    assert_eq!(served.interrupt(), 0);
    assert!(bench.path("run.mcap").exists() && bench.path("run.commands.jsonl").exists());
}

/// Shipped scenes and templates with walls.
fn scenes_with_walls() -> Vec<std::path::PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = [root.join("../../scenes"), root.join("src/commands/new")];
    let files = folders.iter().flat_map(|folder| std::fs::read_dir(folder).unwrap());
    let files =
        files.map(|file| file.unwrap().path()).filter(|path| path.extension() == Some("toml".as_ref()));
    let mut found: Vec<_> =
        files.filter(|path| std::fs::read_to_string(path).unwrap().contains("\nwalls")).collect();
    found.sort();
    found
}

#[test]
fn no_switch_of_the_scheme_stops_a_scene_with_walls() {
    let scenes = scenes_with_walls();
    assert!(scenes.len() >= 7, "{scenes:?}");
    for path in scenes {
        let mut experiment = Experiment::new(Source::from_path(&path).unwrap()).unwrap();
        assert!(experiment.step(), "{}", path.display());
        let (_, own) = experiment.integrators();
        for name in ["implicit-euler", "symplectic-euler", own] {
            let before = experiment.simulation().snapshot();
            if experiment.execute(&ExperimentCommand::Integrator { name: name.into() }).is_err() {
                assert_eq!(experiment.simulation().snapshot(), before, "{} {name}", path.display());
            }
            assert_eq!(experiment.simulation().state().step, before.step, "{} {name}", path.display());
        }
        assert!(experiment.step(), "{}: {:?}", path.display(), experiment.failure());
    }
}
