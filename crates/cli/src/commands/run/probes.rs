//! The table that `--probes` asks for.

use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom};
use std::path::Path;

use pliant::probe::Table;
use pliant_scene::assembly::Assembly;
use same_file::Handle;

use crate::arguments::RunArguments;
use crate::failure::Failure;
use crate::recording;

/// The table, begun; `None` where none is wanted.
///
/// # Errors
/// The scene has no probes; the file exists, is a directory, the scene or the recording, or cannot be
/// written.
pub(super) fn table(
    arguments: &RunArguments,
    assembly: &Assembly,
) -> Result<Option<(File, Table<File>)>, Failure> {
    let Some(path) = &arguments.probes else { return Ok(None) };
    if assembly.probes.is_empty() {
        let message = "`--probes` has nothing to write: the scene has no [[probe]]";
        return Err(Failure::usage(message));
    }
    Failure::unless_file(path)?;
    let existed = path.exists();
    let what = format!("writing {}", path.display());
    let failed = |error| Failure::failed("probes", format!("{what}: {error}"));
    // Not emptied before it is known to be none of the files that the run needs.
    let file = OpenOptions::new().write(true).create(true).truncate(false).open(path).map_err(failed)?;
    let checked = own(path, &file, arguments).and_then(|()| match existed && !arguments.options.force {
        true => Err(exists(path)),
        false => file.set_len(0).map_err(failed),
    });
    if checked.is_err() && !existed {
        // Not the link, where the path is one to a file that was not there.
        let _ = std::fs::remove_file(path.canonicalize().as_deref().unwrap_or(path));
    }
    checked?;
    let written = file.try_clone().map_err(failed)?;
    Ok(Some((file, Table::new(&assembly.probes, written, &what))))
}

/// The table at `path` behind its first `written` bytes: what follows is what the run will write again.
///
/// # Errors
/// The file is not there, is no file, or is shorter.
pub(in crate::commands) fn resumed(
    path: &Path,
    written: u64,
    assembly: &Assembly,
) -> Result<(File, Table<File>), Failure> {
    Failure::unless_file(path)?;
    let what = format!("writing {}", path.display());
    let failed = |error| Failure::failed("probes", format!("{what}: {error}"));
    let mut file = OpenOptions::new().write(true).open(path).map_err(failed)?;
    let length = file.metadata().map_err(failed)?.len();
    if length < written {
        return Err(Failure::usage(format!(
            "{} ends before the checkpoint, after {length} of {written} bytes; put back the table that the \
             run wrote",
            path.display()
        )));
    }
    file.set_len(written).and_then(|()| file.seek(SeekFrom::End(0))).map_err(failed)?;
    let table = Table::behind(&assembly.probes, file.try_clone().map_err(failed)?, &what, written);
    Ok((file, table))
}

fn exists(path: &Path) -> Failure {
    let message = format!("{} exists; choose another name, or replace it with `--force`", path.display());
    Failure::usage(message)
}

/// Refuses a table that is, under whatever name, the scene, the recording, or what that is before it is
/// complete.
fn own(path: &Path, file: &File, arguments: &RunArguments) -> Result<(), Failure> {
    let mut taken = vec![(arguments.scene.clone(), "the scene")];
    if !arguments.options.no_record {
        let output = recording::output(arguments);
        taken.extend(pliant_record::files(&output).map(|file| (file, "the recording")));
    }
    if arguments.options.checkpoint.is_some() {
        taken.push((recording::checkpoint_of(&recording::output(arguments)), "the checkpoint"));
    }
    let is_table = |other: &Path| -> std::io::Result<bool> {
        Ok(Handle::from_file(file.try_clone()?)? == Handle::from_path(other)?)
    };
    // What is not there is another file.
    match taken.iter().find(|(other, _)| is_table(other).unwrap_or(false)) {
        None => Ok(()),
        Some((other, what)) if other == path => {
            Err(Failure::usage(format!("{} is {what}; choose another file", path.display())))
        }
        Some((other, what)) => Err(Failure::usage(format!(
            "{} is {what}, {}; choose another file",
            path.display(),
            other.display()
        ))),
    }
}
