//! Runs that go on from a checkpoint, after a signal, a kill, and their end.

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use pliant_record::checkpoint::{CheckpointContent, CheckpointFile};

use super::failures::PIERCED;
use super::{Bench, Ended, logged};

/// A beam and a strand tied to it, by a scheme of two steps, with a pin that lets go, one that moves, a wall,
/// and all that can be recorded.
const BEAM: &str = r#"
dimension = 2
[time]
integrator = "generalised-alpha"
step = 2e-3
duration = 0.12
[world]
gravity = ["0.5*sin(200*t)", "-9.8"]
walls = [{ normal = [0.0, 1.0], offset = -0.001 }]
[[body]]
name = "beam"
mesh = { grid = { cells = [3, 1], spacing = 0.1 } }
elastic = { corotated = { young = 1e4, poisson = 0.3 } }
mass = { density = 1000.0 }
damping = { strain_rate = { shear = "5 Pa s" } }
pin = [
    { name = "moving", vertices = [1], motion = { displacement = ["0.01*(1 - cos(60*t))", "0"] } },
    { name = "released", vertices = [0], until = 0.05 },
]
[[probe]]
name = "corner"
body = "beam"
at = [0.29, 0.09]
[output]
rate = 150.0
channels = ["state", "mesh", "energy", "reactions", "von-mises"]
"#;

/// A checkpoint after every step.
const ALWAYS: [&str; 2] = ["--checkpoint", "1e-9"];

fn with<'a>(first: &[&'a str], rest: &[&'a str]) -> Vec<&'a str> {
    [first, &ALWAYS, rest].concat()
}

/// A run, or what goes on with it, in the background. It does not outlive its test.
struct Running(Option<Child>);

impl Running {
    fn start(bench: &Bench, arguments: &[&str]) -> Running {
        let mut command = Command::new(super::PLIANT);
        command.args(arguments).current_dir(bench.directory.path());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        Running(Some(command.spawn().unwrap()))
    }

    /// True if the process still runs.
    fn alive(&mut self) -> bool {
        self.0.as_mut().is_some_and(|child| child.try_wait().unwrap().is_none())
    }

    /// Waits until the checkpoint has been written, and written again so many times, or the run is over.
    fn after(mut self, bench: &Bench, times: usize) -> Running {
        let deadline = Instant::now() + Duration::from_secs(50);
        let written =
            || std::fs::metadata(bench.path("scene.checkpoint")).and_then(|there| there.modified()).ok();
        let mut last = None;
        for _ in 0..times {
            while self.alive() && (written().is_none() || written() == last) {
                assert!(Instant::now() < deadline, "no checkpoint after 50 s");
                std::thread::sleep(Duration::from_millis(1));
            }
            last = written();
        }
        self
    }

    #[cfg(unix)]
    fn interrupt(mut self) -> Ended {
        let child = self.0.take().unwrap();
        assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
        child.wait_with_output().unwrap().into()
    }
}

/// As by SIGKILL.
impl Drop for Running {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn bytes(bench: &Bench, name: &str) -> Vec<u8> {
    std::fs::read(bench.path(name)).unwrap()
}

/// The same run, not stopped.
fn whole(scene: &str, rest: &[&str]) -> Bench {
    let bench = Bench::new(scene);
    bench.pliant(with(&["run", "scene.toml"], rest)).succeeded();
    bench
}

/// Recording of the same run without checkpoints.
fn without_checkpoints(scene: &str) -> Vec<u8> {
    let bench = Bench::new(scene);
    bench.pliant(["run", "scene.toml"]).succeeded();
    bytes(&bench, "scene.mcap")
}

/// Whether checkpoints are written, and how often, goes by the clock; the recording does not.
#[test]
fn a_recording_has_the_same_bytes_with_checkpoints_and_without() {
    for scheme in ["\"generalised-alpha\"", "\"symplectic-euler\"", "\"implicit-euler\""] {
        let scene = BEAM.replace("\"generalised-alpha\"", scheme).replace("2e-3", "1e-3");
        let expected = without_checkpoints(&scene);
        for every in ["1e-9", "1 ms", "1000"] {
            let bench = Bench::new(&scene);
            bench.pliant(["run", "scene.toml", "--checkpoint", every]).succeeded();
            assert!(bytes(&bench, "scene.mcap") == expected, "{scheme}, a checkpoint every {every}");
        }
    }
}

/// To the last byte of the recording and of the table of probes.
#[cfg(unix)]
#[test]
fn an_interrupted_run_goes_on_as_if_it_had_not_been() {
    // Solvers forget, and leave a checkpoint, after 64 steps at the latest.
    for (scheme, step, duration, kept, numbers) in [
        ("{ generalised-alpha = {} }", "2e-3", "1.2", 4, (Some(181), Some(600))),
        ("'symplectic-euler'", "1e-3", "0.12", 8, (Some(19), Some(120))),
    ] {
        let scene = BEAM.replace("\"generalised-alpha\"", scheme).replace("2e-3", step);
        let scene = scene.replace("duration = 0.12", &format!("duration = {duration}"));
        let expected = whole(&scene, &["--probes", "table.csv"]);
        let bench = Bench::new(&scene);
        let run =
            Running::start(&bench, &with(&["scene.toml", "--threads", "1"], &["--probes", "table.csv"]));
        let ended = run.after(&bench, kept).interrupt().ended_with(130);
        ended.says(&["interrupted after ", "`pliant resume scene.checkpoint` goes on from t = "]);
        assert_eq!(bench.files(), ["scene.checkpoint", "scene.mcap", "table.csv"]);
        assert!(bytes(&bench, "scene.mcap").len() < bytes(&expected, "scene.mcap").len());
        let ended = bench.pliant(["resume", "scene.checkpoint", "--threads", "2", "--json"]).succeeded();
        let summary = &ended.json()["summary"];
        assert_eq!((summary["frames"].as_u64(), summary["steps"].as_u64()), numbers);
        assert_eq!(bench.files(), expected.files());
        assert!(bytes(&bench, "table.csv") == bytes(&expected, "table.csv"), "{scheme}: another table");
        assert!(bytes(&bench, "scene.mcap") == bytes(&expected, "scene.mcap"), "{scheme}: another recording");
        assert_eq!(logged(&bench.path("scene.mcap")), logged(&expected.path("scene.mcap")));
    }
}

/// While it computes, while it writes a checkpoint, while it goes on from one: wherever that is. The run is
/// so long that a fast machine has not finished before the last kill.
#[test]
fn a_run_killed_again_and_again_ends_as_if_it_had_not_been() {
    let scene =
        BEAM.replace("\"generalised-alpha\"", "{ bdf2 = {} }").replace("duration = 0.12", "duration = 2.4");
    let expected = whole(&scene, &[]);
    let bench = Bench::new(&scene);
    drop(Running::start(&bench, &with(&["run", "scene.toml"], &[])).after(&bench, 3));
    let ended = bench.pliant(["scene.toml"]).ended_with(2);
    ended.says(&["scene.mcap.part is left over", "`pliant resume scene.checkpoint` goes on with it"]);
    let mut killed = 0;
    for kill in 0..6 {
        let mut running = Running::start(&bench, &["resume", "scene.checkpoint"]);
        if kill % 2 == 0 {
            running = running.after(&bench, 2 + kill);
        } else {
            std::thread::sleep(Duration::from_millis(7 * kill as u64));
        }
        killed += usize::from(running.alive());
        drop(running);
    }
    assert!(killed >= 3, "only {killed} kills met a run");
    bench.pliant(["resume", "scene.checkpoint"]).succeeded();
    assert_eq!(bench.files(), expected.files());
    assert!(bytes(&bench, "scene.mcap") == bytes(&expected, "scene.mcap"));
    assert!(bytes(&bench, "scene.mcap") == without_checkpoints(&scene));
}

#[test]
fn a_complete_run_is_said_to_be_complete_and_goes_on_where_asked_to() {
    let bench = whole(PAIR, &[]);
    let before = (bytes(&bench, "scene.mcap"), bytes(&bench, "scene.checkpoint"));
    let ended = bench.pliant(["resume", "scene.checkpoint"]).succeeded();
    ended.prints(&[
        "the run of scene.checkpoint is complete: it reached t = 0.051 s; `--until` takes it further",
    ]);
    assert!(before == (bytes(&bench, "scene.mcap"), bytes(&bench, "scene.checkpoint")));
    let ended = bench.pliant(["resume", "scene.checkpoint", "--until", "0.02"]).ended_with(2);
    ended.says(&["scene.checkpoint is at t = 0.051 s, beyond the 0.02 s"]);
    bench.pliant(["resume", "scene.checkpoint", "--until", "0.08"]).succeeded();
    let expected = whole(PAIR, &["--until", "0.08"]);
    assert!(bytes(&bench, "scene.mcap") == bytes(&expected, "scene.mcap"));
    // And again, into another file.
    bench.pliant(["resume", "scene.checkpoint", "--until", "0.1", "-o", "longer.mcap"]).succeeded();
    assert_eq!(bench.files(), ["longer.mcap", "scene.checkpoint", "scene.mcap"]);
    assert!(bytes(&bench, "scene.mcap") == bytes(&expected, "scene.mcap"));
    let expected = whole(PAIR, &["--until", "0.1"]);
    assert!(bytes(&bench, "longer.mcap") == bytes(&expected, "scene.mcap"));
}

/// Two masses on a spring; the 17 steps go a little beyond the duration.
const PAIR: &str = r#"
dimension = 2
[time]
integrator = "implicit-midpoint"
step = 0.003
duration = 0.05
[[body]]
name = "pair"
mesh = { strand = { segments = 1, start = [0.0, 0.0], end = [1.0, 0.0] } }
springs = { stiffness = 100.0 }
mass = { per_vertex = 1.0 }
position = { affine = { matrix = [[1.1, 0.0], [0.0, 1.0]] } }
[output]
rate = 130.0
"#;

#[test]
fn what_is_no_checkpoint_or_a_broken_one_is_refused() {
    let bench = whole(PAIR, &[]);
    bench.pliant(["resume", "nowhere"]).ended_with(2).says(&["cannot read nowhere: "]);
    bench.pliant(["resume", "scene.toml"]).ended_with(2).says(&["scene.toml is not a checkpoint"]);
    let ended =
        bench.pliant(["resume", "scene.checkpoint", "--until", "1", "-o", "./scene.checkpoint", "--force"]);
    ended.ended_with(2).says(&["scene.checkpoint is the checkpoint"]);
    let probe = format!("{PAIR}[[probe]]\nname = \"end\"\nbody = \"pair\"\nvertex = 1\n");
    let other = Bench::new(&probe);
    let ended = other.pliant(with(&["scene.toml"], &["--probes", "scene.checkpoint"])).ended_with(2);
    ended.says(&["scene.checkpoint is the checkpoint"]);
    bench.pliant(["resume", "scene.mcap"]).ended_with(2).says(&["scene.mcap is not a checkpoint"]);
    bench.pliant(["resume", "."]).ended_with(2).says(&["it is a directory, not a regular file"]);
    #[cfg(unix)]
    {
        let pipe = bench.path("pipe");
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        bench.pliant(["resume", "pipe"]).ended_with(2).says(&["it is a named pipe, not a regular file"]);
        let ended = bench.pliant(with(&["scene.toml", "-o", "pipe"], &["--force"])).ended_with(2);
        ended.says(&["pipe is no regular file"]);
    }
    let whole = bytes(&bench, "scene.checkpoint");
    std::fs::write(bench.path("cut"), &whole[..whole.len() / 2]).unwrap();
    bench.pliant(["resume", "cut"]).ended_with(2).says(&["cut is damaged", "checksum"]);
    let ended = bench.pliant(["resume", "cut", "--json"]).ended_with(2);
    assert_eq!(ended.json()["problems"][0]["kind"], "checkpoint");
    assert_eq!(bytes(&bench, "scene.checkpoint"), whole);
}

#[test]
fn a_checkpoint_is_not_replaced_unasked() {
    let bench = whole(PAIR, &["--no-record"]);
    assert_eq!(bench.files(), ["scene.checkpoint"]);
    let ended = bench.pliant(with(&["scene.toml", "--no-record"], &[])).ended_with(2);
    ended.says(&["scene.checkpoint exists", "`pliant resume scene.checkpoint`", "--force"]);
    bench.pliant(with(&["scene.toml", "--no-record"], &["--force"])).succeeded();
    bench.pliant(["resume", "scene.checkpoint"]).succeeded().prints(&["is complete"]);
    bench
        .pliant(["resume", "scene.checkpoint", "--until", "0.06"])
        .succeeded()
        .prints(&["done: 9 frames, 20 steps"]);
    let ended = bench.pliant(["resume", "scene.checkpoint", "--until", "0.07", "-o", "a.mcap"]).ended_with(2);
    ended.says(&["the run was not recorded"]);
}

/// The new run may fail, or be killed, before it has one of its own.
#[test]
fn an_old_checkpoint_stays_until_there_is_a_new_one() {
    let bench = whole(PAIR, &[]);
    let old = bytes(&bench, "scene.checkpoint");
    std::fs::write(bench.path("scene.toml"), PIERCED).unwrap();
    let arguments = ["run", "scene.toml", "--force", "--checkpoint", "1000"];
    let ended = bench.pliant(arguments).ended_with(1);
    ended.says(&["error: step "]);
    assert!(bytes(&bench, "scene.checkpoint") == old);
}

/// A checkpoint from somebody else, which names this recording and this table of probes.
fn forged(bench: &Bench, recording: &str, probes: &str) {
    let path = bench.path("scene.checkpoint");
    let mut file = CheckpointFile::read(&path).unwrap();
    let mut settings: serde_json::Value = serde_json::from_slice(&file.notes["command line"]).unwrap();
    settings["recording"] = recording.into();
    settings["probes"] = probes.into();
    file.notes.insert("command line".into(), serde_json::to_vec(&settings).unwrap());
    let CheckpointFile { scene, simulation, run, notes } = &file;
    CheckpointContent { scene, simulation, run: run.as_ref(), notes }.write(&path).unwrap();
}

#[test]
fn a_checkpoint_from_a_stranger_changes_no_file_of_yours() {
    // Explicit steps: the checkpoint is that of the end, behind rows of the table.
    let explicit = PAIR.replace("implicit-midpoint", "velocity-verlet");
    let probe = format!("{explicit}[[probe]]\nname = \"end\"\nbody = \"pair\"\nvertex = 1\n");
    let bench = whole(&probe, &["--probes", "table.csv"]);
    let elsewhere = tempfile::TempDir::new().unwrap();
    let precious = elsewhere.path().join("precious.csv");
    let mine = bytes(&bench, "table.csv").repeat(3);
    std::fs::write(&precious, &mine).unwrap();
    let absolute = precious.to_str().unwrap();
    let climbing = format!("../{}/precious.csv", elsewhere.path().file_name().unwrap().to_str().unwrap());
    let further = ["resume", "scene.checkpoint", "--until", "0.08"];
    let before = (bytes(&bench, "scene.mcap"), bytes(&bench, "table.csv"));
    for path in [absolute, &climbing] {
        forged(&bench, "scene.mcap", path);
        bench.pliant(further).ended_with(2).says(&["not next to it", "`--probes "]);
        forged(&bench, path, "table.csv");
        bench.pliant(further).ended_with(2).says(&["not next to it", "`-o "]);
    }
    // A file beside it that is no table, one of other times, one of other probes, one without rows.
    let table = String::from_utf8(before.1.clone()).unwrap();
    let other_time = table.replace("\n0.0", "\n9.0");
    let (notes, titles) = ("a line\n".repeat(200), table.lines().next().unwrap());
    for text in [&notes[..], &other_time, &table.replace("end.x", "tip.x"), &format!("{titles}\n{notes}")] {
        std::fs::write(bench.path("notes.csv"), text).unwrap();
        forged(&bench, "scene.mcap", "notes.csv");
        bench.pliant(further).ended_with(2).says(&["notes.csv is not the table of this run"]);
        assert_eq!(std::fs::read_to_string(bench.path("notes.csv")).unwrap(), text);
        let said = [&further[..], &["--probes", "notes.csv"]].concat();
        bench.pliant(said).ended_with(2).says(&["notes.csv is not the table of this run"]);
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&precious, bench.path("link.csv")).unwrap();
        forged(&bench, "scene.mcap", "link.csv");
        bench.pliant(further).ended_with(2).says(&["link.csv is a link", "--probes link.csv"]);
        // What the program writes on its way.
        for name in ["scene.checkpoint.new", "scene.mcap.part", "scene.mcap.part.tail"] {
            std::os::unix::fs::symlink(&precious, bench.path(name)).unwrap();
        }
    }
    assert_eq!(std::fs::read(&precious).unwrap(), mine);
    assert!(before == (bytes(&bench, "scene.mcap"), bytes(&bench, "table.csv")));
    // The table is where the command line says it is.
    std::fs::rename(bench.path("table.csv"), elsewhere.path().join("table.csv")).unwrap();
    let moved = elsewhere.path().join("table.csv");
    forged(&bench, "scene.mcap", moved.to_str().unwrap());
    let said = [&further[..], &["--probes", moved.to_str().unwrap()]].concat();
    bench.pliant(said).succeeded();
    let expected = whole(&probe, &["--until", "0.08", "--probes", "table.csv"]);
    assert!(std::fs::read(&moved).unwrap() == bytes(&expected, "table.csv"));
    assert!(bytes(&bench, "scene.mcap") == bytes(&expected, "scene.mcap"));
    assert_eq!(std::fs::read(&precious).unwrap(), mine);
}

#[test]
fn the_frames_before_must_be_there() {
    let bench = whole(PAIR, &[]);
    let further = ["resume", "scene.checkpoint", "--until", "0.08"];
    let recording = bytes(&bench, "scene.mcap");
    std::fs::remove_file(bench.path("scene.mcap")).unwrap();
    bench.pliant(further).ended_with(2).says(&["scene.mcap is not there", "--no-record"]);
    bench.pliant(["scene.toml", "--until", "0.02"]).succeeded();
    bench.pliant(further).ended_with(2).says(&["scene.mcap was recorded with another scene"]);
    assert_eq!(bench.files(), ["scene.checkpoint", "scene.mcap"]);
    std::fs::write(bench.path("scene.mcap"), recording).unwrap();
    bench.pliant(further).succeeded();
}

/// The checkpoint holds the scene; meshes it does not hold, and refuses others.
#[test]
fn a_changed_scene_is_noted_and_a_changed_mesh_refused() {
    let scene = PAIR.replace(
        "strand = { segments = 1, start = [0.0, 0.0], end = [1.0, 0.0] }",
        "file = { path = \"plate.obj\" }",
    );
    let bench = Bench::new(&scene);
    let plate = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::fs::write(bench.path("plate.obj"), plate).unwrap();
    bench.pliant(with(&["scene.toml"], &[])).succeeded();
    std::fs::write(bench.path("plate.obj"), plate.replace("v 1 0 0", "v 3 0 0")).unwrap();
    let further = ["resume", "scene.checkpoint", "--until", "0.06"];
    bench.pliant(further).ended_with(2).says(&["plate.obj has changed since"]);
    std::fs::write(bench.path("plate.obj"), plate).unwrap();
    std::fs::write(bench.path("scene.toml"), scene.replace("100.0", "200.0")).unwrap();
    let ended = bench.pliant(further).succeeded();
    ended.says(&["scene.toml has changed since; the run goes on with the scene that it began with"]);
}
