//! `pliant schema`: the JSON schema of scenes.

use pliant::scene;

use crate::failure::{Failure, Status};
use crate::terminal::Terminal;

pub(crate) fn execute(terminal: Terminal) -> Result<Status, Failure> {
    terminal.print(&format!("{:#}", scene::schema().as_value()))?;
    Ok(Status::Done)
}
