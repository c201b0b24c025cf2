//! Runs that cannot go on.

use super::{Bench, logged};

/// A tetrahedron that two steps turn inside out: its tip flies through its base.
const PIERCED: &str = r#"
dimension = 3
[time]
integrator = "symplectic-euler"
step = 1e-3
duration = 1.0
[[body]]
name = "tet"
mesh = { inline = { points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], tetrahedra = [[0, 1, 2, 3]] } }
elastic = { neo-hookean = { young = 1.0, poisson = 0.3 } }
mass = { per_vertex = 1.0 }
velocity = { per_vertex = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, -400.0]] }
[output]
rate = 1000.0
"#;

#[test]
fn a_step_that_cannot_be_taken_is_named() {
    let bench = Bench::new(PIERCED);
    let ended = bench.pliant(["scene.toml"]).ended_with(1);
    let ended = ended.says(&["error: step ", "element 0 of `tet` has J = -", "smaller step"]);
    ended
        .says(&["scene.mcap is complete up to t = ", "the last good frame"])
        .prints(&["ended early", "rerun"]);
    assert_eq!(bench.files(), ["scene.mcap"]);
    let info = bench.info("scene.mcap");
    assert_eq!(
        (info["state"].as_str(), info["outcome"]["status"].as_str()),
        (Some("complete"), Some("failed"))
    );
    assert!(info["frames"].as_u64().unwrap() >= 2, "{info}");
    assert!(info["outcome"]["message"].as_str().unwrap().contains("element 0 of `tet`"), "{info}");
    assert!(logged(&bench.path("scene.mcap")).iter().any(|message| message.contains("element 0 of `tet`")));
}

#[test]
fn a_failure_is_json_too() {
    let json = Bench::new(PIERCED).pliant(["scene.toml", "--json"]).ended_with(1).json();
    assert_eq!(json["status"], "failed");
    assert_eq!(json["problems"][0]["kind"], "not_finite");
    assert_eq!(json["file"], "scene.mcap");
    assert!(json["summary"]["time"].as_f64().unwrap() > 0.0, "{json}");
    // Of the element at rest it is 1: lanes that only fill up a pack must not show.
    assert_eq!(json["summary"]["start"]["min_j"], 1.0);
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_reported() {
    use std::process::{Command, Stdio};
    // A limit on the size of files stands for a full disk: the shell sets it, in blocks of 512 or 1024 bytes.
    let bench = Bench::new(
        &super::SPRING.replace("rate = 10.0", "rate = 100.0").replace("duration = 1.0", "duration = 100.0"),
    );
    let script = format!("ulimit -f 200; trap '' XFSZ; exec {} scene.toml", super::PLIANT);
    let mut command = Command::new("sh");
    command.args(["-c", &script]).current_dir(bench.directory.path()).stdin(Stdio::null());
    let ended: super::Ended = command.output().unwrap().into();
    ended.ended_with(1).says(&["cannot write scene.mcap.part", "pliant recover"]);
    bench.pliant(["recover", "scene.mcap.part"]).succeeded();
    assert!(bench.info("scene.mcap")["frames"].as_u64().unwrap() > 10);
}

#[test]
#[cfg(target_os = "linux")]
fn standard_output_that_takes_nothing_is_reported() {
    use std::process::Command;
    let bench = Bench::new(PIERCED);
    let script = format!("exec {} list > /dev/full", super::PLIANT);
    let output =
        Command::new("sh").args(["-c", &script]).current_dir(bench.directory.path()).output().unwrap();
    super::Ended::from(output).ended_with(1).says(&["cannot write to standard output"]);
}
