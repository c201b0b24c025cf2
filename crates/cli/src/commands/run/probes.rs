//! The table that `--probes` asks for.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use pliant::probe::{self, Table};
use pliant_scene::assembly::Assembly;
use same_file::Handle;

use crate::arguments::RunArguments;
use crate::failure::Failure;
use crate::recording;

/// Bytes of a number in a row at most, its comma included.
const LONGEST_NUMBER: u64 = 32;

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
    let failed = |error| cannot_write(path, &error);
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
    Ok(Some((file, Table::new(&assembly.probes, written, &writing(path)))))
}

/// Length of a table at a checkpoint, and time of its last row.
#[derive(Clone, Copy, Debug)]
pub(in crate::commands) struct TableEnd {
    /// Length [bytes]; 0 before the first row.
    pub(in crate::commands) written: u64,
    /// Time of the last row [s]; `None` before the first.
    pub(in crate::commands) time: Option<f64>,
}

/// The table at `path`, which had this `end` at a checkpoint; its content does not change.
///
/// # Errors
/// The file is not there, is no file, is shorter, or is not the table of this run.
pub(in crate::commands) fn found(path: &Path, end: TableEnd, assembly: &Assembly) -> Result<File, Failure> {
    Failure::unless_file(path)?;
    let failed = |error| cannot_write(path, &error);
    let mut file = OpenOptions::new().read(true).write(true).open(path).map_err(failed)?;
    let (length, written) = (file.metadata().map_err(failed)?.len(), end.written);
    if length < written {
        return Err(Failure::usage(format!(
            "{} ends before the checkpoint, after {length} of {written} bytes; put back the table that the \
             run wrote",
            path.display()
        )));
    }
    if !is_table_until(&mut file, length, end, assembly).map_err(failed)? {
        return Err(Failure::usage(format!(
            "{} is not the table of this run: its titles or the time of its last row differ; put back the \
             table that the run wrote",
            path.display()
        )));
    }
    Ok(file)
}

/// The table that was [`found`] at `path`, cut at this `end`: what follows is what the run will write again.
///
/// # Errors
/// It cannot be cut.
pub(in crate::commands) fn resumed(
    mut file: File,
    path: &Path,
    TableEnd { written, .. }: TableEnd,
    assembly: &Assembly,
) -> Result<(File, Table<File>), Failure> {
    let failed = |error| cannot_write(path, &error);
    file.set_len(written).and_then(|()| file.seek(SeekFrom::End(0))).map_err(failed)?;
    let rows = file.try_clone().map_err(failed)?;
    let table = Table::behind(&assembly.probes, rows, &writing(path), written);
    Ok((file, table))
}

/// What is done to the table at `path`, in errors.
fn writing(path: &Path) -> String {
    format!("writing {}", path.display())
}

fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    Failure::failed("probes", format!("{}: {error}", writing(path)))
}

/// True if a `file` of `length` bytes begins with the titles of the table of this run, and has a row of the
/// right time where it ended at the checkpoint. A table may be empty before its first row.
fn is_table_until(file: &mut File, length: u64, end: TableEnd, assembly: &Assembly) -> io::Result<bool> {
    let Some(time) = end.time else {
        return Ok(end.written == 0 && (length == 0 || has_titles(file, assembly)?));
    };
    if !has_titles(file, assembly)? {
        return Ok(false);
    }
    let columns = 2 + probe::columns(&assembly.probes, assembly.topology.dimension).len() as u64;
    let tail = end.written.min(columns * LONGEST_NUMBER);
    file.seek(SeekFrom::Start(end.written - tail))?;
    let mut text = vec![];
    file.take(tail).read_to_end(&mut text)?;
    let Some(rows) = text.strip_suffix(b"\n") else { return Ok(false) };
    let row = rows.rsplit(|byte| *byte == b'\n').next().unwrap_or_default();
    let number = row.split(|byte| *byte == b',').next().and_then(|number| str::from_utf8(number).ok());
    Ok(number.and_then(|number| number.parse().ok()) == Some(time))
}

/// True if `file` begins with the titles of the table of this run.
fn has_titles(file: &mut File, assembly: &Assembly) -> io::Result<bool> {
    let has_factor = assembly.simulation.load_factor().is_some();
    let titles = probe::titles(&assembly.probes, assembly.topology.dimension, has_factor);
    let mut found = vec![];
    file.rewind()?;
    file.take(titles.len() as u64).read_to_end(&mut found)?;
    Ok(found == titles.as_bytes())
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
