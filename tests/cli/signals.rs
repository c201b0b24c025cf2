//! Runs that are stopped: asked to, and killed.
#![cfg(unix)]

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::{Bench, Ended, SPRING};

/// A run in the background. It does not outlive its test.
struct Running(Option<Child>);

impl Running {
    /// Starts a run that would take many minutes, and waits until it has recorded some frames.
    fn start(bench: &Bench, arguments: &[&str]) -> Running {
        let mut command = Command::new(super::PLIANT);
        command.arg("scene.toml").args(arguments).current_dir(bench.directory.path());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let running = Running(Some(command.spawn().unwrap()));
        let deadline = Instant::now() + Duration::from_secs(30);
        loop {
            let info = bench.pliant(["info", "scene.mcap.part", "--json"]);
            if info.code == Some(0) && info.json()["info"]["frames"].as_u64().unwrap() >= 5 {
                return running;
            }
            assert!(Instant::now() < deadline, "no frames after 30 s");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    fn signal(&self, name: &str) {
        let id = self.0.as_ref().unwrap().id().to_string();
        assert!(Command::new("kill").args([&format!("-{name}"), &id]).status().unwrap().success());
    }

    fn wait(mut self) -> Ended {
        self.0.take().unwrap().wait_with_output().unwrap().into()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn long_scene() -> Bench {
    Bench::new(&SPRING.replace("step = 0.002", "step = 1e-3").replace("duration = 1.0", "duration = 1e5"))
}

#[test]
fn a_run_that_is_asked_to_stop_finishes_its_file() {
    for name in ["INT", "TERM"] {
        let bench = long_scene();
        let run = Running::start(&bench, &[]);
        run.signal(name);
        let ended = run.wait().ended_with(130).prints(&["ended early", "rerun scene.mcap"]);
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
    let run = Running::start(&bench, &["--json"]);
    run.signal("INT");
    let json = run.wait().ended_with(130).json();
    assert_eq!((json["status"].as_str(), json["file"].as_str()), (Some("interrupted"), Some("scene.mcap")));
    assert!(json["summary"]["frames"].as_u64() < json["summary"]["planned_frames"].as_u64());
}

#[test]
fn what_a_killed_run_leaves_can_be_recovered() {
    let bench = long_scene();
    let run = Running::start(&bench, &[]);
    bench.pliant(["recover", "scene.mcap.part"]).ended_with(2).says(&["written by another process"]);
    bench.pliant(["scene.toml", "--force"]).ended_with(2).says(&["written by another process"]);
    let before = bench.info("scene.mcap.part")["frames"].as_u64().unwrap();
    run.signal("KILL");
    assert_eq!(run.wait().code, None);
    assert_eq!(bench.info("scene.mcap.part")["state"], "unfinished");
    bench.pliant(["scene.toml"]).ended_with(2).says(&["pliant recover scene.mcap.part"]);
    bench.pliant(["recover", "scene.mcap"]).ended_with(2).says(&["scene.mcap.part"]);
    for command in ["info", "plot"] {
        let part = "scene.mcap.part is there";
        bench.pliant([command, "scene.mcap"]).ended_with(2).says(&[part, "pliant recover scene.mcap.part"]);
        let ended = bench.pliant([command, "other.mcap"]).ended_with(2);
        assert!(!ended.stderr.contains(".part"), "{}", ended.stderr);
    }

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

/// Two hundred modes of a block, which take seconds at least.
#[test]
fn modes_that_are_asked_to_stop_end_with_130() {
    let scene = "dimension = 3\ntime = { integrator = 'velocity-verlet', step = 1e-6, duration = 1.0 \
                 }\n[[body]]\n\
                 mesh = { grid = { cells = [24, 6, 6], spacing = 0.1 } }\nelastic = { linear = { preset = \
                 'steel' } }\n\
                 mass = { preset = 'steel' }\n";
    let bench = Bench::new(scene);
    let mut command = Command::new(super::PLIANT);
    command.args(["modes", "scene.toml", "--count", "200", "-v"]).current_dir(bench.directory.path());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let running = Running(Some(command.spawn().unwrap()));
    let id = running.0.as_ref().unwrap().id();
    // Signals are caught once its mask of caught ones says so.
    let catches = || {
        let status = std::fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).map(str::trim);
        mask.and_then(|mask| u64::from_str_radix(mask, 16).ok()).is_some_and(|mask| mask >> 14 & 1 == 1)
    };
    let deadline = Instant::now() + Duration::from_secs(120);
    while !catches() {
        assert!(Instant::now() < deadline, "no handler after two minutes");
        std::thread::sleep(Duration::from_millis(5));
    }
    running.signal("TERM");
    running.wait().ended_with(130).says(&["interrupted: no modes were found yet"]);
}
