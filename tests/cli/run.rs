//! Runs that end well, and what may be written where.

use super::{Bench, SPRING, logged};

#[test]
fn a_run_leaves_a_file_and_says_how_to_open_it() {
    let bench = Bench::new(SPRING);
    let ended = bench.pliant(["run", "scene.toml"]).succeeded();
    let ended =
        ended.prints(&["done: 11 frames, 500 steps", "energy", "momentum", "scene.mcap", "rerun scene.mcap"]);
    assert_eq!(ended.stderr, "", "no terminal, no progress");
    assert_eq!(bench.files(), ["scene.mcap"]);
    let info = bench.info("scene.mcap");
    assert_eq!((info["state"].as_str(), info["frames"].as_u64()), (Some("complete"), Some(11)));
    assert_eq!(info["outcome"]["status"], "completed");
}

#[test]
fn run_is_the_default_command() {
    let bench = Bench::new(SPRING);
    bench.pliant(["run", "scene.toml", "-o", "long.mcap", "--until", "0.5"]).succeeded();
    bench.pliant(["scene.toml", "--until", "0.5", "-o", "short.mcap"]).succeeded();
    let [long, short] = ["long.mcap", "short.mcap"].map(|name| std::fs::read(bench.path(name)).unwrap());
    assert!(long == short, "the same scene gives the same bytes");
    assert_eq!(bench.info("short.mcap")["frames"], 6);
}

#[test]
fn the_file_keeps_the_scene_that_was_run() {
    let bench = Bench::new(SPRING);
    bench.pliant(["scene.toml", "--until", "0.5", "--set", "time.step=0.004"]).succeeded();
    let bytes = std::fs::read(bench.path("scene.mcap")).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let index = summary.attachment_indexes.iter().find(|index| index.name == "scene.toml").unwrap();
    let scene = mcap::read::attachment(&bytes, index).unwrap();
    let scene = std::str::from_utf8(&scene.data).unwrap();
    assert!(scene.contains("step = 0.004") && scene.contains("duration = 0.5"), "{scene}");
}

#[test]
fn json_is_one_document_with_everything() {
    let bench = Bench::new(SPRING);
    let ended = bench.pliant(["scene.toml", "--json"]).succeeded();
    let json = ended.json();
    assert_eq!((json["status"].as_str(), json["file"].as_str()), (Some("done"), Some("scene.mcap")));
    let summary = &json["summary"];
    assert_eq!((summary["frames"].as_u64(), summary["steps"].as_u64()), (Some(11), Some(500)));
    assert_eq!(summary["planned_frames"], 11);
    assert!(summary["relative_energy_error"].as_f64().unwrap() < 1e-3);
    assert!(summary["steps_per_second"].as_f64().unwrap() > 0.0);
    assert_eq!(json["bytes"].as_u64().unwrap(), bench.path("scene.mcap").metadata().unwrap().len());
}

/// Two plates that meet rows of elements, in one step.
const PRESSED: &str = "dimension = 2
time = { integrator = 'quasi-static', step = 1.0, duration = 2.0, solver = { retries = 3 } }
output = { rate = 1.0 }
[[body]]
mesh = { grid = { cells = [2, 4], size = [1, 1] } }
elastic = { neo-hookean = { young = 1e4, poisson = 0.3 } }
mass = { density = 10.0 }
pin = [
  { name = 'foot', half_space = { normal = [0, 1], offset = 0 } },
  { name = 'head', half_space = { normal = [0, -1], offset = -1 }, motion = { displacement = ['0', '-0.3 * t * (2 - t)'] } },
]
";

#[test]
fn steps_in_parts_are_counted_in_the_report_the_document_and_the_file() {
    let bench = Bench::new(PRESSED);
    let ended = bench.pliant(["scene.toml"]).succeeded();
    ended.prints(&[
        "done: 3 frames, 2 steps",
        "retries   1 step not solved at once, taken in 2 parts, the smallest 1/2 of a step",
    ]);
    let json = bench.pliant(["scene.toml", "--json", "--force"]).succeeded().json();
    let expected = serde_json::json!({ "steps": 1, "parts": 2, "halvings": 1 });
    assert_eq!(json["summary"]["retried"], expected);
    let bytes = std::fs::read(bench.path("scene.mcap")).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let last = messages.filter(|message| message.channel.topic == "/energy").last().unwrap();
    let row: serde_json::Value = serde_json::from_slice(&last.data).unwrap();
    assert_eq!(row["work"]["retried"], expected);
    let ended = bench.pliant(["check", "scene.toml"]).succeeded();
    ended.prints(&["taken in parts, down to 1.250e-1 s"]);
    let ended = bench.pliant(["check", "scene.toml", "--set", "time.solver.retries=0"]).succeeded();
    ended.prints(&["steps in parts: one that is not solved ends the run"]);
    let ended = bench.pliant(["scene.toml", "--force", "--set", "time.solver.retries=0"]);
    assert!(ended.stderr.contains("`retries` in [time] solver"), "{}", ended.stderr);
}

#[test]
fn quiet_is_silent() {
    let ended = Bench::new(SPRING).pliant(["scene.toml", "-q", "--set", "time.step=0.001"]).succeeded();
    assert_eq!((ended.stdout.as_str(), ended.stderr.as_str()), ("", ""));
}

#[test]
fn verbose_shows_the_problem_first() {
    Bench::new(SPRING).pliant(["scene.toml", "-v"]).succeeded().says(&["left out", "2 vertices"]);
}

#[test]
fn nothing_is_recorded_if_nothing_shall_be() {
    let bench = Bench::new(SPRING);
    bench.pliant(["scene.toml", "--no-record"]).succeeded().prints(&["done: 11 frames"]);
    assert!(bench.files().is_empty());
}

#[test]
fn nothing_is_overwritten_unasked() {
    let bench = Bench::new(SPRING);
    std::fs::write(bench.path("scene.mcap"), "precious").unwrap();
    bench.pliant(["scene.toml"]).ended_with(2).says(&["scene.mcap exists", "-o", "--force"]);
    assert_eq!(std::fs::read(bench.path("scene.mcap")).unwrap(), b"precious");
    bench.pliant(["scene.toml", "--force"]).succeeded();
    assert_eq!(bench.info("scene.mcap")["frames"], 11);
    std::fs::write(bench.path("new.mcap.part"), "half a run").unwrap();
    bench.pliant(["scene.toml", "-o", "new.mcap"]).ended_with(2).says(&["left over", "pliant recover"]);
    bench.pliant(["scene.toml", "-o", "scene.toml", "--force"]).ended_with(2).says(&["is the scene"]);
    assert_eq!(std::fs::read_to_string(bench.path("scene.toml")).unwrap(), SPRING);
}

#[test]
fn outputs_that_cannot_be() {
    let bench = Bench::new(SPRING);
    std::fs::create_dir(bench.path("folder")).unwrap();
    bench.pliant(["scene.toml", "-o", "folder", "--force"]).ended_with(2).says(&["folder is a directory"]);
    bench.pliant(["scene.toml", "-o", "nowhere/a.mcap"]).ended_with(1).says(&["cannot write nowhere/a.mcap"]);
    #[cfg(unix)]
    bench.pliant(["scene.toml", "-o", "/dev/null", "--force"]).ended_with(2).says(&["no regular file"]);
}

/// Enough triangles for several patches and therefore several tasks.
const SHEET: &str = r#"
dimension = 2
[time]
integrator = "symplectic-euler"
step = 1e-4
duration = 0.002
[world]
gravity = [0.0, -9.8]
[[body]]
mesh = { grid = { cells = [48, 48], spacing = 0.1 } }
elastic = { stvk = { young = 1e6, poisson = 0.3 } }
mass = { density = 1000.0 }
velocity = { rigid = { angular = [3.0] } }
pin = [{ vertices = [0, 48] }]
[output]
rate = 1000.0
"#;

#[test]
fn threads_do_not_change_the_file() {
    let bench = Bench::new(SHEET);
    let files = ["1", "2", "3", "8"].map(|threads| {
        let name = format!("{threads}.mcap");
        bench.pliant(["scene.toml", "--threads", threads, "-o", &name]).succeeded();
        std::fs::read(bench.path(&name)).unwrap()
    });
    assert!(files.iter().all(|file| *file == files[0]), "{:?}", files.map(|file| file.len()));
}

#[test]
fn lost_energy_is_reported() {
    // A close encounter with a fixed step: the planet is thrown out, and the run must say that something is wrong.
    let kepler = r#"
dimension = 2
[time]
integrator = "velocity-verlet"
step = 0.02
duration = 10.0
[world]
nbody = { constant = 1.0 }
[[body]]
mesh = { inline = { points = [[0.0, 0.0], [1.9, 0.0]] } }
mass = { per_vertex = [1.0, 1e-9] }
velocity = { per_vertex = [[0.0, 0.0], [0.0, 0.16]] }
"#;
    let bench = Bench::new(kepler);
    bench.pliant(["scene.toml"]).succeeded().says(&["warning: the total energy was off", "smaller step"]);
    assert!(
        logged(&bench.path("scene.mcap")).iter().any(|message| message.contains("the total energy was off"))
    );
    let json = bench.pliant(["scene.toml", "--json", "--force"]).succeeded().json();
    assert_eq!(json["warnings"].as_array().unwrap().len(), 1);
    assert!(json["summary"]["relative_energy_error"].as_f64().unwrap() > 1e-3);
    // What drag takes is known, and is no error; where nobody asks for it, there is nothing to warn of.
    for (changes, warned) in [
        (["time.step=1e-5", "world.ether_drag=0"], false),
        (["time.step=1e-5", "world.ether_drag=0.001"], false),
        (["time.step=0.02", "world.ether_drag=0.1"], true),
        (["output.channels=['state']", "world.ether_drag=0.1"], false),
    ] {
        let [first, second] = changes;
        let ended = bench.pliant(["scene.toml", "--force", "--set", first, "--set", second]).succeeded();
        assert_eq!(!ended.stderr.is_empty(), warned, "{changes:?}: {}", ended.stderr);
        assert_eq!(!logged(&bench.path("scene.mcap")).is_empty(), warned, "{changes:?}");
    }
}

#[test]
#[cfg(unix)]
fn a_reader_that_has_had_enough_is_no_failure() {
    use std::process::{Command, Stdio};
    let bench = Bench::new(SPRING);
    for arguments in [&["list"][..], &["scene.toml"], &["schema"]] {
        let mut command = Command::new(super::PLIANT);
        command.args(arguments).current_dir(bench.directory.path());
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let ended: super::Ended = child.wait_with_output().unwrap().into();
        assert_eq!(ended.succeeded().stderr, "");
    }
}

#[test]
fn probes_are_written_as_a_table() {
    let bench = Bench::new(&format!("{SPRING}\n[[probe]]\nname = 'end'\nvertex = 1\n"));
    bench.pliant(["scene.toml", "--no-record", "--probes", "end.csv"]).succeeded();
    let text = std::fs::read_to_string(bench.path("end.csv")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 12, "{text}");
    assert!(
        lines[0].starts_with("time [s],end.x [m],end.y [m],") && lines[1].starts_with("0.0,1.1,0.0,"),
        "{text}"
    );
    bench
        .pliant(["scene.toml", "--no-record", "--probes", "end.csv"])
        .ended_with(2)
        .says(&["end.csv exists", "--force"]);
    bench.pliant(["scene.toml", "--no-record", "--probes", "end.csv", "--force"]).succeeded();
    bench
        .pliant(["scene.toml", "--no-record", "--probes", "scene.toml", "--force"])
        .ended_with(2)
        .says(&["is the scene"]);
    bench.pliant(["scene.toml", "-o", "a.mcap", "--probes", "a.mcap"]).ended_with(2).says(&["the recording"]);
    // However it is called, and while it has other names; by default it is scene.mcap.
    for table in ["scene.mcap", "./scene.mcap", "scene.mcap.part", "scene.mcap.part.tail"] {
        bench
            .pliant(["scene.toml", "--probes", table, "--force"])
            .ended_with(2)
            .says(&[table, "is the recording", "choose another file"]);
    }
    // What is in the way of the table is found before anything is written.
    assert_eq!(bench.files(), ["end.csv"]);
    Bench::new(SPRING)
        .pliant(["scene.toml", "--probes", "x.csv"])
        .ended_with(2)
        .says(&["the scene has no [[probe]]"]);
}

#[test]
#[cfg(unix)]
fn a_link_to_the_recording_takes_no_table() {
    let bench = Bench::new(&format!("{SPRING}\n[[probe]]\nname = 'end'\nvertex = 1\n"));
    let run = |table: &str| bench.pliant(["scene.toml", "--probes", table, "--force"]);
    // To one that is not there yet, to one that is, to the scene; a hard link, and a folder of another name.
    std::os::unix::fs::symlink("scene.mcap", bench.path("a.csv")).unwrap();
    run("a.csv").ended_with(2).says(&["a.csv is the recording, scene.mcap"]);
    assert_eq!(bench.files(), ["a.csv"], "nothing is left where the link leads");
    bench.pliant(["scene.toml"]).succeeded();
    let before = std::fs::read(bench.path("scene.mcap")).unwrap();
    std::fs::hard_link(bench.path("scene.mcap"), bench.path("b.csv")).unwrap();
    std::fs::hard_link(bench.path("scene.toml"), bench.path("c.csv")).unwrap();
    std::os::unix::fs::symlink(".", bench.path("d")).unwrap();
    for table in ["a.csv", "b.csv", "c.csv", "d/scene.mcap", "d/scene.toml"] {
        run(table).ended_with(2).says(&[table, "choose another file"]);
    }
    assert!(std::fs::read(bench.path("scene.mcap")).unwrap() == before);
    run("e.csv").succeeded();
}
