//! `pliant schema`: the format of scenes, for editors and for people.

mod reference;

use crate::arguments::{SchemaArguments, SchemaFormat};
use crate::failure::{ExitStatus, Failure};
use crate::terminal::Terminal;

pub(crate) fn execute(arguments: &SchemaArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let schema = pliant_scene::schema();
    match arguments.format {
        // One JSON document is what `--json` promises of every command.
        SchemaFormat::Markdown if !terminal.json => terminal.print(&reference::page(schema.as_value()))?,
        _ => terminal.print(&format!("{:#}", schema.as_value()))?,
    }
    Ok(ExitStatus::Done)
}
