//! The program as a user meets it: arguments, exit codes, messages, files.

mod bench;
mod commands;
mod contact;
mod export;
mod failures;
mod fit;
mod live;
mod memory;
mod meshes;
mod modes;
mod new;
mod pictures;
mod reference;
mod resume;
mod run;
mod scenes;
mod signals;
mod stability;
mod stress;
mod study;
mod usage;
mod view;

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

/// Path of the program under test.
const PLIANT: &str = env!("CARGO_BIN_EXE_pliant");

/// Two masses on a spring, stretched by a tenth; the largest stable step is `2 / sqrt(200) = 0.1414`.
const SPRING: &str = r#"
dimension = 2
[time]
integrator = "velocity-verlet"
step = 0.002
duration = 1.0
[[body]]
name = "pair"
mesh = { strand = { segments = 1, start = [0.0, 0.0], end = [1.0, 0.0] } }
springs = { stiffness = 100.0 }
mass = { per_vertex = 1.0 }
position = { affine = { matrix = [[1.1, 0.0], [0.0, 1.0]] } }
[output]
rate = 10.0
"#;

/// A working directory with a scene in it.
struct Bench {
    directory: TempDir,
}

/// Outcome of a command.
struct Ended {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

impl Bench {
    /// With `text` as `scene.toml`.
    fn new(text: &str) -> Bench {
        let directory = TempDir::new().unwrap();
        std::fs::write(directory.path().join("scene.toml"), text).unwrap();
        Bench { directory }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// Runs the program here until it ends.
    fn pliant<S: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = S>) -> Ended {
        let mut command = assert_cmd::Command::new(PLIANT);
        command.current_dir(self.directory.path()).env_remove("NO_COLOR").args(arguments);
        command.timeout(Duration::from_secs(60)).output().unwrap().into()
    }

    /// The names of all files here but the scene, sorted.
    fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.directory.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.retain(|name| name != "scene.toml");
        names.sort();
        names
    }

    /// Output of `pliant info --json` for a file.
    fn info(&self, name: &str) -> Value {
        self.pliant(["info", name, "--json"]).succeeded().json()["info"].clone()
    }
}

impl Ended {
    #[track_caller]
    fn ended_with(self, code: i32) -> Ended {
        assert_eq!(self.code, Some(code), "stdout:\n{}\nstderr:\n{}", self.stdout, self.stderr);
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        self
    }

    #[track_caller]
    fn succeeded(self) -> Ended {
        self.ended_with(0)
    }

    /// Standard error holds each of these.
    #[track_caller]
    fn says(self, parts: &[&str]) -> Ended {
        for part in parts {
            assert!(self.stderr.contains(part), "no {part:?} in:\n{}", self.stderr);
        }
        self
    }

    /// Standard output holds each of these.
    #[track_caller]
    fn prints(self, parts: &[&str]) -> Ended {
        for part in parts {
            assert!(self.stdout.contains(part), "no {part:?} in:\n{}", self.stdout);
        }
        self
    }

    /// Standard output as the one JSON document that it must be.
    #[track_caller]
    fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}:\n{}", self.stdout))
    }
}

impl From<Output> for Ended {
    fn from(output: Output) -> Ended {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Ended { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }
}

/// The messages on `/log` of a recording.
fn logged(path: &Path) -> Vec<String> {
    let bytes = std::fs::read(path).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap();
    messages
        .map(|message| message.unwrap())
        .filter(|message| message.channel.topic == "/log")
        .map(|message| String::from_utf8_lossy(&message.data).into_owned())
        .collect()
}
