//! `pliant new`: a commented scene to begin with.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::render::{refuse_existing, write};
use crate::arguments::NewArguments;
use crate::failure::{ExitStatus, Failure};
use crate::terminal::Terminal;

/// A scene to begin with.
struct SceneKind {
    name: &'static str,
    text: &'static str,
}

/// Kinds of scenes: one file and one line here for each.
const KINDS: &[SceneKind] = &[
    SceneKind { name: "jelly", text: include_str!("new/jelly.toml") },
    SceneKind { name: "cloth", text: include_str!("new/cloth.toml") },
    SceneKind { name: "beam", text: include_str!("new/beam.toml") },
    SceneKind { name: "galaxy", text: include_str!("new/galaxy.toml") },
    SceneKind { name: "static", text: include_str!("new/static.toml") },
    SceneKind { name: "gripper", text: include_str!("new/gripper.toml") },
];

impl SceneKind {
    /// The first sentence of its comment.
    fn summary(&self) -> String {
        let comment = self.text.lines().map_while(|line| line.strip_prefix("# "));
        comment.take_while(|line| !line.starts_with("What one should see")).collect::<Vec<_>>().join(" ")
    }
}

pub(crate) fn execute(arguments: &NewArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let Some(name) = arguments.name.as_deref().filter(|_| !arguments.list) else { return list(terminal) };
    let kind = kind(&arguments.kind)?;
    let file = file(name)?;
    refuse_existing(&file, arguments.force)?;
    write(&file, kind.text.as_bytes())?;
    let shown = file.display();
    terminal.report(&format!("wrote {shown}\n  run it, and look at it   pliant run {shown} --view"))?;
    terminal.report(&format!("  touch it while it runs   pliant live {shown}"))?;
    terminal.document(&json!({ "status": ExitStatus::Done, "new": { "file": file, "kind": kind.name } }))?;
    Ok(ExitStatus::Done)
}

fn list(terminal: Terminal) -> Result<ExitStatus, Failure> {
    for kind in KINDS {
        terminal.report(&format!("{:8} {}", kind.name, kind.summary()))?;
    }
    let kinds = KINDS.iter().map(|kind| json!({ "kind": kind.name, "summary": kind.summary() }));
    terminal.document(&json!({ "status": ExitStatus::Done, "kinds": kinds.collect::<Vec<_>>() }))?;
    Ok(ExitStatus::Done)
}

fn kind(name: &str) -> Result<&'static SceneKind, Failure> {
    KINDS.iter().find(|kind| kind.name == name).ok_or_else(|| {
        let names: Vec<&str> = KINDS.iter().map(|kind| kind.name).collect();
        Failure::usage(format!("`{name}` is no kind of scene to begin with; there are {}", names.join(", ")))
    })
}

/// `NAME.toml` for `NAME`.
fn file(name: &Path) -> Result<PathBuf, Failure> {
    match name.extension() {
        _ if name.file_name().is_none() => {
            Err(Failure::usage(format!("{} is no name of a file; name one, e.g. `jelly`", name.display())))
        }
        Some(ending) if ending == "toml" => Ok(name.to_owned()),
        _ => {
            let mut file = name.as_os_str().to_owned();
            file.push(".toml");
            Ok(file.into())
        }
    }
}
