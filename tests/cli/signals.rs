//! Runs that are stopped: asked to, and killed.
#![cfg(unix)]

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::{Bench, Ended, SPRING};

/// Starts a run that would take many minutes, and waits until it has recorded some frames.
fn started(bench: &Bench, arguments: &[&str]) -> Child {
    let mut command = Command::new(super::PLIANT);
    command.arg("scene.toml").args(arguments).current_dir(bench.directory.path());
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let deadline = Instant::now() + Duration::from_secs(30);
    loop {
        let info = bench.pliant(["info", "scene.mcap.part", "--json"]);
        if info.code == Some(0) && info.json()["info"]["frames"].as_u64().unwrap() >= 5 {
            return child;
        }
        assert!(Instant::now() < deadline, "no frames after 30 s");
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn long_scene() -> Bench {
    Bench::new(&SPRING.replace("step = 0.002", "step = 1e-3").replace("duration = 1.0", "duration = 1e5"))
}

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status().unwrap();
    assert!(status.success());
}

fn ended(child: Child) -> Ended {
    child.wait_with_output().unwrap().into()
}

#[test]
fn a_run_that_is_asked_to_stop_finishes_its_file() {
    for name in ["INT", "TERM"] {
        let bench = long_scene();
        let child = started(&bench, &[]);
        signal(&child, name);
        let ended = ended(child).ended_with(130).prints(&["ended early", "rerun scene.mcap"]);
        ended.says(&["interrupted after ", " of 1000001 frames; scene.mcap is complete up to t = "]);
        assert_eq!(bench.files(), ["scene.mcap"]);
        let info = bench.info("scene.mcap");
        assert_eq!(
            (info["state"].as_str(), info["outcome"]["status"].as_str()),
            (Some("complete"), Some("interrupted"))
        );
        assert!(info["frames"].as_u64().unwrap() >= 5, "{info}");
    }
}

#[test]
fn an_interruption_is_json_too() {
    let bench = long_scene();
    let child = started(&bench, &["--json"]);
    signal(&child, "INT");
    let json = ended(child).ended_with(130).json();
    assert_eq!((json["status"].as_str(), json["file"].as_str()), (Some("interrupted"), Some("scene.mcap")));
    assert!(json["summary"]["frames"].as_u64() < json["summary"]["planned_frames"].as_u64());
}

#[test]
fn what_a_killed_run_leaves_can_be_recovered() {
    let bench = long_scene();
    let mut child = started(&bench, &[]);
    bench.pliant(["recover", "scene.mcap.part"]).ended_with(2).says(&["written by another process"]);
    bench.pliant(["scene.toml", "--force"]).ended_with(2).says(&["written by another process"]);
    let before = bench.info("scene.mcap.part")["frames"].as_u64().unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(bench.info("scene.mcap.part")["state"], "unfinished");
    bench.pliant(["scene.toml"]).ended_with(2).says(&["pliant recover scene.mcap.part"]);
    bench.pliant(["recover", "scene.mcap"]).ended_with(2).says(&["scene.mcap.part"]);

    let ended = bench.pliant(["recover", "scene.mcap.part"]).succeeded();
    ended.prints(&["recovered ", "scene.mcap", "scene.mcap.part is no longer needed"]);
    let info = bench.info("scene.mcap");
    assert_eq!(
        (info["state"].as_str(), info["outcome"]["status"].as_str()),
        (Some("complete"), Some("recovered"))
    );
    assert!(info["frames"].as_u64().unwrap() >= before, "{info}");

    bench.pliant(["recover", "scene.mcap.part"]).ended_with(2).says(&["scene.mcap exists"]);
    bench.pliant(["recover", "scene.mcap.part", "--force"]).succeeded();
    let json = bench.pliant(["recover", "scene.mcap.part", "-o", "other.mcap", "--json"]).succeeded().json();
    assert_eq!(json["recovered"]["path"], "other.mcap");
    assert!(
        std::fs::read(bench.path("other.mcap")).unwrap() == std::fs::read(bench.path("scene.mcap")).unwrap()
    );
}
