//! `pliant modes`: natural frequencies of a scene about where it starts.

use pliant::assembly::UnstableStep;
use pliant::modes::Modes;
use serde_json::json;

use crate::arguments::ModesArguments;
use crate::failure::{Failure, Status};
use crate::input::Input;
use crate::terminal::Terminal;
use crate::text::{counted, number, table};

pub(crate) fn execute(arguments: &ModesArguments, terminal: Terminal) -> Result<Status, Failure> {
    let input = Input::read(&arguments.scene, &arguments.set, None)?;
    let mut simulation = input.assemble(UnstableStep::Accept)?.simulation;
    let found = simulation
        .modes(arguments.count.get().into())
        .map_err(|error| Failure::failed("modes", error.to_string()))?;
    terminal.report(&describe(&found))?;
    terminal.document(&json!({ "status": Status::Done, "scene": input.source.name(), "modes": found }))?;
    Ok(Status::Done)
}

/// The table for people.
fn describe(found: &Modes) -> String {
    let axes = ["x", "y", "z"];
    let mut header = vec!["mode".to_owned(), "frequency [Hz]".to_owned(), "period [s]".to_owned()];
    header.extend(axes.iter().take(found.free_mass.len()).map(|axis| format!("mass along {axis}")));
    let mut rows = vec![header];
    for (i, mode) in found.modes.iter().enumerate() {
        let period = if mode.frequency > 0.0 { number(1.0 / mode.frequency) } else { "-".into() };
        let mut row = vec![(i + 1).to_string(), number(mode.frequency), period];
        row.extend(mode.effective_mass.iter().map(|share| format!("{:.1}%", 100.0 * share)));
        rows.push(row);
    }
    let mass: Vec<String> = found.free_mass.iter().map(|mass| number(*mass)).collect();
    format!(
        "{}\n{} free to move, {} kg of them along each axis; {}\n",
        table(&rows, 0),
        counted(found.free_coordinates as u64, "coordinate", "coordinates"),
        mass.join(", "),
        counted(found.solves as u64, "linear solve", "linear solves"),
    )
}
