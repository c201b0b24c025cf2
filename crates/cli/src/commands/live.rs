//! `pliant live`: a running scene in the browser.

use std::path::Path;

use pliant_live::{LiveError, LiveOptions, LiveServer, LiveSummary};
use serde_json::json;

use super::run::use_threads;
use super::view::opened;
use crate::arguments::LiveArguments;
use crate::failure::{ExitStatus, Failure};
use crate::input::Input;
use crate::interrupt;
use crate::terminal::Terminal;
use crate::text::counted;

pub(crate) fn execute(arguments: &LiveArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    use_threads(None)?;
    let input = Input::read(&arguments.scene, &arguments.set, None)?;
    let options = LiveOptions {
        address: arguments.bind,
        port: arguments.port,
        speed: arguments.speed.0,
        paused: arguments.paused,
        record: arguments.record.clone(),
        ..LiveOptions::default()
    };
    let server = LiveServer::new(input.source, &options).map_err(failure)?;
    let stop = interrupt::flag()?;
    if !arguments.bind.is_loopback() {
        terminal.warn(&format!(
            "listening at {}: all who have the address can steer this run and make recordings in this \
             folder; nothing is encrypted",
            arguments.bind
        ));
    }
    announce(&server, !arguments.no_open, terminal)?;
    let summary = server.run(stop).map_err(failure)?;
    report(&summary, terminal)?;
    Ok(ExitStatus::Done)
}

/// Prints the address, and opens it where that is wanted and possible.
fn announce(server: &LiveServer, open: bool, terminal: Terminal) -> Result<(), Failure> {
    let url = server.url();
    if !terminal.json {
        terminal.print(&url)?;
    }
    if open && !opened(Path::new(&url)) {
        terminal.note("no browser could be opened; open the address in one");
    }
    terminal.note("Ctrl-C ends it");
    Ok(())
}

fn report(summary: &LiveSummary, terminal: Terminal) -> Result<(), Failure> {
    for recorded in &summary.recorded {
        terminal.report(&format!(
            "recorded {} ({})",
            recorded.path.display(),
            counted(recorded.frames, "frame", "frames")
        ))?;
    }
    let recorded: Vec<_> = summary.recorded.iter().map(|recorded| &recorded.path).collect();
    let live = json!({ "steps": summary.steps, "time": summary.time, "recorded": recorded });
    terminal.document(&json!({ "status": ExitStatus::Done, "live": live }))
}

fn failure(error: LiveError) -> Failure {
    match error {
        LiveError::Scene(error) => error.into(),
        LiveError::Record(error) => Failure::recording(&error),
        error @ (LiveError::Outside { .. } | LiveError::Recording { .. }) => {
            Failure::usage(error.to_string())
        }
        error => Failure::failed("live", error.to_string()),
    }
}
