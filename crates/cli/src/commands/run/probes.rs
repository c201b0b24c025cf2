//! The table that `--probes` asks for.

use std::fs::{File, OpenOptions};
use std::path::Path;

use pliant::assembly::Assembly;
use pliant::probe::Table;

use crate::arguments::RunArguments;
use crate::failure::Failure;

/// The table, begun; `None` if nobody wants one.
///
/// # Errors
/// The scene has no probes; the file exists, is a directory, or cannot be written.
pub(super) fn table(arguments: &RunArguments, assembly: &Assembly) -> Result<Option<Table<File>>, Failure> {
    let Some(path) = &arguments.probes else { return Ok(None) };
    if assembly.probes.is_empty() {
        let message = "`--probes` has nothing to write: the scene has no [[probe]]";
        return Err(Failure::usage(message));
    }
    Failure::unless_file(path)?;
    let is =
        |other: &Path| path.canonicalize().is_ok_and(|path| other.canonicalize().is_ok_and(|o| o == path));
    if is(&arguments.scene) || arguments.output.as_deref().is_some_and(|output| is(output) || output == path)
    {
        let message = format!("{} is the scene or the recording; choose another file", path.display());
        return Err(Failure::usage(message));
    }
    if path.exists() && !arguments.force {
        let message = format!("{} exists; choose another name, or replace it with `--force`", path.display());
        return Err(Failure::usage(message));
    }
    let file = OpenOptions::new().write(true).create(true).truncate(true).open(path);
    let what = format!("writing {}", path.display());
    let file = file.map_err(|error| Failure::failed("probes", format!("{what}: {error}")))?;
    Ok(Some(Table::new(&assembly.probes, file, &what)))
}
