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
  { name = 'head', half_space = { normal = [0, -1], offset = -1 }, motion = { displacement = ['0', '-0.3 * \
  t * (2 - t)'] } },
]
";

#[test]
fn steps_in_parts_are_counted_in_the_report_the_document_and_the_file() {
    let bench = Bench::new(PRESSED);
    let ended = bench.pliant(["scene.toml"]).succeeded();
    ended.prints(&[
        "done: 3 frames, 2 steps",
        "retries   1 step subdivided into 2 parts, the smallest 1/2 of a step",
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
    ended.prints(&["a failed step is halved repeatedly, down to 125 ms"]);
    let ended = bench.pliant(["check", "scene.toml", "--set", "time.solver.retries=0"]).succeeded();
    ended.prints(&["step subdivision: `retries` in [time] solver is 0"]);
    let ended = bench.pliant(["scene.toml", "--force", "--set", "time.solver.retries=0"]);
    assert!(ended.stderr.contains("`retries` in [time] solver"), "{}", ended.stderr);
}

#[test]
fn increments_are_counted_in_the_report_the_document_and_the_file() {
    let own =
        PRESSED.replace("step = 1.0", "adaptive = { first = 1.0 }").replace(", solver = { retries = 3 }", "");
    let bench = Bench::new(&own);
    let ended = bench.pliant(["check", "scene.toml"]).succeeded();
    ended.prints(&["automatic increments, the first 1 s, down to 2 us"]);
    let ended = bench.pliant(["scene.toml"]).succeeded();
    ended.prints(&["increments solved, 1 try cut back; the smallest 250 ms, the largest"]);
    let json = bench.pliant(["scene.toml", "--json", "--force"]).succeeded().json();
    let increments = &json["summary"]["increments"];
    assert_eq!((increments["cut_back"].as_u64(), increments["least"].as_f64()), (Some(1), Some(0.25)));
    assert_eq!(increments["accepted"], json["summary"]["steps"]);
    let bytes = std::fs::read(bench.path("scene.mcap")).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let last = messages.filter(|message| message.channel.topic == "/energy").last().unwrap();
    let row: serde_json::Value = serde_json::from_slice(&last.data).unwrap();
    assert_eq!(&row["work"]["increments"], increments);
    let ended = bench.pliant(["scene.toml", "--force", "--set", "time.adaptive.smallest=1.0"]);
    for part in ["increment 1 (t = 0 s) failed", "`arc_length` in [time]"] {
        assert!(ended.stderr.contains(part), "{}", ended.stderr);
    }
}

#[test]
fn paths_are_in_the_report_the_document_the_table_and_the_file() {
    let scene = include_str!("../../scenes/snap_through_2d.toml");
    let bench = Bench::new(&scene.replace("until = [3.0]", "until = [2.0]"));
    let ended = bench.pliant(["scene.toml", "--probes", "table.csv"]).succeeded();
    ended.prints(&[
        "path      to the load factor 2, ",
        "limit     load factor at most 0.99",
        "at least -0.99",
    ]);
    let table = std::fs::read_to_string(bench.path("table.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0][..3], ["time [s]", "load_factor [1]", "ridge.x [m]"]);
    assert_eq!((rows[1][1], rows.last().unwrap()[1]), ("0.0", "2.0"));
    let fell = rows[1..].windows(2).any(|pair| {
        let number = |row: &[&str], column: usize| row[column].parse::<f64>().unwrap();
        assert!(number(&pair[1], 0) > number(&pair[0], 0), "time goes on");
        number(&pair[1], 1) < number(&pair[0], 1)
    });
    assert!(fell, "the load factor falls on the way");
    let json = bench.pliant(["scene.toml", "--json", "--force"]).succeeded().json();
    let path = &json["summary"]["path"];
    assert_eq!((path["load_factor"].as_f64(), path["has_ended"].as_bool()), (Some(2.0), Some(true)));
    assert_eq!(path["limit_points"].as_array().unwrap().len(), 2);
    let bytes = std::fs::read(bench.path("scene.mcap")).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let last = messages.filter(|message| message.channel.topic == "/energy").last().unwrap();
    let row: serde_json::Value = serde_json::from_slice(&last.data).unwrap();
    assert_eq!(row["load_factor"], 2.0);
}

#[test]
fn quiet_is_silent() {
    let ended = Bench::new(SPRING).pliant(["scene.toml", "-q", "--set", "time.step=0.001"]).succeeded();
    assert_eq!((ended.stdout.as_str(), ended.stderr.as_str()), ("", ""));
}

#[test]
fn verbose_shows_the_problem_first() {
    Bench::new(SPRING).pliant(["scene.toml", "-v"]).succeeded().says(&["inactive", "2 vertices"]);
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
    // A close encounter with a fixed step: the planet is thrown out, and the run must say that something is
    // wrong.
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
    // What drag takes is known, and is no error; where it is not asked for, it excuses a loss, but no gain.
    let changed = |changes: &[&str]| {
        let sets = changes.iter().flat_map(|change| ["--set", *change]);
        bench.pliant(["scene.toml", "--force"].into_iter().chain(sets)).succeeded()
    };
    for (changes, warned) in [
        (&["time.step=1e-5", "world.ether_drag=0"][..], false),
        (&["time.step=1e-5", "world.ether_drag=0.001"], false),
        (&["time.step=0.02", "world.ether_drag=0.1"], true),
        (&["time.step=0.02", "world.ether_drag=0.1", "output.channels=['state']"], true),
        (&["time.step=1e-5", "world.ether_drag=0.1", "output.channels=['state']"], false),
    ] {
        let ended = changed(changes);
        assert_eq!(!ended.stderr.is_empty(), warned, "{changes:?}: {}", ended.stderr);
        assert_eq!(!logged(&bench.path("scene.mcap")).is_empty(), warned, "{changes:?}");
    }
}

/// A block pushed by a pressure that grows from nothing: at rest at the start, with more energy in every
/// increment.
const PUSHED: &str = "dimension = 2
time = { integrator = 'quasi-static', step = 0.1, duration = 1.0 }
[[body]]
name = 'block'
mesh = { grid = { cells = [4, 2], size = [2.0, 0.8] } }
elastic = { neo-hookean = { young = 2e5, poisson = 0.35 } }
mass = { density = 900.0 }
pin = [{ half_space = { normal = [1, 0], offset = 0.0 } }]
load = [{ half_space = { normal = [0, -1], offset = -0.8 }, pressure = '2000*t' }]
";

/// In statics the pressure is carried by the pin alone: as a force of 2000 Pa on 2 m, nearly down while the
/// block has hardly turned.
#[test]
fn a_quasi_static_run_ends_with_what_statics_is_about() {
    let bench = Bench::new(PUSHED);
    let ended = bench.pliant(["scene.toml", "--no-record"]).succeeded();
    let ended = ended.prints(&["displaced", "von Mises", "reactions", "residual", "work"]);
    for unsaid in ["drift", "momentum", "relative to"] {
        assert!(!ended.stdout.contains(unsaid), "{unsaid:?} in:\n{}", ended.stdout);
    }
    assert_eq!(ended.stderr, "");
    let json = bench.pliant(["scene.toml", "--no-record", "--json"]).succeeded().json();
    let summary = &json["summary"];
    for none in ["relative_energy_drift", "relative_energy_error", "momentum_change", "energy_scale"] {
        assert!(summary[none].is_null(), "{none}: {summary:#}");
    }
    let statics = &summary["statics"];
    assert_eq!(statics["displacement"]["body"], "block");
    assert_eq!(statics["reactions"], summary["reactions"][0]["force"], "there is one pin");
    // Of 2000 Pa on a surface of 2 m that has turned a little.
    let up = statics["reactions"][1].as_f64().unwrap();
    assert!(up > 3000.0 && up < 4400.0, "{statics}");
    assert!(statics["residual"].as_f64().unwrap() < 1e-3, "{statics}");
    assert!(statics["von_mises"]["value"].as_f64().unwrap() > 2000.0, "{statics}");
}

/// In a point all of its elements are without volume: a stationary state of stable neo-hookean solids in 3D.
#[test]
fn elements_that_are_inverted_at_the_end_are_warned_of() {
    let collapsed = "dimension = 3
time = { integrator = 'quasi-static', step = 1.0, duration = 1.0 }
[[body]]
mesh = { grid = { cells = [2, 2, 2], size = [1, 1, 1] } }
elastic = { stable-neo-hookean = { young = 1e4, poisson = 0.3 } }
mass = { density = 10.0 }
pin = [{ vertices = [0] }]
position = { affine = { matrix = [[0, 0, 0], [0, 0, 0], [0, 0, 0]] } }
";
    let bench = Bench::new(collapsed);
    let ended = bench.pliant(["scene.toml", "--no-record"]).succeeded();
    ended
        .prints(&["48 at the end"])
        .says(&["warning: 48 of 48 elements are inverted at the end or without volume"]);
    let json = bench.pliant(["scene.toml", "--json"]).succeeded().json();
    assert_eq!(json["summary"]["end"]["inverted"], 48);
    assert!(logged(&bench.path("scene.mcap")).iter().any(|message| message.contains("48 of 48 elements")));
}

/// A beam that moves by about a millimetre in each increment.
const HANGING_BEAM: &str = "dimension = 2
time = { integrator = 'quasi-static', step = 0.01, duration = 1.0, solver = { tolerance = TOLERANCE } }
world = { gravity = [0, '-9.81 * t'] }
[[body]]
mesh = { grid = { cells = [16, 2], size = [1.6, 0.2] } }
elastic = { stable-neo-hookean = { young = 2e6, poisson = 0.3 } }
mass = { density = 100.0 }
pin = [{ half_space = { normal = [1, 0], offset = 0 } }]
";

#[test]
fn a_tolerance_as_large_as_the_scene_is_refused_and_one_as_large_as_a_step_warned_of() {
    Bench::new(&HANGING_BEAM.replace("TOLERANCE", "'1 m'")).pliant(["scene.toml"]).ended_with(2).says(&[
        "would stop at updates of 1 m",
        "in a scene of 1.612 m",
        "give 2e-6 or less",
    ]);
    let warned = |tolerance: &str| {
        let bench = Bench::new(&HANGING_BEAM.replace("TOLERANCE", tolerance));
        bench.pliant(["scene.toml", "--no-record"]).succeeded().stderr
    };
    let text = warned("'16 mm'");
    assert!(
        text.contains("a `tolerance` of 0.016 m is too large") && text.contains("1.612e-6 m or less"),
        "{text}"
    );
    let text = warned("'1.6 um'");
    assert!(!text.contains("tolerance"), "{text}");
}

/// A motion by steps; and one that is not where it starts.
#[test]
fn a_motion_that_jumps_is_refused_at_the_start_and_warned_of_later() {
    let scene = |motion: &str| {
        format!(
            "{SPRING}\n[[body]]\nname = 'driven'\nmesh = {{ strand = {{ segments = 1, start = [0.0, 1.0], \
             end = [1.0, 1.0] }} }}\n\
                 springs = {{ stiffness = 100.0 }}\nmass = {{ per_vertex = 1.0 }}\n\
                 pin = [{{ name = 'end', vertices = [0], motion = {{ {motion} }} }}]\n"
        )
    };
    for (motion, key, help) in [
        ("displacement = ['0.05 + t', 0]", "displacement", "subtract from each formula"),
        ("displacement = ['0.1 * cos(t)', 0]", "displacement", "smoothstep(0, 1, t)"),
        ("rotation = { point = [1, 0], angle = '0.5 + t' }", "rotation", "subtract 0.5 from `angle`"),
        (
            "keyframes = { times = [0.2, 1], displacements = [[0.1, 0], [0, 0]] }",
            "keyframes",
            "the displacement 0",
        ),
    ] {
        let ended = Bench::new(&scene(motion)).pliant(["scene.toml"]).ended_with(2);
        ended.says(&["pin `end` would jump by", "before the first step", key, help]);
    }
    let bench = Bench::new(&scene("displacement = ['0.05 * step(0.5, t) + 0.01 * (t > 0.7)', 0]"));
    let ended = bench.pliant(["scene.toml"]).succeeded();
    ended.says(&[
        "the motion of pin `driven/end` jumps by 0.05 m at t = 0.5 s, the first of 2 jumps",
        "smoothstep",
    ]);
    let json = bench.pliant(["scene.toml", "--json", "--force"]).succeeded().json();
    assert_eq!(json["summary"]["motion_jumps"]["count"], 2);
    // Two jumps of a spring of 100 N/m that a mass of 1 kg hardly follows in a step: their energy is known to
    // the order of the step.
    assert!(json["summary"]["relative_energy_drift"].as_f64().unwrap() < 0.05, "{json:#}");
    Bench::new(&scene("displacement = ['0.05 * smoothstep(0, 1, t)', 0]")).pliant(["scene.toml"]).succeeded();
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
        bench.pliant(["scene.toml", "--probes", table, "--force"]).ended_with(2).says(&[
            table,
            "is the recording",
            "choose another file",
        ]);
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

/// A block on a floor, by a scheme that solves its steps.
const ON_A_FLOOR: &str = "dimension = 2
time = { integrator = 'implicit-euler', step = 0.01, duration = 0.02 }
world = { gravity = [0, -10], walls = [{ normal = [0, 1], offset = 0 }] }
[[body]]
mesh = { grid = { cells = [2, 2], size = [1, 1] } }
elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }
mass = { density = 1000.0 }
";

#[test]
fn walls_that_steps_are_solved_without_are_said() {
    let behind = ["--set", "world.walls.0.offset=0.1"];
    let cases: [(&[&str], &str); 2] = [
        (&[], "`gauss2` solves a step as if there were no walls"),
        (&behind, "3 vertices start behind a wall, vertex 0 by 0.1 m behind wall 0"),
    ];
    for (changes, said) in cases {
        let warning = format!("warning: {said}");
        let bench = Bench::new(&ON_A_FLOOR.replace("implicit-euler", "gauss2"));
        let arguments = |command: &'static str| [&[command, "scene.toml"][..], changes].concat();
        bench.pliant(arguments("check")).succeeded().says(&[&warning]);
        bench.pliant(arguments("run")).succeeded().says(&[&warning]);
        let messages = logged(&bench.path("scene.mcap"));
        assert!(messages.iter().any(|message| message.contains(said)), "{messages:?}");
        let json = bench.pliant([&arguments("check")[..], &["--json"]].concat()).succeeded().json();
        let warnings = json["report"]["warnings"].as_array().unwrap();
        assert!(warnings.iter().any(|warning| warning.as_str().unwrap().starts_with(said)), "{warnings:?}");
    }
    // What holds contact solves for walls.
    let solved = Bench::new(ON_A_FLOOR);
    let checked = solved.pliant(["check", "scene.toml"]).succeeded();
    let checked = checked.prints(&["walls are compliant within", "body0-wall0: 100000 Pa"]);
    assert_eq!(checked.stderr, "");
    let run = solved.pliant(["run", "scene.toml"]).succeeded();
    run.prints(&["wall0: 0, ", "body0 came ", "behind wall0"]);
    let told = solved.pliant(["check", "scene.toml", behind[0], behind[1]]).ended_with(2);
    told.says(&["`body0` and `wall0` overlap by 0.1 m", "move the body out of the wall"]);
    let explicit = Bench::new(&ON_A_FLOOR.replace("implicit-euler", "velocity-verlet"));
    let checked = explicit.pliant(["check", "scene.toml", "--json", "--set", "time.step=1e-3"]).succeeded();
    assert_eq!(checked.json()["report"]["warnings"], serde_json::json!([]));
    assert_eq!(checked.stderr, "");
}

/// Forces that walls carry stand beside what they took: nothing from what lies still.
#[test]
fn a_run_ends_with_what_walls_carry_and_took() {
    let bench = Bench::new(
        "dimension = 3\ntime = { integrator = 'symplectic-euler', step = 0.01, duration = 10.0 }\n\
         world = { gravity = [0, 0, -10], walls = [{ normal = [0, 0, 1], offset = 0 }] }\n\
         [output]\nrate = 10.0\nchannels = ['energy', 'reactions']\n\
         [[body]]\nmesh = { inline = { points = [[0, 0, 0]] } }\nmass = { per_vertex = 1.0 }\n",
    );
    let ended = bench.pliant(["scene.toml"]).succeeded();
    let ended = ended.prints(&["wall0: 0, 0, 10 N", "losses", "0 J to walls", "drift 0,"]);
    assert_eq!(ended.stderr, "");
    let info = bench.info("scene.mcap");
    assert!(info["topics"].as_array().unwrap().iter().any(|topic| topic["topic"] == "/reactions"), "{info}");
}

/// A mass without size, as a scene.
#[test]
fn a_single_mass_falls() {
    let bench = Bench::new(
        "dimension = 3\ntime = { integrator = 'rk4', step = 1e-2, duration = 1.0 }\nworld = { gravity = [0, \
         0, -9.81] }\n\
         [[body]]\nmesh = { inline = { points = [[0.1, 0, 2]] } }\nmass = { per_vertex = 1.0 }\n",
    );
    // Compared with `m g` over the 2 m to the origin.
    bench.pliant(["scene.toml"]).succeeded().prints(&["relative to 19.62 J"]);
}

/// A beam that falls, with a probe at its end.
const BEAM: &str = "dimension = 2
time = { integrator = 'velocity-verlet', step = 0.0015625, duration = 1.0 }
world = { gravity = [0.0, -9.81] }
[[body]]
name = 'beam'
mesh = { grid = { cells = [32, 8], size = [4.0, 1.0] } }
elastic = { neo-hookean = { young = 1e6, poisson = 0.3 } }
mass = { density = 1000.0 }
pin = [{ name = 'left', half_space = { normal = [1.0, 0.0], offset = 0.0 } }]
[[probe]]
name = 'tip'
at = [4.0, 0.5]
";

#[test]
fn errors_of_a_run_are_split_by_mesh_step_and_solver() {
    let bench = Bench::new(BEAM);
    let ended = bench.pliant(["scene.toml", "--errors"]).succeeded();
    ended.prints(&[
        "tip.x ",
        "tip.y ",
        "extrapolated",
        "mesh ",
        "8x2, 16x4, 32x8 cells",
        "4 runs in addition to yours",
    ]);
    // The recording is that of the run itself.
    let with = std::fs::read(bench.path("scene.mcap")).unwrap();
    bench.pliant(["scene.toml", "-o", "alone.mcap"]).succeeded();
    assert!(with == std::fs::read(bench.path("alone.mcap")).unwrap());
    let ended = bench.pliant(["scene.toml", "--force", "--json", "--errors=tip.y max,left.force.y mean"]);
    let json = ended.succeeded().json();
    let quantities = json["errors"]["quantities"].as_array().unwrap();
    let names: Vec<&str> = quantities.iter().map(|of| of["quantity"].as_str().unwrap()).collect();
    assert_eq!(names, ["tip.y max", "left.force.y mean"]);
    assert!(quantities.iter().all(|of| of["parts"].as_array().unwrap().len() == 3));
    assert_eq!(quantities[1]["unit"], "N");
}

#[test]
fn errors_of_what_is_not_there_are_refused() {
    let bench = Bench::new(BEAM);
    for (quantity, expected) in [
        ("toe.y", "the scene has no `toe.y`"),
        ("left.force.z", "the scene has no `left.force.z`"),
        ("tip", "`tip` is no quantity"),
        ("tip.y often", "`tip.y often` is no quantity"),
    ] {
        let ended = bench.pliant(["scene.toml", "--no-record", &format!("--errors={quantity}")]);
        ended.ended_with(2).says(&[expected]);
    }
}
