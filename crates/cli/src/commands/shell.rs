//! `pliant completions` and `pliant man`: the command line, for shells and as pages of a manual.

use clap::{Command, CommandFactory};
use clap_mangen::Man;
use serde_json::json;

use super::render::{refuse_existing, write};
use crate::arguments::{CommandLine, CompletionsArguments, ManArguments};
use crate::failure::{ExitStatus, Failure};
use crate::output;
use crate::terminal::Terminal;

pub(crate) fn completions(
    arguments: &CompletionsArguments,
    terminal: Terminal,
) -> Result<ExitStatus, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut CommandLine::command(), "pliant", &mut script);
    text("completions", &script, terminal)
}

/// Prints a text, as a value of a document where one is asked for.
fn text(name: &str, text: &[u8], terminal: Terminal) -> Result<ExitStatus, Failure> {
    let text = String::from_utf8_lossy(text);
    if terminal.json {
        terminal.document(&json!({ "status": ExitStatus::Done, name: text }))?;
    } else {
        terminal.print(&text)?;
    }
    Ok(ExitStatus::Done)
}

/// `pliant.1`, and a page for each command as `git` has them: `pliant-run.1`.
pub(crate) fn man(arguments: &ManArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let mut command = CommandLine::command();
    command.build();
    let Some(folder) = &arguments.output else {
        return text("page", &page(command)?, terminal);
    };
    output::folder(folder)?;
    let commands = command.get_subcommands().map(|of| (format!("pliant-{}", of.get_name()), of.clone()));
    let mut pages = Vec::new();
    for (name, command) in std::iter::once(("pliant".to_owned(), command.clone())).chain(commands) {
        let file = folder.join(format!("{name}.1"));
        refuse_existing(&file, arguments.force)?;
        write(&file, &page(command)?)?;
        pages.push(file);
    }
    terminal.report(&format!("wrote {} pages into {}", pages.len(), folder.display()))?;
    terminal.document(&json!({ "status": ExitStatus::Done, "pages": pages }))?;
    Ok(ExitStatus::Done)
}

fn page(command: Command) -> Result<Vec<u8>, Failure> {
    let mut page = Vec::new();
    Man::new(command)
        .render(&mut page)
        .map_err(|error| Failure::failed("output", format!("cannot write the page: {error}")))?;
    Ok(page)
}
