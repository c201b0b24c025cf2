//! `pliant info`: what a recording holds.

use pliant::element::{CELL_KINDS, CellKind};
use pliant_record::read::{self, FileInfo, FileState};
use pliant_record::{BodySummary, RecordedStatus};
use serde_json::json;

use crate::arguments::InfoArguments;
use crate::failure::{ExitStatus, Failure};
use crate::terminal::Terminal;
use crate::text::{bytes, count, counted, entry, number, table};

pub(crate) fn execute(arguments: &InfoArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    Failure::unless_file(&arguments.file)?;
    let info = read::info(&arguments.file).map_err(|error| Failure::recording(&error))?;
    if !terminal.json {
        terminal.print(&describe(&info, terminal.width()))?;
    }
    terminal.document(&json!({ "status": ExitStatus::Done, "info": info }))?;
    Ok(ExitStatus::Done)
}

fn describe(info: &FileInfo, width: usize) -> String {
    let mut out = String::new();
    let mut line = |name: &str, text: &str| out += &entry(name, text, 0, 13, width);
    let state = match info.state {
        FileState::Complete => "complete",
        FileState::Unfinished => "not finished: still being written, or its run was killed",
    };
    line("file", &format!("{}, {}", info.path.display(), bytes(info.bytes)));
    line("state", state);
    if let Some(title) = &info.title {
        line("title", title);
    }
    if let Some(outcome) = &info.outcome {
        let ending = match outcome.status {
            RecordedStatus::Completed => "completed",
            RecordedStatus::Interrupted => "interrupted",
            RecordedStatus::Failed => "failed",
            RecordedStatus::Recovered => "killed, and recovered",
            _ => "ended",
        };
        let step = outcome
            .step
            .map_or_else(String::new, |step| format!(" after {}", counted(step, "step", "steps")));
        line("run", &format!("{ending} at t = {} s{step}", number(outcome.time)));
        if !outcome.message.is_empty() {
            line("", &outcome.message);
        }
    }
    line(
        "frames",
        &format!("{}, t = {} to {} s", count(info.frames), number(info.start_time), number(info.end_time)),
    );
    if let (Some(dimension), Some(vertices)) = (info.dimension, info.vertices) {
        line("problem", &format!("{dimension}D, {}", counted(vertices as u64, "vertex", "vertices")));
    }
    if !info.bodies.is_empty() {
        let mut rows = vec![row(["body", "vertices", "edges", "triangles", "tetrahedra"])];
        let kinds = CELL_KINDS.iter().filter(|kind| info.bodies.iter().any(|body| cells(body, kind) > 0));
        rows[0].extend(kinds.clone().map(|kind| kind.plural.to_owned()));
        for body in &info.bodies {
            let counts =
                [u64::from(body.vertices), body.edges as u64, body.triangles as u64, body.tetrahedra as u64];
            let counts = counts.into_iter().chain(kinds.clone().map(|kind| cells(body, kind) as u64));
            rows.push(std::iter::once(body.name.clone()).chain(counts.map(count)).collect());
        }
        out += &format!("\n{}", table(&rows, 0));
    }
    let mut rows = vec![row(["channel", "messages", "encoding", "schema"])];
    for topic in &info.topics {
        let schema = topic.schema.clone().unwrap_or_default();
        rows.push(vec![topic.topic.clone(), count(topic.messages), topic.encoding.clone(), schema]);
    }
    out += &format!("\n{}", table(&rows, 0));
    let mut rows = vec![row(["attachment", "size"])];
    rows.extend(
        info.attachments.iter().map(|attachment| vec![attachment.name.clone(), bytes(attachment.bytes)]),
    );
    if rows.len() > 1 {
        out += &format!("\n{}", table(&rows, 0));
    }
    out
}

/// Number of cells of a kind.
fn cells(body: &BodySummary, kind: &CellKind) -> usize {
    body.blocks.iter().filter(|block| block.kind == kind.name).map(|block| block.cells).sum()
}

fn row<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_owned).to_vec()
}
